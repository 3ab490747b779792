"""The generated reference: nothing is missing, and its links lead somewhere."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import pytest

import actors
from actors.interfaces import types
from robot import contracts
from tests.project.test_surface import FACES
from tests.site.markdown import headlines
from tests.tools import reference


@pytest.fixture(scope="module")
def text(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The page as the command writes it."""
    page = tmp_path_factory.mktemp("build") / "reference.md"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reference, "PAGE", page)
        said = io.StringIO()
        with redirect_stdout(said):
            assert reference.main() == 0
    assert said.getvalue().startswith("written: reference.md, ")
    return page.read_text(encoding="utf-8")


def test_every_public_name_has_an_entry_and_every_link_leads_to_one(text: str) -> None:
    found = list(headlines(text))
    anchors = [anchor for _, _, anchor in found]
    assert {*actors.__all__} <= {name for _, name, _, face in reference.entries() if face == "actors"}
    assert {"actors", *reference.SECTIONS.values()} == {*FACES}
    assert "### qos (module)" in text
    assert {"goalstatus", "goalstatus-1"} <= {*anchors}  # GoalStatus and Goal.status
    assert sorted(anchors) == sorted(set(anchors))
    assert {*re.findall(r"\]\(#([^)]+)\)", text)} <= {*anchors}
    words = {headline for _, headline, _ in found}
    for member in ("Node.call", "Node.log", "System.snapshot", "Rig.advance", "Probe.last", "Supervisor", "Child", "QoS", "Time", "Duration"):  # fmt: skip
        assert member in words


def test_every_entry_has_a_text(text: str) -> None:
    bare = re.compile(r"^### (\S+)\n+```py\n[^`]*```\n*(?=^##|\Z)", re.MULTILINE)
    found = {*bare.findall(text)}
    explained = {*types.__all__, *reference.contracts(contracts)}  # field types together, contracts by name and type
    assert found <= explained, "say in a docstring what it is"


def test_no_entry_has_the_text_of_its_base_class() -> None:
    """Of a base class of others that would be their text."""
    kinds = [value for _, _, value, _ in reference.entries() if isinstance(value, type)]
    assert [kind.__name__ for kind in kinds if not vars(kind).get("__doc__")] == []
    ours = [kind for kind in kinds if kind.__module__.startswith("actors.")]
    inherited = [
        f"{kind.__name__}.{name}"
        for kind in ours
        for name, value in reference.members(kind)
        if not value.__doc__
        and any(name in vars(base) and not base.__module__.startswith("actors.") for base in kind.__mro__)
    ]
    assert inherited == []


def test_the_page_is_the_same_wherever_it_is_written(text: str) -> None:
    assert " at 0x" not in text
    assert str(Path(__file__).parents[2]) not in text


def test_an_entry_has_signature_and_text(text: str) -> None:
    entry = text.partition("#### Node.call\n")[2].partition("\n#### ")[0]
    assert "    timeout: float = 1.0,\n" in entry
    assert "Ask a service and wait for its answer, `timeout` seconds at most" in entry
    assert "[Steps](#steps)" in text
    assert "Steps = AsyncGenerator[F | Done[R] | Aborted[R], None]\n" in text
    assert "### transient\n\n```py\ntransient = 'transient'\n```\n\nRestarted only when it fails;" in text
    assert "### CallTimeout\n\n```py\nclass CallTimeout(ActorError, TimeoutError)\n```" in text
    assert "`ACCEPTED` = 1, `EXECUTING` = 2" in text
    assert "#### System.gone" not in text


def test_a_new_name_comes_last_until_it_is_put_into_a_group(monkeypatch: pytest.MonkeyPatch) -> None:
    def brand_new(one: int, /, *rest: str, two: Callable[[], Any] = print, **more: int) -> None:
        """Does something::

            brand_new(1)

        It is new.
        """

    monkeypatch.setattr(actors, "brand_new", brand_new, raising=False)
    monkeypatch.setattr(actors, "__all__", [*actors.__all__, "brand_new"])
    text = reference.page()
    assert (
        "## More\n\n### brand_new\n\n```py\n"
        "brand_new(one: int, /, *rest: str, two: Callable[[], Any] = print, **more: int) -> None\n"
        "```\n\nDoes something:\n\n    brand_new(1)\n\nIt is new.\n"
    ) in text
