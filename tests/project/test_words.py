"""Public texts are in plain words: docs/contributing.md has a list of words to avoid, and none of them is in the documents, docstrings or help."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from cli.command import COMMANDS, added, found
from cli.verb import Group, Verb
from tests.tools import reference

ROOT = Path(__file__).parents[2]
LIST = ROOT / "docs" / "contributing.md"


def avoided() -> list[str]:
    """The words in quotation marks in the right column of the list."""
    table = LIST.read_text(encoding="utf-8").partition("| write | not |")[2].partition("\n\n")[0]
    return [word for row in table.splitlines() for word in re.findall(r'"([^"]+)"', row)]


WORDS = [word.lower() for word in avoided()]
AVOIDED = re.compile(rf"\b(?:{'|'.join(map(re.escape, WORDS))})\b")


def uses(text: str) -> Iterator[str]:
    """The lines of a text with a word of the list."""
    lowered = text.lower()
    if any(word in lowered for word in WORDS):  # which takes a hundredth of the time
        yield from (line.strip() for line in text.splitlines() if AVOIDED.search(line.lower()))


DOCUMENTS = sorted({ROOT / "README.md", *(ROOT / "docs").rglob("*.md"), *(ROOT / "docs").rglob("*.py")} - {LIST})


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_a_document_has_none_of_them(document: Path) -> None:
    assert list(uses(document.read_text(encoding="utf-8"))) == []


def test_the_docstrings_of_public_names_have_none_of_them() -> None:
    assert list(uses(reference.page())) == []


def helps() -> Iterator[str]:
    """What `--help` prints, of each command and verb."""
    for name in (*(entry.name for entry in added()), *COMMANDS):
        command = found(name)
        assert command is not None
        for verb in command.verbs.values() if isinstance(command, Group) else (command,):
            yield verb.parser().format_help() if isinstance(verb, Verb) else verb.help


def test_no_help_has_one_of_them() -> None:
    texts = list(helps())
    assert len(texts) > 60
    assert [line for text in texts for line in uses(text)] == []


def test_a_word_of_the_list_would_be_found() -> None:
    assert len(avoided()) >= 12
    assert list(uses("It begins anew.\nIt starts again; they knew.")) == ["It begins anew."]
