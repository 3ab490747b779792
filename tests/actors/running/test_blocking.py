"""The blocking face (S-04): scripts and threads without an event loop; inside one it is refused at once."""

from __future__ import annotations

import asyncio
import os
import signal
import threading
from collections.abc import Callable, Coroutine
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, ClassVar, cast

import pytest

from actors import (
    Action,
    ActionUnavailable,
    CallTimeout,
    Child,
    Done,
    GoalAborted,
    GoalCanceled,
    GoalRejected,
    GoalStatus,
    Intensity,
    Node,
    Reject,
    Service,
    ServiceUnavailable,
    StartFailed,
    Steps,
    Supervisor,
    SupervisorGaveUp,
    Topic,
    blocking,
    publishes,
    qos,
    run,
)
from actors.blocking import BlockingNode, InsideEventLoop
from actors.checks import create
from actors.errors import Ended, NotRunning
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int32, String
from actors.system import System, system_of
from actors.testing import Rig
from tests import warm
from tests.stage import ADD, COUNT, NUMBERS, WORDS, number, order, result, step, total, two, word

LATCHED = Topic(Int32, "latched", qos.LATCHED.replace(depth=10))
FAIL = Service(AddTwoInts, "fail")


def left_over(before: set[threading.Thread]) -> list[threading.Thread]:
    """The threads that are there now, were not `before`, and go on; one that has done its work may need a moment to end."""
    new = set(threading.enumerate()) - before
    for thread in new:
        thread.join(10.0)
    return [thread for thread in new if thread.is_alive()]


