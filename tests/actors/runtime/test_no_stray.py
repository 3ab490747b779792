"""Errors that nobody meant for a node's code: whoever waits is answered, nothing goes on without an owner, and nothing ends in silence."""

from __future__ import annotations

import asyncio
import inspect
import itertools
from typing import Any

import anyio
import pytest

from actors import (
    Action,
    ActorError,
    Child,
    Done,
    GoalAborted,
    GoalCanceled,
    LifecycleNode,
    Node,
    Service,
    ServiceFailed,
    Steps,
    Topic,
    background,
)
from actors.errors import Ended
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.lifecycle_msgs.msg import Transition
from actors.interfaces.lifecycle_msgs.srv import ChangeState
from actors.interfaces.std_msgs.msg import Int32
from actors.lifecycle import bring_up
from actors.runtime.incarnation import incarnation_of
from actors.supervision.reasons import ExitReason
from actors.testing import Rig
from tests.stage import events, number, order, result, step, total, two

Body = Steps[Fibonacci.Feedback, Fibonacci.Result]

GRIP = Action(Fibonacci, "grip")
READINGS = Topic(Int32, "readings", 10)
PLAIN, MANY = Service(AddTwoInts, "plain"), Service(AddTwoInts, "many")


def lost_connection(after: float) -> asyncio.Future[None]:
    """Something that is awaited, and that somebody else cancels."""
    loop = asyncio.get_running_loop()
    connection: asyncio.Future[None] = loop.create_future()
    loop.call_later(after, connection.cancel)
    return connection


# -- D4: leaving the block cancels -----------------------------------------------------------------------------------


class Gripper(Node):
    """Holds on until it is told to let go, and is asked whether it may."""

    @GRIP.serve(arrivals="parallel")
    async def grip(self, goal: Fibonacci.Goal) -> Body:
        await self.clock.sleep(3600.0)
        yield Done(result())

    @GRIP.cancels
    async def may_let_go(self, goal: Fibonacci.Goal) -> bool:
        await self.clock.sleep(0.1)
        return goal.order == 0


async def holds(rig: Rig, force: int = 0) -> None:
    async with rig.me.send_goal(GRIP, order(force)) as goal:
        await goal


async def by_an_asyncio_timeout(rig: Rig) -> None:
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(1.0):
            await holds(rig)


async def by_an_anyio_scope(rig: Rig) -> None:
    with anyio.move_on_after(1.0):
        await holds(rig)


async def by_an_anyio_group(rig: Rig) -> None:
    async with anyio.create_task_group() as group:
        group.start_soon(holds, rig)
        await anyio.sleep(1.0)
        group.cancel_scope.cancel()


async def by_two_cancellations(rig: Rig) -> None:
    task = asyncio.create_task(holds(rig))
    await asyncio.sleep(1.0)
    task.cancel()
    await asyncio.sleep(0.0)
    task.cancel()
    await asyncio.wait([task])


@pytest.mark.parametrize("leave", [by_an_asyncio_timeout, by_an_anyio_scope, by_an_anyio_group, by_two_cancellations])
async def test_D4_a_goal_whose_block_is_left_is_canceled_by_its_server(rig: Rig, leave: Any) -> None:
    await rig.start(Gripper)
    await leave(rig)
    await rig.advance(0.2)
    (server,) = incarnation_of(rig.node(Gripper)).record.actions.values()
    assert not server.running
    assert [goal.status.name for goal in server.table.records()] == ["CANCELED"]


async def test_D4_a_server_that_refuses_is_heard_also_when_nobody_waits_for_its_answer(rig: Rig) -> None:
    await rig.start(Gripper)
    with anyio.move_on_after(1.0):
        await holds(rig, force=9)
    await rig.advance(10.0)
    (server,) = incarnation_of(rig.node(Gripper)).record.actions.values()
    assert [run.status.name for run in server.running] == ["EXECUTING"]


async def test_D4_a_client_canceled_while_its_goal_is_accepted_leaves_no_goal(rig: Rig) -> None:
    await rig.start(Gripper)
    task = asyncio.create_task(holds(rig))
    (server,) = incarnation_of(rig.node(Gripper)).record.actions.values()
    while not server.running:
        await asyncio.sleep(0)
    task.cancel()  # the acceptance is on its way
    await rig.advance(1.0)
    assert task.cancelled()
    assert not server.running


