"""Whatever ends a system, everything in it ends in order, has its last word, and leaves nothing behind."""

from __future__ import annotations

import asyncio
import importlib.util
import textwrap
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any, ClassVar

import anyio
import pytest

import actors.system
from actors import (
    Child,
    Done,
    GoalAborted,
    Node,
    ServiceFailed,
    StartFailed,
    Steps,
    Supervisor,
    System,
    background,
    every,
    open_node,
    publishes,
    run,
)
from actors.checks import create
from actors.errors import NotRunning, ProgramExit
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int32
from actors.supervision.reasons import ExitReason, Leaked
from actors.system import system_here, system_of
from actors.testing import Rig
from actors.time.virtual_loop import VirtualLoop
from tests import warm
from tests.stage import ADD, COUNT, NUMBERS, events, number, order, two

Body = Steps[Fibonacci.Feedback, Fibonacci.Result]


class Motor(Node):
    """Runs until it is stopped, and needs a while for that."""

    out = publishes(NUMBERS)
    diary: ClassVar[list[str]] = []

    @every(hz=50)
    async def turn(self) -> None:
        self.out(number(1))

    async def on_stop(self, reason: ExitReason) -> None:
        self.diary.append(f"{self.name} brakes")
        await self.clock.sleep(0.05)
        self.diary.append(f"{self.name} stands")


IN_ORDER = ["right brakes", "right stands", "left brakes", "left stands"]


@pytest.fixture(autouse=True)
def _new_diary() -> None:
    Motor.diary.clear()


def motors(*more: Child) -> Supervisor:
    return Supervisor("system", children=[Child(Motor, name="left"), Child(Motor, name="right"), *more])


def task_named(name: str) -> asyncio.Task[Any]:
    return next(task for task in asyncio.all_tasks() if task.get_name() == name)


def nothing_is_left(system: System) -> bool:
    return not system.running and asyncio.all_tasks() == {asyncio.current_task()} and system_here() is None


# -- D1: clients that end when the system does ------------------------------------------------------------------------


async def lingers(node: Node) -> None:
    try:
        await node.clock.sleep(3600.0)
    finally:
        await node.clock.sleep(0.01)


async def listens(name: str, slowly: bool) -> str:
    async with open_node(name) as node:
        if slowly:
            node.create_task(lingers(node))
        async for _ in node.subscribe(NUMBERS):
            pass
    return f"{name} has left"


@pytest.mark.virtual
@pytest.mark.parametrize("slowly", [False, True])
@pytest.mark.parametrize("count", [1, 3])
async def test_D1_clients_whose_streams_end_with_the_system_leave_in_order(count: int, slowly: bool) -> None:
    async with run(motors(), sinks=()) as system:
        clients = [asyncio.create_task(listens(f"client{index}", slowly)) for index in range(count)]
        await asyncio.sleep(1.0)
        assert len(system.master.joined) == count
    assert Motor.diary == IN_ORDER
    assert await asyncio.gather(*clients) == [f"client{index} has left" for index in range(count)]
    assert nothing_is_left(system)
    await system.stop()


# -- D2: a block that is left by a cancellation -----------------------------------------------------------------------


async def by_an_asyncio_timeout(block: Callable[[], Coroutine[Any, Any, None]]) -> None:
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(1.0):
            await block()


async def by_an_anyio_scope(block: Callable[[], Coroutine[Any, Any, None]]) -> None:
    with anyio.move_on_after(1.0):
        await block()


async def by_a_sibling(block: Callable[[], Coroutine[Any, Any, None]]) -> None:
    with pytest.raises(ExceptionGroup):
        async with anyio.create_task_group() as group:
            group.start_soon(block)
            await anyio.sleep(1.0)
            raise OSError("the sibling failed")


async def by_many_cancellations(block: Callable[[], Coroutine[Any, Any, None]]) -> None:
    task = asyncio.create_task(block())
    await asyncio.sleep(1.0)
    while not task.done():
        task.cancel()
        await asyncio.sleep(0.01)
    assert task.cancelled()


