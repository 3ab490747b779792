"""A tree as a running system: how it starts, how it ends, and who hears why."""

from __future__ import annotations

import asyncio
import signal
import textwrap
from pathlib import Path
from typing import Any, ClassVar

import pytest

from actors import (
    Child,
    DeclarationError,
    DynamicSupervisor,
    Intensity,
    Node,
    StartFailed,
    Supervisor,
    SupervisorGaveUp,
    System,
    background,
    every,
    execute,
    open_node,
    parameter,
    publishes,
    run,
)
from actors.checks import create
from actors.errors import NotRunning, NotStarted
from actors.interfaces.std_msgs.msg import Int32
from actors.logs import LogRecord
from actors.running.run import Run
from actors.runtime.incarnation import incarnation_of
from actors.supervision.reasons import ExitReason
from actors.system import system_here, system_of
from tests import warm
from tests.stage import NUMBERS, number


def silent(_: LogRecord) -> None:
    """A sink for tests that do not look at the log."""


def quiet_run(tree: Any, **options: Any) -> Run:
    return run(tree, sinks=(silent,), **options)


class Named(Node):
    """Writes down its start and its end, which takes a second."""

    story: ClassVar[list[str]] = []

    async def on_start(self) -> None:
        self.story.append(f"start {self.name}")

    async def on_stop(self, reason: ExitReason) -> None:
        await self.clock.sleep(1.0)
        self.story.append(f"stop {self.name}")


class Brittle(Node):
    """Fails at its first tick, after a second."""

    @every(hz=1)
    async def tick(self) -> None:
        raise OSError("snapped")


@pytest.fixture(autouse=True)
def _forget() -> None:
    Named.story.clear()


BRITTLE = Supervisor("system", intensity=Intensity(0, within=5.0), children=[Child(Named), Child(Brittle)])


# -- run -------------------------------------------------------------------------------------------------------------


@pytest.mark.virtual
async def test_a_tree_starts_in_order_and_stops_in_reverse_order() -> None:
    children = [Child(Named, name=name) for name in ("a", "b", "c")]
    async with quiet_run(Supervisor("system", children=children)) as system:
        assert Named.story == ["start a", "start b", "start c"]
        assert system.running
        assert system_here() is system
        assert repr(system) == "<system of 3 nodes, <virtual clock at 0.000000 s>>"
    assert Named.story[3:] == ["stop c", "stop b", "stop a"]
    assert not system.running
    assert system_here() is None
    assert system.exit_code == 0
    await system.stop()  # twice is fine


@pytest.mark.virtual
async def test_a_single_child_is_a_tree_and_so_is_a_dynamic_supervisor() -> None:
    async with quiet_run(Child(Named)) as system:
        assert [state.identity.fqn for state in system.nodes.values()] == ["/named"]
    async with quiet_run(DynamicSupervisor("fleet", Child(Named))) as system:
        assert system.supervisor is not None
        await system.supervisor.spawn(name="first")
        assert [state.identity.fqn for state in system.nodes.values()] == ["/first"]


@pytest.mark.virtual
async def test_an_exception_in_the_block_stops_the_tree_and_is_the_blocks() -> None:
    with pytest.raises(LookupError, match="mine"):
        async with quiet_run(Child(Named)):
            raise LookupError("mine")
    assert Named.story == ["start named", "stop named"]


@pytest.mark.virtual
async def test_a_child_that_does_not_start_fails_the_run_and_nothing_stays() -> None:
    class Broken(Node):
        async def on_start(self) -> None:
            raise OSError("no power")

    with pytest.raises(StartFailed, match="broken did not start"):
        async with quiet_run(Supervisor("system", children=[Child(Named), Child(Broken)])):
            raise AssertionError("the block must not be entered")
    assert Named.story == ["start named", "stop named"]
    assert system_here() is None
    assert asyncio.all_tasks() == {asyncio.current_task()}


@pytest.mark.virtual
async def test_a_run_that_is_canceled_while_it_starts_leaves_nothing() -> None:
    class Slow(Node):
        async def on_start(self) -> None:
            await self.clock.sleep(60.0)

    async def program() -> None:
        async with quiet_run(Supervisor("system", children=[Child(Named), Child(Slow)])):
            raise AssertionError("the block must not be entered")

    task = asyncio.create_task(program())
    await asyncio.sleep(1.0)
    task.cancel()
    await asyncio.wait([task])
    assert task.cancelled()
    assert Named.story == ["start named", "stop named"]
    assert system_here() is None