class Hesitant(Node):
    """Is asked, and may be busy, undecided, or deaf when it is told to stop."""

    def __init__(self) -> None:
        self.asked: list[str] = []
        self.decided = asyncio.Event()

    @READINGS.on()
    async def take(self, message: Int32) -> None:
        await self.clock.sleep(message.data)

    @GRIP.serve(arrivals="parallel")
    async def grip(self, goal: Fibonacci.Goal) -> Body:
        await self.clock.sleep(goal.order)
        yield Done(result())

    @GRIP.accepts
    async def may_hold(self, goal: Fibonacci.Goal) -> None:
        if goal.order == 0:
            await self.clock.sleep(3600.0)

    @GRIP.cancels
    async def may_let_go(self, goal: Fibonacci.Goal) -> bool:
        self.asked.append(f"let go of {goal.order}")
        while not self.decided.is_set():
            try:
                await self.decided.wait()
            except asyncio.CancelledError:
                self.asked.append("not now")
        return True


async def test_D4_a_goal_that_ends_before_the_server_is_asked_is_not_asked_about(rig: Rig) -> None:
    await rig.start(Hesitant)
    goal = await rig.send_goal(GRIP, order(1))
    rig.publish(READINGS, number(2))
    await rig.advance(0.5)
    asking = asyncio.create_task(goal.cancel())
    await rig.advance(3.0)
    assert await asking is False
    assert goal.status.name == "SUCCEEDED"
    assert rig.node(Hesitant).asked == []


async def test_D4_who_asks_a_server_that_refuses_to_die_hears_no_when_it_is_given_up(rig: Rig) -> None:
    await rig.start(Child(Hesitant, stop=1.0))
    node = rig.node(Hesitant)
    goal = await rig.send_goal(GRIP, order(3600))
    asking = asyncio.create_task(goal.cancel())
    await rig.advance(0.5)
    assert rig.system.supervisor is not None
    await rig.system.supervisor.terminate_child("hesitant")
    assert await asyncio.wait_for(asking, 0.1) is False
    assert (await goal.ended()).status.name == "ABORTED"
    node.decided.set()
    await rig.advance(1.0)
    assert node.asked == ["let go of 3600", "not now"]
    assert goal.status.name == "ABORTED"


async def test_D4_a_goal_whose_server_is_killed_before_it_has_decided_is_answered(rig: Rig) -> None:
    await rig.start(Child(Hesitant, stop="kill"))
    sending = asyncio.create_task(rig.send_goal(GRIP, order(0), timeout=600.0))
    await rig.advance(0.5)
    assert rig.system.supervisor is not None
    await rig.system.supervisor.terminate_child("hesitant")
    with pytest.raises(ActorError, match="hesitant"):
        await asyncio.wait_for(sending, 1.0)


# -- D6: errors that are no Exception ----------------------------------------------------------------------------------


class Panic(BaseException):
    """As the panics of some native libraries."""


