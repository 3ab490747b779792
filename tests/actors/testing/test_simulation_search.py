"""Searching seeds for a failure, shrinking it, and replaying it from one line: in tests and from a shell."""

from __future__ import annotations

import asyncio
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, cast

import anyio
import pytest

from actors import Child, Done, Intensity, Node, Steps, Stop, Supervisor, background, every, qos
from actors.checks import create
from actors.errors import CallCycle
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.std_msgs.msg import Int32
from actors.interfaces.std_srvs.srv import Trigger
from actors.runtime.runtime import NodeRecord
from actors.supervision.running import RunningSupervisor
from actors.system import System
from actors.testing import Rig, scenario
from actors.testing.__main__ import run
from actors.testing.explore import main
from actors.testing.faults import ALL, Delay, Duplicate, Lose, parse
from actors.testing.simulation import search as simulation_search
from actors.testing.simulation.invariants import InvariantBroken
from actors.testing.simulation.search import search, shrink
from actors.testing.simulation.trial import Scenario, Trial
from actors.topics.publisher import Publisher
from tests.actors.testing import buggy_systems, odd_systems
from tests.actors.testing.buggy_systems import TICKS, Listener, Source
from tests.facts import lacks
from tests.stage import COUNT, order
from tests.suites import run_pytest

HERE = "tests.actors.testing.buggy_systems"


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
        (["no.such.module:tree"], "no module named 'no.such.module'"),
        ([f"{HERE}:nothing"], "has nothing of the name 'nothing'; trees that it has: "),
        ([f"{HERE}:Registry"], "neither a tree, nor a node class, nor a function that makes one"),
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
    for option in ("-h", "--help"):
        with pytest.raises(SystemExit, match="0"):
            run([option])
        assert capsys.readouterr().out.startswith("usage: python -m actors.testing explore MODULE:TREE")
    with pytest.raises(SystemExit, match="0"):
        run(["explore", f"{HERE}:sound", "--seeds", "1", "--seconds", "1"])


def test_the_module_is_the_command() -> None:
    command = [sys.executable, "-m", "actors.testing", "explore", f"{HERE}:sound", "--seeds", "1", "--seconds", "1"]
    done = subprocess.run(command, cwd=Path(__file__).parents[3], capture_output=True, text=True, timeout=60)
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
    assert set(map(str, least.trial.faults)) == {f"lose:{way}#7", f"duplicate:{way}#12"}
    assert not least.trial.shuffled
    assert runs < 40


def test_a_search_tells_what_it_found() -> None:
    tried: list[int] = []

    def seeds() -> Iterator[int]:
        for seed in range(4000):
            tried.append(seed)
            yield seed

    finding = search(Scenario(strict), seeds(), [Lose(), Duplicate()])
    assert finding is not None
    assert finding.replay.seed == tried[-1] == len(tried) - 1
    assert "2 faults" in finding.describe()
    assert finding.describe().endswith(f"found and shrunk in {finding.trials} trials")
    assert Scenario(strict).play(finding.replay).error is not None
    assert Trial.parse(str(finding.replay)) == finding.replay


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
    assert finding.describe().endswith("found and shrunk in 1 trial")


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
        goal = await rig.send_goal(COUNT, order(1))
        await rig.advance(1.0)
        await goal.cancel()
        await rig.advance(30.0)

    error = Scenario(body).run(0).error
    assert isinstance(error, InvariantBroken)
    assert str(error).endswith("was asked to cancel at t=1.000 s and goes on")


def test_an_endpoint_that_outlives_its_node_is_a_failure() -> None:
    async def body(rig: Rig) -> None:
        system = await rig.start(Source)
        core, supervisor = rig.state(Source).running, system.supervisor
        assert core is not None
        assert supervisor is not None
        await supervisor.terminate_child("source")
        topic = system.graph.topic("/left")
        topic.add_publisher(create(Publisher, core, topic, Int32, qos.DEFAULT))
        await rig.advance(1.0)

    error = Scenario(body).run(0).error
    assert isinstance(error, InvariantBroken)
    assert lacks(str(error), "publisher /left /source outlived") == []


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


