"""`bag replay` in a terminal: equal or the first difference, in a bag or in a file, with a debugger, a parameter or another class."""

from __future__ import annotations

import json
from io import StringIO
from pathlib import Path
from typing import Any

import pytest

from actors import Child, Supervisor, execute, run
from actors.bag import Recorder, RecordOptions, Selection
from actors.interfaces.std_msgs.msg import Int32
from actors.replay import Journal, ReplayError
from actors.replay.publishing import topic_of
from cli.command import CommandFailed, UsageError
from cli.verbs.bag import COMMAND
from tests.actors.replay.story import NUMBERS, OTHERS, Hero, Visitor, lived, story
from tests.actors.replay.test_subtree import TEAM, WORLD, Doubler, Source

REFUSED = (CommandFailed, ReplayError)
"""What the command prints as one line, with exit code 1."""


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


async def plain_bag_of(path: Path) -> None:
    recorder = Child(Recorder, args=(path, RecordOptions(selection=Selection(all_topics=True))))
    async with run(recorder, OTHERS, sinks=()) as system:
        await system.clock.sleep(0.3)


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bag without a journal."""
    path = tmp_path_factory.mktemp("bags") / "plain"
    execute(lambda: plain_bag_of(path), clock="virtual")
    return path


@pytest.fixture(scope="module")
def journal(tmp_path_factory: pytest.TempPathFactory) -> Path:
    kept, _ = execute(story, clock="virtual")
    return kept.save(tmp_path_factory.mktemp("journals") / "hero.journal", "hero")


def test_a_journal_in_a_bag_is_replayed_to_its_node_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    execute(lambda: bag_of(tmp_path / "walk"), clock="virtual")
    assert COMMAND.main(["replay", str(tmp_path / "walk"), "--node", "hero"]) == 0
    assert capsys.readouterr().out.startswith("/hero: equal; ")
    with pytest.raises(REFUSED, match="has no journal of ghost; it has those of: /hero"):
        COMMAND.main(["replay", str(tmp_path / "walk"), "--node", "ghost"])
    with pytest.raises(REFUSED, match="say which node with --node NODE"):
        COMMAND.main(["replay", str(tmp_path / "walk")])
    with pytest.raises(REFUSED, match=r"there is no bag and no journal .*/wlak$"):
        COMMAND.main(["replay", str(tmp_path / "wlak"), "--node", "hero"])


def test_the_first_difference_is_printed_and_the_exit_code_is_1(
    journal: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert COMMAND.main(["replay", str(journal), "--with", "tests.cli.test_bag_replay:Heavy"]) == 1
    first = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("publish"))
    assert first.startswith("publish /told[")
    assert "field data: recorded 'asked to climb 2', replayed 'asked to ascend 2'" in first
    assert COMMAND.main(["replay", str(journal), "--set", "factor=4", "--json"]) == 1
    facts: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert (facts["node"], facts["equal"], facts["lacking"]) == ("/hero", False, "")
    assert "factor 4" in facts["differences"][0]


def test_a_debugger_stops_in_the_node_at_the_message_that_is_named(
    journal: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    stops: list[str] = []
    monkeypatch.setattr("sys.breakpointhook", lambda: stops.append("here"))
    assert COMMAND.main(["replay", str(journal), "--break", "measured[3]", "--node", "/hero"]) == 0
    assert COMMAND.main(["replay", str(journal), "--break", "/measured[100000]"]) == 0
    assert stops == ["here"]
    assert "equal" in capsys.readouterr().out


def test_what_a_journal_costs_is_printed(journal: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert COMMAND.main(["replay", str(journal), "--cost"]) == 0
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
    with pytest.raises(REFUSED, match=text):
        COMMAND.main(["replay", str(journal), *words])


def test_a_bag_without_a_journal_is_refused_in_one_line(plain: Path) -> None:
    with pytest.raises(REFUSED, match="has no journal of adder; it has those of: no node"):
        COMMAND.main(["replay", str(plain), "--node", "adder"])


@pytest.mark.usefixtures("own_debugger")
def test_a_debugger_that_is_quit_leaves_no_verdict(
    journal: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.stdin", StringIO("up\nup\nquit\n"))
    with pytest.raises(REFUSED, match="the debugger was quit, and the replay with it: there is no verdict"):
        COMMAND.main(["replay", str(journal), "--break", "measured[3]"])
    assert "equal" not in capsys.readouterr().out


@pytest.mark.usefixtures("own_debugger")
def test_a_debugger_that_goes_on_leaves_the_verdict(
    journal: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.stdin", StringIO("p 40 + 2\ncontinue\n"))
    assert COMMAND.main(["replay", str(journal), "--break", "measured[3]"]) == 0
    out = capsys.readouterr().out
    assert "42" in out
    assert "/hero: equal; " in out


def test_a_parameter_that_the_node_does_not_have_is_refused_before_anything_runs(
    journal: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(REFUSED, match=r"^parameters: /hero: there is no parameter 'fcator'; did you mean 'factor'\?"):
        COMMAND.main(["replay", str(journal), "--set", "fcator=3"])
    with pytest.raises(REFUSED, match=r"^parameters: .*factor"):
        COMMAND.main(["replay", str(journal), "--set", "factor=99"])
    assert capsys.readouterr() == ("", "")


async def bag_of_a_subtree(path: Path) -> None:
    journal = Journal("world/team", publish=True)
    topics = [topic_of("world/team"), "/results"]
    recorder = Child(Recorder, args=(path, RecordOptions(selection=Selection(topics=topics))))
    async with run(
        Supervisor("world", children=[recorder, Child(Source), TEAM]), observers=(journal,), sinks=()
    ) as system:
        await system.clock.sleep(1.5)


class Thrice(Doubler):
    """With another constant."""

    @NUMBERS.on()
    def double(self, message: Int32) -> None:
        super().double(Int32(data=message.data + (message.data == 60)))


def test_a_subtree_is_replayed_from_a_bag_and_a_changed_node_in_it_is_found_at_the_border(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = str(tmp_path / "walk")
    execute(lambda: bag_of_a_subtree(tmp_path / "walk"), clock="virtual")
    assert COMMAND.main(["replay", path, "--subtree", "world/team"]) == 0
    assert capsys.readouterr().out.startswith("world/team: equal; ")
    changed = ["--subtree", "world/team", "--node", "doubler", "--with", "tests.cli.test_bag_replay:Thrice"]
    COMMAND.main(["replay", path, *changed])
    assert (
        "inside: publish /doubled[59] at 0.600000 s, field data: recorded 120, replayed 122" in capsys.readouterr().out
    )
    assert (
        COMMAND.main(["replay", path, "--subtree", "world/team", "--node", "doubler", "--set", "factor=1", "--json"])
        == 1
    )
    facts: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert "publish /results[0] at 0.320000 s" in facts["differences"][0]
    assert facts["inner"][0].startswith("publish /doubled[0] at 0.010000 s")
    with pytest.raises(REFUSED, match="say which one is changed; it has /doubler, /summer"):
        COMMAND.main(["replay", path, "--subtree", "world/team", "--set", "factor=1"])
    with pytest.raises(REFUSED, match="has no journal of world/crew; it has those of: world/team"):
        COMMAND.main(["replay", path, "--subtree", "world/crew"])
    with pytest.raises(REFUSED, match=r"--node NODE, or which nodes with --subtree PATH"):
        COMMAND.main(["replay", path])


def test_the_file_of_a_subtree_is_replayed_by_its_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = str(tmp_path / "team.journal")
    execute(lambda: saved_team(tmp_path / "team.journal"), clock="virtual")
    assert COMMAND.main(["replay", file]) == 0
    assert COMMAND.main(["replay", file, "--subtree", "world/team"]) == 0
    with pytest.raises(REFUSED, match="is the journal of world/team, not of world/crew"):
        COMMAND.main(["replay", file, "--subtree", "world/crew"])
    with pytest.raises(UsageError, match="'team' is no path of a supervisor below the root, such as robot/navigation"):
        COMMAND.main(["replay", file, "--subtree", "team"])


async def saved_team(path: Path) -> None:
    journal = Journal("world/team")
    async with run(WORLD, observers=(journal,), sinks=()) as system:
        await system.clock.sleep(0.3)
    journal.save(path, "world/team")