class Native(Node):
    """Rests on a library that panics."""

    ends: list[str] = []

    async def on_stop(self, reason: ExitReason) -> None:
        self.ends.append(f"{self.incarnation}: {reason}")

    @PLAIN.serve()
    async def plain(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        if request.a == 0:
            raise Panic("division")
        return total(request.a)

    @MANY.serve(concurrent=1)
    async def many(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        await self.clock.sleep(0.1)
        if request.a == 0:
            raise BaseExceptionGroup("two of them", [Panic("division"), Panic("modulo")])
        return total(request.a)

    @GRIP.serve()
    async def grip(self, goal: Fibonacci.Goal) -> Body:
        yield step(1)
        raise Panic("overrun")


async def test_D6_who_waits_for_an_answer_hears_of_a_panic_at_once(rig: Rig) -> None:
    Native.ends.clear()
    await rig.start(Native)
    rig.expect_failure(Panic)
    rig.expect_failure(BaseExceptionGroup)
    begun = rig.now
    with pytest.raises(ServiceFailed, match="/native failed to serve the request: Panic: division"):
        await rig.call(PLAIN, two(0, 0), timeout=30.0)
    assert rig.now == begun
    await rig.advance(0.1)
    with pytest.raises(ServiceFailed, match="BaseExceptionGroup: two of them"):
        await rig.call(MANY, two(0, 0), timeout=30.0)
    await rig.advance(0.1)
    goal = await rig.send_goal(GRIP, order(1))
    with pytest.raises(GoalAborted, match="Panic: overrun"):
        await asyncio.wait_for(goal, 1.0)
    await rig.advance(0.1)
    assert rig.incarnation(Native) == 4
    assert Native.ends == [
        "1: it raised Panic: division",
        "2: it raised BaseExceptionGroup: two of them (2 sub-exceptions)",
        "3: it raised Panic: overrun",
    ]
    assert await rig.call(PLAIN, two(4, 0)) == total(4)


# -- D7, D8: what a stray cancellation ends ---------------------------------------------------------------------------


class Reader(Node):
    """Three ways to await a connection that somebody closes."""

    how = ""

    def begin(self) -> None:
        if self.incarnation == 1 and self.how == "spawned":
            self.create_task(self.read())

    async def on_start(self) -> None:
        self.begin()

    async def read(self) -> None:
        await lost_connection(0.5)

    @background
    async def keep_reading(self) -> None:
        if self.incarnation == 1 and self.how == "background":
            await self.read()
        await self.clock.sleep(3600.0)

    @READINGS.on(concurrent=1)
    async def take(self, message: Int32) -> None:
        if self.incarnation == 1 and self.how == "concurrent handler":
            await self.read()


@pytest.mark.parametrize(
    ("how", "name"),
    [("background", "/reader keep_reading"), ("spawned", "/reader Reader.read"), ("concurrent handler", "Reader.take")],
)
async def test_D7_a_stray_cancellation_is_the_failure_of_the_code_that_let_it_out(
    rig: Rig, how: str, name: str
) -> None:
    kind = type("Reader", (Reader,), {"how": how})
    await rig.start(kind)
    rig.expect_failure(RuntimeError, match=f"{name} awaited something that was canceled, and did not handle it")
    rig.publish(READINGS, number(1))
    await rig.advance(1.0)
    assert rig.incarnation(kind) == 2
    (line,) = events(rig.logs, "child terminated")
    assert name in str(line.fields["reason"])


class Sorter(Node):
    """Takes the bad with the good."""

    def __init__(self, bad: str) -> None:
        self.bad = bad
        self.taken: list[int] = []

    def on_error(self, error: Exception, handler: str) -> Any:
        return "continue"

    @READINGS.on(concurrent=1)
    async def take(self, message: Int32) -> None:
        await asyncio.sleep(0)
        if message.data == 1 and self.bad == "raises":
            raise ValueError("a bad reading")
        if message.data == 1:
            await lost_connection(0.1)
        self.taken.append(message.data)


@pytest.mark.parametrize("bad", ["raises", "loses its connection"])
async def test_D8_what_waits_behind_a_message_that_failed_is_handled_when_the_node_goes_on(rig: Rig, bad: str) -> None:
    await rig.start(Child(Sorter, args=(bad,)))
    for value in (1, 2, 3, 4):
        rig.publish(READINGS, number(value))
    await rig.advance(1.0)
    assert rig.node(Sorter).taken == [2, 3, 4]
    assert rig.incarnation(Sorter) == 1


async def test_D8_the_same_with_several_tasks_of_which_all_fail_at_once(rig: Rig) -> None:
    class Wide(Node):
        taken: list[int] = []

        def on_error(self, error: Exception, handler: str) -> Any:
            return "continue"

        @READINGS.on(concurrent=3)
        async def take(self, message: Int32) -> None:
            await self.clock.sleep(0.1)
            if message.data <= 3:
                raise ValueError("a bad reading")
            self.taken.append(message.data)

    await rig.start(Wide)
    for value in range(1, 10):
        rig.publish(READINGS, number(value))
    await rig.advance(0.3)
    assert Wide.taken == [4, 5, 6, 7, 8, 9]


# -- D9: lifecycle hooks -----------------------------------------------------------------------------------------------

CHANGE = Service(ChangeState, "/camera/change_state")


class Camera(LifecycleNode):
    """Whose first configuration goes wrong, as `trouble` says."""

    trouble = ""
    tries = 0
    faults = 0

    async def on_configure(self, previous: object) -> None:
        self.tries += 1
        if self.tries > 1:
            return
        if self.trouble == "slow":
            await self.clock.sleep(10.0)
        else:
            await lost_connection(0.1)

    async def on_fault(self, previous: object) -> None:
        self.faults += 1


async def configure(rig: Rig) -> bool:
    request = ChangeState.Request(transition=Transition(label="configure"))
    return (await rig.call(CHANGE, request, timeout=20.0)).success


async def test_D9_a_hook_that_met_a_stray_cancellation_counts_as_failed(rig: Rig) -> None:
    await rig.start(Camera)
    assert not await configure(rig)
    camera = rig.node(Camera)
    assert (camera.state.label, camera.faults, camera.incarnation) == ("unconfigured", 1, 1)
    (line,) = events(rig.logs, "lifecycle hook failed")
    assert line.fields["hook"] == "on_configure"
    assert "awaited something that was canceled" in str(line.fields["error"])
    assert await configure(rig)
    assert camera.state.label == "inactive"


async def test_D9_a_hook_whose_caller_gives_up_leaves_a_node_that_can_be_asked_again(rig: Rig) -> None:
    kind = type("Camera", (Camera,), {"trouble": "slow"})
    await rig.start(kind)
    camera = rig.node(kind)
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(1.0):
            await camera.change_state("configure")
    assert (camera.state.label, camera.faults) == ("unconfigured", 1)
    await bring_up(rig.system)
    assert camera.state.label == "active"


@pytest.mark.parametrize("asked", [None, ["/camera"]])
async def test_D9_bring_up_names_the_node_that_cannot_be_asked_in_its_state(rig: Rig, asked: list[str] | None) -> None:
    class Finalized(Camera):
        node_name = "camera"

        async def on_shutdown(self, previous: object) -> None: ...

    await rig.start(Child(Finalized, name="camera"))
    camera = rig.node(Finalized)
    await camera.change_state("shutdown")
    assert camera.state.label == "finalized"
    with pytest.raises(RuntimeError, match=r"^/camera: the transition 'configure' is refused: the node is finalized"):
        await bring_up(rig.system, asked)


async def test_D9_bring_up_names_the_node_that_does_not_run(rig: Rig) -> None:
    await rig.start(Camera, Arm)
    assert rig.system.supervisor is not None
    for name in ("/nobody", "/arm"):
        with pytest.raises(RuntimeError, match=f"^{name} is no running lifecycle node; there are: /camera$"):
            await bring_up(rig.system, ["/camera", name])
    await rig.system.supervisor.terminate_child("camera")
    with pytest.raises(RuntimeError, match=r"^/camera is no running lifecycle node; there are: none$"):
        await bring_up(rig.system, ["/camera"])


async def test_D9_two_who_bring_a_node_up_at_once_are_both_right(rig: Rig) -> None:
    class Careful(LifecycleNode):
        async def on_configure(self, previous: object) -> None:
            await self.clock.sleep(1.0)

    await rig.start(Careful)
    await asyncio.gather(bring_up(rig.system), bring_up(rig.system, ["/careful"]))
    assert rig.node(Careful).state.label == "active"
    assert rig.now == 1.0


async def test_D7_work_for_a_node_that_has_ended_is_refused_and_thrown_away(rig: Rig) -> None:
    async def work() -> None: ...

    await rig.start(Arm)
    core = incarnation_of(rig.node(Arm))
    rig.crash(Arm)
    await rig.settled()
    coroutine = work()
    with pytest.raises(Ended, match="/arm, incarnation 1, has ended: ask its successor"):
        core.own(coroutine)
    assert inspect.getcoroutinestate(coroutine) == inspect.CORO_CLOSED


# -- D10: feedback while cleaning up -----------------------------------------------------------------------------------


class Arm(Node):
    """Tells what it does, also while it is retracted."""

    def __init__(self) -> None:
        self.done: list[str] = []

    @GRIP.serve()
    async def grip(self, goal: Fibonacci.Goal) -> Body:
        try:
            while True:
                await self.clock.sleep(0.1)
                yield step(1)
        finally:
            yield step(0)
            await self.clock.sleep(1.0)
            yield step(-1)
            self.done.append("brake on")


async def test_feedback_while_cleaning_up_is_heard_and_the_clean_up_comes_to_its_end(rig: Rig) -> None:
    await rig.start(Arm)
    async with rig.me.send_goal(GRIP, order(1)) as goal:
        await anext(goal)
        assert await goal.cancel()
        heard = [feedback async for feedback in goal]
        with pytest.raises(GoalCanceled):
            await goal
    assert heard[-2:] == [step(0), step(-1)]
    assert rig.node(Arm).done == ["brake on"]


class Deaf(Node):
    """Goes on as if nobody had canceled it."""

    def __init__(self, period: float) -> None:
        self.period = period
        self.ignored: list[float] = []

    @GRIP.serve()
    async def grip(self, goal: Fibonacci.Goal) -> Body:
        while True:
            try:
                await self.clock.sleep(self.period)
                yield step(1)
            except asyncio.CancelledError:
                self.ignored.append(round(self.clock.now(), 3))


@pytest.mark.parametrize(
    ("period", "each"), [pytest.param(0.1, 5.0, id="5 s"), pytest.param(0.001, 1.0, id="1000 feedbacks")]
)
async def test_a_body_that_ignores_its_cancellation_hears_it_again_and_is_closed_in_the_end(
    rig: Rig, period: float, each: float
) -> None:
    await rig.start(Child(Deaf, args=(period,)))
    goal = await rig.send_goal(GRIP, order(1))
    await rig.advance(1.0)
    canceled = rig.now
    assert await goal.cancel()
    outcome = await asyncio.wait_for(goal.ended(), 100.0)
    assert outcome.status.name == "ABORTED"
    assert "Deaf.grip went on after 3 errors thrown into it; it was closed. The last: CancelledError" in outcome.reason
    times = rig.node(Deaf).ignored
    assert len(times) == 4  # the cancellation, and three more
    assert [round(later - earlier, 1) for earlier, later in itertools.pairwise(times)] == [each] * 3
    assert rig.now - canceled == pytest.approx(4 * each, abs=0.5)
