"""`python -m tests.site`: build the documents into a site, in build/site; a warning or a broken link is an error. Needs the extra `docs`.

`--weights` tells what a reader's browser fetches for each page.
"""

from __future__ import annotations

import argparse
import gzip
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from tests.site.check import Links, faults
from tests.site.pages import ROOT, pages

BUILD = ROOT / "build"
SITE = BUILD / "site"


def main() -> int:
    """Build the site; 1 if it has faults."""
    parser = argparse.ArgumentParser(prog="python -m tests.site", description="Build docs/ into a site, build/site.")
    parser.add_argument(
        "--weights", action="store_true", help="tell what each page weighs, in bytes: as it is, and as it is sent"
    )
    options = parser.parse_args()
    code = build() or report()
    if not code and options.weights:
        for line in weights():
            print(line)
    return code


def build() -> int:
    """Write the pages and let the generator make the site of them; its exit code."""
    sources = BUILD / "pages"
    for folder in (sources, SITE):
        shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(ROOT / "docs", sources, ignore=shutil.ignore_patterns("*.md", "*.toml"))
    found = pages()
    for page, text in found.items():
        path = sources / page
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    parts = ", ".join(f'"{page}"' for page in found if page.startswith("reference/api/"))
    settings = (ROOT / "docs" / "site.toml").read_text(encoding="utf-8").replace('"reference/api/"', parts)
    (BUILD / "site.toml").write_text(settings, encoding="utf-8")
    command = [sys.executable, "-m", "zensical", "build", "--strict", "--clean", "--config-file", "site.toml"]
    return subprocess.run(command, cwd=BUILD, check=False).returncode


def report() -> int:
    """Tell what is wrong with the site, or how large it is."""
    found = list(faults(SITE))
    print("\n".join(found) or f"{len(list(SITE.rglob('*.html')))} pages in {SITE}")
    return 1 if found else 0


def weights() -> Iterator[str]:
    """For each page, the heaviest first: its bytes and those of all that a browser fetches for it, plain and packed."""
    lines: list[tuple[int, str]] = []
    for path in sorted(SITE.rglob("*.html")):
        links = Links()
        links.feed(path.read_text(encoding="utf-8"))
        fetched = {(path.parent / address.partition("#")[0]).resolve() for address in links.fetched}
        plain, packed = weight({path})
        everything = weight({path, *(one for one in fetched if one.is_file())})
        lines.append(
            (
                everything[1],
                f"{plain:>10,} {packed:>10,} {everything[0]:>10,} {everything[1]:>10,}  {path.relative_to(SITE)}",
            )
        )
    yield f"{'page':>10} {'packed':>10} {'with all':>10} {'packed':>10}"
    yield from (line for _, line in sorted(lines, reverse=True))


def weight(paths: set[Path]) -> tuple[int, int]:
    """The bytes of these files, plain and packed; pictures of pixels are packed already."""
    data = [path.read_bytes() for path in paths]
    packed = [one if one.startswith(b"\x89PNG") else gzip.compress(one) for one in data]
    return sum(map(len, data)), sum(map(len, packed))


if __name__ == "__main__":
    sys.exit(main())
