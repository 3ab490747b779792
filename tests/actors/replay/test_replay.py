"""A node is replayed alone from its journal: to the same messages, calls, answers, log lines and crashes, on both clocks."""

from __future__ import annotations

import asyncio
import gc
import inspect
import subprocess
import sys
from pathlib import Path
from typing import Literal

import pytest

from actors import Child, Node, background, every, execute, publishes, run
from actors.interfaces.std_msgs.msg import Int32, String
from actors.nodes import ClockPublisher
from actors.replay import Journal, ReplayError, load, replay
from actors.system import System
from tests.actors.replay.story import HERO, NUMBERS, OTHERS, TOLD, Hero, Visitor, lived, story

CLOCKS = ["virtual", pytest.param("real", marks=pytest.mark.realtime)]
Clock = Literal["real", "virtual"]


class Fragile(Node):
    @NUMBERS.on()
    def number(self, message: Int32) -> None:
        self.log.info("one more", number=message.data)
        if message.data == 3:
            raise ZeroDivisionError("at three")


class Sums(Node):
    told = publishes(TOLD)

    @every(hz=10)
    def beat(self) -> None:
        self.told(String(data="beat"))


BELL: list[asyncio.Event] = []


class Waiting(Node):
    told = publishes(TOLD)

    async def on_start(self) -> None:
        BELL.append(asyncio.Event())
        self.create_task(self.wait())

    async def wait(self) -> None:
        await BELL[0].wait()  # an object that it shares with others
        self.told(String(data="woken"))


@pytest.fixture(scope="module")
def hero() -> Journal:
    """The journal of the story, on the virtual clock."""
    return execute(story, clock="virtual")[0]


def test_a_life_on_the_real_clock_is_replayed_without_a_difference_however_long_its_handlers_took() -> None:
    journal, _ = execute(story, clock="real")
    assert replay(journal.recording("hero")).differences == ()


@pytest.mark.parametrize("clock", CLOCKS)
def test_a_node_that_does_all_that_a_journal_carries_is_replayed_to_the_end_without_a_difference(clock: Clock) -> None:
    journal, became = execute(story, clock=clock)
    recording = journal.recording("hero")
    verdict = replay(recording)
    assert verdict.differences == ()
    assert (verdict.equal, verdict.lacking, verdict.failure) == (True, "", "")
    told = [value.data for kind, name, value in recording.outputs() if (kind, name) == ("publish", "/told")]
    for begin in (
        "life 1", "life 2", "map house", "slow 10", "streamed 10", "slept at", "thread 144", "executor 169", "answer yes", "ServiceFailed",
        "CallTimeout", "ServiceUnavailable", "goal ", "feedback [0]", "result [3]", "ended <CANCELED", "asked to climb", "stops: ",
    ):  # fmt: skip
        assert any(text.startswith(begin) for text in told), begin  # it was in the story, so it was compared
    assert "<CANCELED: preempted by a newer goal>" in became
    kinds = {entry[0] for entry in recording.entries if isinstance(entry, tuple)}
    assert {
        "deliver",
        "tick",
        "request",
        "given up",
        "goal",
        "cancel",
        "done",
        "feedback",
        "outcome",
        "parameters",
        "crash",
    } <= kinds


def test_of_many_replays_no_system_is_left_but_that_of_the_newest() -> None:
    async def main() -> Journal:
        journal = Journal("sums")
        async with run(Child(Sums, name="sums"), observers=(journal,), sinks=()) as system:
            await system.clock.sleep(0.5)
        return journal

    def systems() -> int:
        gc.collect()
        return sum(type(one) is System for one in gc.get_objects())

    recording = execute(main, clock="virtual").recording("sums")
    before = systems()
    for _ in range(4):
        assert replay(recording).equal
    assert systems() <= before + 1


