"""The pages of the site, made from the documents.

The documents are written to be read on GitHub too, so the site is made of what is changed a little: README.md is its first page, the reference
is a page for each of its sections and says which examples use a name, formulas are MathML and diagrams are SVG, so that a reader's browser
asks nobody else for anything.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from latex2mathml.converter import convert

from tests.site import pairs
from tests.site.diagrams import THEMES, Diagram
from tests.site.examples import as_page, examples
from tests.site.markdown import anchored, fenced, headlines, in_prose, relinked
from tests.tools import reference
from tests.tools.reference import ROBOT, SECTIONS

ROOT = Path(__file__).parents[2]
FIRST = {"README.md": "index.md", "CHANGELOG.md": "changelog.md"}
"""Where the documents of the top level are on the site; those of docs/ keep their places."""
REFERENCE = "docs/reference/api.md"
"""Where the reference would be, which is not in the repository."""


@cache
def documents() -> dict[str, str]:
    """The text of every document, by its path from the top level."""
    docs = ROOT / "docs"
    paths = [*(ROOT / name for name in FIRST), *sorted(docs.rglob("*.md")), *sorted(docs.rglob("*.py"))]
    found = {path.relative_to(ROOT).with_suffix(".md").as_posix(): as_page(path) for path in paths}
    found[pairs.PAGE] = pairs.side_by_side(found[pairs.PAGE])
    return {**found, REFERENCE: reference.page()}


def pages() -> dict[str, str]:
    """Every page of the site by its path there, as Markdown."""
    places = Places()
    found: dict[str, str] = {}
    for document, text in documents().items():
        whole = anchored(text)
        parts = dict(reference_parts(whole, text)) if document == REFERENCE else {places.of(document, ""): whole}
        for page, part in parts.items():
            found[page] = drawn(relinked(part, Moved(places, document, page)), page)
    return found


class Places:
    """Where on the site the documents and their anchors are."""

    def __init__(self) -> None:
        self.sections: dict[str, str] = {"": "index"}
        """For each anchor of the reference, the name of its page."""
        self.titles = {
            document.removeprefix("docs/"): next(headlines(text))[1] for document, text in documents().items()
        }
        """The title of each document, by its name."""
        section = "index"
        for level, _, anchor in headlines(documents()[REFERENCE]):
            section = anchor if level == 2 else section
            self.sections[anchor] = section

    def of(self, path: str, anchor: str) -> str | None:
        """The place of a file of this repository; None if it is not on the site."""
        if path == REFERENCE:
            place = f"reference/api/{self.sections[anchor]}.md"
        elif path in FIRST:
            place = FIRST[path]
        elif path.startswith("docs/"):
            place = re.sub(r"\.py$", ".md", path.removeprefix("docs/")).replace("README.md", "index.md")
        else:
            return None
        return f"{place}#{anchor}" if anchor else place


class Moved:
    """Where the links of a document lead to from one page of the site. One whose words are a document's name gets that one's title."""

    def __init__(self, places: Places, document: str, page: str) -> None:
        self.places = places
        self.document = document
        self.page = page

    def __call__(self, words: str, target: str) -> tuple[str, str | None]:
        """Words and target of a link on the page; no target if it is not on the site."""
        if re.match(r"[a-z]+:", target):
            return words, target
        file, _, anchor = target.partition("#")
        path = posixpath.normpath(posixpath.join(posixpath.dirname(self.document), file)) if file else self.document
        place = self.places.of(path, anchor)
        if place is None:
            return words, None
        return self.places.titles.get(words.removeprefix("docs/"), words), posixpath.relpath(
            place, posixpath.dirname(self.page) or "."
        )


# -- the reference ---------------------------------------------------------------------------------------------------------------


def reference_parts(whole: str, text: str) -> Iterator[tuple[str, str]]:
    """The reference as a page for each section, and one that leads to them."""
    anchors = [anchor for level, _, anchor in headlines(text) if level == 2]
    contents, *sections = re.split(r"^(?=## )", whole, flags=re.MULTILINE)
    yield "reference/api/index.md", contents
    for anchor, section in zip(anchors, sections, strict=True):
        face = {**SECTIONS, **ROBOT}.get(section.removeprefix("## ").partition(" {#")[0], "actors")
        risen = in_prose(section, lambda prose: re.sub(r"^#(#+ )", r"\1", prose, flags=re.MULTILINE))
        yield f"reference/api/{anchor}.md", re.sub(r"^## (\w+)\b.*$", lambda line, face=face: with_examples(line, face), risen, flags=re.MULTILINE)  # fmt: skip


def with_examples(line: re.Match[str], face: str) -> str:
    """The headline of a name, and the sections whose examples use it."""
    links = [f"[{one.title}]({posixpath.relpath(one.page, 'docs/reference')}#{one.anchor})" for one in examples().get((face, line[1]), ())[:4]]  # fmt: skip
    return f"{line[0]}\n\nExamples: {', '.join(links)}" if links else line[0]


# -- formulas and diagrams -------------------------------------------------------------------------------------------------------


def drawn(text: str, page: str) -> str:
    """The text with its formulas and diagrams as a browser shows them."""
    folder = posixpath.relpath("diagrams", posixpath.dirname(page) or ".")

    def block(language: str, code: str) -> str | None:
        if language == "math":
            return f'<div class="formula" tabindex="0" role="group" aria-label="formula">{convert(code, display="block")}</div>\n'
        if language == "mermaid":
            pictures = [
                f"![The diagram above, drawn]({folder}/{Diagram(code).picture(one).name}#only-{one})" for one in THEMES
            ]
            return "\n".join(pictures) + "\n"
        return None

    return in_prose(fenced(text, block), lambda prose: re.sub(r"(?<![`\\$\w])\$([^$`\n]+)\$(?!\w)", inline, prose))


def inline(formula: re.Match[str]) -> str:
    """A formula within a line. Its signs must not be taken for those of Markdown."""
    written = re.sub(r"[*_|\\]", lambda sign: f"&#{ord(sign[0])};", convert(formula[1]))
    return f"<span>{written}</span>"  # a line must not begin with what Markdown takes for a block
