"""Call cycles that no single process can see: they are found by asking from process to process, and end in CallCycle at once."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from actors import CallTimeout, Child, Done, GoalRejected, Node, Reject, Service, Steps
from actors.errors import CallCycle
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Trigger
from actors.transport.format.extensions import Extension, Waiting, write_extension
from tests.actors.transport.hosts import Hosts
from tests.stage import COUNT, WORDS, order, result, word

pytestmark = pytest.mark.virtual

FIRST, SECOND, THIRD, FOURTH = (Service(Trigger, name) for name in ("first", "second", "third", "fourth"))


def node(
    name: str, serves: Service[Any, Any], calls: Service[Any, Any], concurrent: int = 0, after: float = 0
) -> Child:
    """A node that answers with what the other service answers, or with the cycle that it is told of."""

    class Caller(Node):
        @serves.serve(concurrent=concurrent)
        async def answer(self, request: Trigger.Request) -> Trigger.Response:
            await self.clock.sleep(after)
            try:
                return await self.call(calls, Trigger.Request(), timeout=20.0)  # type: ignore[no-any-return]
            except (CallCycle, CallTimeout) as error:
                said = ",".join(error.nodes) if isinstance(error, CallCycle) else "late"
                return Trigger.Response(message=said)

    return Child(Caller, name=name)


async def test_three_processes_that_call_each_other_in_a_circle_at_the_same_time_are_told_so(hosts: Hosts) -> None:
    a = await hosts.start(node("a", FIRST, SECOND))
    b = await hosts.start(node("b", SECOND, THIRD))
    c = await hosts.start(node("c", THIRD, FIRST))

    answers = await asyncio.gather(
        a.call(FIRST, Trigger.Request(), timeout=30.0),
        b.call(SECOND, Trigger.Request(), timeout=30.0),
        c.call(THIRD, Trigger.Request(), timeout=30.0),
    )

    assert {answer.message for answer in answers} <= {"/a,/b,/c", "/b,/c,/a", "/c,/a,/b"}
    assert a.now == 0.0


@pytest.mark.parametrize("last", ["a", "b", "c", "d"])
async def test_a_circle_of_four_is_found_whichever_of_them_calls_last(hosts: Hosts, last: str) -> None:
    names, services = "abcd", (FIRST, SECOND, THIRD, FOURTH)
    rigs = [
        await hosts.start(node(name, services[k], services[(k + 1) % 4], after=1.0 if name == last else 0))
        for k, name in enumerate(names)
    ]

    answers = await asyncio.gather(
        *(rig.call(service, Trigger.Request(), timeout=30.0) for rig, service in zip(rigs, services, strict=True))
    )

    assert "late" not in {answer.message for answer in answers}
    assert {frozenset(answer.message.split(",")) for answer in answers} == {frozenset(("/a", "/b", "/c", "/d"))}
    assert rigs[0].now <= 2.0  # the one that is slow may have to answer twice


async def test_a_circle_that_is_closed_by_a_call_within_one_process_is_found(hosts: Hosts) -> None:
    """/k calls /m of its own process, when /m waits for /b elsewhere, and /b for /k."""
    first = await hosts.start(node("k", FIRST, SECOND, after=1.0), node("m", SECOND, THIRD))
    other = await hosts.start(node("b", THIRD, FIRST))

    begun = asyncio.create_task(first.call(FIRST, Trigger.Request(), timeout=30.0))
    await first.quiet()
    answers = await asyncio.gather(
        first.call(SECOND, Trigger.Request(), timeout=30.0), other.call(THIRD, Trigger.Request(), timeout=30.0)
    )

    said = {answer.message for answer in (*answers, await begun)}
    assert said <= {"/k,/m,/b", "/m,/b,/k", "/b,/k,/m"}
    assert first.now <= 2.0


async def test_a_call_to_a_node_of_its_own_process_that_waits_for_a_caller_of_this_handler_is_refused(
    hosts: Hosts,
) -> None:
    """/b waits for /k, whose handler calls /m; /m waits for /b already."""
    first = await hosts.start(node("k", FIRST, SECOND, after=1.0), node("m", SECOND, THIRD))
    other = await hosts.start(node("b", THIRD, FIRST))
    calls = [asyncio.create_task(other.call(THIRD, Trigger.Request(), timeout=30.0))]
    await other.quiet()
    calls.append(asyncio.create_task(first.call(SECOND, Trigger.Request(), timeout=30.0)))
    await other.quiet()

    said = {answer.message for answer in await asyncio.gather(*calls)}

    assert said <= {"/k,/m,/b", "/m,/b,/k", "/b,/k,/m"}
    assert first.now <= 2.0


async def test_a_call_within_one_process_that_closes_a_cycle_over_another_one_is_refused_at_once(hosts: Hosts) -> None:
    """/k serves /b, which serves /j; /m waits for /j, and /k calls /m."""
    here = await hosts.start(node("j", FIRST, SECOND), node("k", THIRD, FOURTH, after=1.0), node("m", FOURTH, FIRST))
    await hosts.start(node("b", SECOND, THIRD))
    begun = asyncio.create_task(here.call(FIRST, Trigger.Request(), timeout=30.0))
    await here.quiet()
    other = asyncio.create_task(here.call(FOURTH, Trigger.Request(), timeout=30.0))

    assert (await begun).message == "/j,/b,/k,/m"
    assert here.now == 1.0
    assert (await other).message == "/m,/j,/b,/k"  # once more, from the other end


async def test_a_handler_of_messages_that_calls_is_the_first_link_of_a_chain(hosts: Hosts) -> None:
    said: list[str] = []

    class Listener(Node):
        @WORDS.on()
        async def heard(self, message: String) -> None:
            said.append((await self.call(SECOND, Trigger.Request(), timeout=20.0)).message)

        @FIRST.serve()
        async def first(self, request: Trigger.Request) -> Trigger.Response:
            return Trigger.Response(message="free")

    rig = await hosts.start(Listener)
    await hosts.start(node("b", SECOND, FIRST))
    rig.me.publisher(WORDS).publish(word("go"))
    await rig.quiet()

    assert (said, rig.now) == (["/listener,/b"], 0.0)


async def test_two_nodes_may_call_each_other_at_the_same_time_if_one_answers_concurrently(hosts: Hosts) -> None:
    back = Service(Trigger, "back")

    class Both(Node):
        @FIRST.serve()
        async def first(self, request: Trigger.Request) -> Trigger.Response:
            return await self.call(SECOND, Trigger.Request(), timeout=20.0)

        @back.serve(concurrent=1)
        async def answer(self, request: Trigger.Request) -> Trigger.Response:
            await self.clock.sleep(0.5)
            return Trigger.Response(message="called back")

    one = await hosts.start(Both)
    other = await hosts.start(node("b", SECOND, back))

    answers = await asyncio.gather(
        one.call(FIRST, Trigger.Request(), timeout=5.0), other.call(SECOND, Trigger.Request(), timeout=5.0)
    )

    assert [answer.message for answer in answers] == ["called back", "called back"]


# Goals ---------------------------------------------------------------------------------------------------------------------


class Sender(Node):
    """Sends a goal to whoever serves count, and says how that ended."""

    @SECOND.serve()
    async def send(self, request: Trigger.Request) -> Trigger.Response:
        try:
            await self.send_goal(COUNT, order(1), timeout=20.0).send()
        except (CallCycle, GoalRejected) as error:
            return Trigger.Response(message=str(getattr(error, "nodes", error)))
        return Trigger.Response(message="accepted")


class Server(Node):
    """Serves goals, and asks for one of its own."""

    @FIRST.serve()
    async def first(self, request: Trigger.Request) -> Trigger.Response:
        return await self.call(SECOND, Trigger.Request(), timeout=20.0)

    @COUNT.serve()
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        yield Done(result(goal.order))


async def test_a_goal_to_a_node_that_waits_for_its_sender_is_refused_at_once(hosts: Hosts) -> None:
    await hosts.start(Server)
    other = await hosts.start(Sender)

    answer = await other.call(FIRST, Trigger.Request(), timeout=30.0)

    assert answer.message == "('/server', '/sender')"
    assert other.now == 0.0
    assert other.system.graph.actions["/count"].server.active == 0  # type: ignore[union-attr]
    assert (await other.call(SECOND, Trigger.Request())).message == "accepted"  # from here nobody waits


async def test_a_circle_over_the_acceptance_of_a_goal_in_a_third_process_is_found(hosts: Hosts) -> None:
    """The check of a goal asks a node which calls the node that waits for the acceptance."""

    class Careful(Node):
        @COUNT.accepts
        async def check(self, goal: Fibonacci.Goal) -> None:
            try:
                await self.call(THIRD, Trigger.Request(), timeout=20.0)
            except CallCycle as cycle:
                raise Reject(",".join(cycle.nodes)) from None
            raise Reject("nobody was in the way")

        @COUNT.serve()
        async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
            yield Done(result(goal.order))

    await hosts.start(Careful)
    sender = await hosts.start(Sender)
    await hosts.start(node("c", THIRD, SECOND))

    answer = await sender.call(SECOND, Trigger.Request(), timeout=30.0)

    assert answer.message.endswith("nobody was in the way")
    assert sender.now == 0.0


async def test_a_call_to_a_node_that_waits_for_the_acceptance_of_its_goal_elsewhere_closes_a_cycle(
    hosts: Hosts,
) -> None:
    """/k calls /sender when that waits for /careful, whose check waits for /k."""

    class Careful(Node):
        @COUNT.accepts
        async def check(self, goal: Fibonacci.Goal) -> None:
            try:
                await self.call(FIRST, Trigger.Request(), timeout=20.0)
            except CallCycle as cycle:
                raise Reject(",".join(cycle.nodes)) from None

        @COUNT.serve()
        async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
            yield Done(result(goal.order))

    here = await hosts.start(node("k", FIRST, SECOND, after=1.0), Sender)
    await hosts.start(Careful)
    begun = asyncio.create_task(here.call(FIRST, Trigger.Request(), timeout=30.0))
    await here.quiet()
    sent = asyncio.create_task(here.call(SECOND, Trigger.Request(), timeout=30.0))

    assert (await begun).message == "/k,/sender,/careful"
    assert (await sent).message == "accepted"
    assert here.now <= 2.0


async def test_the_acceptance_of_a_goal_within_one_process_is_a_link_of_the_chain(hosts: Hosts) -> None:
    class Asking(Node):
        @COUNT.accepts
        async def check(self, goal: Fibonacci.Goal) -> None:
            answer = await self.call(THIRD, Trigger.Request(), timeout=20.0)
            raise Reject(answer.message)

        @COUNT.serve()
        async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
            yield Done(result(goal.order))

    here = await hosts.start(Sender, Asking)
    await hosts.start(node("c", THIRD, SECOND))

    answer = await here.call(SECOND, Trigger.Request(), timeout=30.0)

    assert answer.message.endswith("/sender,/asking,/c")
    assert here.now == 0.0


# Questions -----------------------------------------------------------------------------------------------------------------


async def test_a_question_about_a_node_that_is_not_there_or_does_not_wait_does_nothing(hosts: Hosts) -> None:
    one = await hosts.start(node("a", FIRST, SECOND))
    other = await hosts.start(Node)
    session = hosts.ends[one].session
    waiting = Waiting(session=hosts.ends[other].session, node_id=0, name="/node")
    number = next(at for at in range(9) if f"/{session}/0/{at}/NN/" in " ".join(hosts.network.tokens))

    for payload in (
        b"RBA\x01\xff",
        b"something else",
        write_extension(Extension()),
        write_extension(
            Extension(chain=(waiting, Waiting(session=session, node_id=number, name="/a")), reason="/first")
        ),
        write_extension(
            Extension(chain=(waiting, Waiting(session=session, node_id=999, name="/gone")), reason="/gone")
        ),
    ):
        answers: list[Any] = []
        hosts.ends[other].ask(f"@robactor/0/{session}/waits", payload, b"", None, answers.append)
        await other.quiet()
        assert [answer.timed_out for answer in answers] == [False]

    call = asyncio.create_task(one.call(FIRST, Trigger.Request(), timeout=1.0))
    await one.quiet()
    assert not call.done()
    call.cancel()


async def test_forged_questions_fail_no_call(hosts: Hosts) -> None:
    """They name the caller and what it waits for, as anybody who sees the graph can."""
    one = await hosts.start(node("a", FIRST, SECOND))
    slow = await hosts.start(node("slow", SECOND, THIRD, after=1.0))
    other = await hosts.start(Node)
    sessions = hosts.ends[one].session, hosts.ends[slow].session
    tokens = " ".join(hosts.network.tokens)
    numbers = [next(n for n in range(9) if f"/{session}/0/{n}/NN/" in tokens) for session in sessions]
    a, b = (
        Waiting(session=session, node_id=number, name=name)
        for session, number, name in zip(sessions, numbers, ("/a", "/slow"), strict=True)
    )
    head = Waiting(session=sessions[0], node_id=1, name="")
    call = asyncio.create_task(one.call(FIRST, Trigger.Request(), timeout=30.0))
    await one.quiet()

    for chain in ((a, a), (a, b, a), (b, a, b, a), (head, a, a), (head, b, a), (b, a)):
        payload = write_extension(Extension(chain=chain, reason="x"))
        for session in sessions:
            hosts.ends[other].ask(f"@robactor/0/{session}/waits", payload, b"", None, lambda answer: None)
        await other.quiet()

    await hosts.start(node("c", THIRD, FOURTH))
    assert (await call).message == "late"  # of the last one, who waits for nobody


async def test_a_forged_question_about_a_node_that_waits_for_one_that_goes_on_fails_no_call(hosts: Hosts) -> None:
    one = await hosts.start(node("a", FIRST, SECOND), node("slow", SECOND, THIRD, after=1.0))
    other = await hosts.start(Node)
    session = hosts.ends[one].session
    tokens = " ".join(hosts.network.tokens)
    call = asyncio.create_task(one.call(FIRST, Trigger.Request(), timeout=30.0))
    await one.quiet()

    for number in (n for n in range(9) if f"/{session}/0/{n}/NN/" in tokens):
        a = Waiting(session=session, node_id=number, name="/a")
        payload = write_extension(Extension(chain=(a, a), reason="x"))
        hosts.ends[other].ask(f"@robactor/0/{session}/waits", payload, b"", None, lambda answer: None)
        await other.quiet()

    await hosts.start(node("c", THIRD, FOURTH))
    assert (await call).message == "late"