def test_the_run_is_the_same_with_a_journal_and_without() -> None:
    async def told(journal: bool) -> list[str]:
        heard: list[str] = []

        class Ear(Node):
            @TOLD.on()
            def hear(self, message: String) -> None:
                heard.append(message.data)

        await story(Child(Ear), hero=HERO if journal else HERO.replace(name="hero"))
        return heard

    async def without() -> list[str]:
        heard: list[str] = []

        class Ear(Node):
            @TOLD.on()
            def hear(self, message: String) -> None:
                heard.append(message.data)

        async with run(OTHERS, HERO, Visitor, Child(Ear), sinks=(), seed=5) as system:
            await lived(system, 0.3)
        return heard

    kept = execute(lambda: told(True), clock="virtual")
    assert len(kept) > 50
    assert execute(without, clock="virtual") == kept


def test_a_planted_change_is_found_at_its_first_effect_by_topic_time_and_field(hero: Journal) -> None:
    class Changed(Hero):
        @NUMBERS.on()
        async def number(self, message: Int32) -> None:
            await super().number(Int32(data=message.data + (message.data == 23)))

    first, *_ = replay(hero.recording("hero"), node=Changed).differences
    before = [value for _, name, value in hero.recording("hero").outputs() if name == "/measured"]
    assert (first.kind, first.name, first.field) == ("publish", "/measured", "data")
    assert (first.recorded, first.replayed) == (2 * 23 + 0.23, 2 * 24 + 0.23)
    assert first.time == 0.23
    assert before[first.number].data == first.recorded
    assert "publish /measured[" in str(first)
    assert "at 0.230000 s, field data: recorded 46.23, replayed 48.23" in str(first)


def test_another_parameter_shows_what_the_node_would_have_done_otherwise_and_where(hero: Journal) -> None:
    verdict = replay(hero.recording("hero"), parameters={"factor": 5})
    first = {(one.kind, one.name): one for one in verdict.differences}
    assert "factor 5" in first["publish", "/told"].replayed
    assert (first["publish", "/measured"].recorded, first["publish", "/measured"].replayed) == (2.01, 5.01)


def test_a_changed_node_that_calls_waits_and_ticks_otherwise_is_given_the_rest_of_the_recording(hero: Journal) -> None:
    class Impatient(Hero):
        async def on_start(self) -> None:
            await super().on_start()
            await self.clock.sleep(0.005)  # the recording has no such step

        @every(hz=50)
        def more(self) -> None:
            self.say(f"more at {self.clock.now():.3f}")

    verdict = replay(hero.recording("hero"), node=Impatient, every=True)
    lives = [entry for entry in hero.recording("hero").entries if isinstance(entry, tuple) and entry[0] == "start"]
    assert not verdict.equal
    assert verdict.failure == ""
    assert len(lives) == 2  # and it lived both of them:
    assert verdict.compared > 300


def test_a_crash_replays_to_the_crash() -> None:
    async def main() -> Journal:
        journal = Journal("/fragile")
        async with run(OTHERS, Fragile, observers=(journal,), sinks=()) as system:
            await system.clock.sleep(0.035)
        return journal

    recording = execute(main, clock="virtual").recording("fragile")
    ends = [
        place for place, entry in enumerate(recording.entries) if isinstance(entry, tuple) and entry[1:2] == ("end",)
    ]
    del recording.entries[ends[0] + 1 :]
    verdict = replay(recording)
    assert verdict.equal
    assert verdict.failure == "ZeroDivisionError: at three"


def test_a_debugger_stops_at_the_message_that_is_asked_for(hero: Journal) -> None:
    seen: list[object] = []

    def debugger() -> None:
        frame = inspect.currentframe()
        while frame is not None and frame.f_code.co_name != "number":
            frame = frame.f_back
        assert frame is not None
        seen.append(frame.f_locals["message"])

    assert replay(hero.recording("hero"), pause=("/measured", 0), debugger=debugger).equal
    assert seen == [Int32(data=1)]


