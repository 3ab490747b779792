"""Services, as callers and servers meet them: one answer or one error for every call, never silence."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from actors import (
    ActionUnavailable,
    Backoff,
    CallTimeout,
    Child,
    DeclarationError,
    Node,
    Service,
    ServiceFailed,
    ServiceUnavailable,
    StartFailed,
    Stop,
    Supervisor,
    Topic,
    every,
    one_for_all,
    publishes,
    temporary,
    transient,
)
from actors.errors import CallCycle, NodeRestarting, NotRunning, WrongType
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int32
from actors.interfaces.std_srvs.srv import Trigger
from actors.supervision.policy import Restart
from actors.testing import Rig
from tests.facts import lacks
from tests.stage import ADD, COUNT, NUMBERS, events, number, order, total, two

RING = [Service(AddTwoInts, f"ring_{index}") for index in range(3)]
PING = Service(Trigger, "ping")


class Adder(Node):
    """Adds, after as many seconds as `a` says if it is below ten."""

    @ADD.serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        if request.b == 13:
            raise ValueError("13 brings bad luck")
        if request.b == 7:
            await self.clock.sleep(request.a)
        return total(request.a + request.b)


class Crowd(Node):
    """Adds for three callers at once, a second for each."""

    def __init__(self) -> None:
        self.now = self.most = 0

    @ADD.serve(concurrent=3)
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        self.now += 1
        self.most = max(self.most, self.now)
        await self.clock.sleep(1.0)
        self.now -= 1
        return total(request.a + request.b)


# -- answers ---------------------------------------------------------------------------------------------------------


async def test_a_hundred_callers_at_once_get_each_their_own_sum(rig: Rig) -> None:
    await rig.start(Adder)
    answers = await asyncio.gather(*(rig.call(ADD, two(value, 1000)) for value in range(100)))
    assert [answer.sum for answer in answers] == [value + 1000 for value in range(100)]


async def test_and_so_do_the_callers_of_a_concurrent_server(rig: Rig) -> None:
    await rig.start(Crowd)
    answers = await asyncio.gather(*(rig.call(ADD, two(value, 1), timeout=60.0) for value in range(100)))
    assert [answer.sum for answer in answers] == [value + 1 for value in range(100)]
    assert rig.node(Crowd).most == 3
    assert rig.now == 34.0


async def test_a_node_that_awaits_an_answer_goes_on_ticking_when_its_handler_is_concurrent(rig: Rig) -> None:
    class Caller(Node):
        def __init__(self) -> None:
            self.ticks = 0
            self.answered: list[tuple[float, int]] = []

        @every(hz=10)
        async def tick(self) -> None:
            self.ticks += 1

        @NUMBERS.on(concurrent=2)
        async def ask(self, message: Int32) -> None:
            reply = await self.call(ADD, two(1, 7), timeout=5.0)
            self.answered.append((self.clock.now(), reply.sum))

    await rig.start(Adder, Caller)
    rig.publish(NUMBERS, number(0))
    await rig.advance(1.0)
    assert rig.node(Caller).answered == [(1.0, 8)]
    assert rig.node(Caller).ticks == 10


async def test_requests_that_wait_are_counted_for_the_service_they_are_for(rig: Rig) -> None:
    class Both(Adder):
        @PING.serve()
        async def ping(self, request: Trigger.Request) -> Trigger.Response:
            return Trigger.Response(success=True)

    await rig.start(Both)
    calls = [asyncio.create_task(rig.call(ADD, two(1, 7), timeout=9.0)) for _ in range(2)]
    calls.append(asyncio.create_task(rig.call(ADD, two(1, 2), timeout=9.0)))
    ping = asyncio.create_task(rig.call(PING, Trigger.Request(), timeout=9.0))
    await rig.advance(0.5)
    views = {view.name: (view.calls, view.open) for view in rig.system.snapshot().services}
    assert views == {"/add": (3, 3), "/ping": (1, 1)}
    assert [answer.sum for answer in await asyncio.gather(*calls)] == [8, 8, 3]
    assert (await ping).success
    views = {view.name: (view.calls, view.open) for view in rig.system.snapshot().services}
    assert views == {"/add": (3, 0), "/ping": (1, 0)}


async def test_after_a_call_the_answer_is_there_after_a_publish_nothing_is(rig: Rig) -> None:
    class Doubler(Adder):
        def __init__(self) -> None:
            self.seen: list[int] = []

        @NUMBERS.on()
        async def take(self, message: Int32) -> None:
            self.seen.append(message.data)

    await rig.start(Doubler)
    rig.publish(NUMBERS, number(1))
    assert rig.node(Doubler).seen == []
    assert await rig.call(ADD, two(1, 2)) == total(3)
    assert rig.node(Doubler).seen == [1]


async def test_overlapping_calls_of_one_client_do_not_share_their_requests(rig: Rig) -> None:
    await rig.start(Crowd)
    first, second = await asyncio.gather(rig.call(ADD, two(1, 2), timeout=2.0), rig.call(ADD, two(3, 4), timeout=2.0))
    assert (first.sum, second.sum) == (3, 7)


async def test_a_request_without_fields_needs_no_words(rig: Rig) -> None:
    class Pinged(Node):
        @PING.serve()
        async def ping(self, request: Trigger.Request) -> Trigger.Response:
            return Trigger.Response(success=True, message=f"{self.name} is here")

    await rig.start(Pinged)
    assert (await rig.call(PING, Trigger.Request())).message == "pinged is here"


async def test_a_server_can_be_added_while_its_node_runs(rig: Rig) -> None:
    class Late(Node):
        async def on_start(self) -> None:
            self.serve(ADD, self.add)

        async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            return total(request.a * request.b)

    await rig.start(Late)
    assert (await rig.call(ADD, two(3, 4))).sum == 12
    entry = rig.system.graph.service("/add")
    assert repr(entry.server).startswith("<server of /add in /late: 1 calls, 0 open>")


# -- missing and slow servers ----------------------------------------------------------------------------------------


async def test_a_service_that_nobody_serves_is_unavailable_when_the_timeout_is_over(rig: Rig) -> None:
    await rig.start(Node)
    with pytest.raises(ServiceUnavailable, match=r"nobody serves /add \[AddTwoInts\] after 5 s: start its node"):
        await rig.call(ADD, two(1, 2), timeout=5.0)
    assert rig.now == 5.0


async def test_a_server_that_appears_in_time_answers(rig: Rig) -> None:
    await rig.start(Node)
    call = asyncio.create_task(rig.call(ADD, two(1, 2), timeout=5.0))
    await rig.advance(2.0)
    assert rig.system.supervisor is not None
    await rig.system.supervisor.start_child(Child(Adder))
    assert (await call).sum == 3
    assert rig.now == 2.0


async def test_the_wait_for_the_server_counts_into_the_timeout(rig: Rig) -> None:
    await rig.start(Node)
    call = asyncio.create_task(rig.call(ADD, two(4, 7), timeout=5.0))
    await rig.advance(2.0)
    assert rig.system.supervisor is not None
    await rig.system.supervisor.start_child(Child(Adder))
    with pytest.raises(CallTimeout):
        await call
    assert rig.now == pytest.approx(5.0)


async def test_waiting_in_slices_with_a_line_each_and_an_end(rig: Rig) -> None:
    class Patient(Node):
        """N-03's way to wait: one line a second, and not for ever."""

        outcome = ""

        async def on_start(self) -> None:
            self.create_task(self.main())

        async def main(self) -> None:
            for _ in range(3):
                try:
                    await self.wait_for(ADD, COUNT, timeout=1.0)
                except TimeoutError as error:
                    self.outcome = str(error)
                    self.log.info("Waiting for battery service...")
                else:
                    self.outcome = "there"
                    return

    await rig.start(Child(Patient))
    await rig.advance(10.0)
    assert [record.time for record in events(rig.logs, "Waiting for")] == [1.0, 2.0, 3.0]
    assert all(part in rig.node(Patient).outcome for part in ("/add", "1 s", "start its node", "namespace"))
    await rig.system.supervisor.start_child(Child(Adder))  # type: ignore[union-attr]
    await rig.me.wait_for(ADD, timeout=1.0)
    with pytest.raises(ActionUnavailable, match="nobody serves /count after 1 s"):
        await rig.me.wait_for(ADD, COUNT, timeout=1.0)


