"""The documents as a whole and the site that is made of them: links, diagrams, contents, and the examples of each name.

`python -m tests.site` builds the site and checks all its pages; `.ci/run` does that for each change. Here is what needs no generator.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.site.check import faults
from tests.site.diagrams import FOLDER, THEMES, diagrams
from tests.site.examples import Imported, examples, names_used
from tests.site.markdown import anchored, blocks, headlines, links, relinked
from tests.tools.reference import entries

ROOT = Path(__file__).parents[2]
DOCUMENTS = sorted([ROOT / "README.md", ROOT / "CHANGELOG.md", *(ROOT / "docs").rglob("*.md")])


def leading_nowhere(document: Path) -> Iterator[str]:
    """The links of a document that lead to no file, or to no headline of a document."""
    for target in links(document.read_text(encoding="utf-8")):
        file, _, anchor = target.partition("#")
        path = document.parent / file if file else document
        if not re.match(r"[a-z]+:", target) and not (path.exists() and (not anchor or anchor in anchors(path))):
            yield target


def anchors(document: Path) -> set[str]:
    return {anchor for _, _, anchor in headlines(document.read_text(encoding="utf-8"))}


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_every_link_of_a_document_leads_to_a_file_and_a_headline(document: Path) -> None:
    assert list(leading_nowhere(document)) == []


def test_a_link_that_leads_nowhere_would_be_found(tmp_path: Path) -> None:
    (tmp_path / "other.md").write_text("# Other\n\n## Some `code`\n\n## Some code\n", encoding="utf-8")
    page = tmp_path / "page.md"
    page.write_text(
        "# Page\n[a](other.md) [b](other.md#some-code-1) [c](#page) [d](https://x.org/y) `[e](no.md)`\n"
        "```py\n[f](no.md)\n```\n[g](other.md#gone) [h](missing.md) [i](#gone) ![j](no.png)\n",
        encoding="utf-8",
    )
    assert list(leading_nowhere(page)) == ["other.md#gone", "missing.md", "#gone", "no.png"]


def pages_of(nav: Any) -> Iterator[str]:
    """The pages of the contents, or of a part of them."""
    if isinstance(nav, str):
        yield nav
    else:
        for one in nav.values() if isinstance(nav, dict) else nav:
            yield from pages_of(one)


def test_every_document_has_its_place_in_the_contents_of_the_site() -> None:
    settings = tomllib.loads((ROOT / "docs" / "site.toml").read_text(encoding="utf-8"))["project"]
    documents = [*(ROOT / "docs").rglob("*.md"), *(ROOT / "docs").rglob("*.py")]
    ours = {
        path.relative_to(ROOT / "docs").with_suffix(".md").as_posix().replace("README.md", "index.md")
        for path in documents
    }
    assert sorted(pages_of(settings["nav"])) == sorted([*ours, "index.md", "changelog.md", "reference/api/"])


def test_every_diagram_is_drawn_as_it_is_now() -> None:
    wanted = {one.picture(colour) for one in diagrams() for colour in THEMES}
    assert wanted == {*FOLDER.iterdir()}, "run python -m tests.site.draw"
    assert all("<svg" in path.read_text(encoding="utf-8") for path in wanted)


# -- how the pages are made ------------------------------------------------------------------------------------------------------


def test_headlines_in_code_are_none_and_equal_ones_are_told_apart() -> None:
    text = "# A b\n```sh\n# no\n```\n## `c_d` e!\n## A b\n"
    assert list(headlines(text)) == [(1, "A b", "a-b"), (2, "`c_d` e!", "c_d-e"), (2, "A b", "a-b-1")]
    assert anchored(text) == "# A b {#a-b}\n```sh\n# no\n```\n## `c_d` e! {#c_d-e}\n## A b {#a-b-1}\n"
    assert list(blocks(text)) == [("sh", "# no\n")]


def test_links_are_changed_in_prose_only() -> None:
    text = "[a](b.md) ![c](d.png)\n```\n[a](b.md)\n```\n"
    moved = relinked(text, lambda words, target: (words.upper(), None if target == "b.md" else f"x/{target}"))
    assert moved == "A ![C](x/d.png)\n```\n[a](b.md)\n```\n"


def test_a_name_is_used_where_the_program_says_it_after_an_import() -> None:
    known = Imported()
    first = set(
        names_used(
            "from actors import QoS, Node as N, qos\nfrom actors.bag import BagReader\nfrom x import Topic", known
        )
    )
    assert first == set()
    later = set(names_used("QoS(); N; Topic; qos.LATCHED; qos.nothing; self.BagReader; other: 'BagReader'", known))
    assert later == {("actors", "QoS"), ("actors", "Node"), ("actors", "qos"), ("actors.qos", "LATCHED")}


def test_the_sections_whose_examples_use_a_name_are_found() -> None:
    found = {(one.page, one.anchor) for one in examples()[("actors.qos", "COMMANDS")]}
    assert ("docs/concepts/nodes.md", "contracts-are-typed-names") in found


def test_faults_of_a_built_site_are_found(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "a.html").write_text(
        '<h1 id="top">A</h1><a href="sub/b.html#x">b</a><a href="#top">t</a><a href="https://elsewhere.org">e</a><a href="sub/">s</a>'
        '<img src="p.svg#only-dark" alt="p"><link rel="canonical" href="https://elsewhere.org/a">',
        encoding="utf-8",
    )
    (tmp_path / "p.svg").write_text("<svg/>", encoding="utf-8")
    page = tmp_path / "sub" / "index.html"
    page.write_text("", encoding="utf-8")
    (tmp_path / "sub" / "b.html").write_text('<a id="x"></a>', encoding="utf-8")
    assert list(faults(tmp_path)) == []
    page.write_text(
        '<a href="../a.html#gone"></a><a href="c.html"></a><img src="../p.svg"><script src="//cdn.org/m.js"></script>',
        encoding="utf-8",
    )
    assert list(faults(tmp_path)) == [
        "sub/index.html: the picture ../p.svg has no text",
        "sub/index.html: fetched from elsewhere: //cdn.org/m.js",
        "sub/index.html: ../a.html#gone leads nowhere",
        "sub/index.html: c.html leads nowhere",
    ]


def test_every_public_name_has_an_executed_example() -> None:
    without = [
        f"{face}.{name}"
        for _, name, _, face in entries()
        if not face.startswith("robot") and (face, name) not in examples()
    ]
    assert without == [], "use them in an example of docs/, where a reader looks for what they are for"