async def _source_and_supervisor(rig: Rig) -> tuple[NodeRecord, RunningSupervisor]:
    system = await rig.start(Supervisor("top", children=[Supervisor("below", children=[Child(Source)])]))
    below = system.supervisor.life("below") if system.supervisor is not None else None
    assert isinstance(below, RunningSupervisor)
    await rig.advance(1.0)
    return rig.state(Source), below


def _forget_the_child(state: NodeRecord, supervisor: RunningSupervisor) -> None:
    supervisor._children.entries.clear()


def _count_the_dead(state: NodeRecord, supervisor: RunningSupervisor) -> None:
    entry = supervisor._children["source"]
    done: asyncio.Future[None] = asyncio.get_running_loop().create_future()
    done.set_result(None)
    assert entry.now is not None
    entry.now.task = cast("asyncio.Task[None]", done)


def _lose_the_incarnation(state: NodeRecord, supervisor: RunningSupervisor) -> None:
    supervisor._children["source"].now = None


def _count_a_restart_too_many(state: NodeRecord, supervisor: RunningSupervisor) -> None:
    state.note_restart(1.0, "made up")


def _allow_too_many(state: NodeRecord, supervisor: RunningSupervisor) -> None:
    supervisor._children.window.times.extend([0.5] * 4)


@pytest.mark.parametrize(
    ("tamper", "said"),
    [
        (_forget_the_child, "top/below/source#1 runs, and no supervisor counts it among its children"),
        (_count_the_dead, "supervisor top/below counts 1 active children, and 0 have a task that runs"),
        (
            _lose_the_incarnation,
            "top/below/source is stopped for its supervisor, and an incarnation of it has not ended",
        ),
        (_count_a_restart_too_many, "top/below/source has had 1 restarts in 1 lives"),
        (
            _allow_too_many,
            "supervisor top/below goes on after 4 restarts, and Intensity(restarts=3, within=5.0) are allowed",
        ),
    ],
)
def test_supervisors_that_do_not_count_what_there_is_are_a_failure(
    tamper: Callable[[NodeRecord, RunningSupervisor], None], said: str
) -> None:
    async def body(rig: Rig) -> None:
        tamper(*await _source_and_supervisor(rig))
        await rig.advance(5.0)

    error = Scenario(body).run(0).error
    assert isinstance(error, InvariantBroken)
    assert str(error) == said


def test_counts_are_looked_at_after_every_report_of_a_supervisor() -> None:
    async def body(rig: Rig) -> None:
        state, _ = await _source_and_supervisor(rig)
        _count_a_restart_too_many(state, _)
        rig.crash(Source)
        await rig.advance(0.001)
        raise LookupError("not seen")

    error = Scenario(body).run(0).error
    assert str(error) == "top/below/source has had 2 restarts in 2 lives"


def test_counts_hold_while_nodes_die_and_come_back_one_is_abandoned_and_a_supervisor_gives_up() -> None:
    class Undying(Node):
        async def on_stop(self, reason: object) -> None:
            for _ in range(3):
                try:
                    await asyncio.sleep(5.0)
                except asyncio.CancelledError:
                    pass

    async def body(rig: Rig) -> None:
        below = Supervisor(
            "below", intensity=Intensity(0, within=1.0), children=[Child(Listener), Child(Undying, stop=1.0)]
        )
        await rig.start(Supervisor("top", strategy="one_for_all", children=[Child(Source), below]))
        await rig.advance(0.5)
        rig.expect_failure()
        rig.crash(Listener)
        await rig.advance(10.0)
        assert rig.incarnation(Source) == 2
        await rig.advance(20.0)

    outcome = Scenario(body).run(0)
    assert str(outcome.error) == "left over after the system's end: task top/below/undying#1", "and no miscount"


def test_the_error_of_a_body_is_not_hidden_by_what_it_leaves() -> None:
    async def body(rig: Rig) -> None:
        await rig.start(Source)
        asyncio.get_running_loop().create_task(asyncio.sleep(1000.0), name="forgotten")
        raise LookupError("what matters")

    error = Scenario(body).run(0).error
    assert isinstance(error, LookupError)
    (note,) = error.__notes__
    assert lacks(note, "Leak task forgotten") == []


