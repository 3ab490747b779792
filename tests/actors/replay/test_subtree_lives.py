"""What begins and ends inside a subtree of which a journal is kept: nodes that come late, end for good, are killed, or cannot be kept."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import pytest

from actors import CallTimeout, Child, DynamicSupervisor, Node, Stop, Supervisor, execute, publishes, run, temporary
from actors.bag import Recorder, RecordOptions, Selection
from actors.interfaces.std_msgs.msg import Int32, String
from actors.interfaces.std_srvs.srv import Trigger
from actors.logs import LogRecord
from actors.replay import (
    Journal,
    Recording,
    ReplayError,
    has_journal,
    journals_in,
    load,
    recording_in,
    recordings_in,
    replay,
)
from actors.replay.publishing import topic_of
from actors.replay.recording import starts_of
from actors.runtime.declarations import background, every
from tests.actors.replay.story import TOLD
from tests.actors.replay.test_on_request import Holding, Once, Operator
from tests.actors.replay.test_subtree import DOUBLED, NEVER, TEAM, WORLD, Doubler, Source, Summer


class Watcher(Node):
    """Tells how many listen to what it sends."""

    doubled = publishes(DOUBLED)
    told = publishes(TOLD)

    @every(hz=20)
    def tell(self) -> None:
        self.doubled(Int32(data=1))
        self.told(String(data=f"{self.doubled.subscription_count} listen"))


class Brief(Node):
    """Ends in order after three messages."""

    heard = 0

    @DOUBLED.on()
    def hear(self, message: Int32) -> None:
        self.heard += 1
        if self.heard == 3:
            raise Stop("enough")


class Stubborn(Node):
    """Does not end when it is asked to, and is killed."""

    told = publishes(TOLD)

    @background
    async def cling(self) -> None:
        while True:
            await self.clock.sleep(0.1)
            self.told(String(data="still here"))

    async def on_stop(self, reason: object) -> None:
        self.told(String(data="never"))
        await asyncio.Event().wait()


class Counting(Node):
    """Counts messages of others inside."""

    told = publishes(TOLD)
    heard = 0

    @DOUBLED.on()
    def hear(self, message: Int32) -> None:
        self.heard += 1
        self.told(String(data=f"{self.name} {self.heard}"))


def told(recording: Recording) -> list[str]:
    return [value.data for _, name, value in recording.outputs(inner=True) if name == "/told"]


def assert_equal(recording: Recording) -> None:
    verdict = replay(recording)
    assert (verdict.differences, verdict.inner, verdict.lacking) == ((), (), "")
    assert verdict.compared > 10


def test_a_node_inside_that_ends_for_good_is_no_more_listened_to_in_the_replay_either() -> None:
    async def main() -> Recording:
        journal = Journal("world/team")
        team = Supervisor("team", children=[Child(Watcher), Child(Brief, restart=temporary)])
        async with run(Supervisor("world", children=[team]), observers=(journal,), sinks=()) as system:
            await system.clock.sleep(0.5)
        return journal.recording("world/team")

    recording = execute(main, clock="virtual")
    texts = told(recording)
    assert texts[:2] == ["1 listen", "1 listen"]
    assert texts[-1] == "0 listen"
    assert_equal(recording)


def test_a_node_inside_that_was_stopped_and_is_started_again_later_is_replayed_over_both_lives() -> None:
    async def main() -> Recording:
        journal = Journal("world/team")
        team = Supervisor("team", children=[Child(Watcher), Child(Counting)])
        async with run(Supervisor("world", children=[team]), observers=(journal,), sinks=()) as system:
            assert system.supervisor is not None
            supervisor = next(one for one in system.supervisor.below() if one.name == "world/team")
            await system.clock.sleep(0.3)
            await supervisor.terminate_child("counting")
            await system.clock.sleep(0.2)
            await supervisor.restart_child("counting")
            await system.clock.sleep(0.3)
        return journal.recording("world/team")

    recording = execute(main, clock="virtual")
    assert {"1 listen", "0 listen"} <= {*told(recording)}
    assert [start.node for start in starts_of(recording)] == ["/watcher", "/counting", "/counting"]
    assert_equal(recording)


def test_nodes_that_join_a_supervisor_below_while_it_runs_belong_to_the_subtree() -> None:
    async def main() -> Recording:
        journal = Journal("world/team")
        crew = DynamicSupervisor("crew", Child(Counting))
        team = Supervisor("team", children=[Child(Watcher), crew])
        async with run(Supervisor("world", children=[team]), observers=(journal,), sinks=()) as system:
            assert system.supervisor is not None
            supervisor = next(one for one in system.supervisor.below() if one.name == "world/team/crew")
            for _ in range(2):
                await system.clock.sleep(0.2)
                await supervisor.spawn()
            system.crash("watcher", RuntimeError("struck"))
            await system.clock.sleep(0.3)
        return journal.recording("world/team")

    recording = execute(main, clock="virtual")
    assert len({start.node for start in starts_of(recording)}) == 3
    assert {start.path[:-1] for start in starts_of(recording)} == {("world", "team"), ("world", "team", "crew")}
    assert_equal(recording)


def test_a_node_inside_that_is_killed_is_killed_in_the_replay_and_what_failed_is_said_with_its_name() -> None:
    async def main() -> Recording:
        journal = Journal("world/team")
        team = Supervisor("team", children=[Child(Watcher), Child(Stubborn, stop=0.2, restart=temporary)])
        async with run(Supervisor("world", children=[team]), observers=(journal,), sinks=()) as system:
            assert system.supervisor is not None
            supervisor = next(one for one in system.supervisor.below() if one.name == "world/team")
            await system.clock.sleep(0.5)
            await supervisor.terminate_child("stubborn")
            await system.clock.sleep(0.3)
        return journal.recording("world/team")

    recording = execute(main, clock="virtual")
    assert told(recording).count("never") == 1
    assert_equal(recording)
    assert replay(recording).failure.startswith("/stubborn: CancelledError")


def test_a_subtree_with_a_node_that_cannot_be_kept_has_no_journal_and_runs_on() -> None:
    lines: list[LogRecord] = []

    async def main() -> Journal:
        journal = Journal("world/team")
        team = Supervisor("team", children=[Child(Watcher), Child(Holding, args=(lambda: None,)), Child(Counting)])
        tree = Supervisor("world", children=[team])
        async with run(tree, observers=(journal,), sinks=(lines.append,)) as system:
            await system.clock.sleep(0.5)
            assert system.node(Counting).heard > 5
        return journal

    journal = execute(main, clock="virtual")
    assert journal.refused["world/team"].startswith("/holding: ")
    with pytest.raises(ReplayError, match=r"there is no journal of world/team: /holding: .*lambda"):
        journal.recording("world/team")
    (whole,) = [line for line in lines if line.event == "a journal is not whole"]
    assert whole.fields["node_name"] == "world/team"


def test_when_a_journal_was_given_up_nothing_is_kept_of_what_comes_in_later() -> None:
    async def main() -> list[object]:
        journal: Any = Journal("world/team")
        team = Supervisor("team", children=[Child(Doubler), Child(Holding, args=(lambda: None,))])
        tree = Supervisor("world", children=[Child(Source), team])
        async with run(tree, observers=(journal,), sinks=()) as system:
            await system.clock.sleep(0.1)
            system.crash(Doubler, RuntimeError("struck"))  # no code of its next life is recorded
            await system.clock.sleep(1.0)
            assert system.node(Doubler).incarnation == 2
            return [*journal._boundaries["world/team"].spool.entries]

    assert execute(main, clock="virtual") == []


def test_a_node_is_in_the_journal_of_its_subtree_alone() -> None:
    async def main() -> Journal:
        journal = Journal("summer", "world/team")
        async with run(WORLD, observers=(journal,), sinks=()) as system:
            await system.clock.sleep(0.2)
            with pytest.raises(ReplayError, match="no journal of /summer can be begun: it is in that of world/team"):
                await journal.begin("summer")
        return journal

    journal = execute(main, clock="virtual")
    assert len(starts_of(journal.recording("world/team"))) == 2
    with pytest.raises(ReplayError, match="there is no journal of summer: it has not started"):
        journal.recording("summer")


def test_the_journal_of_a_subtree_is_begun_while_it_runs_by_a_restart_of_its_nodes(tmp_path: Path) -> None:
    reasons: list[str] = []

    async def main() -> None:
        journal = Journal(on_request=True, folder=tmp_path)
        team = Supervisor("team", children=[Child(Doubler), Supervisor("inner", children=[Child(Summer)]), Child(Once)])
        topics = [topic_of("world/team/inner")]
        recorder = Child(Recorder, args=(tmp_path / "bag", RecordOptions(selection=Selection(topics=topics))))
        tree = Supervisor("world", children=[Child(Source), Child(Operator), team, recorder])
        async with run(tree, observers=(journal,), sinks=()) as system:
            await system.clock.sleep(0.1)
            operator = system.node(Operator)
            reasons.append((await operator.keep("world/teem")).reason)
            assert (
                "no node runs below world/team/inner/summer" in (await operator.keep("world/team/inner/summer")).reason
            )
            assert (await operator.keep("world/team/inner")).successful
            await system.clock.sleep(1.0)
            assert [system.node(one).incarnation for one in (Doubler, Summer)] == [1, 2]
            reasons.append((await operator.keep("world/team/inner", "summer")).reason)
            reasons.append((await operator.keep("world/team/inner", "world/team")).reason)

    execute(main, clock="virtual")
    assert "no node runs below world/teem; did you mean 'world/team'?" in reasons[0]
    assert "no journal of /summer can be begun: it is in that of world/team/inner" in reasons[1]
    assert "no journal of world/team can be begun: /summer is in that of world/team/inner" in reasons[2]
    recording = load(tmp_path / "world.team.inner.subtree.journal")
    assert (recording.node, recording.start.incarnation) == ("world/team/inner", 2)
    assert_equal(recording)
    assert journals_in(tmp_path / "bag") == {"world/team/inner"} == {*recordings_in(tmp_path / "bag")}
    assert [has_journal(tmp_path / "bag", path) for path in ("world/team/inner", "world/team")] == [True, False]
    assert repr(recording_in(tmp_path / "bag", "world/team/inner").start) == repr(recording.start)


def test_a_call_inside_of_nodes_that_do_otherwise_times_out_when_it_is_due() -> None:
    class Eager(Summer):
        """Asks at once what is answered by nobody, and gives up one call after another."""

        @background
        async def hurries(self) -> None:
            for _ in range(3):
                try:
                    await self.call(NEVER, Trigger.Request(), timeout=0.03)
                except CallTimeout:
                    self.told(String(data=f"gave up at {self.clock.now():.3f}"))

    async def main() -> Recording:
        journal = Journal("world/team")
        async with run(Supervisor("world", children=[Child(Source), TEAM]), observers=(journal,), sinks=()) as system:
            await system.clock.sleep(0.3)
        return journal.recording("world/team")

    verdict = replay(execute(main, clock="virtual"), changed="summer", node=Eager)
    first = {one.name: one for one in verdict.differences}["/told"]
    # its call goes out when the nodes leave the recording, at the first step that is not that of the recording: at 0.01 s
    assert (first.number, first.time, first.replayed) == (1, 0.04, "gave up at 0.040")


def test_versions_that_are_not_those_of_the_recording_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    async def main() -> Recording:
        journal = Journal("watcher")
        async with run(Watcher, observers=(journal,), sinks=()) as system:
            await system.clock.sleep(0.2)
        return journal.recording("watcher")

    recording = execute(main, clock="virtual")
    assert replay(recording).other_versions == ()
    here: Any = recording.start.versions
    other = tuple((what, "0.1" if what == "numpy" else version) for what, version in here)
    object.__setattr__(recording.start, "versions", other)
    verdict = replay(recording)
    assert verdict.equal
    assert verdict.other_versions == (f"numpy {dict(here)['numpy']} (recorded with 0.1)",)