async def test_a_late_answer_is_dropped_and_the_next_call_gets_its_own(rig: Rig) -> None:
    await rig.start(Adder)
    with pytest.raises(CallTimeout, match="/adder did not answer /add in time"):
        await rig.call(ADD, two(6, 7), timeout=5.0)
    assert rig.now == 5.0
    assert (await rig.call(ADD, two(20, 22), timeout=5.0)).sum == 42
    assert rig.now == 6.0


async def test_a_caller_that_is_canceled_is_forgotten_its_request_is_not_worked_for_nobody(rig: Rig) -> None:
    class Counting(Node):
        calls = 0

        @ADD.serve()
        async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            self.calls += 1
            await self.clock.sleep(1.0)
            return total(request.a)

    await rig.start(Counting)
    calls = [asyncio.create_task(rig.call(ADD, two(value, 0), timeout=9.0)) for value in range(4)]
    await rig.advance(0.5)
    for call in (calls[0], calls[2]):
        call.cancel()
    await rig.advance(9.0)
    assert rig.node(Counting).calls == 3
    assert [call.result().sum for call in (calls[1], calls[3])] == [1, 3]
    assert rig.system.graph.service("/add").server.open() == []  # type: ignore[union-attr]


# -- servers that fail -----------------------------------------------------------------------------------------------


