"""Errors: a program that raises each of them."""

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager

from actors import (
    Aborted,
    Action,
    ActionUnavailable,
    ActorError,
    CallTimeout,
    Child,
    ContentFilter,
    DeclarationError,
    GoalFailed,
    Node,
    Service,
    ServiceFailed,
    ServiceUnavailable,
    StartFailed,
    Steps,
    SupervisorGaveUp,
    Topic,
    every,
    execute,
    run,
)
from actors.errors import (
    CallCycle,
    Ended,
    InvalidFilter,
    NodeRestarting,
    NotRunning,
    NotStarted,
    ProcessDied,
    ProcessHung,
    ProgramExit,
    RemoteError,
    TickMissed,
    WrongThread,
    WrongType,
)
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.std_msgs.msg import Int32, String
from actors.interfaces.std_srvs.srv import Trigger
from actors.testing import Rig
from actors.typing import RunningSupervisor

# -- before anything runs

COUNT, DIG = Topic(Int32, "count"), Action(Fibonacci, "dig")
ASK, OTHER = Service(Trigger, "ask"), Service(Trigger, "other")

try:

    class Wrong(Node):
        @COUNT.on()
        async def count(self) -> None: ...  # takes no message

except DeclarationError as error:
    print(error)

try:
    ContentFilter("data >")
except InvalidFilter as error:
    print(error)


class Idle(Node): ...


@contextmanager
def raising(wanted: type[Exception]) -> Iterator[None]:
    """The block must raise this error."""
    try:
        yield
    except wanted as error:
        print(error)
    else:
        raise AssertionError(wanted)


with raising(NotStarted):
    Idle().publisher(COUNT)

# -- while it runs

class Server(Node):
    """Answers nothing in time, raises, or asks itself."""

    @ASK.serve(concurrent=2)
    async def ask(self, request: Trigger.Request) -> Trigger.Response:
        await self.clock.sleep(60.0)
        return Trigger.Response(success=True)

    @OTHER.serve()
    async def other(self, request: Trigger.Request) -> Trigger.Response:
        return await self.call(OTHER, request)


class Digger(Node):
    @DIG.serve()
    async def dig(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        yield Aborted("rock")


async def failure(rig: Rig, service: Service[Trigger.Request, Trigger.Response]) -> ActorError:
    """What a call ends in."""
    try:
        await rig.call(service, Trigger.Request())
    except ActorError as error:
        return error
    raise AssertionError("it has been answered")


async def test_a_call_ends_in_an_answer_or_an_error_that_says_which(rig: Rig) -> None:
    await rig.start(Server)
    assert isinstance(await failure(rig, ASK), CallTimeout)
    assert isinstance(await failure(rig, Service(Trigger, "nobody")), ServiceUnavailable)
    asked = await failure(rig, OTHER)  # the handler waits for itself: it is told at once, and its caller learns it
    assert isinstance(asked, ServiceFailed) and asked.type == CallCycle.__name__


async def test_a_node_that_has_failed_or_ended_says_so_at_once(rig: Rig) -> None:
    await rig.start(Child(Server, name="server"))
    waiting = asyncio.ensure_future(failure(rig, ASK))
    await rig.advance(0.1)
    rig.crash("server")
    assert isinstance(await waiting, NodeRestarting)
    await rig.settled()
    supervisor: RunningSupervisor | None = rig.system.supervisor
    assert supervisor is not None
    await supervisor.replace("server", Idle)
    assert isinstance(await failure(rig, ASK), NotRunning)


async def test_what_does_not_fit_is_refused_where_it_is_said(rig: Rig) -> None:
    await rig.start(Idle)
    out = rig.me.publisher(COUNT)
    with raising(WrongType):
        out(String(data="1"))
    with raising(WrongThread):
        await asyncio.to_thread(out.assert_liveliness)
    out.close()
    with raising(Ended):
        out(Int32(data=1))
    with raising(ActionUnavailable):
        async with rig.me.send_goal(DIG, Fibonacci.Goal(order=1), timeout=1.0):
            ...


async def test_a_goal_that_ends_without_success_raises_a_goal_failed(rig: Rig) -> None:
    await rig.start(Digger)
    async with rig.me.send_goal(DIG, Fibonacci.Goal(order=1)) as goal:
        with raising(GoalFailed):
            await goal


class Late(Node):
    """Its tick sleeps longer than its period, and may not."""

    @every(hz=10, late="fault")
    async def tick(self) -> None:
        await self.clock.sleep(0.35)


async def test_a_tick_that_may_not_be_late_ends_its_node(rig: Rig) -> None:
    await rig.start(Late)
    with rig.expect_failure(TickMissed):
        await rig.advance(0.6)

# -- the end of a tree

class Broken(Node):
    async def on_start(self) -> None:
        raise OSError("no such device")


class Failing(Node):
    @every(hz=1)
    async def tick(self) -> None:
        raise OSError("cable pulled")


class Exiting(Node):
    @every(hz=1)
    async def tick(self) -> None:
        raise SystemExit(5)


async def end_of(*nodes: type[Node]) -> Exception | SystemExit:
    """What the block of `run` raises."""
    try:
        async with run([Child(node) for node in nodes], sinks=()) as system:
            await system.wait()
    except (ActorError, SystemExit) as error:
        return error
    raise AssertionError("it has ended in order")


async def ends() -> None:
    started = await end_of(Broken)
    assert isinstance(started, StartFailed) and isinstance(started.__cause__, OSError)
    gave_up = await end_of(Failing)
    assert isinstance(gave_up, SupervisorGaveUp) and (gave_up.restarts, gave_up.within) == (3, 5.0)
    left = await end_of(Exiting)
    assert isinstance(left, SystemExit | ProgramExit) and left.code == 5


execute(ends, clock="virtual")

for error in (ProcessDied(4711, "signal 9"), ProcessHung(4711, 2.0, "time.sleep"), RemoteError("CudaError", "out of memory")):
    assert isinstance(error, ActorError)
    print(error)
