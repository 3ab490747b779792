"""docs/concepts/control.md against the code: the names it gives exist, its gaits are the code's, and what the code cites is there.

And no docstring or comment of the project cites a text that the repository does not hold.
"""

from __future__ import annotations

import dataclasses
import importlib
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

from robot.control.gaits import GAITS
from robot.control.slip import SLIDING
from robot.control.walk_config import WalkConfig
from tests.tools import numbers_table

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "concepts" / "control.md"
NAME = re.compile(r"`(robot(?:\.\w+)+)`")
NUMBERS = re.compile(r"-?\d[\d.]*(?:e-?\d+)?(?:, -?\d[\d.]*(?:e-?\d+)?)*")

UNPUBLISHED = re.compile(
    r"robot-domain|ros2-semantics|house\.md|shared/spec|\bsections? \d|\barchitecture section"
    r"|\bspec(?:ification)? \d|\bsemantics \d|\bcontroller [ABC]\b|\b[Pp]rototype's\b"
)
"""Marks of a citation that leads out of the repository. A book is cited by its authors and year, the project's own texts by their links."""
HINT = re.compile(r"domain|semantics|house|spec|ection|controller|rototype")
"""A part of each of them, which is looked for first."""


def sections() -> dict[str, str]:
    """Each section of the page, by its anchor."""
    parts = re.split(r"^## (.+)$", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]
    return {slug(title): text for title, text in zip(parts[::2], parts[1::2], strict=True)}


def slug(headline: str) -> str:
    """The anchor that GitHub gives a headline."""
    return re.sub(r"[^\w\- ]", "", headline.lower()).replace(" ", "-")


def found(name: str) -> object:
    """What a dotted name means; of a dataclass's field, its default. Raises LookupError if there is no such thing."""
    parts = name.split(".")
    for end in range(len(parts), 0, -1):
        try:
            here: object = importlib.import_module(".".join(parts[:end]))
        except ModuleNotFoundError:
            continue
        for part in parts[end:]:
            here = _member(here, part, name)
        return here
    raise LookupError(name)


def _member(owner: object, part: str, name: str) -> object:
    fields: Mapping[str, dataclasses.Field[object]] = getattr(owner, "__dataclass_fields__", {})
    if isinstance(owner, type) and part in fields:
        return fields[part].default
    if not hasattr(owner, part):
        raise LookupError(f"{name}: there is no {part!r}")
    return getattr(owner, part)


def numbers(cell: str) -> list[float]:
    """The numbers that a cell of a table begins with."""
    match = NUMBERS.match(cell)
    assert match is not None, f"no number in {cell!r}"
    return [float(number) for number in match[0].split(", ")]


def test_every_name_of_the_page_is_one_of_the_code() -> None:
    missing: list[str] = []
    for name in NAME.findall(PAGE.read_text(encoding="utf-8")):
        try:
            found(name)
        except LookupError as error:
            missing.append(str(error))
    assert missing == []


def test_every_section_says_where_it_is_implemented() -> None:
    without = [title for title, text in sections().items() if not NAME.search(text)]
    assert without == ["in-short", "sources"]


def test_the_reference_lists_the_numbers_with_their_values_and_reasons() -> None:
    text = "\n".join(numbers_table.tables())
    (sliding,) = re.findall(r"^\| `SLIDING` \| (\S+) \| .*, m/s; chosen: .* \|$", text, re.MULTILINE)
    assert float(sliding) == SLIDING
    (spring,) = re.findall(r"^\| `WalkConfig.turn_spring` \| ([\d., ]+) \|", text, re.MULTILINE)
    assert tuple(numbers(spring)) == WalkConfig().turn_spring
    assert text.count("\n| `") > 200


def test_the_table_of_gaits_is_that_of_the_code() -> None:
    lines = [[cell.strip() for cell in line.strip("|").split("|")] for line in sections()["gaits"].splitlines()]
    written = {line[0]: [numbers(cell) for cell in line[1:]] for line in lines if line[0] in GAITS}
    assert written == {
        name: [[gait.period, gait.shortest], [*gait.hurry], [gait.duty], [*gait.offsets]]
        for name, gait in GAITS.items()
    }


def test_every_source_that_is_cited_is_listed() -> None:
    *texts, sources = sections().values()
    text = " ".join(" ".join(texts).split())
    cited = {*re.findall(r"([A-Z][a-z]+)(?: et al\.| and [A-Z][a-z]+)? \(?(\d{4})\b", text)}
    assert len(cited) > 15
    listed = [" ".join(source.split()) for source in sources.split("\n- ")]
    assert [pair for pair in sorted(cited) if not any(pair[0] in line and pair[1] in line for line in listed)] == []


def test_links_to_the_page_and_within_it_lead_to_a_section() -> None:
    anchors = set(sections())
    assert {*re.findall(r"\]\(#([^)]+)\)", PAGE.read_text(encoding="utf-8"))} <= anchors
    texts = [path.read_text(encoding="utf-8") for path in sources_of("actors", "robot", "cli", "tests")]
    texts += [path.read_text(encoding="utf-8") for path in (ROOT / "README.md", *(ROOT / "docs").rglob("*.md"))]
    cited = {anchor for text in texts for anchor in re.findall(r"control\.md#([\w-]+)", text)}
    assert cited
    assert cited <= anchors


def sources_of(*rooms: str) -> Iterator[Path]:
    for room in rooms:
        yield from sorted((ROOT / room).rglob("*.py"))


def citations(text: str) -> list[str]:
    """The lines of a text that cite what the repository does not hold."""
    return [line.strip() for line in text.splitlines() if HINT.search(line) and UNPUBLISHED.search(line)]


def test_nothing_cites_a_text_that_the_repository_does_not_hold() -> None:
    texts = {path: path.read_text(encoding="utf-8") for path in sources_of("actors", "robot", "cli", "tests")}
    del texts[Path(__file__)]
    texts |= {path: path.read_text(encoding="utf-8") for path in (ROOT / "README.md", *(ROOT / "docs").rglob("*.md"))}
    assert {str(path.relative_to(ROOT)): lines for path, text in texts.items() if (lines := citations(text))} == {}


@pytest.mark.parametrize(
    "text",
    ["(robot-domain section 7)", "as section 3.2 says", "ros2-semantics 6.4", "after sections 3 and 4 (controller C)"],
)
def test_such_a_citation_would_be_found(text: str) -> None:
    assert citations(f"fine\n{text}\n") == [text]