@pytest.mark.virtual
@pytest.mark.parametrize("guest", ["no guest", "a guest", "a guest that nobody leaves"])
@pytest.mark.parametrize("end", [by_an_asyncio_timeout, by_an_anyio_scope, by_a_sibling, by_many_cancellations])
async def test_D2_a_block_that_is_canceled_stops_its_tree_in_order(end: Any, guest: str) -> None:
    systems: list[System] = []

    async def block() -> None:
        async with run(motors(), sinks=()) as system:
            systems.append(system)
            if guest == "a guest":
                async with open_node("guest"):
                    await asyncio.sleep(3600.0)
            elif guest != "no guest":
                await open_node("guest").__aenter__()
            await system.wait()

    await end(block)
    assert Motor.diary == IN_ORDER
    assert nothing_is_left(systems[0])


@pytest.mark.virtual
async def test_D2_a_start_that_is_canceled_by_a_scope_is_taken_back_in_order() -> None:
    class Slow(Node):
        async def on_start(self) -> None:
            await self.clock.sleep(3600.0)

    with anyio.move_on_after(1.0) as scope:
        async with run(motors(Child(Slow)), sinks=()):
            raise AssertionError("the block must not be entered")
    assert scope.cancelled_caught
    assert Motor.diary == IN_ORDER
    assert asyncio.all_tasks() == {asyncio.current_task()}


# -- D11: nodes beside the tree ------------------------------------------------------------------------------------------------------


async def visits(name: str) -> None:
    async with open_node(name) as node:
        node.create_task(lingers(node))
        await asyncio.sleep(3600.0)


@pytest.mark.virtual
async def test_a_guest_left_by_repeated_cancellations_leaves_the_books() -> None:
    async with run(motors(), sinks=()) as system:
        known = list(system.nodes)
        with anyio.move_on_after(1.0):
            await visits("scoped")
        assert (len(system.master.joined), list(system.nodes)) == (0, known)
        for count in (1, 2, 5):
            task = asyncio.create_task(visits("canceled"))
            await asyncio.sleep(1.0)
            for _ in range(count):
                task.cancel()
                await asyncio.sleep(0.001)
            await asyncio.wait([task])
            assert task.cancelled()
            assert (len(system.master.joined), list(system.nodes)) == (0, known)
        async with open_node("scoped"), open_node("canceled"):
            assert len(system.master.joined) == 2


@pytest.mark.virtual
async def test_a_system_of_one_guest_ends_with_it_however_it_is_left() -> None:
    with anyio.move_on_after(1.0):
        await visits("first")
    assert system_here() is None
    async with open_node("second", seed=7) as node:
        assert system_of(node).seed == 7
        assert list(system_of(node).nodes) == [("/unsupervised", "second")]
    assert asyncio.all_tasks() == {asyncio.current_task()}


# -- D19: asyncio.run ends, and cancels everything it finds -----------------------------------------------------------


def test_nodes_in_a_loop_whose_main_ends_are_stopped_all_the_same() -> None:
    async def robot() -> None:
        async with run(motors(), sinks=()) as system:
            await system.wait()

    tasks: list[asyncio.Task[None]] = []

    async def main() -> str:
        tasks.append(asyncio.create_task(robot()))
        await asyncio.sleep(1.0)
        return "main ends"

    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        assert runner.run(main()) == "main ends"
        loop = runner.get_loop()
    assert actors.system._open.of(loop) == ()
    assert sorted(Motor.diary) == sorted(IN_ORDER)
    assert tasks[0].cancelled()


def test_a_start_that_the_end_of_main_breaks_off_is_taken_back() -> None:
    class Slow(Node):
        async def on_start(self) -> None:
            await self.clock.sleep(3600.0)

    async def robot() -> None:
        async with run(motors(Child(Slow)), sinks=()):
            raise AssertionError("the block must not be entered")

    tasks: list[asyncio.Task[None]] = []

    async def main() -> None:
        tasks.append(asyncio.create_task(robot()))
        await asyncio.sleep(1.0)

    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        runner.run(main())
    assert sorted(Motor.diary) == sorted(IN_ORDER)
    assert tasks[0].done()