class Desk(Node):
    """Adds, counts, and echoes each number as ten times it."""

    echo = publishes(LATCHED)

    async def on_start(self) -> None:
        self.heard: list[str] = []
        self.ended: list[str] = []

    @WORDS.on()
    def hear(self, message: String) -> None:
        self.heard.append(message.data)

    @NUMBERS.on()
    def take(self, message: Int32) -> None:
        self.echo(number(10 * message.data))

    @ADD.serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return total(request.a + request.b)

    @FAIL.serve()
    async def fail(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        self.stop("asked to")
        await asyncio.get_running_loop().create_future()
        raise AssertionError

    @COUNT.accepts
    def check(self, goal: Fibonacci.Goal) -> None:
        if goal.order < 0:
            raise Reject("cannot count backwards")

    @COUNT.serve(arrivals="parallel")
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        try:
            for n in range(goal.order):
                yield step(n)
            if goal.order == 13:
                raise ValueError("13 is unlucky")
            if goal.order == 100:
                await asyncio.get_running_loop().create_future()
        finally:
            self.ended.append(f"{goal.order}")
        yield Done(result(*range(goal.order)))


def desk() -> Supervisor:
    return Supervisor("office", children=[Child(Desk)])


async def in_thread(work: Callable[[], object]) -> None:
    """Run a script in a thread of its own; the virtual clock stands still for it."""
    with ThreadPoolExecutor(1) as thread:
        await asyncio.get_running_loop().run_in_executor(thread, work)


def test_a_script_calls_publishes_listens_and_runs_a_goal_and_leaves_nothing_behind() -> None:
    before = set(threading.enumerate())
    seen: list[list[int]] = []

    with blocking.open_node("script", tree=desk()) as node:
        assert node.call(ADD, two(2, 3)).sum == 5
        node.subscribe(LATCHED)
        for value in (1, 2, 3):
            node.publish(NUMBERS, number(value))
        assert [node.next(LATCHED, timeout=30.0).data for _ in range(3)] == [10, 20, 30]
        counted = node.run_goal(COUNT, order(3), on_feedback=lambda feedback: seen.append(feedback.sequence.tolist()))
        assert counted == result(0, 1, 2)
        assert node.run_goal(COUNT, order(2)) == result(0, 1)

    assert seen == [[0], [1], [2]]
    assert not left_over(before)


async def test_a_thread_joins_the_system_of_an_event_loop(rig: Rig) -> None:
    await rig.start(Desk)
    sums: list[int] = []

    def script() -> None:
        with blocking.open_node("thread", system=rig.system) as node:
            assert "blocking <Node /thread" in repr(node)
            sums.append(node.call(ADD, two(20, 22)).sum)
            node.publish(WORDS, word("from a thread"))

    await in_thread(script)

    assert sums == [42]
    assert rig.node(Desk).heard == ["from a thread"]
    assert "/thread" not in {state.identity.fqn for state in rig.system.nodes.values()}


async def test_inside_an_event_loop_it_is_refused_with_advice_to_await(rig: Rig) -> None:
    await rig.start(Desk)
    with pytest.raises(InsideEventLoop, match=r"async with actors\.open_node"), blocking.open_node("script"):
        pass

    holder: list[blocking.BlockingNode] = []
    leave = threading.Event()
    entered = threading.Event()

    def script() -> None:
        with blocking.open_node("thread", system=rig.system) as node:
            holder.append(node)
            entered.set()
            leave.wait()

    thread = asyncio.create_task(in_thread(script))
    await in_thread(entered.wait)
    (node,) = holder
    for use, advice in (
        (lambda: node.call(ADD, two(1, 1)), r"await node\.call"),
        (lambda: node.publish(WORDS, word("x")), r"node\.publisher"),
        (lambda: node.subscribe(WORDS), r"node\.subscribe"),
        (lambda: node.next(WORDS), r"await node\.subscribe"),
        (lambda: node.run_goal(COUNT, order(1)), r"async with node\.send_goal"),
        (lambda: node.run(lambda inner: inner.wait_for(ADD)), "await instead, with the coroutine"),
    ):
        with pytest.raises(InsideEventLoop, match=advice):
            use()
    leave.set()
    await thread


def test_where_an_event_loop_without_nodes_runs_as_in_a_notebook_a_call_may_block() -> None:
    async def cell() -> int:
        with blocking.open_node("cell", tree=Desk) as node:
            return node.call(ADD, two(20, 22), timeout=5.0).sum

    async def cells() -> list[int]:
        return [await asyncio.create_task(cell()) for _ in range(2)]

    assert asyncio.run(cells()) == [42, 42]


async def test_in_a_callback_it_is_refused_instead_of_dead_locking(rig: Rig) -> None:
    refused: list[str] = []

    class Impatient(Node):
        @WORDS.on()
        def hear(self, message: String) -> None:
            try:
                with blocking.open_node("inside") as node:
                    node.call(ADD, two(1, 1))
            except InsideEventLoop as refusal:
                refused.append(str(refusal))

    await rig.start(Impatient)
    rig.publish(WORDS, word("now"))
    await rig.quiet()
    assert len(refused) == 1
    assert "await" in refused[0]


def test_what_goes_wrong_is_raised_in_the_thread_that_asked() -> None:
    with blocking.open_node("script", tree=desk()) as node:
        with pytest.raises(ServiceUnavailable, match="/nobody"):
            node.call(Service(AddTwoInts, "nobody"), two(1, 1), timeout=1e-6)
        with pytest.raises(CallTimeout, match="/words"):
            node.next(WORDS, timeout=1e-6)
        with pytest.raises(GoalRejected, match="backwards"):
            node.run_goal(COUNT, order(-1))
        with pytest.raises(GoalAborted, match="unlucky"):
            node.run_goal(COUNT, order(13))
        with pytest.raises(ActionUnavailable):
            node.run(start_elsewhere)
        assert node.call(ADD, two(1, 1)).sum == 2


async def start_elsewhere(node: Node) -> None:
    async with node.send_goal(Action(Fibonacci, "elsewhere"), order(1), timeout=1e-6):
        pass


def test_what_a_feedback_callback_raises_cancels_the_goal() -> None:
    def stop(feedback: Fibonacci.Feedback) -> None:
        raise ZeroDivisionError("seen enough")

    desks: list[Desk] = []

    class Watched(Desk):
        async def on_start(self) -> None:
            await super().on_start()
            desks.append(self)

    tree = Supervisor("office", children=[Child(Watched)])
    with blocking.open_node("script", tree=tree) as node:
        with pytest.raises(ZeroDivisionError):
            node.run_goal(COUNT, order(100), on_feedback=stop)
        assert node.call(ADD, two(1, 1)).sum == 2
    assert desks[0].ended == ["100"]


def test_a_slow_feedback_callback_gets_the_newest_and_never_holds_up_the_goal() -> None:
    heard: list[int] = []
    with blocking.open_node("script", tree=desk()) as node:

        def late(feedback: Fibonacci.Feedback) -> None:
            if not heard:  # while this one is busy the whole rest is said
                assert node.run_goal(COUNT, order(50)) == result(*range(50))
            heard.append(int(feedback.sequence[0]))

        node.run_goal(COUNT, order(50), on_feedback=late)
    assert heard == [0, *range(40, 50)]


def test_a_node_without_a_tree_is_a_system_of_its_own() -> None:
    with blocking.open_node("alone", namespace="/lab", parameters={"use_sim_time": False}) as node:
        assert node.run(full_name) == "/lab/alone"
        node.publish(LATCHED, number(7))
        assert node.next(LATCHED, timeout=30.0).data == 7


async def for_ever(node: Node) -> None:
    await asyncio.get_running_loop().create_future()


async def full_name(node: Node) -> str:
    return node.fqn


def test_a_tree_that_cannot_start_says_so_and_leaves_no_thread() -> None:
    class Broken(Node):
        async def on_start(self) -> None:
            raise OSError("no such device")

    before = set(threading.enumerate())
    with (
        pytest.raises(StartFailed, match="no such device"),
        blocking.open_node("script", tree=Supervisor("office", children=[Child(Broken)])),
    ):
        raise AssertionError("the block is not entered")
    assert not left_over(before)


def test_the_end_of_the_tree_ends_what_waits_and_is_raised_at_the_end_of_the_block() -> None:
    class Doomed(Desk):
        @NUMBERS.on()
        def take(self, message: Int32) -> None:
            raise RuntimeError("boom")

    tree = Supervisor("office", intensity=Intensity(0, within=1.0), children=[Child(Doomed)])

    def script() -> None:
        with blocking.open_node("script", tree=tree) as node:
            node.subscribe(WORDS)
            node.publish(NUMBERS, number(1))
            for use in (
                lambda: node.next(WORDS),
                lambda: node.run(for_ever),
                lambda: node.publish(WORDS, word("late")),
            ):
                with pytest.raises((NotRunning, Ended)):
                    use()

    with pytest.raises(SupervisorGaveUp):
        script()


def test_what_is_asked_of_a_loop_that_has_just_ended_is_refused_and_never_begun() -> None:
    """The two instants at which the end can overtake a request; a coroutine that is dropped unawaited would warn, and so fail."""
    life: Future[None] = Future()
    loop = asyncio.new_event_loop()
    node = create(BlockingNode, cast("Node", None), loop, life)
    with ThreadPoolExecutor(1) as thread:
        waits = thread.submit(node.run, for_ever)
        while not node._open:  # pyright: ignore[reportPrivateUsage]
            assert not waits.done()
        loop.close()  # it never came to the request
        life.set_result(None)
        with pytest.raises((NotRunning, Ended), match="ended"):
            waits.result()
    with pytest.raises(Ended, match="has ended"):
        create(BlockingNode, cast("Node", None), loop, Future()).run(for_ever)


def test_what_is_on_its_way_to_a_system_that_ends_is_not_waited_for_and_broken_off() -> None:
    life: Future[None] = Future()
    loop = asyncio.new_event_loop()

    def asked(node: Node) -> Coroutine[Any, Any, None]:
        life.set_result(None)  # the system ends in this very moment
        return for_ever(node)

    async def turns() -> list[asyncio.Task[Any]]:
        for _ in range(5):
            await asyncio.sleep(0)
        return [task for task in asyncio.all_tasks() if task is not asyncio.current_task()]

    with pytest.raises(NotRunning, match="its system ended while this thread waited"):
        create(BlockingNode, cast("Node", None), loop, life).run(asked)
    assert loop.run_until_complete(turns()) == []
    loop.close()


def test_after_the_block_everything_is_refused() -> None:
    opened = blocking.open_node("script")
    with opened as node:
        pass
    assert "ended" in repr(node)
    with pytest.raises(Ended, match="block has been left"):
        node.publish(WORDS, word("late"))
    with pytest.raises(RuntimeError, match="entered before"), opened:
        pass


def test_an_error_of_the_block_wins_over_the_tree_s_own_end() -> None:
    with pytest.raises(KeyError), blocking.open_node("script", tree=desk()):
        raise KeyError("mine")


def test_a_tree_and_a_running_system_at_once_are_refused() -> None:
    async def main() -> None:
        blocking.open_node("script", tree=desk(), system=create(System))

    with pytest.raises(ValueError, match="not both"):
        asyncio.run(main())


def test_the_end_of_the_other_thread_s_event_loop_ends_what_waits() -> None:
    said: list[str] = []
    listening = threading.Event()

    def script(system: System) -> None:
        with blocking.open_node("thread", system=system) as node:
            listening.set()
            try:
                node.run(for_ever)
            except NotRunning as ended:
                said.append(str(ended))

    async def main() -> threading.Thread:
        async with run(desk(), signals=False) as system:
            thread = threading.Thread(target=script, args=(system,))
            thread.start()
            await in_thread(listening.wait)
        return thread

    asyncio.run(main()).join()
    assert len(said) == 1


# -- the same names as on a node -----------------------------------------------------------------------------------------------------


def test_what_is_called_as_on_a_node_means_the_same() -> None:
    class Tuned(Node):
        """Its parameters are those of every node."""

    with blocking.open_node("script", namespace="/lab", tree=[Tuned, Desk], parameters={}) as node:
        assert (node.name, node.namespace, node.fqn) == ("script", "/lab", "/lab/script")
        node.wait_for(Service(AddTwoInts, "/add"), timeout=30.0)
        with pytest.raises(ServiceUnavailable):
            node.wait_for(Service(AddTwoInts, "/nobody"), timeout=1e-6)
        assert node.set_parameter("use_sim_time", False).successful
        refusal = node.set_parameters({"start_type_description_service": False})
        assert not refusal.successful and "read-only" in refusal.reason
        node.log.info("still here")
        assert node.run(read_last_line) == "still here"


async def read_last_line(node: Node) -> str:
    return system_of(node).records[-1].event


def test_a_subscription_is_a_stream_to_iterate_to_ask_and_to_close() -> None:
    with blocking.open_node("script", tree=Desk) as node:
        stream = node.subscribe(LATCHED)
        assert stream.latest is None
        for value in (1, 2, 3):
            node.publish(NUMBERS, number(value))
        assert stream.next(timeout=30.0) == number(10)
        assert [message.data for _, message in zip(range(2), stream, strict=False)] == [20, 30]
        assert stream.latest == number(30)
        with pytest.raises(CallTimeout):
            stream.next(timeout=1e-6)
        stream.close()
        assert list(stream) == []
        with pytest.raises(Ended):
            stream.next()
        assert repr(stream).startswith("<blocking <stream of /latched [Int32]: closed")
        newest_only = node.subscribe(LATCHED, qos=qos.LATCHED)
        assert newest_only.next(timeout=30.0) == number(30)


def test_a_goal_is_entered_iterated_and_asked_for_its_result() -> None:
    with blocking.open_node("script", tree=Desk) as node:
        goal = node.send_goal(COUNT, order(3))
        assert goal.status is GoalStatus.UNKNOWN
        assert repr(goal) == "<blocking <goal not sent for /count: UNKNOWN>>"
        with goal:
            assert [feedback.sequence.tolist() for feedback in goal] == [[0], [1], [2]]
            assert goal.result() == result(0, 1, 2)
            assert repr(goal).endswith("for /count: SUCCEEDED>>")
            assert goal.cancel() is False
        with node.send_goal(COUNT, order(100)) as hanging:
            assert len(next(hanging).sequence) == 1, "the first, or, where this thread was late, one of the newest ten"
            assert hanging.cancel("enough") is True
            with pytest.raises(GoalCanceled, match="enough"):
                hanging.result()
        with pytest.raises(KeyError, match="script"), node.send_goal(COUNT, order(100)) as left:
            raise KeyError("script")
        assert left.status is GoalStatus.CANCELED
        with pytest.raises(GoalRejected, match="cannot count backwards"), node.send_goal(COUNT, order(-1)):
            raise AssertionError("it has been accepted")


def test_a_goal_that_outlives_its_node_says_so_unless_the_block_has_said_more() -> None:
    with blocking.open_node("script", tree=Desk) as node:
        goal = node.send_goal(COUNT, order(100))
        goal.__enter__()
        failing = node.send_goal(COUNT, order(100))
        failing.__enter__()
    with pytest.raises(Ended, match="its block has been left"):
        goal.__exit__(None, None, None)
    failing.__exit__(KeyError, KeyError("script"), None)


# -- the end of the program ----------------------------------------------------------------------------------------------------------

PROGRAM = """
import os, signal, threading, time
from actors import Node, Topic, blocking
from actors.interfaces.std_msgs.msg import Int32
from actors.system import system_of

class Motor(Node):
    async def on_stop(self, reason):
        print("motor stopped", flush=True)

"""
HAND = "node = blocking.open_node('script', tree=Motor, sinks=()).__enter__()\n"
BLOCK = "with blocking.open_node('script', tree=Motor, sinks=()) as node:\n    "
KILL = "os.kill(os.getpid(), signal.SIGTERM)"


@pytest.mark.parametrize(
    ("lines", "code"),
    [
        (HAND + "print('the last line', flush=True)", 0),
        (HAND + "raise SystemExit(5)", 5),
        (HAND + "1 / 0", 1),
        (HAND + "another = blocking.open_node('another', sinks=()).__enter__()", 0),
        (HAND + f"{KILL}\ntime.sleep(60)", 143),
        (BLOCK + f"threading.Timer(0.1, lambda: {KILL}).start(); node.next(Topic(Int32, 'nothing'))", 143),
        (BLOCK + "os.kill(os.getpid(), signal.SIGINT); time.sleep(60)", 130),
        ("signal.signal(signal.SIGTERM, lambda *_: print('mine', flush=True))\n" + BLOCK + KILL, 0),
    ],
    ids=["last line", "exit", "exception", "two", "sigterm", "sigterm in a call", "ctrl-c", "a handler of its own"],
)
def test_a_program_that_ends_stops_its_nodes_in_order(lines: str, code: int) -> None:
    done = warm.run("-c", PROGRAM + lines, timeout=60)
    assert done.stdout.count("motor stopped") == 1, done.stderr
    assert (done.returncode if done.returncode >= 0 else 128 - done.returncode) == code
    assert ("mine" in done.stdout) is ("mine" in lines)


def test_afterwards_sigterm_and_the_end_of_the_program_are_what_they_were() -> None:
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
    with blocking.open_node("one"):
        taken = signal.getsignal(signal.SIGTERM)
        assert taken != signal.SIG_DFL
        with blocking.open_node("two"):
            assert signal.getsignal(signal.SIGTERM) is taken
        assert signal.getsignal(signal.SIGTERM) is taken
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL


def test_a_handler_that_was_set_inside_the_block_stays() -> None:
    def mine(*_: object) -> None:
        raise AssertionError

    try:
        with blocking.open_node("one"):
            signal.signal(signal.SIGTERM, mine)
        assert signal.getsignal(signal.SIGTERM) is mine
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


async def test_in_another_thread_signals_are_left_alone() -> None:
    def script() -> object:
        with blocking.open_node("one"):
            return signal.getsignal(signal.SIGTERM)

    assert await asyncio.to_thread(script) == signal.SIG_DFL


def test_sigterm_unwinds_the_block_and_its_nodes_end_before_it() -> None:
    with pytest.raises(SystemExit) as ended, blocking.open_node("one", tree=Desk) as node:
        signal.raise_signal(signal.SIGTERM)
    assert ended.value.code == 143
    with pytest.raises(Ended, match="its block has been left"):
        node.call(ADD, two(1, 1))
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL


def test_sigterm_while_the_tree_starts_ends_it_when_it_has_started() -> None:
    class Slow(Node):
        """Is interrupted while it starts."""

        stopped: ClassVar[list[str]] = []

        async def on_start(self) -> None:
            os.kill(os.getpid(), signal.SIGTERM)
            await self.clock.sleep(0.05)

        async def on_stop(self, reason: object) -> None:
            self.stopped.append(str(reason))

    before = set(threading.enumerate())
    with pytest.raises(SystemExit), blocking.open_node("one", tree=Slow):
        raise AssertionError("the block was entered")
    assert Slow.stopped == ["it stopped: the block was left"]
    assert not left_over(before)
