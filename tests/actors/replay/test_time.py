"""What clocks and timers do to a node is in its journal: simulated time that is switched, and ticks that came late or not at all."""

from __future__ import annotations

import time

import pytest

from actors import Child, Node, Topic, background, every, execute, publishes, run
from actors.errors import TickMissed
from actors.interfaces.std_msgs.msg import String
from actors.nodes import ClockPublisher
from actors.replay import Journal, Recording, replay
from actors.runtime.node import ErrorVerdict
from tests.actors.replay.story import HERO, OTHERS, TOLD, Hero, Visitor, lived
from tests.actors.replay.test_replay import CLOCKS, Clock, Ticking

BLOCK = Topic(String, "block")


class Ticked(Ticking):
    """Has one timer more than was recorded."""

    @every(hz=25)
    def more(self) -> None:
        self.told(String(data=f"more at {self.clock.now():.3f}"))


class Strict(Node):
    """Does not bear a tick that it has missed, and tells of it."""

    told = publishes(TOLD)

    @every(hz=50, late="fault")
    def tick(self) -> None:
        self.told(String(data="tick"))

    def on_error(self, error: Exception, handler: str) -> ErrorVerdict:
        self.told(String(data=str(error).partition(" were due")[0]))
        return "continue" if isinstance(error, TickMissed) else "fail"


class Blocking(Node):
    """Keeps the event loop from everything else, for longer than a tick lasts."""

    block = publishes(BLOCK)

    @background
    async def blocks(self) -> None:
        for seconds in (0.05, 0.09):
            await self.clock.sleep(0.1)
            time.sleep(seconds)  # noqa: ASYNC251


def texts(recording: Recording) -> list[str]:
    return [value.data for kind, name, value in recording.outputs() if (kind, name) == ("publish", "/told")]


async def switched(kind: type[Node], *, simulated: bool) -> Recording:
    """A node whose `use_sim_time` is switched to and fro."""
    journal = Journal("ticking")
    node = Child(kind, name="ticking", parameters={"use_sim_time": simulated})
    async with run(ClockPublisher, node, observers=(journal,), sinks=()) as system:
        for use in (not simulated, simulated):
            await system.clock.sleep(0.513)
            assert system.node("ticking").set_parameter("use_sim_time", use).successful
        await system.clock.sleep(0.513)
    return journal.recording("ticking")


@pytest.mark.parametrize("clock", CLOCKS)
@pytest.mark.parametrize("simulated", [False, True])
def test_a_node_whose_time_is_switched_while_it_runs_is_replayed_with_its_timers_and_sleeps(
    clock: Clock, simulated: bool
) -> None:
    recording = execute(lambda: switched(Ticking, simulated=simulated), clock=clock)
    assert sum(text.startswith("tick at") for text in texts(recording)) > 8
    verdict = replay(recording)
    assert (verdict.differences, verdict.lacking, verdict.equal) == ((), "", True)


def test_a_story_of_all_that_a_journal_carries_is_replayed_over_a_switch_of_its_time() -> None:
    async def main() -> Recording:
        journal = Journal("hero")
        async with run(ClockPublisher, OTHERS, HERO, Visitor, observers=(journal,), sinks=(), seed=5) as system:
            await system.clock.sleep(0.113)
            system.node(Hero).set_parameter("use_sim_time", True)
            await lived(system, 0.3)
            system.node(Hero).set_parameter("use_sim_time", False)  # which is true again in its second life
            await system.clock.sleep(0.2)
        return journal.recording("hero")

    verdict = replay(execute(main, clock="virtual"))
    assert (verdict.differences, verdict.lacking, verdict.equal) == ((), "", True)
    assert verdict.compared > 300


def test_a_timer_that_a_changed_node_has_beside_the_recorded_ones_ticks_as_it_would_have_in_the_recorded_run() -> None:
    recording = execute(lambda: switched(Ticking, simulated=True), clock="virtual")
    live = execute(lambda: switched(Ticked, simulated=True), clock="virtual")
    heard: list[str] = []

    class Listening(Ticked):
        node_name = "ticking"

        @every(hz=25)
        def more(self) -> None:
            heard.append(f"more at {self.clock.now():.3f}")

    verdict = replay(recording, node=Listening)
    assert (verdict.failure, verdict.lacking) == ("", "")
    ticks = [text for text in texts(live) if text.startswith("more")]
    assert heard[1:] == ticks[1:]  # until the first one, the node did as it was recorded
    assert len(heard) == len(ticks) > 30


@pytest.mark.realtime
def test_ticks_that_were_lost_to_a_busy_event_loop_are_lost_in_the_replay_and_counted_alike() -> None:
    async def main() -> Recording:
        journal = Journal("strict")
        async with run(Strict, Blocking, observers=(journal,), sinks=()) as system:
            await system.clock.sleep(0.5)
        return journal.recording("strict")

    recording = execute(main, clock="real")
    assert sum("more tick(s)" in text for text in texts(recording)) >= 2
    verdict = replay(recording)
    assert (verdict.differences, verdict.lacking, verdict.equal) == ((), "", True)