def test_a_kill_cuts_short_what_the_end_of_main_began() -> None:
    class Stuck(Node):
        async def on_stop(self, reason: object) -> None:
            system_of(self).loop.call_later(1.0, system_of(self).kill)
            await self.clock.sleep(3600.0)
            Motor.diary.append("never")

    async def robot() -> None:
        async with run(Supervisor("system", children=[Child(Stuck, stop=3600.0)]), sinks=()) as system:
            await system.wait()

    async def main() -> asyncio.AbstractEventLoop:
        task = asyncio.create_task(robot())
        await asyncio.sleep(1.0)
        assert not task.done()
        return asyncio.get_running_loop()

    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        loop = runner.run(main())
        runner.close()
    assert Motor.diary == []
    assert loop.time() == 2.0


# -- D20: what refuses to die -----------------------------------------------------------------------------------------


class Zombie(Node):
    """Refuses to be canceled, in a goal or in a task of its own, until it is released."""

    where = "goal"
    released: asyncio.Event
    beats = 0

    async def beat(self) -> None:
        while not self.released.is_set():
            try:
                await self.released.wait()
            except asyncio.CancelledError:
                Zombie.beats += 1

    @COUNT.serve()
    async def count(self, goal: Fibonacci.Goal) -> Body:
        await self.beat()
        yield Done(Fibonacci.Result())

    @background
    async def pulse(self) -> None:
        if self.where == "background" and self.incarnation == 1:
            await self.beat()


@pytest.mark.parametrize("where", ["goal", "background"])
async def test_a_node_whose_code_refuses_to_die_is_given_up_and_said_to_be(rig: Rig, where: str) -> None:
    Zombie.released = asyncio.Event()
    await rig.start(Child(type("Zombie", (Zombie,), {"where": where}), name="zombie", stop=0.5))
    if where == "goal":
        goal = await rig.send_goal(COUNT, order(1))
    await rig.advance(1.0)
    supervisor = rig.system.supervisor
    assert supervisor is not None
    before = rig.now
    rig.loop.call_later(0.9, task_named("system/zombie#1").cancel)  # somebody else joins in: that changes nothing
    await supervisor.terminate_child("zombie")
    assert rig.now - before == 1.5  # its stop timeout, and a second after the kill
    assert [leaked.ref.id for leaked in supervisor.leaked] == ["zombie"]
    (report,) = [each for each in rig.reports if each.context == "shutdown_error"]
    assert isinstance(report.reason, Leaked)
    (line,) = events(rig.logs, "shutdown error")
    assert line.fields["child"] == "system/zombie"
    assert "refused to die within 1 s after the kill and was abandoned" in str(line.fields["reason"])
    if where == "goal":
        assert (await asyncio.wait_for(goal.ended(), 1.0)).status.name == "ABORTED"
    await supervisor.restart_child("zombie")
    assert rig.state("zombie").incarnation == 2
    Zombie.released.set()
    await rig.advance(0.1)
    assert supervisor.leaked == []


@pytest.mark.virtual
async def test_a_guest_that_refuses_to_die_is_given_up_and_said_to_be() -> None:
    Zombie.released = asyncio.Event()
    system = create(System, sinks=())
    await system.start(motors())
    kind = type("Zombie", (Zombie,), {"where": "background"})
    life = await system.join(Child(kind, name="zombie", stop=0.5))
    before = system.clock.now()
    await system.leave(life)
    assert system.clock.now() - before == 1.5
    (line,) = events(system.records, "a node beside the tree refused to die and was abandoned")
    assert line.fields["node_name"] == "/zombie"
    assert len(system.master.joined) == 0
    Zombie.released.set()
    await system.stop()
    assert nothing_is_left(system)


@pytest.mark.virtual
async def test_a_failed_node_whose_clean_up_hangs_is_killed_after_its_stop_timeout_and_restarted() -> None:
    class Hung(Node):
        async def on_stop(self, reason: ExitReason) -> None:
            if self.incarnation == 1:
                await self.clock.sleep(3600.0)

    async with run(Supervisor("system", children=[Child(Hung, stop=2.0)]), sinks=()) as system:
        state = system.nodes["system", "hung"]
        assert state.running is not None
        state.running.fail(OSError("a loose wire"), "the test")
        await asyncio.sleep(1.9)
        assert (state.state, state.incarnation) == ("stopping", 1)
        await asyncio.sleep(0.2)
        assert (state.state, state.incarnation) == ("running", 2)
        (report,) = [each for each in system.reports if each.context == "child_terminated"]
        assert (str(report.reason), report.at) == ("it was killed after 2 s of clean-up", 2.0)
        (line,) = events(system.records, "clean-up cut short")
        assert line.fields["after"] == "it raised OSError: a loose wire"


