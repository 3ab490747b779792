"""Searching seeds for a failure, shrinking it, and replaying it from one line: in tests and from a shell."""

from __future__ import annotations

import asyncio
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from actors import Child, Done, Node, Steps, Supervisor, background, qos
from actors.channel import Publisher
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.std_msgs.msg import Int32
from actors.system import System
from actors.testing import Rig, scenario
from actors.testing.__main__ import run
from actors.testing.explore import main
from actors.testing.faults import ALL, Delay, Duplicate, Lose, parse
from actors.testing.simulation.invariants import InvariantBroken
from actors.testing.simulation.search import Replay, search, shrink
from actors.testing.simulation.trial import Scenario
from tests.stage import COUNT, order
from tests.unit import planted
from tests.unit.planted import TICKS, Source

HERE = "tests.unit.planted"


@pytest.mark.parametrize("name", ["race", "deadlock", "lost_cancel", "storm"])
def test_each_planted_bug_is_found_within_200_seeds_and_replayed(
    name: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    record = tmp_path / "flight.mcap"
    assert main([f"{HERE}:{name}", "--seconds", "30", "--flight-record", str(record)]) == 1
    assert record.stat().st_size > 1000
    found = capsys.readouterr().out
    line = next(line for line in found.splitlines() if line.startswith("replay: "))
    trial = line.partition("--replay ")[2].strip("'")
    assert "fifo" not in trial.split()[1:] or len(trial.split()) > 2, "no bug shows in plain order and without faults"
    assert main([f"{HERE}:{name}", "--seconds", "30", "--replay", trial]) == 1
    again = capsys.readouterr().out
    assert "Traceback" in again
    error = found.splitlines()[1].split(":")[0].strip()
    assert error in again


def test_a_sound_system_passes(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([f"{HERE}:sound", "--seeds", "30", "--seconds", "10"]) == 0
    assert "30 seeds of 10 s, no failure" in capsys.readouterr().out
    assert main([f"{HERE}:Source", "--seeds", "1", "--faults", "none"]) == 0
    assert main([f"{HERE}:sound", "--seconds", "10", "--replay", "4 lose:/ticks>/listener#3"]) == 0
    assert "passes" in capsys.readouterr().out


TREE = Supervisor("tree", children=[Child(Source)])
CHILD = Child(Source)


@pytest.mark.parametrize("name", ["TREE", "CHILD"])
def test_a_tree_may_be_a_value(name: str) -> None:
    assert main([f"{__name__}:{name}", "--seeds", "2", "--seconds", "1"]) == 0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([HERE], "write MODULE:TREE"),
        (["no.such.module:tree"], "No module named"),
        ([f"{HERE}:nothing"], "no tree, node class or function"),
        ([f"{HERE}:Registry"], "no tree, node class or function"),
        ([f"{HERE}:sound", "--replay", "x"], "is no trial"),
        ([f"{HERE}:sound", "--replay", "3 lost"], "is not a fault"),
    ],
)
def test_what_cannot_be_run_is_said_in_one_line(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert said in line


def test_an_unknown_fault_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main([f"{HERE}:sound", "--faults", "lose,steal"])
    assert "there is no fault 'steal'" in capsys.readouterr().err


def test_the_command_says_what_it_knows(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match=r"usage: python -m actors\.testing explore"):
        run([])
    with pytest.raises(SystemExit, match="0"):
        run(["explore", f"{HERE}:sound", "--seeds", "1", "--seconds", "1"])


def test_the_module_is_the_command() -> None:
    command = [sys.executable, "-m", "actors.testing", "explore", f"{HERE}:sound", "--seeds", "1", "--seconds", "1"]
    done = subprocess.run(command, cwd=Path(__file__).parents[2], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")
    assert "1 seeds of 1 s, no failure" in done.stdout


class Strict(Node):
    """Keeps all that it hears."""

    async def on_start(self) -> None:
        self.seen: list[int] = []

    @TICKS.on()
    def take(self, message: Int32) -> None:
        self.seen.append(message.data)


async def strict(rig: Rig) -> None:
    """Fails if number 7 is lost and number 12 doubled; nothing else matters."""
    await rig.start(Source, Strict)
    await rig.advance(3.0)
    seen = rig.node(Strict).seen
    assert 7 in seen or seen.count(12) < 2, "both"


def test_a_failure_is_shrunk_to_the_faults_that_make_it() -> None:
    way = "/ticks>/strict"
    faults = " ".join(
        [f"lose:{way}#{n}" for n in (3, 7, 9)] + [f"duplicate:{way}#{n}" for n in (1, 12, 20)] + [f"delay:{way}#5+0.01"]
    )
    played = Scenario(strict)
    failed = played.run(5, faults=parse(faults))
    assert isinstance(failed.error, AssertionError)
    least, runs = shrink(played, failed)
    assert set(map(str, least.faults)) == {f"lose:{way}#7", f"duplicate:{way}#12"}
    assert not least.shuffled
    assert runs < 40


def test_a_search_tells_what_it_found() -> None:
    seen: list[int] = []
    finding = search(Scenario(strict), range(4000), [Lose(), Duplicate()], progress=seen.append)
    assert finding is not None
    assert seen == list(range(len(seen)))
    assert "2 faults" in finding.describe()
    assert finding.replay.run(Scenario(strict)).error is not None
    assert Replay.parse(str(finding.replay)) == finding.replay


def test_a_search_that_finds_nothing_says_so() -> None:
    async def fine(rig: Rig) -> None:
        await rig.start(Source)

    assert search(Scenario(fine), range(20), ALL) is None


def test_a_failure_of_the_plain_run_needs_no_search() -> None:
    async def never(rig: Rig) -> None:
        raise AssertionError("always")

    finding = search(Scenario(never), range(20), ALL)
    assert finding is not None
    assert finding.trials == 1
    assert str(finding.replay) == "0 fifo"
    assert "no fault" in finding.describe()


def test_an_invariant_is_looked_at_in_every_quiet_moment() -> None:
    def few(system: System) -> None:
        topic = system.graph.topics.get("/ticks")
        assert topic is None or topic.message_count < 5, "too many"

    async def body(rig: Rig) -> None:
        await rig.start(Source)
        await rig.advance(10.0)

    outcome = Scenario(body, invariants=(few,)).run(0)
    assert str(outcome.error).startswith("too many")
    assert Scenario(body).run(0).error is None


def test_a_node_that_does_not_end_when_asked_is_a_failure() -> None:
    class Stubborn(Node):
        async def on_stop(self, reason: object) -> None:
            await asyncio.sleep(100.0)

    async def body(rig: Rig) -> None:
        await rig.start(Stubborn)

    assert isinstance(Scenario(body).run(0).error, InvariantBroken)


def test_a_canceled_goal_that_goes_on_is_a_failure() -> None:
    class Deaf(Node):
        @COUNT.serve()
        async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
            for _ in range(2):
                try:
                    await self.clock.sleep(60.0)
                except asyncio.CancelledError:
                    pass
            yield Done(Fibonacci.Result())

    async def body(rig: Rig) -> None:
        await rig.start(Deaf, Source)
        goal = await rig.start_goal(COUNT, order(1))
        await rig.advance(1.0)
        await goal.cancel()
        await rig.advance(30.0)

    error = Scenario(body).run(0).error
    assert isinstance(error, InvariantBroken)
    assert str(error).endswith("was asked to cancel at t=1.000 s and goes on")


def test_an_endpoint_that_outlives_its_node_is_a_failure() -> None:
    async def body(rig: Rig) -> None:
        system = await rig.start(Source)
        core, supervisor = rig.state(Source).core, system.supervisor
        assert core is not None
        assert supervisor is not None
        await supervisor.terminate_child("source")
        topic = system.graph.topic("/left")
        topic.add_publisher(Publisher(core, topic, Int32, qos.DEFAULT))
        await rig.advance(1.0)

    error = Scenario(body).run(0).error
    assert isinstance(error, InvariantBroken)
    assert str(error) == "<publisher of /left [Int32] in /source: 0 sent> has outlived its node"


@pytest.mark.parametrize(("seconds", "fails"), [(3.0, False), (100.0, True)])
def test_a_task_that_goes_on_long_after_its_node_has_died_is_a_failure(seconds: float, fails: bool) -> None:
    class Parent(Node):
        @background
        async def child(self) -> None:
            try:
                await self.clock.sleep(1000.0)
            finally:
                await asyncio.sleep(seconds)

        @TICKS.on()
        async def take(self, message: Int32) -> None:
            await self.clock.sleep(0.01)

    async def body(rig: Rig) -> None:
        await rig.start(Source, Parent)
        await rig.advance(20.0)

    outcome = Scenario(body).run(0, shuffled=False, faults=parse("crash:/parent#4"))
    if fails:
        assert isinstance(outcome.error, InvariantBroken)
        assert "/parent child" in str(outcome.error)
        assert "go on" in str(outcome.error)
    else:
        assert outcome.error is None


def test_an_error_that_nobody_noticed_is_a_failure() -> None:
    async def body(rig: Rig) -> None:
        await rig.start(Source)
        asyncio.get_running_loop().call_soon(lambda: 1 // 0)
        asyncio.get_running_loop().call_exception_handler({"message": "strange"})
        await rig.advance(1.0)

    assert str(Scenario(body).run(0).error) in ("strange", "integer division or modulo by zero")

    async def strange(rig: Rig) -> None:
        asyncio.get_running_loop().call_exception_handler({"message": "strange"})

    assert str(Scenario(strange).run(0).error) == "strange"


def test_an_interrupt_is_not_a_finding() -> None:
    async def body(rig: Rig) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Scenario(body).run(0)


def test_the_same_trial_is_the_same_trial() -> None:
    async def body(rig: Rig) -> None:
        await rig.start(planted.race())
        await rig.advance(5.0)

    first, again = (Scenario(body).run(7, faults=parse("lose:/ticks>/one#3")) for _ in range(2))
    assert first.profile == again.profile
    assert first.timeline == again.timeline
    assert first.signature == again.signature


def test_a_scenario_is_an_async_test_with_a_rig() -> None:
    with pytest.raises(TypeError, match="with the argument `rig`"):

        @scenario()
        async def without(other: int) -> None: ...

    with pytest.raises(TypeError, match="async def"):

        @scenario()
        def plain(rig: Rig) -> Any: ...

    with pytest.raises(ValueError, match="at least one"):
        scenario(seeds=0)


TESTS = """
import pytest
from actors.testing import scenario
from actors.testing.faults import Lose
from tests.unit.planted import TICKS, Listener, Source

ran = []

@pytest.fixture
def least():
    return 10

@scenario(seeds=50, faults=[Lose(TICKS)])
async def test_hears_everything(rig, least, request):
    ran.append(1)
    assert request.node.name == "test_hears_everything"
    await rig.start(Source, Listener)
    await rig.advance(1.0)
    assert rig.node(Listener).heard == least

@scenario(seeds=5)
async def test_passes(rig):
    await rig.start(Source)

def test_how_often():
    print("runs:", len(ran))
"""


def pytest_here(pytester: pytest.Pytester, *arguments: str) -> pytest.RunResult:
    return pytester.runpytest_inprocess(
        "-p",
        "actors.testing.plugin",
        "-p",
        "no:cacheprovider",
        "-p",
        "no:looptime_plugin",
        "-o",
        "asyncio_default_fixture_loop_scope=function",
        *arguments,
    )


def test_a_failing_scenario_prints_the_line_that_replays_it(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(test_it=TESTS)
    result = pytest_here(pytester, "-s")
    result.assert_outcomes(passed=2, failed=1)
    text = result.stdout.str()
    assert "scenario: AssertionError with events in plain order and 1 fault" in text
    replay = next(line for line in text.splitlines() if "replay:" in line)
    assert "test_it.py::test_hears_everything" in replay
    trial = replay.partition("--replay ")[2].strip().strip("'")
    assert trial.endswith("fifo lose:/ticks>/listener#10")
    flight = next(line for line in text.splitlines() if "flight record:" in line).partition("record: ")[2]
    assert Path(flight.strip()).stat().st_size > 1000
    again = pytest_here(pytester, "-k", "hears", "--replay", trial)
    again.assert_outcomes(failed=1)
    fine = pytest_here(pytester, "-k", "hears", "--replay", "3")
    fine.assert_outcomes(passed=1)


def test_the_number_of_seeds_can_be_set_from_the_command_line(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(test_it=TESTS)
    result = pytest_here(pytester, "-s", "--seeds", "1")
    result.assert_outcomes(passed=3)
    result.stdout.fnmatch_lines(["*runs: 2*"])  # the plain run and one seed


def test_delays_alone_do_not_hurt_who_only_listens() -> None:
    async def body(rig: Rig) -> None:
        await rig.start(Source, planted.Listener)
        await rig.advance(20.0)
        assert rig.node(planted.Listener).heard >= 195

    assert search(Scenario(body), range(60), [Delay(up_to=0.2)]) is None