@pytest.mark.virtual
async def test_a_system_that_is_stopped_while_it_starts_says_so() -> None:
    class Hasty(Node):
        async def on_start(self) -> None:
            system_of(self).supervisor.stop("changed my mind")  # type: ignore[union-attr]
            await self.clock.sleep(60.0)

    with pytest.raises(NotRunning, match="was stopped while it started"):
        async with quiet_run(Child(Hasty)):
            raise AssertionError("the block must not be entered")


@pytest.mark.virtual
async def test_a_failure_while_the_block_waits_is_raised_by_wait() -> None:
    async with quiet_run(BRITTLE) as system:
        with pytest.raises(
            SupervisorGaveUp, match="brittle has ended, and is not to be restarted: it raised OSError: snapped"
        ):
            await system.wait()
        assert system.exit_code == 3
        assert system.clock.now() == 2.0
        await asyncio.sleep(1.0)  # who has heard it goes on
    assert Named.story == ["start named", "stop named"]


@pytest.mark.virtual
async def test_a_failure_while_the_block_does_something_else_interrupts_it_and_is_raised_by_the_whole() -> None:
    begun = asyncio.get_running_loop().time()
    with pytest.raises(SupervisorGaveUp):
        async with quiet_run(BRITTLE):
            await asyncio.sleep(3600.0)
    assert asyncio.get_running_loop().time() - begun == 2.0
    task = asyncio.current_task()
    assert task is not None
    assert task.cancelling() == 0
    await asyncio.sleep(1.0)  # nobody is canceled any more


@pytest.mark.virtual
async def test_a_block_that_swallows_the_interruption_cannot_hide_the_failure() -> None:
    with pytest.raises(SupervisorGaveUp):
        async with quiet_run(BRITTLE):
            try:
                await asyncio.sleep(3600.0)
            except asyncio.CancelledError:
                pass


@pytest.mark.virtual
async def test_a_failure_that_comes_while_the_block_is_being_left_is_raised_not_turned_into_a_cancellation() -> None:
    with pytest.raises(SupervisorGaveUp):
        async with quiet_run(BRITTLE):
            await asyncio.sleep(1.5)  # brittle has failed; the others are still stopping
    assert Named.story == ["start named", "stop named"]
    assert asyncio.current_task().cancelling() == 0  # type: ignore[union-attr]


@pytest.mark.virtual
async def test_an_exception_of_the_block_itself_comes_before_the_failure_of_the_tree() -> None:
    with pytest.raises(LookupError):
        async with quiet_run(BRITTLE):
            try:
                await asyncio.sleep(3600.0)
            except asyncio.CancelledError:
                raise LookupError("mine") from None


@pytest.mark.virtual
async def test_a_tree_that_comes_to_its_end_by_itself_interrupts_nobody() -> None:
    class Job(Node):
        @background
        async def work(self) -> None:
            await self.clock.sleep(1.0)
            self.stop("done")

    tree = Supervisor(
        "system", auto_shutdown="all_significant", children=[Child(Job, restart="transient", significant=True)]
    )
    async with quiet_run(tree) as system:
        await system.wait()
        assert system.clock.now() == 1.0
    async with quiet_run(tree):
        await asyncio.sleep(5.0)


@pytest.mark.virtual
async def test_D2_a_stop_that_is_canceled_still_gives_each_node_its_stop_timeout_and_leaves_nothing() -> None:
    stopped: list[str] = []

    class Slow(Node):
        async def on_stop(self, reason: ExitReason) -> None:
            await self.clock.sleep(60.0)
            stopped.append(self.name)

    begun = asyncio.get_running_loop().time()
    with pytest.raises(TimeoutError):
        async with (
            asyncio.timeout(2.0),
            quiet_run(Supervisor("s", children=[Child(Slow, stop=100.0), Child(Slow, name="cut", stop=5.0)])),
        ):
            async with open_node("guest"):
                pass
    assert asyncio.get_running_loop().time() - begun == 65.0
    assert stopped == ["slow"]
    assert system_here() is None
    assert asyncio.all_tasks() == {asyncio.current_task()}


@pytest.mark.virtual
async def test_a_system_runs_one_tree_and_waits_only_when_it_does() -> None:
    system = create(System, sinks=(silent,))
    with pytest.raises(NotStarted, match="use `async with run"):
        await system.wait()
    assert not system.running
    await system.start(Supervisor("system", children=[Child(Named)]))
    with pytest.raises(RuntimeError, match="runs a tree already"):
        await system.start(Supervisor("other"))
    await system.stop()
    with pytest.raises(NotRunning, match="has been stopped"):
        await system.join(Child(Node, name="late"))