def test_a_node_that_is_thrown_away_while_it_cleans_up_waits_for_nothing_any_more() -> None:
    class Hung(Node):
        async def on_stop(self, reason: ExitReason) -> None:
            try:
                await self.clock.sleep(3600.0)
            finally:
                Motor.diary.append("thrown away")

    async def main() -> Coroutine[Any, Any, Any]:
        system = create(System, sinks=())
        await system.start(Supervisor("system", children=[Child(Hung)]))
        assert system.supervisor is not None
        state, task = system.nodes["system", "hung"], task_named("system/hung#1")
        assert state.running is not None
        state.running.fail(OSError("a loose wire"), "the test")
        await asyncio.sleep(1.0)
        return task.get_coro()  # type: ignore[return-value]

    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        runner.run(main()).close()  # as the interpreter does with what nobody refers to any more
        assert Motor.diary == ["thrown away"]


# -- code that asks the program to exit -------------------------------------------------------------------------------

EXITS = [SystemExit(5), KeyboardInterrupt()]


class Menu(Node):
    """Has an item "exit" in every place."""

    place = ""
    exit: BaseException

    def choose(self, place: str) -> None:
        if self.place == place:
            raise self.exit

    async def on_start(self) -> None:
        if self.place == "spawned":
            self.create_task(self.spawned())
        self.choose("on_start")

    async def spawned(self) -> None:
        self.choose("spawned")

    @every(hz=1)
    async def tick(self) -> None:
        self.choose("handler")
        if self.place == "offloaded":
            await self.offload(self.choose, "offloaded")
        if self.place == "on_stop":
            self.stop("done")

    @background
    async def work(self) -> None:
        await self.clock.sleep(1.0)
        self.choose("background")
        self.threadsafe(self.choose, "from a thread")

    @NUMBERS.on(concurrent=1)
    async def take(self, message: Int32) -> None:
        self.choose("concurrent handler")

    @ADD.serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        self.choose("service")
        return AddTwoInts.Response()

    @COUNT.serve()
    async def count(self, goal: Fibonacci.Goal) -> Body:
        self.choose("goal")
        yield Done(Fibonacci.Result())

    async def on_stop(self, reason: object) -> None:
        self.choose("on_stop")


def menu(place: str, exit: BaseException) -> Child:
    return Child(type("Menu", (Menu,), {"place": place, "exit": exit}), name="menu")


RUNNING = [
    "handler", "offloaded", "background", "spawned", "from a thread", "concurrent handler", "service", "goal", "on_stop",
]  # fmt: skip


@pytest.mark.virtual
@pytest.mark.parametrize("exit", EXITS, ids=repr)
@pytest.mark.parametrize("place", RUNNING)
async def test_D6_code_that_asks_the_program_to_exit_stops_everything_in_order(place: str, exit: BaseException) -> None:
    systems: list[System] = []

    async def block() -> None:
        async with run(motors(menu(place, exit)), sinks=()) as system:
            systems.append(system)
            async with open_node("guest") as guest:
                if place == "service":
                    with pytest.raises(ServiceFailed, match="asked the program to exit"):
                        await guest.call(ADD, two(1, 2))
                elif place == "goal":
                    with pytest.raises(GoalAborted, match="asked the program to exit"):
                        async with guest.send_goal(COUNT, order(1)) as goal:
                            await goal
                elif place == "concurrent handler":
                    guest.publisher(NUMBERS)(number(1))
                await asyncio.sleep(3600.0)

    with pytest.raises(type(exit)) as raised:
        await block()
    assert raised.value is exit
    assert Motor.diary == IN_ORDER
    (system,) = systems
    assert system.exit_code == (5 if isinstance(exit, SystemExit) else 130)
    assert isinstance(system.runtime.tree.exit_request, ProgramExit)
    assert nothing_is_left(system)
    assert asyncio.current_task().cancelling() == 0  # type: ignore[union-attr]


