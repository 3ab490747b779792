"""What crosses on its way: ends, cancellations and departures that meet at the same instant."""

from __future__ import annotations

import asyncio

import pytest

from actors import CallTimeout, Child, Done, GoalStatus, Intensity, Node, Reject, Steps, Supervisor, temporary
from actors.actions.server import ActionServer
from actors.errors import NodeRestarting, NotRunning
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int32
from actors.supervision.policy import Backoff
from actors.testing import Rig
from tests.stage import ADD, COUNT, NUMBERS, number, order, result, total, two


class Worker(Node):
    """Counts one number a second; its checks take their time for goals that are large; a number holds it up for as long."""

    async def on_start(self) -> None:
        self.asked: list[str] = []

    @NUMBERS.on()
    async def hold_up(self, message: Int32) -> None:
        await self.clock.sleep(float(message.data))

    @COUNT.accepts
    async def check(self, goal: Fibonacci.Goal) -> None:
        self.asked.append("accept")
        if goal.order >= 100:
            await self.clock.sleep(0.4)
            raise Reject("too many")

    @COUNT.cancels
    async def may_cancel(self, goal: Fibonacci.Goal) -> bool:
        self.asked.append("cancel")
        if goal.order >= 10:
            await self.clock.sleep(0.4)
        return True

    @COUNT.serve(arrivals="parallel")
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        for _ in range(goal.order % 10):
            await self.clock.sleep(1.0)
            yield Fibonacci.Feedback()
        yield Done(result(goal.order))


def server_of(rig: Rig) -> ActionServer:
    server = rig.system.graph.action("/count").server
    assert server is not None
    return server


async def test_a_goal_that_ends_while_its_server_thinks_about_canceling_it_has_ended(rig: Rig) -> None:
    await rig.start(Worker)
    goal = await rig.send_goal(COUNT, order(11))
    await rig.advance(0.8)
    assert not await goal.cancel()  # it takes the check until 1.2 s to agree
    assert goal.status is GoalStatus.SUCCEEDED


async def test_D4_who_no_longer_waits_for_an_answer_to_a_cancellation_has_asked_for_it_all_the_same(rig: Rig) -> None:
    await rig.start(Worker)
    goal = await rig.send_goal(COUNT, order(3))
    rig.publish(NUMBERS, number(1))
    await rig.advance(0.1)
    asking = asyncio.create_task(goal.cancel())
    await rig.advance(0.1)
    asking.cancel()
    await rig.advance(2.0)
    assert rig.node(Worker).asked == ["accept", "cancel"]
    assert goal.status is GoalStatus.CANCELED


async def test_D4_who_goes_while_the_check_is_made_has_its_goal_canceled_if_the_check_agrees(rig: Rig) -> None:
    await rig.start(Worker)
    goal = await rig.send_goal(COUNT, order(13))
    asking = asyncio.create_task(goal.cancel())
    await rig.advance(0.1)
    asking.cancel()
    await rig.advance(1.0)
    assert rig.node(Worker).asked == ["accept", "cancel"]
    assert goal.status is GoalStatus.CANCELED


async def test_who_goes_before_a_goal_is_rejected_hears_nothing_of_it(rig: Rig) -> None:
    await rig.start(Worker)
    sending = asyncio.create_task(rig.send_goal(COUNT, order(100)))
    await rig.advance(0.1)
    sending.cancel()
    await rig.advance(1.0)
    assert sending.cancelled()
    assert rig.node(Worker).asked == ["accept"]
    assert (await rig.send_goal(COUNT, order(1))).status is GoalStatus.EXECUTING


async def test_goals_that_wait_at_the_end_of_the_node_are_told_unless_their_clients_have_gone(rig: Rig) -> None:
    await rig.start(Worker)
    rig.publish(NUMBERS, number(1))
    await rig.advance(0.1)
    rig.crash(Worker)  # once the number has been dealt with, and before the goals are looked at
    sending, other = (asyncio.create_task(rig.send_goal(COUNT, order(1))) for _ in range(2))
    await rig.advance(0.1)
    sending.cancel()
    await rig.settled()
    assert sending.cancelled()
    with pytest.raises(NodeRestarting):
        await other
    assert rig.node(Worker).asked == []


async def test_cancellations_that_wait_at_the_end_of_the_node_are_refused_unless_nobody_asks_any_more(rig: Rig) -> None:
    class Leaving(Worker):
        async def on_stop(self, reason: object) -> None:
            self.last_act()

        def last_act(self) -> None: ...

    await rig.start(Leaving)
    goal, second = [await rig.send_goal(COUNT, order(3)) for _ in range(2)]
    rig.publish(NUMBERS, number(1))
    await rig.advance(0.1)
    rig.crash(Leaving)
    asking, other = asyncio.create_task(goal.cancel()), asyncio.create_task(second.cancel())
    await rig.advance(0.1)
    rig.node(Leaving).last_act = asking.cancel  # type: ignore[method-assign, assignment]
    await rig.settled()
    assert asking.cancelled()
    assert not await other
    assert (goal.status, second.status) == (GoalStatus.ABORTED, GoalStatus.ABORTED)


