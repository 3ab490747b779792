"""`bag replay` in a terminal: equal or the first difference, in a bag or in a file, with a debugger, a parameter or another class."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from actors import Child, execute, run
from actors.bag import Recorder, RecordOptions, Selection
from actors.replay import Journal
from cli.bag import main
from cli.command import CommandFailed
from tests.actors.replay.story import OTHERS, Hero, Visitor, lived, story


class Heavy(Hero):
    """With another constant."""

    def say(self, text: str) -> None:
        super().say(text.replace("climb", "ascend"))


async def bag_of(path: Path) -> None:
    journal = Journal("hero", publish=True)
    recorder = Child(Recorder, args=(path, RecordOptions(selection=Selection(topics=["/hero/_journal", "/told"]))))
    async with run(recorder, OTHERS, Hero, Visitor, observers=(journal,), sinks=(), seed=5) as system:
        await lived(system, 0.1)
        await system.clock.sleep(1.0)


@pytest.fixture(scope="module")
def journal(tmp_path_factory: pytest.TempPathFactory) -> Path:
    kept, _ = execute(story, clock="virtual")
    return kept.save(tmp_path_factory.mktemp("journals") / "hero.journal", "hero")


def test_a_journal_in_a_bag_is_replayed_to_its_node_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    execute(lambda: bag_of(tmp_path / "walk"), clock="virtual")
    assert main(["replay", str(tmp_path / "walk"), "--node", "hero"]) == 0
    assert capsys.readouterr().out.startswith("/hero: equal; ")
    with pytest.raises(CommandFailed, match="has no journal of ghost; it has those of: /hero"):
        main(["replay", str(tmp_path / "walk"), "--node", "ghost"])
    with pytest.raises(CommandFailed, match="say which node's journal with --node NODE"):
        main(["replay", str(tmp_path / "walk")])
    with pytest.raises(CommandFailed, match=r"there is no bag and no journal .*/wlak$"):
        main(["replay", str(tmp_path / "wlak"), "--node", "hero"])


def test_the_first_difference_is_printed_and_the_exit_code_is_1(
    journal: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["replay", str(journal), "--with", "tests.cli.test_bag_replay:Heavy"]) == 1
    first = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("publish"))
    assert first.startswith("publish /told[")
    assert "field data: recorded 'asked to climb 2', replayed 'asked to ascend 2'" in first
    assert main(["replay", str(journal), "--set", "factor=4", "--json"]) == 1
    facts: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert (facts["node"], facts["equal"], facts["lacking"]) == ("/hero", False, "")
    assert "factor 4" in facts["differences"][0]


def test_a_debugger_stops_in_the_node_at_the_message_that_is_named(
    journal: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    stops: list[str] = []
    monkeypatch.setattr("sys.breakpointhook", lambda: stops.append("here"))
    assert main(["replay", str(journal), "--break", "measured[3]", "--node", "/hero"]) == 0
    assert main(["replay", str(journal), "--break", "/measured[100000]"]) == 0
    assert stops == ["here"]
    assert "equal" in capsys.readouterr().out


def test_what_a_journal_costs_is_printed(journal: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(journal), "--cost"]) == 0
    *kinds, total = capsys.readouterr().out.splitlines()
    assert {"step", "deliver", "out", "tick"} <= {line.split()[1] for line in kinds}
    assert sum(int(line.split()[0]) for line in kinds) == int(total.split()[0])
    assert total.endswith("kB/s")


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["--node", "other"], "is the journal of /hero, not of other"),
        (["--with", "no_such_module:Node"], "give the class as MODULE:NODE"),
        (["--with", "json:JSONDecoder"], "that is no class of a node"),
        (["--set", "factor"], "give it as PARAM=VALUE"),
        (["--break", "/told[x]"], "give it as TOPIC"),
    ],
)
def test_a_slip_is_told_in_one_line(journal: Path, words: list[str], text: str) -> None:
    with pytest.raises(CommandFailed, match=text):
        main(["replay", str(journal), *words])