@pytest.mark.virtual
async def test_two_systems_in_one_loop_do_not_hear_each_other() -> None:
    class Counter(Node):
        def __init__(self) -> None:
            self.seen: list[int] = []

        @NUMBERS.on()
        async def take(self, message: Int32) -> None:
            self.seen.append(message.data)

    class Talker(Node):
        out = publishes(NUMBERS)

        async def on_start(self) -> None:
            self.out(number(1))

    tree = Supervisor("system", children=[Child(Counter), Child(Talker)])
    async with quiet_run(tree) as one, quiet_run(tree) as other:
        await asyncio.sleep(1.0)
        for system in (one, other):
            core = system.runtime.directory.find("/counter")
            assert core is not None
            assert isinstance(core.node, Counter)
            assert core.node.seen == [1]
        assert system_here() is other


# -- determinism -----------------------------------------------------------------------------------------------------


class Noisy(Node):
    """Does random things at random times, and fails now and then."""

    out = publishes(NUMBERS)

    @every(hz=20)
    async def act(self) -> None:
        roll = self.rng.random()
        if roll < 0.02:
            raise RuntimeError(f"rolled {roll:.3f}")
        if roll < 0.5:
            self.log.info("rolled", roll=roll)
            self.out(number(int(roll * 1000)))
        await self.clock.sleep(roll / 20)

    @NUMBERS.on()
    async def take(self, message: Int32) -> None:
        self.log.info("heard", value=message.data)


def trace(seed: int) -> list[str]:
    """The log of ten seconds of four noisy nodes."""
    lines: list[str] = []

    async def program() -> None:
        tree = Supervisor(
            "system",
            intensity=Intensity(1000, within=1.0),
            children=[Child(Noisy, name=f"n{index}") for index in range(4)],
        )
        async with run(tree, seed=seed, sinks=(lambda record: lines.append(repr(record)),)):
            await asyncio.sleep(10.0)

    execute(program, clock="virtual")
    return lines


def test_the_same_seed_gives_the_same_trace_and_another_one_another() -> None:
    first = trace(7)
    assert len(first) > 1000
    assert any("child terminated" in line for line in first)
    assert trace(7) == first
    assert trace(8) != first


# -- the real clock --------------------------------------------------------------------------------------------------


@pytest.mark.realtime
def test_the_same_program_runs_on_the_real_clock() -> None:
    """The one test here that waits: 0.3 s of ticks on the real clock, in a loop that the library was given."""
    ticks: list[int] = []

    class Clockwork(Node):
        @every(hz=50)
        async def tick(self) -> None:
            ticks.append(1)

    async def program() -> str:
        async with quiet_run(Child(Clockwork)) as system:
            while system.clock.now() < 0.3:
                await system.clock.sleep(0.01)
            return repr(system.clock)

    assert asyncio.run(program()).startswith("<real clock at 0.3")
    assert len(ticks) >= 5


async def test_a_run_is_a_library_call_in_whatever_loop_there_is() -> None:
    async with quiet_run(Child(Named, stop="kill")) as system:
        assert not system.clock.virtual
        assert abs(system.clock.wall() - system.clock.stamp().sec) < 2.0
        before = signal.getsignal(signal.SIGTERM)
    assert signal.getsignal(signal.SIGTERM) is not before


def test_execute_gives_the_result_and_knows_two_clocks() -> None:
    async def program() -> bool:
        return bool(getattr(asyncio.get_running_loop(), "virtual", False))

    assert execute(program) is False
    assert execute(program, clock="virtual") is True
    with pytest.raises(ValueError, match="clock='sundial': use 'real' or 'virtual'"):
        execute(program, clock="sundial")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"execute\(5\): give the async function itself"):
        execute(5)  # type: ignore[arg-type]


def test_execute_ends_with_130_after_a_keyboard_interrupt() -> None:
    async def program() -> None:
        raise KeyboardInterrupt

    with pytest.raises(SystemExit) as caught:
        execute(program)
    assert caught.value.code == 130


# -- offload on the real clock ---------------------------------------------------------------------------------------


async def test_on_the_real_clock_offloaded_work_goes_to_a_thread_or_a_process() -> None:
    import os
    import threading

    async with quiet_run(Child(Named, stop="kill")) as system:
        core = system.runtime.directory.find("/named")
        assert core is not None
        node = core.node
        for _ in range(2):
            assert await node.offload(threading.get_ident, thread=True) != threading.get_ident()
        assert await node.offload(os.getpid) != os.getpid()


# -- signals (each in a process of its own) --------------------------------------------------------------------------