async def test_an_exception_in_the_handler_is_that_callers_the_server_lives(rig: Rig) -> None:
    await rig.start(Adder)
    with pytest.raises(
        ServiceFailed, match="/adder failed to serve the request: ValueError: 13 brings bad luck"
    ) as caught:
        await rig.call(ADD, two(1, 13))
    assert (caught.value.node, caught.value.type, caught.value.text) == ("/adder", "ValueError", "13 brings bad luck")
    assert (await rig.call(ADD, two(1, 2))).sum == 3
    assert rig.incarnation(Adder) == 1
    (line,) = events(rig.logs, "service handler failed")
    assert (line.fields["handler"], line.fields["error"]) == ("Adder.add", "ValueError: 13 brings bad luck")
    assert line.fields["at"].endswith("in Adder.add")
    assert isinstance(caught.value.__cause__, ValueError)


async def test_an_answer_or_a_request_of_the_wrong_type_is_named(rig: Rig) -> None:
    class Confused(Node):
        @ADD.serve()
        async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            return number(1)  # type: ignore[return-value]

    await rig.start(Confused)
    with pytest.raises(ServiceFailed, match=r"WrongType: Confused\.add answered Int32, not AddTwoInts_Response"):
        await rig.call(ADD, two(1, 2))
    with pytest.raises(WrongType, match="/add takes AddTwoInts_Request, not Int32 "):
        await rig.call(ADD, number(1))  # type: ignore[misc]


async def test_a_handler_that_awaits_something_canceled_fails_that_call_only(rig: Rig) -> None:
    class Careless(Node):
        @ADD.serve()
        async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            if request.a:
                task = asyncio.ensure_future(asyncio.sleep(1.0))
                task.cancel()
                await task
            return total(0)

    await rig.start(Careless)
    with pytest.raises(
        ServiceFailed, match=r"Careless\.add awaited something that was canceled, and did not handle it"
    ):
        await rig.call(ADD, two(1, 2))
    assert (await rig.call(ADD, two(0, 0))).sum == 0
    assert rig.incarnation(Careless) == 1


async def test_a_server_that_is_killed_with_the_request_tells_the_caller_at_once(rig: Rig) -> None:
    children = [Child(Node, name="head"), Child(Adder, stop=0.5)]
    await rig.start(Supervisor("system", strategy=one_for_all, children=children))
    served = asyncio.create_task(rig.call(ADD, two(5, 7), timeout=60.0))
    queued = asyncio.create_task(rig.call(ADD, two(1, 2), timeout=60.0))
    await rig.quiet()
    rig.crash("head")
    await asyncio.wait([served, queued])
    assert rig.now == 0.5
    for call in (served, queued):
        with pytest.raises(
            NodeRestarting, match=r"/adder \(incarnation 1\) has ended and is being restarted"
        ) as caught:
            await call
        assert (caught.value.node, caught.value.incarnation) == ("/adder", 1)
    await rig.settled()
    assert (await rig.call(ADD, two(1, 2))).sum == 3
    assert rig.incarnation("adder") == 2