def test_a_task_that_outlives_its_trial_does_not_keep_it_from_ending() -> None:
    left: list[asyncio.Task[None]] = []

    async def deaf() -> None:
        with pytest.raises(GeneratorExit):
            while True:
                try:
                    await asyncio.sleep(1.0)
                except asyncio.CancelledError:
                    pass

    async def body(rig: Rig) -> None:
        left.append(asyncio.get_running_loop().create_task(deaf(), name="deaf"))

    error = Scenario(body).run(0, shuffled=False).error
    assert isinstance(error, InvariantBroken)
    assert lacks(str(error), "60 s canceled deaf") == []
    coroutine = left[0].get_coro()
    assert coroutine is not None
    coroutine.close()
    left[0]._log_destroy_pending = False  # type: ignore[attr-defined]  # as asyncio's own `gather` does


def test_a_trial_that_never_ends_is_ended() -> None:
    async def body(rig: Rig) -> None:
        await rig.start(Source)
        await rig.advance(1e9)

    error = Scenario(body, limit=20.0).run(0, shuffled=False).error
    assert isinstance(error, InvariantBroken)
    assert lacks(str(error), "t=20.1 end") == []


@pytest.mark.parametrize(
    ("tree", "said"),
    [
        (lambda: Child(odd_systems.Hesitant), "t=21 s, and no end: /hesitant is starting, at "),
        (odd_systems.clinging, "and no end: the system is to stop; /clinging is stopping, at "),
    ],
)
def test_a_node_that_never_starts_or_ends_is_named(tree: Callable[[], Any], said: str) -> None:
    async def body(rig: Rig) -> None:
        await rig.start(tree())

    error = Scenario(body, limit=20.0).run(0, shuffled=False).error
    assert isinstance(error, InvariantBroken)
    assert said in str(error)
    assert f"{odd_systems.__file__}:" in str(error)


def test_a_handler_that_is_stuck_in_a_system_where_nothing_happens_is_a_failure() -> None:
    class Stuck(Node):
        @TICKS.on()
        async def take(self, message: Int32) -> None:
            await asyncio.Event().wait()

    async def body(rig: Rig) -> None:
        await rig.start(Stuck)
        await rig.advance(1.0)
        rig.publish(TICKS, Int32(data=1))
        await rig.advance(100.0)

    error = Scenario(body).run(0).error
    assert isinstance(error, InvariantBroken)
    assert "Stuck.take of /stuck is stuck: it has been waiting since t=1.000 s" in str(error)


def test_an_answer_that_is_a_failed_assertion_or_a_refused_deadlock_is_a_failure_whoever_hears_it() -> None:
    async def body(rig: Rig) -> None:
        await rig.start(odd_systems.lost_update())
        await rig.advance(5.0)

    async def asking(rig: Rig) -> None:
        await rig.start(odd_systems.asking_back())
        await rig.advance(5.0)

    error = Scenario(body).run(0, shuffled=False).error
    assert isinstance(error, AssertionError)
    assert "a deposit was lost" in str(error)
    assert isinstance(Scenario(asking).run(0, faults=parse("clock-jump:clock#1+5")).error, CallCycle)


def test_an_answer_that_is_an_error_of_another_kind_is_the_callers_business() -> None:
    class Refuses(Node):
        @odd_systems.FIRST.serve()
        async def first(self, request: Trigger.Request) -> Trigger.Response:
            raise ValueError("not now")

    async def body(rig: Rig) -> None:
        await rig.start(Refuses, odd_systems.Patient)
        await rig.advance(5.0)

    assert Scenario(body).run(0).error is None


@pytest.mark.parametrize(
    ("allowed", "faults", "kind"),
    [
        (0, "kill:/source#500", ""),
        (1, "kill:/source#500 kill:/source#600", "SupervisorGaveUp"),
        (2, "kill:/source#500 kill:/source#600", ""),
        (3, "kill:/source#500 kill:/source#1000 kill:/source#1500 kill:/source#2000", "SupervisorGaveUp"),
        (0, "slow-start:/source#1+1", "ServiceUnavailable"),
    ],
)
def test_that_the_whole_tree_gives_up_is_a_failure_unless_it_allows_no_restart_and_a_fault_ended_it(
    allowed: int, faults: str, kind: str
) -> None:
    class Calls(Node):
        @every(hz=1)
        async def ask(self) -> None:
            await self.call(odd_systems.FIRST, Trigger.Request(), timeout=0.1)

    async def body(rig: Rig) -> None:
        children = [Child(Source), *([Child(Calls)] if kind == "ServiceUnavailable" else [])]
        await rig.start(Supervisor("top", intensity=Intensity(allowed, within=5.0), children=children))
        await rig.advance(5.0)

    outcome = Scenario(body).run(0, faults=parse(faults))
    assert ("supervisor top gave up" in str(outcome.error)) is bool(kind)
    assert outcome.signature[0] == kind