PRELUDE = """
import asyncio, os, signal, sys
from actors import Child, Node, Supervisor, Intensity, execute, run, every, background
from actors.logs import json_sink
from actors.runtime.incarnation import incarnation_of
from actors.system import system_of

def say(*words):
    print(*words, flush=True)

class Part(Node):
    async def on_stop(self, reason):
        say("stop", self.name)

class Stuck(Node):
    async def on_stop(self, reason):
        say("stuck")
        for later in (0.0, 0.6):  # the first is the same signal as the one that stops the tree
            asyncio.get_running_loop().call_later(later, kill_me, signal.SIGINT)
        await asyncio.sleep(3600.0)
        say("never")

def kill_me(number):
    os.kill(os.getpid(), number)

TREE = Supervisor("system", children=[Child(Part, name="a"), Child(Part, name="b")])
STUCK = Supervisor("system", children=[Child(Part, name="a"), Child(Stuck, stop=3600.0)])
"""


def script(tmp_path: Path, body: str) -> tuple[int, list[str], str]:
    """Run a program in a process of its own: exit code, lines of output, standard error."""
    code = "import warnings; warnings.simplefilter('error')\n" + PRELUDE + textwrap.dedent(body)
    done = warm.run("-c", code, timeout=60, cwd=tmp_path, env={"PYTHONPATH": str(warm.ROOT)})
    return done.returncode, done.stdout.splitlines(), done.stderr


WAITING = """
async def main():
    async with run(TREE, sinks=()) as system:
        asyncio.get_running_loop().call_soon(kill_me, signal.{name})
        await system.wait()
        say("waited")
    return system.exit_code

sys.exit({how}(main{call}))
"""


@pytest.mark.parametrize(("name", "code"), [("SIGINT", 130), ("SIGTERM", 143)])
@pytest.mark.parametrize("how", ["execute", "asyncio.run"])
def test_a_signal_stops_the_tree_in_order_and_wait_returns(tmp_path: Path, name: str, code: int, how: str) -> None:
    body = WAITING.format(name=name, how=how, call="()" if how == "asyncio.run" else "")
    assert script(tmp_path, body) == (code, ["stop b", "stop a", "waited"], "")


@pytest.mark.parametrize(("name", "code"), [("SIGINT", 130), ("SIGTERM", 143)])
def test_a_signal_interrupts_a_block_that_does_something_else(tmp_path: Path, name: str, code: int) -> None:
    body = f"""
        async def main():
            async with run(TREE, sinks=()):
                asyncio.get_running_loop().call_soon(kill_me, signal.{name})
                try:
                    await asyncio.sleep(3600.0)
                finally:
                    say("interrupted")
            say("never")

        execute(main)
    """
    assert script(tmp_path, body) == (code, ["stop b", "stop a", "interrupted"], "")


def test_a_signal_while_the_tree_starts_takes_the_start_back(tmp_path: Path) -> None:
    body = """
        class Slow(Node):
            async def on_start(self):
                kill_me(signal.SIGTERM)
                await asyncio.sleep(3600.0)

        async def main():
            async with run(Supervisor("system", children=[Child(Part, name="a"), Child(Slow)]), sinks=()):
                say("never")

        execute(main)
    """
    assert script(tmp_path, body) == (143, ["stop a"], "")


def test_a_second_signal_kills_what_is_still_stopping(tmp_path: Path) -> None:
    body = """
        async def main():
            async with run(STUCK, sinks=()) as system:
                asyncio.get_running_loop().call_soon(kill_me, signal.SIGINT)
                await system.wait()
            return system.exit_code

        sys.exit(execute(main))
    """
    assert script(tmp_path, body) == (130, ["stuck"], "")


def test_a_program_that_wants_its_signals_itself_keeps_them(tmp_path: Path) -> None:
    body = """
        async def main():
            mine = asyncio.Event()
            asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, mine.set)
            async with run(TREE, sinks=(), signals=False) as system:
                kill_me(signal.SIGTERM)
                await mine.wait()
                say("mine", system.running)

        execute(main)
    """
    assert script(tmp_path, body) == (0, ["mine True", "stop b", "stop a"], "")


def test_after_a_run_the_signals_are_what_they_were(tmp_path: Path) -> None:
    body = """
        def handler(number, frame):
            say("handler", number)

        signal.signal(signal.SIGTERM, handler)

        async def main():
            async with run(TREE, sinks=()):
                async with run(TREE, sinks=()):
                    pass
            kill_me(signal.SIGTERM)
            try:
                kill_me(signal.SIGINT)
                await asyncio.sleep(3600.0)
            except asyncio.CancelledError:
                say("as asyncio does it")
                raise

        execute(main)
    """
    code, lines, errors = script(tmp_path, body)
    assert (code, lines[-2:], errors) == (130, ["handler 15", "as asyncio does it"], "")