async def test_a_call_to_a_node_that_is_being_restarted_fails_at_once(rig: Rig) -> None:
    await rig.start(Child(Crowd, backoff=Backoff(10.0, 10.0)))
    open_calls = [asyncio.create_task(rig.call(ADD, two(1, 2), timeout=60.0)) for _ in range(5)]
    await rig.quiet()
    server = rig.system.graph.service("/add").server
    assert repr(server) == "<server of /add in /crowd: 5 calls, 5 open>"
    rig.crash(Crowd)
    await rig.quiet()
    for call in open_calls:  # three at work, two waiting
        with pytest.raises(NodeRestarting):
            await call
    assert repr(server) == "<server of /add in /crowd: 5 calls, 0 open>"
    with pytest.raises(NodeRestarting):
        await rig.call(ADD, two(1, 2))
    assert rig.now == 0.0
    await rig.settled()
    back = rig.now
    again = await asyncio.gather(*(rig.call(ADD, two(value, 2), timeout=2.0) for value in range(3)))
    assert [answer.sum for answer in again] == [2, 3, 4]
    assert rig.now - back == pytest.approx(1.0)  # what waited before the end takes no place among the three


@pytest.mark.parametrize("concurrent", [0, 2])
async def test_requests_that_come_in_the_start_phase_are_answered_when_it_is_over(rig: Rig, concurrent: int) -> None:
    class Slow(Node):
        ready = False
        begun: list[float]
        order: list[int]

        async def on_start(self) -> None:
            self.begun, self.order = [], []
            await self.clock.sleep(3.0)
            self.ready = True

        @ADD.serve(concurrent=concurrent)
        async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            assert self.ready
            self.begun.append(self.clock.now())
            self.order.append(request.a)
            await self.clock.sleep(1.0)
            return total(request.a + request.b)

        @NUMBERS.on(concurrent=concurrent)
        async def take(self, message: Int32) -> None:
            assert self.ready

    await rig.start(Node)
    supervisor = rig.system.supervisor
    assert supervisor is not None
    starting = asyncio.create_task(supervisor.start_child(Child(Slow)))
    await rig.quiet()
    rig.publish(NUMBERS, number(1))
    calls = [asyncio.create_task(rig.call(ADD, two(value, 0), timeout=20.0)) for value in range(5)]
    await starting
    assert rig.now == 3.0
    assert [(await call).sum for call in calls] == [0, 1, 2, 3, 4]
    assert rig.node(Slow).begun == ([3.0, 3.0, 4.0, 4.0, 5.0] if concurrent else [3.0, 4.0, 5.0, 6.0, 7.0])
    assert rig.node(Slow).order == [0, 1, 2, 3, 4]
    assert rig.incarnation(Slow) == 1


@pytest.mark.parametrize("how", ["stops itself", "raises Stop", "is terminated", "fails for good"])
async def test_a_call_to_a_node_that_has_stopped_for_good_fails_at_once(rig: Rig, how: str) -> None:
    restart: Restart = temporary if how == "fails for good" else transient
    await rig.start(Supervisor("system", children=[Child(Adder, restart=restart), Child(Node, name="other")]))
    await rig.me.call(ADD, two(1, 2))
    assert rig.system.supervisor is not None
    if how == "stops itself":
        rig.node(Adder).stop("done")
    elif how == "raises Stop":
        rig.crash(Adder, Stop("done"))
    elif how == "is terminated":
        await rig.system.supervisor.terminate_child("adder")
    else:
        rig.crash(Adder)
    await rig.settled()
    assert rig.state("adder").state == "stopped"
    with pytest.raises(NotRunning, match="/adder, which served /add, has stopped"):
        await rig.call(ADD, two(1, 2))
    assert rig.now == 0.0
    assert rig.system.graph.service("/add").server is None


async def test_a_client_that_asks_a_stopped_server_again_and_again_lets_the_others_run(rig: Rig) -> None:
    await rig.start(Child(Adder, restart=transient))
    await rig.me.call(ADD, two(1, 2))
    rig.node(Adder).stop("done")
    await rig.settled()
    others: list[str] = []
    asyncio.get_running_loop().call_soon(others.append, "signals, timers, messages")
    for _ in range(1000):
        with pytest.raises(NotRunning):
            await rig.me.call(ADD, two(1, 2))
        if others:
            break
    assert others and rig.now == 0.0


