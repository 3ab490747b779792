"""One incarnation by itself: told to stop before it begins and after it has ended, and the hooks of several actions."""

from __future__ import annotations

import asyncio
import gc
import weakref

import pytest

from actors import (
    Action,
    Child,
    Done,
    DynamicSupervisor,
    GoalRejected,
    Node,
    Reject,
    Steps,
    background,
    every,
    parameter,
    publishes,
    temporary,
)
from actors.errors import Ended
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int32
from actors.runtime.incarnation import incarnation_of
from actors.supervision.reasons import Leaked
from actors.testing import Rig
from tests.stage import ADD, NUMBERS, number, order, result, total, two

UP = Action(Fibonacci, "up")
DOWN = Action(Fibonacci, "down")


class Brief(Node):
    """Notes what happens to it, and leaves when it is told to."""

    async def on_stop(self, reason: object) -> None:
        self.log.info("stopping", reason=str(reason))


async def test_a_stop_before_the_first_step_and_one_after_the_end_hurt_nobody(rig: Rig) -> None:
    system = await rig.start(Child(Brief, restart=temporary))
    rig.node(Brief).stop("done")
    await rig.settled()
    state = rig.state(Brief)
    life = system.runtime.incarnate(Child(Brief, restart=temporary), state)
    life.stop("changed my mind")
    await life.run(lambda: None)
    last = rig.logs[-1]
    assert (last.event, last.fields["reason"]) == ("stopping", "it stopped: changed my mind")
    life.stop("too late")  # must not reach the next incarnation, which would find it in its inbox
    assert not state.inbox.control


class Busy(Node):
    """A node with endpoints, a timer, a parameter and a task."""

    out = publishes(NUMBERS)
    level = parameter(1)

    @NUMBERS.on()
    async def take(self, message: Int32) -> None: ...

    @ADD.serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return total(request.a + request.b)

    async def on_start(self) -> None:
        self.log.info("at work", level=self.level)

    @background
    async def wait(self) -> None:
        await self.clock.sleep(1000.0)

    @every(hz=10)
    def tick(self) -> None: ...


async def test_a_node_that_has_ended_is_freed_without_the_garbage_collector(rig: Rig) -> None:
    await rig.start(DynamicSupervisor("pool", Child(Busy, name="busy")))
    assert rig.system.supervisor is not None
    gc.collect()
    gc.disable()  # a garbage collector that has nothing to do costs the other nodes no time
    try:
        ref = await rig.system.supervisor.spawn(name="busy")
        assert ref is not None
        seen = weakref.ref(rig.node(Busy)), weakref.ref(incarnation_of(rig.node(Busy)).inbox.task)  # type: ignore[arg-type]
        await rig.advance(1.0)
        await rig.system.supervisor.terminate_child(ref)
        await rig.advance(1.0)
        assert [each() for each in seen] == [None, None]
    finally:
        gc.enable()


async def test_a_node_that_has_ended_and_is_held_answers_questions(rig: Rig) -> None:
    await rig.start(Child(Busy, restart=temporary))
    node = rig.node(Busy)
    node.stop()
    await rig.settled()
    assert (node.fqn, node.incarnation, node.get_parameter("level").value) == ("/busy", 1, 1)
    with pytest.raises(Ended):
        node.create_timer(1.0, node.tick)


class Lift(Node):
    """Two actions, each with a check of its own."""

    @UP.accepts
    def may_rise(self, goal: Fibonacci.Goal) -> None:
        if goal.order > 5:
            raise Reject("there is no such floor")

    @UP.serve()
    async def up(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        yield Done(result(goal.order))

    @DOWN.serve()
    async def down(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        yield Done(result(-goal.order))


async def test_the_check_of_one_action_is_none_of_the_others_business(rig: Rig) -> None:
    await rig.start(Lift)
    with pytest.raises(GoalRejected, match="no such floor"):
        await rig.send_goal(UP, order(7))
    assert await (await rig.send_goal(DOWN, order(7))) == result(-7)
    assert await (await rig.send_goal(UP, order(2))) == result(2)


async def test_what_serves_and_asks_introduces_itself(rig: Rig) -> None:
    """The texts that a debugger shows of a request on its way."""

    class Adder(Node):
        """Adds, when somebody lets it."""

        async def on_start(self) -> None:
            self.go = asyncio.Event()

        @ADD.serve()
        async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            await self.go.wait()
            return total(request.a + request.b)

    await rig.start(Adder)
    asking = asyncio.create_task(rig.call(ADD, two(1, 2)))
    await rig.quiet()
    assert repr(rig.state(Adder).inbox.current).startswith("<request of /rig to /add: ")
    assert repr(incarnation_of(rig.me).endpoints.clients[ADD]) == "<client of /add in /rig>"
    rig.node(Adder).go.set()
    assert (await asking).sum == 3


class Clinging(Node):
    """Answers its cancellation by an error, and comes to the end of its clean-up only when it is let go."""

    async def on_start(self) -> None:
        self.let_go = asyncio.Event()

    @NUMBERS.on()
    async def take(self, message: Int32) -> None:
        try:
            await self.clock.sleep(3600.0)
        except asyncio.CancelledError:
            raise OSError("interrupted") from None

    async def on_stop(self, reason: object) -> None:
        await self.let_go.wait()


async def test_a_clean_up_that_begins_after_the_kill_gets_no_time_of_its_own(rig: Rig) -> None:
    system = await rig.start(Child(Clinging, stop="kill"))
    rig.publish(NUMBERS, number(1))
    await rig.quiet()
    node = rig.node(Clinging)
    supervisor = system.supervisor
    assert supervisor is not None
    terminated = asyncio.create_task(supervisor.terminate_child("clinging"))
    await rig.advance(0.9)
    assert not terminated.done()
    assert rig.state(Clinging).state == "stopping"
    await rig.advance(0.2)
    assert terminated.done()
    (report,) = [each for each in rig.reports if each.context == "shutdown_error"]
    assert (report.reason, report.at) == (Leaked(1.0), 1.0)
    assert [leaked.ref.id for leaked in supervisor.leaked] == ["clinging"]
    node.let_go.set()
    await rig.settled()
    assert supervisor.leaked == []