def test_a_failure_ends_a_program_with_its_reason(tmp_path: Path) -> None:
    body = """
        class Brittle(Node):
            @background
            async def work(self):
                raise OSError("snapped")

        async def main():
            async with run(Supervisor("system", intensity=Intensity(0, within=1.0), children=[Child(Part), Child(Brittle)]), sinks=()):
                await asyncio.sleep(3600.0)

        execute(main)
    """
    code, lines, errors = script(tmp_path, body)
    assert (code, lines) == (1, ["stop part"])
    assert errors.splitlines()[-1].startswith("actors.supervision.errors.SupervisorGaveUp: supervisor system gave up")
    assert "OSError: snapped" in errors
    assert "never retrieved" not in errors


# -- what is easily written wrongly ----------------------------------------------------------------------------------------


class Leg(Node):
    speed = parameter(1.0)


class Loose(Node):
    """Takes any parameter it is given."""

    async def on_start(self) -> None:
        incarnation_of(self).parameters.allow_undeclared = True


class Own(Node):
    """Declares a parameter of its own when it starts."""

    async def on_start(self) -> None:
        incarnation_of(self).parameters.declare("gain", 1.0)


@pytest.mark.virtual
async def test_a_parameter_that_the_node_does_not_have_is_refused_with_what_may_be_meant() -> None:
    sentence = r"/leg has no parameter 'sped'; did you mean 'speed'\? \(Leg declares speed\)"
    with pytest.raises(StartFailed, match=sentence) as caught:
        async with run(Child(Leg, parameters={"sped": 2.0}), sinks=()):
            raise AssertionError("it must not start")
    assert isinstance(caught.value.__cause__, DeclarationError)
    with pytest.raises(
        StartFailed, match=r"/node has no parameter 'sped': correct the name, or declare it \(Still declares none\)"
    ):
        async with run(Child(type("Still", (Node,), {}), name="node", parameters={"sped": 2.0}), sinks=()):
            raise AssertionError("it must not start")


@pytest.mark.virtual
async def test_a_parameter_that_is_declared_at_the_start_or_need_not_be_is_taken() -> None:
    children = [
        Child(Leg, parameters={"use_sim_time": False, "speed": 2.0}),
        Child(Own, parameters={"gain": 3.0}),
        Child(Loose, parameters={"anything": 4}),
    ]
    async with run(Supervisor("s", children=children), sinks=()) as system:
        core = system.runtime.directory.find("/own")
        assert core is not None
        assert core.parameters.value("gain") == 3.0


@pytest.mark.virtual
async def test_a_run_that_is_not_entered_says_how() -> None:
    with pytest.warns(RuntimeWarning, match=r"never entered: <run\(tree\), which is entered by `async with run"):
        run(Child(Leg))
    with pytest.raises(TypeError, match=r"^with run.tree.: a system runs within a block, write `async with run"):
        with run(Child(Leg)):  # type: ignore[attr-defined]  # pyright: ignore[reportGeneralTypeIssues, reportAttributeAccessIssue]
            raise AssertionError("not reached")


def test_what_is_no_async_program_says_how() -> None:
    async def program() -> int:
        return 3

    class Wrong(Node):
        """Is no program."""

    with pytest.raises(TypeError, match=r"give the async function itself, as in execute\(.*program\)"):
        execute(program())  # type: ignore[arg-type]  # pyright: ignore[reportArgumentType]
    with pytest.raises(TypeError, match=r"it returned <Wrong, not started>: give an async function"):
        execute(Wrong)  # type: ignore[arg-type]  # pyright: ignore[reportArgumentType]

    def mistaken() -> None:
        with pytest.raises(ValueError, match=r"a coroutine was expected, got <run\(tree\), which is entered by"):
            asyncio.run(run(Child(Leg)))  # type: ignore[arg-type]  # pyright: ignore[reportArgumentType]

    with pytest.warns(RuntimeWarning, match="never entered"):
        mistaken()
    assert execute(program) == execute(lambda: program()) == 3


@pytest.mark.virtual
async def test_awaiting_what_is_a_block_says_how_to_write_it() -> None:
    with pytest.raises(TypeError, match=r"await run.tree.: a system runs within a block, write `async with run"):
        await run(Child(Leg))  # type: ignore[misc]
    with pytest.raises(TypeError, match="write `async with open_node"):
        await open_node("listener")  # type: ignore[misc]