async def test_a_node_that_was_terminated_and_is_started_again_serves_again(rig: Rig) -> None:
    rig.expect_failure(DeclarationError)
    await rig.start(Adder)
    supervisor = rig.system.supervisor
    assert supervisor is not None
    await supervisor.terminate_child("adder")
    await supervisor.restart_child("adder")
    assert (await rig.call(ADD, two(1, 2))).sum == 3
    with pytest.raises(StartFailed, match="would be the second node named /adder"):
        await supervisor.start_child(Child(Adder, name="twin", remap={"__node": "adder"}))


async def test_a_call_that_is_open_when_the_system_stops_hears_that_its_server_has_stopped(rig: Rig) -> None:
    await rig.start(Adder)
    served = asyncio.create_task(rig.call(ADD, two(3, 7), timeout=60.0))
    queued = asyncio.create_task(rig.call(ADD, two(1, 2), timeout=60.0))
    caller = asyncio.create_task(rig.system.stop("enough"))
    await rig.advance(1.0)
    assert (await served).sum == 10
    with pytest.raises(NotRunning, match="/adder has stopped: enough"):
        await queued
    await caller


async def test_on_error_may_let_a_failed_request_end_the_node_and_is_asked_once(rig: Rig) -> None:
    rig.expect_failure(ValueError)

    class Strict(Adder):
        asked: list[tuple[str, str]] = []

        def on_error(self, error: Exception, handler: str) -> Any:
            self.asked.append((type(error).__name__, handler))
            return "fail"

    await rig.start(Strict)
    with pytest.raises(ServiceFailed, match="13 brings bad luck"):
        await rig.call(ADD, two(1, 13))
    await rig.settled()
    assert rig.incarnation(Strict) == 2
    assert Strict.asked == [("ValueError", "Strict.add")]


async def test_an_on_error_that_fails_itself_ends_the_node_and_leaves_no_caller_waiting(rig: Rig) -> None:
    rig.expect_failure(LookupError)

    class Broken(Adder):
        def on_error(self, error: Exception, handler: str) -> Any:
            raise LookupError("no verdict")

    await rig.start(Broken)
    with pytest.raises(ServiceFailed, match="13 brings bad luck"):
        await rig.call(ADD, two(1, 13))
    await rig.settled()
    assert rig.incarnation(Broken) == 2
    assert "LookupError: no verdict" in rig.state(Broken).restarts[0][1]


async def test_a_service_handler_may_raise_Stop_to_end_its_node(rig: Rig) -> None:
    class Mortal(Node):
        @ADD.serve()
        async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            raise Stop("asked to by a caller")

    await rig.start(Child(Mortal, restart=transient))
    with pytest.raises(ServiceFailed, match="Stop: asked to by a caller"):
        await rig.call(ADD, two(1, 2))
    await rig.settled()
    assert rig.state(Mortal).state == "stopped"


# -- who may serve ---------------------------------------------------------------------------------------------------


async def test_a_second_server_is_refused_and_both_are_named(rig: Rig) -> None:
    with pytest.raises(
        StartFailed,
        match="/second would be the second server of service /add, which /first serves already: give one of them another name",
    ):
        await rig.start(Child(Adder, name="first"), Child(Adder, name="second"))
    await rig.start(Child(Adder, name="first"), Child(Adder, name="second", namespace="/there"))
    assert (await rig.call(ADD, two(1, 2))).sum == 3


ADD_AS_TRIGGER = Service(Trigger, "add")


class Trickster(Node):
    """Serves another type under the name of the adder's service."""

    @ADD_AS_TRIGGER.serve()
    async def trick(self, request: Trigger.Request) -> Trigger.Response:
        return Trigger.Response(success=True)


async def test_a_second_server_of_another_type_is_refused_with_both_types(rig: Rig) -> None:
    with pytest.raises(
        StartFailed,
        match="which /adder serves already as example_interfaces/srv/AddTwoInts, not as std_srvs/srv/Trigger",
    ):
        await rig.start(Adder, Trickster)


async def test_who_asks_for_another_type_than_is_served_hears_both_and_the_server_hears_nothing(rig: Rig) -> None:
    await rig.start(Adder)
    with pytest.raises(
        WrongType,
        match=r"/add is served by /adder as example_interfaces/srv/AddTwoInts, and asked by .* as std_srvs/srv/Trigger: give",
    ):
        await rig.call(ADD_AS_TRIGGER, Trigger.Request())
    assert (await rig.call(ADD, two(1, 2))).sum == 3