@pytest.mark.virtual
@pytest.mark.parametrize("exit", EXITS, ids=repr)
async def test_D6_a_start_that_asks_the_program_to_exit_is_taken_back(exit: BaseException) -> None:
    with pytest.raises(type(exit)):
        async with run(motors(menu("on_start", exit)), sinks=()):
            raise AssertionError("the block must not be entered")
    assert Motor.diary == IN_ORDER
    assert asyncio.all_tasks() == {asyncio.current_task()}


@pytest.mark.virtual
async def test_D6_who_waits_for_the_system_goes_on_and_the_block_raises_the_exit() -> None:
    with pytest.raises(SystemExit):
        async with run(motors(menu("handler", SystemExit(5))), sinks=()) as system:
            await system.wait()
            Motor.diary.append("waited")
            assert system.exit_code == 5
            assert str(system.runtime.tree.exit_request) == "Menu.tick asked the program to exit: SystemExit: 5"
    assert Motor.diary == [*IN_ORDER, "waited"]


@pytest.mark.virtual
@pytest.mark.parametrize(
    ("given", "code"), [(SystemExit(), 0), (SystemExit("a reason"), 1), (SystemExit(7), 7), (KeyboardInterrupt(), 130)]
)
async def test_D6_the_exit_code_is_the_interpreters(given: BaseException, code: int) -> None:
    with pytest.raises(type(given)):
        async with run(menu("background", given), sinks=()) as system:
            await system.wait()
    assert system.exit_code == code


@pytest.mark.virtual
async def test_D6_an_exception_of_the_block_comes_before_the_exit() -> None:
    with pytest.raises(LookupError, match="mine"):
        async with run(menu("background", SystemExit(5)), sinks=()) as system:
            await system.wait()
            raise LookupError("mine")


def test_D6_a_script_without_a_tree_ends_with_the_exit_of_its_node() -> None:
    async def leave(node: Node) -> None:
        raise SystemExit(5)

    left_by: list[type[BaseException]] = []

    async def main() -> None:
        try:
            async with open_node("script") as node:
                node.create_task(leave(node))
                await asyncio.sleep(3600.0)
        except BaseException as error:
            left_by.append(type(error))
            raise

    with pytest.raises(SystemExit) as raised, asyncio.Runner(loop_factory=VirtualLoop) as runner:
        runner.run(main())
    assert raised.value.code == 5
    assert left_by == [asyncio.CancelledError], (
        "the exit is the loop's already, and would be complained of a second time"
    )


# -- kill -------------------------------------------------------------------------------------------------------------


@pytest.mark.virtual
async def test_kill_ends_everything_without_a_last_word_and_interrupts_nobody() -> None:
    async with run(motors(), sinks=()) as system:
        async with open_node("guest"):
            system.kill()
            await system.wait()
            await asyncio.sleep(10.0)
            assert system.clock.now() == 10.0
        system.kill()  # again, when there is nothing left
    assert Motor.diary == []
    assert nothing_is_left(system)


@pytest.mark.virtual
async def test_kill_breaks_off_a_start() -> None:
    class Hasty(Node):
        async def on_start(self) -> None:
            system_of(self).kill()
            await self.clock.sleep(3600.0)

    system = create(System, sinks=())
    with pytest.raises((NotRunning, StartFailed)):
        await system.start(motors(Child(Hasty)))
    assert Motor.diary == []
    assert nothing_is_left(system)


# -- signals (each in a process of its own) ---------------------------------------------------------------------------