def test_a_fault_that_comes_while_a_tree_ends_by_itself_is_no_failure() -> None:
    class Errand(Node):
        @every(hz=1)
        def end(self) -> None:
            raise Stop("done")

    async def body(rig: Rig) -> None:
        children = [Child(Listener), Child(Errand, restart="transient", significant=True)]
        await rig.start(Supervisor("errand", auto_shutdown="any_significant", children=children))
        await rig.advance(5.0)

    plain = Scenario(body).run(0, shuffled=False)
    awaits = plain.profile.awaits["/listener"]
    for nth in range(1, awaits + 1):
        assert Scenario(body).run(0, shuffled=False, faults=parse(f"crash:/listener#{nth}")).error is None


def test_a_system_without_a_tree_has_nothing_to_count() -> None:
    async def body(rig: Rig) -> None:
        system = rig._make_system(seed=0, sinks=())
        life = await system.join(Child(Source))
        await system.leave(life)

    assert Scenario(body).run(0).error is None


def test_what_takes_too_long_to_shrink_is_told_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(simulation_search, "SHRINKING_SECONDS", -1.0)
    failed = Scenario(strict).run(
        5, faults=parse("lose:/ticks>/strict#7 duplicate:/ticks>/strict#12 lose:/ticks>/strict#9")
    )
    least, _ = shrink(Scenario(strict), failed)
    assert least is failed


@pytest.mark.parametrize("kind", [asyncio.Lock, anyio.Lock])
@pytest.mark.parametrize(("seconds", "fails"), [(5.0, False), (None, True)])
def test_tasks_that_wait_for_each_others_locks_are_a_failure_unless_somebody_gives_up(
    kind: Callable[[], Any], seconds: float | None, fails: bool
) -> None:
    async def take(first: Any, second: Any, seconds: float | None) -> None:
        async with first:
            await asyncio.sleep(0.1)
            try:
                async with asyncio.timeout(seconds):
                    async with second:
                        pass
            except TimeoutError:
                pass

    async def body(rig: Rig) -> None:
        await rig.start(Source)
        left, right, other = kind(), kind(), kind()
        tasks = [
            asyncio.create_task(take(left, right, seconds), name="a"),
            asyncio.create_task(take(right, left, None), name="b"),
            asyncio.create_task(take(other, left, None), name="c"),  # waits for them, and is none of them
            asyncio.create_task(left.acquire(), name="d"),
        ]
        try:
            await rig.advance(20.0)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.wait(tasks)

    error = Scenario(body).run(0).error
    if fails:
        assert isinstance(error, InvariantBroken)
        assert str(error).startswith("deadlock since t=0.100 s: ")
        assert " c, at " not in str(error)
        assert " d, at " not in str(error)
    else:
        assert error is None


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
        await rig.start(buggy_systems.race())
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
from tests.actors.testing.buggy_systems import TICKS, Listener, Source

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