async def test_who_no_longer_waits_for_a_result_does_not_hold_up_the_goals_end(rig: Rig) -> None:
    await rig.start(Worker)
    goal = await rig.send_goal(COUNT, order(2))
    first, second = (asyncio.create_task(server_of(rig).result_of(goal.goal_id)) for _ in range(2))
    await rig.advance(1.0)
    first.cancel()
    (running,) = server_of(rig).running
    assert server_of(rig).describe(running).endswith("of /count: EXECUTING>")
    await rig.advance(2.0)
    assert await second == (GoalStatus.SUCCEEDED, result(2))


async def test_a_handler_may_start_a_goal_of_another_node_and_wait_for_it(rig: Rig) -> None:
    class Chief(Node):
        """Adds by having others count."""

        @ADD.serve()
        async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            async with self.send_goal(COUNT, order(request.a + request.b)) as goal:
                return total(len((await goal).sequence))

    await rig.start(Worker, Chief)
    assert (await rig.call(ADD, two(1, 2), timeout=10.0)).sum == 1
    assert rig.now == 3.0


class Adder(Node):
    """Adds."""

    @ADD.serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return total(request.a + request.b)


class Other(Adder):
    pass


async def test_a_service_that_somebody_else_took_over_meanwhile_stays_with_the_other(rig: Rig) -> None:
    """The first server restarts late; it may not serve a second time, and its end takes nothing from who serves now."""
    patient = Child(Adder, backoff=Backoff(5.0, 5.0))
    system = await rig.start(Supervisor("system", intensity=Intensity(10, within=1.0), children=[patient]))
    assert system.supervisor is not None
    rig.crash(Adder)
    await rig.advance(1.0)
    await system.supervisor.start_child(Child(Other, restart=temporary))
    assert (await rig.call(ADD, two(1, 2))).sum == 3
    rig.expect_failure(node=Adder, match="second server of service /add, which /other serves already")
    await rig.advance(6.0)
    assert (await rig.call(ADD, two(2, 2))).sum == 4
    await system.supervisor.terminate_child("adder")
    assert (await rig.call(ADD, two(3, 2))).sum == 5
    await system.supervisor.terminate_child("other")
    with pytest.raises(NotRunning):
        await rig.call(ADD, two(1, 1))


async def test_a_node_that_serves_no_more_after_its_restart_takes_nothing_from_who_serves_now(rig: Rig) -> None:
    class Fickle(Node):
        """Adds in its first life only."""

        async def on_start(self) -> None:
            if self.incarnation == 1:
                self.serve(ADD, self.add)

        async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            return total(request.a - request.b)

    fickle = Child(Fickle, backoff=Backoff(5.0, 5.0))
    system = await rig.start(Supervisor("system", children=[fickle]))
    assert system.supervisor is not None
    assert (await rig.call(ADD, two(4, 2))).sum == 2
    rig.crash(Fickle)
    await rig.advance(1.0)
    await system.supervisor.start_child(Child(Other))
    await rig.advance(6.0)
    assert rig.incarnation(Fickle) == 2
    assert (await rig.call(ADD, two(4, 2))).sum == 6


async def test_the_wait_for_a_server_counts_towards_the_timeout_of_the_call(rig: Rig) -> None:
    class Slow(Node):
        """Adds, in half a second."""

        @ADD.serve()
        async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            await self.clock.sleep(0.5)
            return total(request.a + request.b)

    system = await rig.start(Worker)
    assert system.supervisor is not None
    await rig.advance(5.0)
    in_time, late = (asyncio.create_task(rig.call(ADD, two(1, 2), timeout=seconds)) for seconds in (2.0, 1.2))
    await rig.advance(1.0)
    await system.supervisor.start_child(Child(Slow))
    with pytest.raises(CallTimeout, match="did not answer /add in time"):
        await late
    assert rig.now == pytest.approx(6.2)
    assert (await in_time).sum == 3


async def test_a_body_that_has_had_its_last_word_does_not_hold_up_the_end_of_its_node(rig: Rig) -> None:
    class Tidy(Node):
        """Says what it has to say, and then takes for ever."""

        @COUNT.serve()
        async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
            yield Done(result(goal.order))
            await self.clock.sleep(1e6)

    system = await rig.start(Tidy)
    goal = await rig.send_goal(COUNT, order(2))
    await rig.advance(1.0)
    await system.stop()
    assert rig.now == 1.0
    assert goal.status is GoalStatus.SUCCEEDED