PRELUDE = """
import asyncio, os, signal, sys
from actors import Child, Node, Supervisor, execute, open_node, run, every, publishes, Topic
from actors.interfaces.std_msgs.msg import Int32
from actors.system import system_of

NUMBERS = Topic(Int32, "numbers")
SIGNAL = signal.{signal}

def say(*words):
    print(*words, flush=True)

def kill_me():
    os.kill(os.getpid(), SIGNAL)

soon = [0.05]

def kill_me_soon():
    asyncio.get_running_loop().call_later(soon[0], kill_me)
    soon[0] = 0.6  # what comes sooner after the first is the same signal

class Part(Node):
    out = publishes(NUMBERS)

    @every(hz=100)
    def tick(self):
        self.out(Int32(data=1))

    async def on_stop(self, reason):
        await asyncio.sleep(0.05)
        say("stop", self.name)

def tree(*names, more=()):
    return Supervisor(names[0] + "_tree", children=[*(Child(Part, name=name) for name in names), *more])

def start(main):
    if {uvloop}:
        import uvloop
        with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
            return runner.run(main())
    return asyncio.run(main())
"""

LOOPS = [
    pytest.param(False, id="asyncio"),
    pytest.param(
        True,
        id="uvloop",
        marks=pytest.mark.skipif(importlib.util.find_spec("uvloop") is None, reason="uvloop is not installed"),
    ),
]
SIGNALS = [("SIGINT", 130), ("SIGTERM", 143)]
both_loops = pytest.mark.parametrize("uvloop", LOOPS)
both_signals = pytest.mark.parametrize(("name", "code"), SIGNALS)


def program(folder: Path, name: str, body: str, uvloop: bool = False) -> tuple[int, list[str], str]:
    """Run a program in a process of its own: exit code, lines of output, standard error."""
    code = PRELUDE.format(signal=name, uvloop=uvloop) + textwrap.dedent(body)
    done = warm.run("-c", code, timeout=60, cwd=folder, env={"PYTHONPATH": str(warm.ROOT)})
    return done.returncode, done.stdout.splitlines(), done.stderr


@both_signals
def test_D1_a_signal_with_a_client_that_reads_a_stream(tmp_path: Path, name: str, code: int) -> None:
    body = """
        async def console():
            async with open_node("console") as node:
                async for message in node.subscribe(NUMBERS):
                    pass
            say("console left")

        async def main():
            async with run(tree("a", "b"), sinks=()) as system:
                task = asyncio.create_task(console())
                kill_me_soon()
                await system.wait()
            await task
            return system.exit_code

        sys.exit(start(main))
    """
    assert program(tmp_path, name, body) == (code, ["stop b", "stop a", "console left"], "")


@both_loops
@both_signals
def test_D3_after_an_inner_run_the_outer_one_still_hears_signals(
    tmp_path: Path, name: str, code: int, uvloop: bool
) -> None:
    body = """
        async def main():
            async with run(tree("a", "b"), sinks=()) as system:
                async with run(tree("inner"), sinks=()):
                    pass
                say("inner has ended")
                kill_me_soon()
                await system.wait()
            return system.exit_code

        sys.exit(start(main))
    """
    expected = (code, ["stop inner", "inner has ended", "stop b", "stop a"], "")
    assert program(tmp_path, name, body, uvloop) == expected


@both_loops
@both_signals
def test_D3_all_systems_of_a_loop_hear_a_signal(tmp_path: Path, name: str, code: int, uvloop: bool) -> None:
    body = """
        async def one(name):
            async with run(tree(name), sinks=()) as system:
                await system.wait()
            say("end of", name, system.exit_code)

        async def main():
            asyncio.get_running_loop().call_later(0.3, kill_me)
            await asyncio.gather(one("one"), one("two"))

        start(main)
    """
    result, lines, errors = program(tmp_path, name, body, uvloop)
    assert (result, sorted(lines), errors) == (
        0, [f"end of one {code}", f"end of two {code}", "stop one", "stop two"], "",
    )  # fmt: skip


@both_signals
def test_D3_a_signal_stops_a_system_within_a_system(tmp_path: Path, name: str, code: int) -> None:
    body = """
        async def main():
            async with run(tree("outer"), sinks=()) as outer:
                async with run(tree("inner"), sinks=()) as inner:
                    kill_me_soon()
                    await inner.wait()
                say("never: the outer block was not waiting for its own")

        execute(main)
    """
    result, lines, errors = program(tmp_path, name, body)
    assert (result, sorted(lines), errors) == (code, ["stop inner", "stop outer"], "")


