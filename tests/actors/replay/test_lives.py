"""The beginnings of lives are replayed: what comes in during the first step, and lives that cannot be made."""

from __future__ import annotations

import pytest

from actors import Child, Node, Topic, execute, parameter, publishes, run, subscribes
from actors.interfaces.rcl_interfaces.msg import ParameterEvent
from actors.interfaces.std_msgs.msg import String
from actors.replay import Journal, Recording, replay
from actors.replay.recording import BACK
from tests.actors.replay.story import TOLD
from tests.actors.replay.test_replay import CLOCKS, Clock

MADE: list[Node] = []
FAULTY: set[int] = set()


class Born(Node):
    """Cannot be made at some attempts."""

    told = publishes(TOLD)

    def __init__(self) -> None:
        MADE.append(self)
        if len(MADE) in FAULTY:
            raise ValueError("not yet")

    async def on_start(self) -> None:
        self.told(String(data=f"life {self.incarnation}"))


class Unborn(Born):
    """Cannot be made at all."""

    node_name = "born"

    def __init__(self) -> None:
        raise OSError("no such device")


async def crashed(kind: type[Node] = Born) -> Recording:
    """Three lives, with crashes in between."""
    MADE.clear()
    journal = Journal("born")
    async with run(Child(kind, name="born"), observers=(journal,), sinks=()) as system:
        for _ in range(2):
            await system.clock.sleep(10.0)
            system.crash("born", RuntimeError("struck"))
        await system.clock.sleep(10.0)
    return journal.recording("born")


class Watched(Node):
    """Has its parameters heard by a node that came before it."""

    told = publishes(TOLD)
    limit = parameter(1)

    async def on_start(self) -> None:
        self.told(String(data=f"at {self.clock.now()}"))


class Listener(Node):
    """Hears of the parameters of all nodes."""

    heard = subscribes(Topic(ParameterEvent, "/parameter_events", 100))


class Quiet(Born):
    """Sends nothing."""

    async def on_start(self) -> None:
        pass


def test_a_life_that_could_not_be_made_cannot_be_made_in_the_replay_and_the_next_one_is() -> None:
    FAULTY.update({2, 4})
    try:
        recording = execute(crashed, clock="virtual")
        assert recording.counts()["start"] == 5
        MADE.clear()
        verdict = replay(recording)
        assert (verdict.differences, verdict.lacking, len(MADE)) == ((), "", 5)
    finally:
        FAULTY.clear()
    MADE.clear()
    mended = replay(recording, every=True)  # now each life can be made, two of them sooner than in the recording
    assert (mended.failure, len(MADE)) == ("", 3)


def test_a_node_that_could_be_made_only_in_the_replay_and_sends_nothing_lives_on() -> None:
    FAULTY.add(2)
    try:
        recording = execute(lambda: crashed(Quiet), clock="virtual")
    finally:
        FAULTY.clear()
    MADE.clear()
    verdict = replay(recording)
    assert (verdict.failure, verdict.lacking, len(MADE)) == ("", "", 3)


def test_a_changed_node_that_cannot_be_made_does_nothing_of_the_recording() -> None:
    recording = execute(crashed, clock="virtual")
    verdict = replay(recording, node=Unborn)
    assert verdict.failure == "OSError: no such device"
    assert [(one.name, one.replayed) for one in verdict.differences if one.kind == "publish"] == [("/told", "nothing")]


@pytest.mark.parametrize("clock", CLOCKS)
def test_what_others_see_of_a_node_in_its_first_step_does_not_part_that_step(clock: Clock) -> None:
    async def main() -> Recording:
        journal = Journal("watched")
        async with run(Listener, Watched, observers=(journal,), sinks=()) as system:
            await system.clock.sleep(0.1)
            system.crash("watched", RuntimeError("struck"))
            await system.clock.sleep(0.1)
        return journal.recording("watched")

    recording = execute(main, clock=clock)
    (met, *_) = [
        entry for entry in recording.entries if isinstance(entry, tuple) and entry[4:5] == ("/parameter_events",)
    ]
    assert (met[0], met[2]) == ("subscription", BACK)
    verdict = replay(recording)
    assert (verdict.differences, verdict.lacking) == ((), "")
