"""A journal is begun while its node runs: the node is restarted, and what it does from then on is replayed alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from actors import Child, DynamicSupervisor, Node, Service, Supervisor, execute, publishes, run
from actors.interfaces.rcl_interfaces import msg, srv
from actors.interfaces.std_msgs.msg import String
from actors.logs import LogRecord
from actors.replay import Journal, Recording, ReplayError, replay
from actors.replay.publishing import PUBLISHER
from actors.supervision.errors import StartFailed
from tests.actors.replay.story import HERO, OTHERS, TOLD, Hero, Visitor, lived
from tests.actors.replay.test_replay import CLOCKS, Clock

SET = Service(srv.SetParameters, f"{PUBLISHER}/set_parameters")


class Operator(Node):
    """Sets the parameter of the node that publishes journals."""

    async def keep(self, *nodes: str) -> Any:
        value = msg.ParameterValue(type=msg.ParameterType.PARAMETER_STRING_ARRAY, string_array_value=[*nodes])
        request = srv.SetParameters.Request(parameters=[msg.Parameter(name="nodes", value=value)])
        return (await self.call(SET, request)).results[0]


class Drawing(Node):
    """Tells its life, and draws an id."""

    told = publishes(TOLD)

    async def on_start(self) -> None:
        drawn = self.new_goal_id()
        self.told(String(data=f"life {self.incarnation}: {drawn.hex()} {self.rng.random()}"))

    def new_goal_id(self) -> bytes:
        from actors.runtime.incarnation import incarnation_of

        return incarnation_of(self).new_id()


class Once(Node):
    """Starts only once."""

    async def on_start(self) -> None:
        if self.incarnation > 1:
            raise OSError("the device is gone")


class Holding(Node):
    """Has a device, which cannot be kept."""

    def __init__(self, device: object) -> None:
        self.device = device


def texts(recording: Recording) -> list[str]:
    return [value.data for kind, name, value in recording.outputs() if (kind, name) == ("publish", "/told")]


@pytest.mark.parametrize("clock", CLOCKS)
def test_a_journal_that_is_begun_amid_a_run_begins_with_a_life_and_is_replayed(clock: Clock) -> None:
    async def main() -> Journal:
        journal = Journal(on_request=True)
        assert repr(journal) == "<journal of no node yet>"
        async with run(OTHERS, HERO, Visitor, observers=(journal,), sinks=(), seed=5) as system:
            await lived(system, 0.1)
            before = system.node(Hero)
            await journal.begin("hero")
            assert system.node(Hero) is not before
            await journal.begin("/hero")  # it is kept already
            assert system.node(Hero).incarnation == before.incarnation + 1
            await lived(system, 0.1)
        return journal

    journal = execute(main, clock=clock)
    recording = journal.recording("hero")
    assert journal.nodes == ("/hero",)
    assert (recording.start.incarnation, recording.start.id_streams) == (3, 2)
    assert texts(recording)[0].startswith("life 3 ")
    verdict = replay(recording)
    assert (verdict.differences, verdict.lacking) == ((), "")
    assert verdict.compared > 150


def test_messages_that_waited_for_the_node_when_its_journal_was_begun_are_lost_and_counted() -> None:
    async def main() -> tuple[Recording, int]:
        journal = Journal(on_request=True)
        async with run(OTHERS, HERO, observers=(journal,), sinks=()) as system:
            await system.clock.sleep(0.049)  # since 0.04 s it sleeps in a handler, and others wait
            before = system.dead_letters
            await journal.begin("hero")
            return journal.recording("hero"), system.dead_letters - before

    recording, lost = execute(main, clock="virtual")
    assert lost > 0
    assert recording.start.incarnation == 2
    verdict = replay(recording)
    assert (verdict.differences, verdict.lacking) == ((), "")


def test_another_process_begins_a_journal_by_a_parameter_and_is_told_why_not() -> None:
    lines: list[LogRecord] = []

    async def main() -> tuple[Journal, dict[str, str]]:
        journal = Journal(on_request=True)
        tree = (OTHERS, HERO, Operator, Once, Child(Holding, args=(lambda: None,)))
        reasons: dict[str, str] = {}
        async with run(*tree, observers=(journal,), sinks=(lines.append,)) as system:
            await system.join(Child(Visitor, name="guest"))
            operator = system.node(Operator)
            for node in ("heroe", "guest", "holding"):
                reasons[node] = (await operator.keep(node)).reason
            assert (await operator.keep("/hero", "once")).successful
            await system.clock.sleep(1.0)
            assert (await operator.keep("/hero", "once", "hero")).successful  # nothing new
            assert system.node(Hero).incarnation == 2
            reasons["left out"] = (await operator.keep("once")).reason
        return journal, reasons

    journal, reasons = execute(main, clock="virtual")
    assert "did you mean 'hero'?" in reasons["heroe"]
    assert "no journal of /guest can be begun: it has no supervisor that could restart it" in reasons["guest"]
    assert "lambda" in reasons["holding"]
    assert "a journal is kept to the end of the run: that of /hero, hero cannot be ended" in reasons["left out"]
    (failed,) = [line for line in lines if line.event == "no journal was begun"]
    assert failed.fields["node_name"] == "/once"
    assert "the device is gone" in failed.fields["because"]
    assert replay(journal.recording("hero")).equal


def test_a_node_runs_on_whose_journal_cannot_be_written_and_whoever_began_it_is_told(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("a file", encoding="utf-8")

    async def main() -> Journal:
        journal = Journal(on_request=True, folder=tmp_path / "taken")
        async with run(OTHERS, HERO, observers=(journal,), sinks=()) as system:
            with pytest.raises(
                ReplayError, match=r"no journal of /hero is kept: its journal cannot be written: .*taken"
            ):
                await journal.begin("hero")
            await system.clock.sleep(0.1)
            assert system.node(Hero).incarnation == 2
        return journal

    journal = execute(main, clock="virtual")
    with pytest.raises(ReplayError, match="there is no journal of hero: its journal cannot be written"):
        journal.recording("hero")


def test_a_journal_that_no_run_has_begins_nothing() -> None:
    with pytest.raises(ReplayError, match="has not been attached"):
        Journal(on_request=True).check("hero")


def test_a_node_that_does_not_start_again_is_told_to_whoever_began_its_journal() -> None:
    async def main() -> None:
        journal = Journal(on_request=True)
        async with run(Once, observers=(journal,), sinks=()):
            with pytest.raises(StartFailed, match="the device is gone"):
                await journal.begin("once")

    execute(main, clock="virtual")


def test_a_node_that_was_removed_and_added_again_begins_anew_and_draws_further_ids() -> None:
    async def main() -> Recording:
        journal = Journal("drawing")
        group = DynamicSupervisor("group", template=Child(Drawing))
        async with run(OTHERS, group, observers=(journal,), sinks=()) as system:
            assert system.supervisor is not None
            (drawings,) = (one for one in system.supervisor.below() if one.path == ("system", "group"))
            for _ in range(3):
                await drawings.spawn(name="drawing")
                await system.clock.sleep(0.1)
                await drawings.terminate_child("drawing")  # which forgets it
        return journal.recording("drawing")

    recording = execute(main, clock="virtual")
    said = [text.split() for text in texts(recording)]
    assert [words[1] for words in said] == ["1:"] * 3
    assert len({words[2] for words in said}) == 3, "no id twice"
    assert len({words[3] for words in said}) == 1, "the same random numbers as the first time"
    verdict = replay(recording)
    assert (verdict.differences, verdict.lacking) == ((), "")


def test_a_subtree_that_has_gone_with_its_supervisor_is_named() -> None:
    async def main() -> None:
        journal = Journal(on_request=True)
        tree = Supervisor("world", children=[Supervisor("outer", children=[Supervisor("team", children=[HERO])])])
        async with run(OTHERS, tree, observers=(journal,), sinks=()) as system:
            name = journal.check("system/world/outer/team")
            assert system.supervisor is not None
            world = next(one for one in system.supervisor.below() if one.path[-1] == "world")
            await world.terminate_child("outer")
            with pytest.raises(LookupError, match="team has gone with its supervisor"):
                await journal.restart(name)

    execute(main, clock="virtual")
