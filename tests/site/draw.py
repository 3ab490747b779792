"""`python -m tests.site.draw`: draw the diagrams of the documents as SVG into docs/diagrams, after a change of one.

GitHub draws them itself. The site shows these pictures, so that its readers need neither Mermaid's three megabytes nor the net. Needs npm,
the net and Chromium, and the extra `test`.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tarfile
import tempfile
from pathlib import Path

from playwright.sync_api import Page, sync_playwright

from tests.site.diagrams import FOLDER, THEMES, diagrams
from tests.tools import no_arguments

MERMAID = "mermaid@12.3.0"
DRAWN = """async ([source, theme]) => {
    mermaid.initialize({startOnLoad: false, theme, htmlLabels: false, flowchart: {htmlLabels: false}, deterministicIds: true});
    return (await mermaid.render("diagram", source)).svg;
}"""


def main() -> None:
    """Draw what is not drawn, and remove the pictures of diagrams that are no more."""
    wanted = {one.picture(colour): (one.source, theme) for one in diagrams() for colour, theme in THEMES.items()}
    FOLDER.mkdir(exist_ok=True)
    for path in {*FOLDER.iterdir()} - {*wanted}:
        path.unlink()
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_page()
        page.add_script_tag(path=mermaid(Path(folder)))
        for path, (source, theme) in wanted.items():
            path.write_text(drawn(page, source, theme), encoding="utf-8")
            print(f"{path.stat().st_size:>9,}  {path.name}")


def mermaid(folder: Path) -> Path:
    """Mermaid's script, fetched by npm."""
    packed = subprocess.run(
        ["npm", "pack", "--silent", MERMAID], cwd=folder, capture_output=True, text=True, check=True, timeout=300
    )
    with tarfile.open(folder / packed.stdout.split()[-1]) as archive:
        archive.extract("package/dist/mermaid.min.js", folder, filter="data")
    return folder / "package" / "dist" / "mermaid.min.js"


def drawn(page: Page, source: str, theme: str) -> str:
    """One picture, as wide as it needs to be; a page may make it smaller."""
    svg: str = page.evaluate(DRAWN, [source, theme])
    _, _, width, height = (float(one) for one in re.findall(r'viewBox="([^"]+)"', svg)[0].split())
    return re.sub(r' width="100%"', f' width="{width:.0f}" height="{height:.0f}"', svg, count=1)


if __name__ == "__main__":
    no_arguments(__doc__)
    main()