def test_a_journal_is_saved_and_replayed_by_another_process(hero: Journal, tmp_path: Path) -> None:
    path = hero.save(tmp_path / "hero.journal", "/hero")
    program = "import sys, tests.actors.replay.nodes; from actors.replay import load, replay; v = replay(load(sys.argv[1])); print(v.equal, v.compared)"
    done = subprocess.run([sys.executable, "-c", program, path], capture_output=True, text=True, check=True)
    assert done.stdout.split()[0] == "True"
    assert int(done.stdout.split()[1]) > 300


def test_what_no_journal_carries_ends_the_replay_by_name() -> None:
    async def main() -> Journal:
        journal = Journal("waiting")
        async with run(Waiting, observers=(journal,), sinks=()) as system:
            await system.clock.sleep(0.1)
            BELL.pop().set()
            await system.clock.sleep(0.1)
        return journal

    recording = execute(main, clock="virtual").recording("waiting")
    verdict = replay(recording)
    assert "woken by" in verdict.lacking
    (unknown,) = [entry for entry in recording.entries if isinstance(entry, tuple) and entry[0] == "unknown"]
    assert "which no journal carries" in unknown[3]
    assert not verdict.equal


def test_a_node_whose_arguments_cannot_be_kept_runs_on_without_a_journal() -> None:
    class Device:
        no_replay = "is a device"

    class Driver(Node):
        def __init__(self, device: object) -> None:
            self.device = device

    async def main() -> dict[str, str]:
        journal = Journal("driver", "lambda")
        tree = (Child(Driver, args=(Device(),)), Child(Driver, name="lambda", args=(lambda: None,)))
        async with run(*tree, observers=(journal,), sinks=()) as system:
            assert vars(system.node("driver"))["device"] is tree[0].args[0]
            with pytest.raises(ReplayError, match="there is no journal of /driver: its argument Device is a device"):
                journal.recording("/driver")
        return journal.refused

    refused = execute(main, clock="virtual")
    assert refused["/driver"] == "its argument Device is a device"
    assert "lambda" in refused["/lambda"]


def test_a_node_that_has_not_started_has_no_journal_and_a_journal_names_its_nodes(tmp_path: Path) -> None:
    with pytest.raises(ReplayError, match="say of which nodes"):
        Journal()
    with pytest.raises(ReplayError, match="there is no journal of ghost: it has not started"):
        Journal("ghost").recording("ghost")
    (tmp_path / "text").write_text("no journal")
    with pytest.raises(ReplayError, match="/text: this is no journal of a node"):
        load(tmp_path / "text")
    assert repr(Journal("b", "a")) == "<journal of a, b>"


class Ticking(Node):
    told = publishes(TOLD)

    @every(hz=10)
    def tick(self) -> None:
        self.told(String(data=f"tick at {self.clock.now():.3f}"))

    @background
    async def waits(self) -> None:
        while True:
            await self.clock.sleep(0.07)
            self.told(String(data=f"slept until {self.clock.now():.3f}"))


def test_a_node_that_starts_on_simulated_time_is_replayed_with_its_timers_and_sleeps_and_over_a_crash() -> None:
    async def main() -> Journal:
        journal = Journal("ticking")
        node = Child(Ticking, parameters={"use_sim_time": True})
        async with run(ClockPublisher, node, observers=(journal,), sinks=()) as system:
            await system.clock.sleep(0.5)
            system.crash("ticking", RuntimeError("struck"))
            await system.clock.sleep(0.5)
        return journal

    recording = execute(main, clock="virtual").recording("ticking")
    told = [value.data for kind, name, value in recording.outputs() if name == "/told"]
    assert sum(text.startswith("tick at") for text in told) > 5
    assert sum(text.startswith("slept until") for text in told) > 8
    verdict = replay(recording)
    assert (verdict.equal, verdict.lacking, verdict.differences) == (True, "", ())