async def test_the_type_counts_again_when_another_node_has_taken_over_the_name(rig: Rig) -> None:
    await rig.start(Child(Adder, name="first"))
    assert (await rig.call(ADD, two(1, 2))).sum == 3
    supervisor = rig.system.supervisor
    assert supervisor is not None
    await supervisor.replace("first", Trickster)
    with pytest.raises(WrongType, match="as std_srvs/srv/Trigger, and asked by"):
        await rig.call(ADD, two(1, 2))
    assert (await rig.call(ADD_AS_TRIGGER, Trigger.Request())).success


async def test_a_node_that_is_replaced_by_one_without_the_service_frees_its_name(rig: Rig) -> None:
    class Idle(Node):
        pass

    await rig.start(Child(Adder, name="first"))
    supervisor = rig.system.supervisor
    assert supervisor is not None
    await supervisor.replace("first", Idle)
    with pytest.raises(NotRunning):
        await rig.call(ADD, two(1, 2))
    await supervisor.start_child(Child(Adder, name="second"))
    rig.crash("first")
    await rig.settled()
    assert (await rig.call(ADD, two(1, 2))).sum == 3


# -- cycles ----------------------------------------------------------------------------------------------------------


class Link(Node):
    """Answers by asking the next one in the ring."""

    def __init__(self, index: int, length: int) -> None:
        self.ask = RING[(index + 1) % length]
        self.mine = RING[index]

    async def on_start(self) -> None:
        self.serve(self.mine, self.forward)

    async def forward(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return await self.call(self.ask, request, timeout=100.0)


@pytest.mark.parametrize("length", [1, 2, 3])
async def test_a_cycle_of_calls_is_refused_at_once_and_named(rig: Rig, length: int) -> None:
    await rig.start(
        Supervisor("ring", children=[Child(Link, name=f"n{index}", args=(index, length)) for index in range(length)])
    )
    with pytest.raises(ServiceFailed, match="CallCycle: this call can never be answered: ") as caught:
        await rig.call(RING[0], two(1, 2), timeout=100.0)
    assert rig.now == 0.0
    names = [f"/n{(length - 1 + index) % length}" for index in range(length)]
    assert " waits for ".join([*names, names[0]]) in str(caught.value)


async def test_two_handlers_that_call_each_other_at_the_same_time_are_a_cycle_too(rig: Rig) -> None:
    class Peer(Node):
        def __init__(self, index: int) -> None:
            self.index = index
            self.outcome: object = None

        async def on_start(self) -> None:
            self.serve(RING[self.index], self.answer)

        async def answer(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            return total(self.index)

        @NUMBERS.on()
        async def ask(self, message: Int32) -> None:
            try:
                self.outcome = (await self.call(RING[1 - self.index], two(0, 0), timeout=9.0)).sum
            except CallCycle as cycle:
                self.outcome = cycle.nodes

    await rig.start(Child(Peer, name="p0", args=(0,)), Child(Peer, name="p1", args=(1,)))
    rig.publish(NUMBERS, number(1))
    await rig.quiet()
    assert [rig.state(name).node.outcome for name in ("p0", "p1")] == [1, ("/p1", "/p0")]  # type: ignore[union-attr]


async def test_who_has_its_answer_waits_for_nobody_and_may_be_called_by_who_gave_it(rig: Rig) -> None:
    class Peer(Node):
        def __init__(self, index: int) -> None:
            self.index = index
            self.sums: list[int] = []

        async def on_start(self) -> None:
            self.serve(RING[self.index], self.answer)

        async def answer(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            return total(self.index)

        @NUMBERS.on()
        async def ask(self, message: Int32) -> None:
            if message.data == self.index:
                self.sums.append((await self.call(RING[1 - self.index], two(0, 0))).sum)

    peers = [Child(Peer, name=f"p{index}", args=(index,)) for index in range(2)]
    await rig.start(*peers)
    for index in (0, 1, 0):
        rig.publish(NUMBERS, number(index))
        await rig.settled()
    sums = [rig.state(peer.name).node.sums for peer in peers]  # type: ignore[union-attr]
    assert sums == [[1, 1], [0]]


async def test_who_has_its_answer_waits_for_nobody_also_before_its_task_has_run_again(rig: Rig) -> None:
    begin = Topic(Int32, "begin")
    sums: list[int] = []

    class Front(Node):
        @RING[0].serve()
        async def answer(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            return total(10)

        @begin.on()
        async def ask(self, message: Int32) -> None:
            sums.append((await self.call(RING[1], two(0, 0))).sum)

    class Back(Node):
        numbers = publishes(NUMBERS)

        @RING[1].serve()
        async def answer(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            self.numbers(number(1))  # its own handler has its turn next, in the same step
            return total(20)

        @NUMBERS.on()
        async def ask_back(self, message: Int32) -> None:
            sums.append((await self.call(RING[0], two(0, 0))).sum)

    await rig.start(Front, Back)
    rig.publish(begin, number(0))
    await rig.settled()
    assert sums == [20, 10]


async def test_a_call_back_into_a_caller_whose_service_is_concurrent_is_no_cycle(rig: Rig) -> None:
    class Front(Node):
        @RING[0].serve(concurrent=2)
        async def front(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            return await self.call(RING[1], request)

        @RING[2].serve()
        async def helper(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            return total(request.a + request.b)

    class Back(Node):
        @RING[1].serve()
        async def back(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            return await self.call(RING[2], request)

    await rig.start(Front, Back)
    assert (await rig.call(RING[0], two(1, 2))).sum == 3


async def test_a_node_that_calls_itself_while_it_starts_or_stops_is_told_so(rig: Rig) -> None:
    class Selfish(Adder):
        heard: list[str] = []

        async def on_start(self) -> None:
            await self.try_it()

        async def on_stop(self, reason: object) -> None:
            await self.try_it()

        async def try_it(self) -> None:
            try:
                await self.call(ADD, two(1, 2))
            except CallCycle as cycle:
                self.heard.append(str(cycle))

    await rig.start(Selfish)
    await rig.system.stop()
    (heard,) = set(Selfish.heard)
    assert lacks(heard, "/selfish concurrent=n") == []
    assert len(Selfish.heard) == 2


async def test_a_handler_that_starts_a_goal_of_its_own_node_is_told_so(rig: Rig) -> None:
    from actors import Done, Steps
    from actors.interfaces.example_interfaces.action import Fibonacci

    class Selfish(Node):
        heard = ""

        @COUNT.serve()
        async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
            yield Done(Fibonacci.Result())

        @NUMBERS.on()
        async def take(self, message: Int32) -> None:
            try:
                async with self.send_goal(COUNT, order(1)):
                    pass
            except CallCycle as cycle:
                self.heard = str(cycle)

    await rig.start(Selfish)
    rig.publish(NUMBERS, number(1))
    await rig.quiet()
    assert rig.node(Selfish).heard.startswith("this call can never be answered: /selfish waits for /selfish; ")


@pytest.mark.parametrize(("seconds", "told"), [(0.9, []), (1.5, ["a request took 1.5 s"])])
async def test_a_concurrent_service_that_takes_more_than_a_second_is_told_once_to_become_an_action(
    seconds: float, told: list[str], rig: Rig
) -> None:
    class Patient(Node):
        @ADD.serve(concurrent=2)
        async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            await self.clock.sleep(seconds)
            return AddTwoInts.Response(sum=request.a + request.b)

    await rig.start(Patient)
    for _ in range(3):
        await rig.call(ADD, AddTwoInts.Request(a=1, b=2), timeout=10.0)

    lines = [line for line in rig.logs if line.level == 30]
    assert [line.event for line in lines] == told
    assert all(line.fields["service"] == "/add" and "make it an action" in line.fields["remedy"] for line in lines)


@pytest.mark.parametrize("asked", ["ad", "/adds", "/spot1/add"])
async def test_a_service_of_nearly_that_name_is_told(rig: Rig, asked: str) -> None:
    await rig.start(Adder)
    with pytest.raises(ServiceUnavailable, match=r"check the name and namespace; did you mean '/add'\?$"):
        await rig.call(Service(AddTwoInts, asked), two(1, 2))
    with pytest.raises(ServiceUnavailable, match=r"check the name and namespace$"):
        await rig.call(Service(AddTwoInts, "something_else"), two(1, 2))