def test_a_failing_scenario_prints_the_line_that_replays_it(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(test_it=TESTS)
    result = run_pytest(pytester, "-s")
    result.assert_outcomes(passed=2, failed=1)
    text = result.stdout.str()
    assert "scenario: AssertionError with events in plain order and 1 fault" in text
    replay = next(line for line in text.splitlines() if "replay:" in line)
    assert "test_it.py::test_hears_everything" in replay
    trial = replay.partition("--scenario-replay ")[2].strip().strip("'")
    assert trial.endswith("fifo lose:/ticks>/listener#10")
    flight = next(line for line in text.splitlines() if "flight record:" in line).partition("record: ")[2]
    assert Path(flight.strip()).stat().st_size > 1000
    assert "started listener child=" in text, "what happened, in its order"
    again = run_pytest(pytester, "-k", "hears", "--scenario-replay", trial)
    again.assert_outcomes(failed=1)
    fine = run_pytest(pytester, "-k", "hears", "--scenario-replay", "3")
    fine.assert_outcomes(passed=1)


def test_the_number_of_seeds_can_be_set_from_the_command_line(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(test_it=TESTS)
    result = run_pytest(pytester, "-s", "--scenario-seeds", "1")
    result.assert_outcomes(passed=3)
    result.stdout.fnmatch_lines(["*runs: 2*"])  # the plain run and one seed


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--scenario-seeds", "0"], "--scenario-seeds 0: at least one"),
        (["--scenario-seeds", "-5"], "--scenario-seeds -5: at least one"),
        (["--scenario-replay", "x"], "--scenario-replay: 'x' is no trial"),
        (
            ["--scenario-replay", "3 kill:/sorce#5"],
            "--scenario-replay: kill:/sorce#5 names nothing in this system. Did you mean /source?",
        ),
    ],
)
def test_what_makes_no_sense_to_a_scenario_is_refused_without_a_traceback(
    options: list[str], said: str, pytester: pytest.Pytester
) -> None:
    pytester.makepyfile(test_it=TESTS)
    result = run_pytest(pytester, "-k", "passes", *options)
    result.assert_outcomes(failed=1)
    text = result.stdout.str()
    assert said in text
    assert "Traceback" not in text
    assert "decorator.py" not in text


ASTRAY = """
from actors.testing import scenario
from actors.testing.faults import ALL, Crash, Cut, Delay, Lose, SlowHandler
from tests.actors.testing.buggy_systems import TICKS, Listener, Source

@scenario(seeds=2, faults=[Lose(TICKS), Crash("lisener")])
async def test_a_node(rig):
    await rig.start(Source, Listener)
    await rig.advance(1.0)

@scenario(seeds=2, faults=[Delay("/tikcs")])
async def test_a_topic(rig):
    await rig.start(Source, Listener)
    await rig.advance(1.0)

@scenario(seeds=2, faults=[SlowHandler(Listener)])
async def test_a_class(rig):
    await rig.start(Source)

@scenario(seeds=2, faults=[Cut("hose")])
async def test_a_host(lab):
    await lab.start("house", Source)

@scenario(seeds=2, faults=[*ALL, Lose("/no*"), Crash(Listener), Cut("house")])
async def test_patterns_and_all_kinds(rig):
    await rig.start(Source, Listener)
    await rig.advance(1.0)
"""


def test_a_fault_that_could_never_occur_fails_the_scenario(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(test_it=ASTRAY)
    result = run_pytest(pytester)
    result.assert_outcomes(passed=1, failed=4)
    told = [line for line in result.stdout.lines if line.startswith("@scenario(faults=...): ")]
    assert [line.partition(": ")[2] for line in told] == [
        "Crash('lisener') can hit nothing: the run without faults has no node of this name; did you mean '/listener'?",
        "Delay('/tikcs') can hit nothing: the run without faults receives no message of a topic of this name; did you mean '/ticks'?",
        "SlowHandler('listener') can hit nothing: the run without faults has no node of this name",
        "Cut('hose') can hit nothing: the run without faults has no host of this name; did you mean 'house'?",
    ]
    assert "Traceback" not in result.stdout.str() and "During handling" not in result.stdout.str()


def test_a_record_that_cannot_be_written_does_not_hide_why_a_scenario_failed(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(self: object, path: object, **more: object) -> None:
        raise ValueError("argument out of range")

    monkeypatch.setattr("actors.bag.flight_recorder.FlightRecord.write", fail)
    pytester.makepyfile(test_it=TESTS)
    result = run_pytest(pytester, "-k", "hears")
    result.assert_outcomes(failed=1)
    text = result.stdout.str()
    assert "replay:   python -m pytest 'test_it.py::test_hears_everything' --scenario-replay '" in text
    assert "flight record: could not be written: ValueError: argument out of range" in text


def test_delays_alone_do_not_hurt_who_only_listens() -> None:
    async def body(rig: Rig) -> None:
        await rig.start(Source, buggy_systems.Listener)
        await rig.advance(20.0)
        assert rig.node(buggy_systems.Listener).heard >= 195

    assert search(Scenario(body), range(60), [Delay(up_to=0.2)]) is None