SLOW = """
    class Slow(Node):
        async def on_start(self):
            kill_me_soon()
            await asyncio.sleep(3600.0)

        async def on_stop(self, reason):
            say("slow is asked to stop")
            kill_me_soon()
            await asyncio.sleep(3600.0)
            say("never")

    async def main():
        async with run(tree("a", more=[Child(Slow, stop=3600.0)]), sinks=()):
            say("never")

    execute(main)
"""


@both_signals
def test_a_second_signal_while_the_tree_starts_kills_it_and_is_no_traceback(
    tmp_path: Path, name: str, code: int
) -> None:
    assert program(tmp_path, name, SLOW) == (code, ["slow is asked to stop"], "")


@both_signals
def test_a_block_that_swallows_its_interruption_is_ended_by_the_next_signal(
    tmp_path: Path, name: str, code: int
) -> None:
    body = """
        async def main():
            async with run(tree("a", "b"), sinks=()):
                kill_me_soon()
                try:
                    await asyncio.sleep(3600.0)
                except asyncio.CancelledError:
                    say("swallowed")
                kill_me_soon()
                await asyncio.sleep(3600.0)
                say("never")

        execute(main)
    """
    result, lines, _ = program(tmp_path, name, body)
    assert (result, lines) == (code, ["stop b", "stop a", "swallowed"])


@pytest.mark.parametrize(("name", "code"), [("SIGINT", 130), ("SIGTERM", -15)])
def test_a_program_that_swallows_everything_is_ended_by_the_third_signal(tmp_path: Path, name: str, code: int) -> None:
    body = """
        async def main():
            async with run(tree("a", "b"), sinks=()):
                while True:
                    kill_me_soon()
                    try:
                        await asyncio.sleep(3600.0)
                    except asyncio.CancelledError:
                        say("swallowed")

        execute(main)
    """
    result, lines, _ = program(tmp_path, name, body)
    assert (result, lines) == (code, ["stop b", "stop a", "swallowed", "swallowed"])


@both_signals
def test_a_third_signal_after_a_kill_ends_the_process_at_once(tmp_path: Path, name: str, code: int) -> None:
    body = """
        class Stuck(Node):
            async def on_stop(self, reason):
                kill_me_soon()
                await asyncio.sleep(3600.0)

        async def main():
            async with run(tree("a", more=[Child(Stuck, stop=3600.0)]), sinks=()):
                kill_me_soon()
                try:
                    await asyncio.sleep(3600.0)
                except asyncio.CancelledError:
                    say("swallowed")
                kill_me_soon()
                try:
                    await asyncio.sleep(3600.0)
                finally:
                    say("never")

        execute(main)
    """
    assert program(tmp_path, name, body) == (128 - code, ["swallowed"], "")


def test_the_end_of_main_stops_the_nodes_of_another_task(tmp_path: Path) -> None:
    body = """
        async def robot():
            async with run(tree("a", "b"), sinks=()) as system:
                await system.wait()

        async def main():
            task = asyncio.create_task(robot())
            await asyncio.sleep(0.2)
            say("main ends")

        start(main)
    """
    result, lines, errors = program(tmp_path, "SIGTERM", body)
    assert (result, lines[0], sorted(lines[1:]), errors) == (0, "main ends", ["stop a", "stop b"], "")


def test_D6_sys_exit_in_a_handler_ends_the_program_in_order_with_its_code(tmp_path: Path) -> None:
    body = """
        class Menu(Node):
            @every(hz=10)
            async def choose(self):
                sys.exit(7)

        async def main():
            async with run(tree("a", "b", more=[Child(Menu)]), sinks=()) as system:
                await system.wait()
            say("never")

        execute(main)
    """
    assert program(tmp_path, "SIGTERM", body) == (7, ["stop b", "stop a"], "")


def test_a_call_from_another_thread_after_the_end_of_the_program_is_refused_each_time() -> None:
    nodes: list[Node] = []

    async def main() -> None:
        async with run(Node) as system:
            nodes.append(system.node(Node))

    asyncio.run(main())
    for _ in range(2):
        with pytest.raises(RuntimeError, match="closed"):
            nodes[0].threadsafe(print)
