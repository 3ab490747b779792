"""Actions across processes: a goal, its feedback, its result and its cancellation are those of a goal within one process."""

from __future__ import annotations

import asyncio
from random import Random
from typing import Any

import pytest

from actors import (
    Aborted,
    ActionUnavailable,
    Backoff,
    Child,
    Done,
    GoalAborted,
    GoalCanceled,
    GoalRejected,
    Node,
    Reject,
    Service,
    ServiceFailed,
    Steps,
)
from actors.actions.goals import GoalStatus
from actors.errors import CallCycle, NodeRestarting, NotRunning, WrongType
from actors.interfaces import decode, derived, encode, type_hash
from actors.interfaces.action_msgs.msg import GoalInfo, GoalStatusArray
from actors.interfaces.action_msgs.msg import GoalStatus as GoalStatusMessage
from actors.interfaces.action_msgs.srv import CancelGoal
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.std_srvs.srv import Trigger
from actors.interfaces.unique_identifier_msgs.msg import UUID
from actors.testing import Rig
from actors.transport import remote_actions
from actors.transport.format.attachments import Attachment, write_attachment
from actors.transport.format.extensions import Extension, write_extension
from actors.transport.format.names import new_session, write_type
from actors.transport.keyed.protocol import Answer, Delivery, Replied
from actors.transport.protocol import Failed
from tests.actors.transport.hosts import Hosts
from tests.facts import lacks
from tests.stage import COUNT, events, order, result, step

pytestmark = pytest.mark.virtual

GET_RESULT = Service(derived.get_result_service(Fibonacci), "count/_action/get_result")
CANCEL = Service(CancelGoal, "count/_action/cancel_goal")


class Counter(Node):
    """Counts one number a second."""

    @COUNT.accepts
    def check(self, goal: Fibonacci.Goal) -> None:
        if goal.order < 0:
            raise Reject("too few")

    @COUNT.cancels
    def let_go(self, goal: Fibonacci.Goal) -> bool:
        return goal.order != 99

    @COUNT.serve(arrivals="parallel")
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        if goal.order == 13:
            yield Aborted(result(13), "thirteen")
            return
        for number in range(goal.order):
            yield step(number)
            await self.clock.sleep(1.0)
        yield Done(result(goal.order))


def answer_of(service: Any, answers: list[Answer]) -> Any:
    (answer,) = answers
    assert isinstance(answer, Replied)
    return decode(service.type.Response, answer.payload)


async def test_a_goal_runs_in_another_process_with_its_feedback_and_result(hosts: Hosts) -> None:
    server, client = await hosts.start(Counter), await hosts.start(Node)
    states: list[GoalStatus] = []
    async with client.me.send_goal(COUNT, order(3)) as goal:
        await client.advance(0.5)
        states.append(goal.status)
        views = [view for rig in (server, client) for view in rig.system.snapshot().services if view.name == "/count"]
        feedback = [one async for one in goal]
        answer = await goal
        states.append(goal.status)

    assert (feedback, answer) == ([step(0), step(1), step(2)], result(3))
    assert states == [GoalStatus.EXECUTING, GoalStatus.SUCCEEDED]
    assert [(view.server, view.type, view.calls, view.open) for view in views] == [
        ("/counter", "example_interfaces/action/Fibonacci", 1, 1)
    ] * 2
    remote: Any = client.system.graph.actions["/count"].server
    assert repr(remote) == "<server of /count in /counter, elsewhere: 0 goals>"


async def test_a_goal_waits_for_a_server_that_is_started_later_and_several_may_run(hosts: Hosts) -> None:
    client = await hosts.start(Node)
    goals = [asyncio.create_task(client.send_goal(COUNT, order(number))) for number in (1, 2)]
    await client.advance(1.0)
    await hosts.start(Counter)
    assert [await (await goal) for goal in goals] == [result(1), result(2)]


async def test_a_rejection_says_why(hosts: Hosts) -> None:
    await hosts.start(Counter)
    client = await hosts.start(Node)
    with pytest.raises(GoalRejected) as rejected:
        await client.send_goal(COUNT, order(-1))
    assert rejected.value.reason == "too few"
    assert client.system.graph.actions["/count"].server.active == 0  # type: ignore[union-attr]


async def test_an_abort_hands_over_its_result_and_reason(hosts: Hosts) -> None:
    await hosts.start(Counter)
    client = await hosts.start(Node)
    goal = await client.send_goal(COUNT, order(13))
    with pytest.raises(GoalAborted) as aborted:
        await goal
    assert (aborted.value.result, aborted.value.reason) == (result(13), "thirteen")


async def test_a_cancellation_takes_effect_and_the_server_hears_its_reason(hosts: Hosts) -> None:
    await hosts.start(Counter)
    client = await hosts.start(Node)
    goal = await client.send_goal(COUNT, order(5))
    await client.advance(1.5)
    assert await goal.cancel("changed my mind")
    with pytest.raises(GoalCanceled) as canceled:
        await goal
    assert (canceled.value.reason, client.now) == ("changed my mind", 1.5)
    assert not await goal.cancel()


async def test_a_server_may_refuse_to_cancel(hosts: Hosts) -> None:
    await hosts.start(Counter)
    client = await hosts.start(Node)
    goal = await client.send_goal(COUNT, order(99))
    assert not await goal.cancel()
    await client.advance(1.0)
    assert goal.status is GoalStatus.EXECUTING


async def test_leaving_the_block_cancels(hosts: Hosts) -> None:
    server, client = await hosts.start(Counter), await hosts.start(Node)
    async with client.me.send_goal(COUNT, order(5)) as goal:
        await client.advance(0.5)
    assert goal.status is GoalStatus.CANCELED
    assert server.state(Counter).actions["/count"].active == 0


async def test_a_goal_whose_client_gives_up_before_the_answer_is_canceled(hosts: Hosts) -> None:
    server, client = await hosts.start(Counter), await hosts.start(Node)
    sending = asyncio.create_task(client.send_goal(COUNT, order(5)))
    for _ in range(3):
        await asyncio.sleep(0)
    sending.cancel()
    await client.quiet()
    (goal,) = server.state(Counter).actions["/count"].table.records()
    assert (goal.status, goal.reason) == (GoalStatus.CANCELED, "its client was canceled")
    assert client.system.graph.actions["/count"].server.active == 0  # type: ignore[union-attr]


async def test_a_server_process_that_is_lost_aborts_its_goals_with_a_reason_that_names_it(hosts: Hosts) -> None:
    server, client = await hosts.start(Counter), await hosts.start(Node)
    goal = await client.send_goal(COUNT, order(5))
    await client.advance(1.5)
    hosts.lose(server)
    with pytest.raises(GoalAborted) as aborted:
        await goal
    assert client.now == 1.5
    assert lacks(aborted.value.reason, "/counter lost") == []
    with pytest.raises(NotRunning, match="/counter, which served /count, has stopped"):
        await client.send_goal(COUNT, order(1))
    assert not [token for token in hosts.network.tokens if "/MS/" in token and "_action" in token]
    assert not await goal.cancel()


async def test_a_server_process_that_is_lost_before_it_answers_is_named(hosts: Hosts) -> None:
    server, client = await hosts.start(Counter), await hosts.start(Node)
    sending = asyncio.create_task(client.send_goal(COUNT, order(5)))
    await asyncio.sleep(0)
    hosts.lose(server)
    with pytest.raises(NotRunning, match="/counter, which serves /count, has ended or is lost"):
        await sending


async def test_a_node_that_is_restarted_aborts_its_goals_and_takes_new_ones(hosts: Hosts) -> None:
    server, client = await hosts.start(Child(Counter, backoff=Backoff(5.0, 5.0))), await hosts.start(Node)
    goal = await client.send_goal(COUNT, order(50))
    await client.advance(1.5)
    server.crash(Counter)
    with pytest.raises(GoalAborted, match="/counter"):
        await goal
    with pytest.raises(NodeRestarting, match=r"/counter \(incarnation 1\)"):
        await client.send_goal(COUNT, order(1))
    await server.advance(6.0)
    assert await (await client.send_goal(COUNT, order(1))) == result(1)


async def test_a_client_process_that_is_lost_leaves_its_goals_to_the_server(hosts: Hosts) -> None:
    server, client = await hosts.start(Counter), await hosts.start(Node)
    await client.send_goal(COUNT, order(3))
    hosts.lose(client)
    await server.advance(5.0)
    (goal,) = server.state(Counter).actions["/count"].table.records()
    assert goal.status is GoalStatus.SUCCEEDED


async def test_an_action_of_another_definition_is_refused_with_both_hashes(hosts: Hosts) -> None:
    client, other = await hosts.start(Node), await hosts.start(Node)
    hashed = f"RIHS01_{'0' * 64}/::,10:,:,:,,"
    kinds = {
        "send_goal": "example_interfaces::action::dds_::Fibonacci_SendGoal_",
        "get_result": "example_interfaces::action::dds_::Fibonacci_GetResult_",
        "cancel_goal": "action_msgs::srv::dds_::CancelGoal_",
    }
    shown = [
        hosts.ends[other].announce(f"@ros2_lv/0/2/90/{91 + index}/SS/%/%/counter/%count%_action%{part}/{kind}/{hashed}")
        for index, (part, kind) in enumerate(kinds.items())
    ]
    await client.quiet()
    with pytest.raises(WrongType, match=r"Fibonacci \(RIHS01_0000.*Fibonacci \(RIHS01_"):
        await client.send_goal(COUNT, order(1))
    for one in shown:
        one.close()
    await client.quiet()
    assert "/count" not in client.system.graph.actions


async def test_the_action_of_ones_own_process_wins_and_both_processes_log_the_other_one(hosts: Hosts) -> None:
    first = await hosts.start(Counter)
    second = await hosts.start(Child(Counter, name="other_counter"))
    await first.send_goal(COUNT, order(1))

    assert (first.state(Counter).actions["/count"].goals, second.state(Counter).actions["/count"].goals) == (1, 0)
    for rig, elsewhere in ((first, "/other_counter"), (second, "/counter")):
        (line,) = events(rig.logs, "two servers of one action")
        assert line.fields["elsewhere"] == elsewhere


async def test_a_client_whose_node_ends_is_no_subscriber_any_more(hosts: Hosts) -> None:
    await hosts.start(Counter)
    client = await hosts.start(Node)
    await (await client.send_goal(COUNT, order(1)))
    joined = await client.system.join(Child(Node, name="guest"))
    async with joined.node.send_goal(COUNT, order(1)) as goal:
        await goal
    before = [token for token in hosts.network.tokens if "/guest/" in token and ("/MS/" in token or "/SC/" in token)]
    await client.system.leave(joined)
    remote: Any = client.system.graph.actions["/count"].server
    assert await remote.cancel(bytes(16), "it does not exist") is False
    assert len([one for one in hosts.ends[client].subscriptions if "_action" in one.key]) == 2, "shared by all clients"
    assert len(before) == 4
    assert not [token for token in hosts.network.tokens if "/guest" in token]


class Slow(Node):
    """Takes 2 s to accept a goal; rejects one of 0."""

    @COUNT.accepts
    async def check(self, goal: Fibonacci.Goal) -> None:
        await self.clock.sleep(2.0)
        if not goal.order:
            raise Reject("nothing to do")

    @COUNT.serve(arrivals="parallel")
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        await self.clock.sleep(goal.order)
        yield Done(result(goal.order))


@pytest.mark.parametrize(("size", "status"), [(50, [GoalStatus.CANCELED]), (0, [])])
async def test_a_goal_that_is_accepted_after_the_end_of_its_node_is_canceled_and_the_node_is_shown_no_longer(
    hosts: Hosts, size: int, status: list[GoalStatus]
) -> None:
    server, client = await hosts.start(Slow), await hosts.start(Node)

    def shown() -> set[str]:
        return {token.split("/")[5] for token in hosts.network.tokens if "/guest" in token}

    joined = await client.system.join(Child(Node, name="guest"))
    sending = asyncio.create_task(joined.node.send_goal(COUNT, order(size), timeout=10.0).send())
    await client.advance(1.0)
    sending.cancel()
    await client.system.leave(joined)
    await client.quiet()
    assert shown() == {"NN", "SC"}  # what is needed to cancel the goal

    await client.advance(2.0)
    assert [goal.status for goal in server.state(Slow).actions["/count"].table.records()] == status
    assert shown() == set()


async def test_the_result_of_a_long_goal_is_not_asked_for_again_when_its_node_has_ended(hosts: Hosts) -> None:
    _, client = await hosts.start(Slow), await hosts.start(Node)
    joined = await client.system.join(Child(Node, name="guest"))
    await joined.node.send_goal(COUNT, order(8000), timeout=10.0).send()
    await client.system.leave(joined)
    await client.advance(4000.0)
    assert not [token for token in hosts.network.tokens if "/guest" in token]
    assert client.system.graph.actions["/count"].server.active == 0  # type: ignore[union-attr]


async def test_a_node_that_takes_the_name_of_one_with_an_undecided_goal_stays_when_that_is_decided(
    hosts: Hosts,
) -> None:
    _, client = await hosts.start(Slow), await hosts.start(Node)
    joined = await client.system.join(Child(Node, name="guest"))
    sending = asyncio.create_task(joined.node.send_goal(COUNT, order(5), timeout=10.0).send())
    await client.advance(1.0)
    sending.cancel()
    await client.system.leave(joined)
    again = await client.system.join(Child(Node, name="guest"))
    await client.advance(3.0)
    assert [token for token in hosts.network.tokens if "/NN/" in token and "/guest" in token]
    await client.system.leave(again)
    assert not [token for token in hosts.network.tokens if "/guest" in token]


# Between processes of this library: the result is asked for together with the acceptance ------------------------------------


OURS = [new_session(Random(seed)) for seed in (1, 2)]


async def ours(hosts: Hosts) -> tuple[Rig, Rig, list[str]]:
    """A server, a client, and the questions that the client asks from now on, those for goals a turn late if "late" is put first."""
    server, client = await hosts.start(Counter, session=OURS[0]), await hosts.start(Node, session=OURS[1])
    end, asked = hosts.ends[client], list[str]()
    ask = end.ask

    def noting(key: str, payload: bytes, attachment: bytes, timeout: float | None, done: Any) -> Any:
        part = key.split("/")[3]
        late = part == "send_goal" and "late" in asked
        asked.append(part)
        if not late:
            return ask(key, payload, attachment, timeout, done)
        asyncio.get_running_loop().call_later(0.1, ask, key, payload, attachment, timeout, done)
        return None

    end.ask = noting  # type: ignore[method-assign]
    return server, client, asked


async def test_the_result_of_a_goal_is_asked_for_at_once(hosts: Hosts) -> None:
    _, client, asked = await ours(hosts)
    sending = asyncio.create_task(client.send_goal(COUNT, order(2)))
    for _ in range(2):
        await asyncio.sleep(0)
    assert asked == ["send_goal", "get_result"], "before it is accepted"
    goal = await sending
    assert [one async for one in goal] == [step(0), step(1)]
    assert (await goal, asked) == (result(2), ["send_goal", "get_result"])


@pytest.mark.parametrize("early", [True, False])
async def test_a_goal_may_run_for_longer_than_a_request_is_remembered(hosts: Hosts, early: bool) -> None:
    """The transport forgets each request after an hour; the one for the result is sent again."""
    _, client, asked = await ours(hosts)
    client.system.graph.actions["/count"].server.asks_early = early  # type: ignore[union-attr]
    goal = await client.send_goal(COUNT, order(4000))
    assert (await goal, asked) == (result(4000), ["send_goal", "get_result", "get_result"])


async def test_a_goal_that_is_rejected_leaves_no_question_for_its_result(hosts: Hosts) -> None:
    server, client, _ = await ours(hosts)
    with pytest.raises(GoalRejected, match="too few"):
        await client.send_goal(COUNT, order(-1))
    assert (hosts.ends[client].questions, client.system.graph.actions["/count"].server.active) == ([], 0)  # type: ignore[union-attr]
    assert server.state(Counter).actions["/count"].active == 0


async def test_a_goal_whose_client_gives_up_is_canceled_and_leaves_no_question(hosts: Hosts) -> None:
    server, client, _ = await ours(hosts)
    sending = asyncio.create_task(client.send_goal(COUNT, order(5)))
    for _ in range(2):
        await asyncio.sleep(0)
    sending.cancel()
    await client.quiet()
    (goal,) = server.state(Counter).actions["/count"].table.records()
    assert (goal.status, hosts.ends[client].questions) == (GoalStatus.CANCELED, [])


async def test_a_question_for_a_result_that_overtakes_its_goal_is_asked_again(hosts: Hosts) -> None:
    _, client, asked = await ours(hosts)
    asked.append("late")
    goal = await client.send_goal(COUNT, order(1))
    assert (await goal, asked) == (result(1), ["late", "send_goal", "get_result", "get_result"])


async def test_a_result_that_overtakes_the_acceptance_waits_for_it(hosts: Hosts) -> None:
    client, other = await hosts.start(Node, session=OURS[0]), await hosts.start(Node, session=OURS[1])
    server = Server(hosts, other, session=OURS[1], get_result=encode(RESULT(status=4, result=result(1))))
    held: list[Any] = []
    server.answer_goal = held.append  # type: ignore[method-assign]
    await client.quiet()
    sending = asyncio.create_task(client.send_goal(COUNT, order(1)))
    await client.quiet()
    assert not sending.done()
    held[0].reply(ACCEPTED, b"")
    assert await (await sending) == result(1)


# By the services of ROS 2 alone ----------------------------------------------------------------------------------------------


async def test_a_client_of_ros_2_asks_for_results_and_cancels_without_reasons(hosts: Hosts) -> None:
    server, client = await hosts.start(Counter), await hosts.start(Node)
    goal = await server.send_goal(COUNT, order(5))
    other = await client.send_goal(COUNT, order(5))
    ids = [UUID(uuid=one.goal_id) for one in (goal, other)]
    waiting = [
        asyncio.create_task(client.call(GET_RESULT, GET_RESULT.type.Request(goal_id=one), timeout=99.0)) for one in ids
    ]
    unknown = await client.call(GET_RESULT, GET_RESULT.type.Request(goal_id=UUID(uuid=bytes(16))))
    answer = await client.call(CANCEL, CancelGoal.Request(goal_info=GoalInfo(goal_id=ids[0])))
    everything = await client.call(CANCEL, CancelGoal.Request())
    statuses = [(await one).status for one in waiting]
    ended = await client.call(GET_RESULT, GET_RESULT.type.Request(goal_id=ids[0]))

    assert (unknown.status, len(answer.goals_canceling), len(everything.goals_canceling)) == (0, 1, 1)
    assert (statuses, ended.status) == ([5, 5], 5)
    with pytest.raises(GoalCanceled, match="canceled by a client"):
        await other


async def test_what_is_no_request_of_a_client_of_ros2_is_answered_with_an_error(hosts: Hosts) -> None:
    await hosts.start(Counter)
    client = await hosts.start(Node)
    answers: list[Answer] = []
    for part in ("send_goal", "get_result", "cancel_goal"):
        (key,) = (one.key for one in hosts.ends[hosts.rigs[0]].servers if part in one.key)
        hosts.ends[client].ask(key, b"", write_attachment(Attachment(1, 0, bytes(16))), None, answers.append)
    await client.quiet()
    assert [type(answer).__name__ for answer in answers] == ["Replied", "Failed", "Failed"]
    assert isinstance(answers[0], Replied)
    assert not decode(derived.send_goal_service(Fibonacci).Response, answers[0].payload).accepted


async def test_a_goal_id_that_is_in_use_is_rejected_and_the_first_goal_goes_on(hosts: Hosts) -> None:
    await hosts.start(Counter)
    client = await hosts.start(Node)
    goal = await client.send_goal(COUNT, order(2))
    send: Any = Service(derived.send_goal_service(Fibonacci), "count/_action/send_goal")
    again = await client.call(send, send.type.Request(goal_id=UUID(uuid=goal.goal_id), goal=order(1)))
    assert not again.accepted
    assert await goal == result(2)


# What may go wrong ------------------------------------------------------------------------------------------------------------


class Server:
    """An action server without a bridge, whose answers the test makes."""

    attachment = b""

    def __init__(self, hosts: Hosts, at: Any, session: str = "2", **answers: bytes) -> None:
        self.end = hosts.ends[at]
        self.answers = answers
        kinds: dict[str, Any] = {
            "send_goal": derived.send_goal_service(Fibonacci),
            "get_result": derived.get_result_service(Fibonacci),
            "cancel_goal": CancelGoal,
        }
        for index, (part, kind) in enumerate(kinds.items()):
            name, hashed = f"count/_action/{part}", type_hash(kind)
            dds = write_type(kind.__ros_type__)
            self.end.serve(f"0/{name}/{dds}/{hashed}", lambda query, part=part: self.answer(part, query))
            mangled = name.replace("/", "%")
            self.end.announce(f"@ros2_lv/0/{session}/90/{91 + index}/SS/%/%/odd/%{mangled}/{dds}/{hashed}/::,10:,:,:,,")

    def answer_goal(self, query: Any) -> None:
        self.reply("send_goal", query)

    def answer(self, part: str, query: Any) -> None:
        if part == "send_goal":
            self.answer_goal(query)
        else:
            self.reply(part, query)

    def reply(self, part: str, query: Any) -> None:
        if part in self.answers:
            query.reply(self.answers[part], self.attachment)
        else:
            query.fail(b"Timeout")


ACCEPTED = encode(derived.send_goal_service(Fibonacci).Response(accepted=True))  # type: ignore[attr-defined]
RESULT: Any = derived.get_result_service(Fibonacci).Response  # type: ignore[attr-defined]


async def test_a_server_that_answers_nonsense_does_not_leave_its_clients_waiting(hosts: Hosts) -> None:
    client, other = await hosts.start(Node), await hosts.start(Node)
    server = Server(hosts, other)
    await client.quiet()
    with pytest.raises(ActionUnavailable, match="/odd, which serves /count, neither accepted nor rejected the goal"):
        await client.send_goal(COUNT, order(1))
    server.answers["send_goal"] = b"nonsense"
    with pytest.raises(ServiceFailed, match=r"/odd failed .* its answer to the goal cannot be read"):
        await client.send_goal(COUNT, order(1))
    server.answers["send_goal"] = ACCEPTED
    reasons: list[str] = []
    for answer in (b"nonsense", encode(RESULT(status=0)), encode(RESULT(status=77))):
        server.answers["get_result"] = answer
        outcome = await (await client.send_goal(COUNT, order(1))).ended()
        reasons.append(outcome.reason)
    server.answers["get_result"] = encode(RESULT(status=5))
    canceled = await (await client.send_goal(COUNT, order(1))).ended()

    assert reasons == [
        "/odd ended while the goal ran",
        "/odd does not know the goal any more",
        "/odd does not know the goal any more",
    ]
    assert (canceled.status, canceled.reason) == (GoalStatus.CANCELED, "")


async def test_requests_about_goals_that_come_faster_than_they_are_answered_are_refused_beyond_a_limit(
    hosts: Hosts, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("actors.transport.local_services._MOST_OPEN", 2)
    server, client = await hosts.start(Counter), await hosts.start(Node)
    goals = [await client.send_goal(COUNT, order(50)) for _ in range(2)]
    with pytest.raises(ServiceFailed, match="request dropped: 2 requests of other processes to /count/_action/send"):
        await client.send_goal(COUNT, order(1))

    goal_id = UUID(uuid=goals[0].goal_id)
    asking = encode(GET_RESULT.type.Request(goal_id=goal_id))
    canceling = encode(CancelGoal.Request(goal_info=GoalInfo(goal_id=goal_id)))
    results, cancels = list[Answer](), list[Answer]()
    for _ in range(3):
        for part, payload, answers in (("get_result", asking, results), ("cancel_goal", canceling, cancels)):
            (key,) = (one.key for one in hosts.ends[server].servers if part in one.key)
            attachment = write_attachment(Attachment(1, 0, bytes(16), write_extension(Extension(reason="enough"))))
            hosts.ends[client].ask(key, payload, attachment, None, answers.append)
    await client.quiet()
    assert [type(answer) for answer in cancels].count(Failed) == 1
    assert [type(answer) for answer in results].count(Failed) == 2  # one more waits for the client itself
    assert await (await client.send_goal(COUNT, order(1))) == result(1)


async def test_a_rejection_whose_reason_cannot_be_read_is_one_without_a_reason(hosts: Hosts) -> None:
    client, other = await hosts.start(Node), await hosts.start(Node)
    server = Server(hosts, other, send_goal=encode(derived.send_goal_service(Fibonacci).Response(accepted=False)))  # type: ignore[attr-defined]
    server.attachment = write_attachment(Attachment(1, 0, bytes(16))) + b"RBA\x01\xff"
    await client.quiet()
    with pytest.raises(GoalRejected, match="/count"):
        await client.send_goal(COUNT, order(1))


async def test_status_and_feedback_that_are_none_or_of_other_goals_are_ignored(hosts: Hosts) -> None:
    server, client = await hosts.start(Counter), await hosts.start(Node)
    goal = await client.send_goal(COUNT, order(3))
    for part in ("status", "feedback"):
        (key,) = (one.key for one in hosts.ends[client].subscriptions if part in one.key)
        outlet = hosts.ends[server].outlet(key, Delivery())
        outlet.put(b"nonsense", b"")
        message = (
            encode(GoalStatusArray(status_list=(GoalStatusMessage(status=2),)))
            if part == "status"
            else encode(derived.feedback_message(Fibonacci)())
        )
        outlet.put(message, b"")
    assert await goal == result(3)
    assert goal.feedback_count == 3


ENDED = tuple(
    GoalStatusMessage(goal_info=GoalInfo(goal_id=UUID(uuid=number.to_bytes(16, "big"))), status=4)
    for number in range(500)
)


@pytest.mark.parametrize(
    ("shape", "status"),
    [
        (lambda usual: usual, GoalStatus.CANCELING),
        (lambda usual: b"\0\0\0\0" + usual[4:], GoalStatus.EXECUTING),  # another byte order: nonsense
        (lambda usual: usual[:4] + b"\xff\xff\xff\xff" + usual[8:], GoalStatus.EXECUTING),  # longer than it is
        (lambda usual: usual[:8] + bytes(8) + usual[8:], GoalStatus.EXECUTING),  # the id stands where none is
        (lambda usual: usual[:-1], GoalStatus.EXECUTING),
    ],
)
@pytest.mark.parametrize("last", [True, False])
async def test_a_list_of_many_goals_is_searched_for_ones_own(
    hosts: Hosts, shape: Any, status: GoalStatus, last: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    decoded: list[Any] = []
    plain = remote_actions.decode
    monkeypatch.setattr(remote_actions, "decode", lambda kind, data: decoded.append(kind) or plain(kind, data))
    server, client = await hosts.start(Counter), await hosts.start(Node)
    goal = await client.send_goal(COUNT, order(3))
    await client.quiet()
    decoded.clear()
    (key,) = (one.key for one in hosts.ends[client].subscriptions if "status" in one.key)
    own = GoalStatusMessage(goal_info=GoalInfo(goal_id=UUID(uuid=goal.goal_id)), status=3)
    attachment = write_attachment(Attachment(1, 0, bytes(16)))
    outlet = hosts.ends[server].outlet(key, Delivery())
    outlet.put(shape(encode(GoalStatusArray(status_list=(*ENDED, own) if last else (own, *ENDED)))), attachment)
    outlet.put(encode(GoalStatusArray(status_list=ENDED)), attachment)  # it is not there: nothing is known of it
    await client.quiet()
    assert goal.status is status
    assert decoded.count(GoalStatusArray) == (0 if status is GoalStatus.CANCELING else 1)
    assert await goal == result(3)


async def test_a_server_that_neither_accepts_nor_rejects_is_named(hosts: Hosts) -> None:
    class Slow(Node):
        @COUNT.accepts
        async def check(self, goal: Fibonacci.Goal) -> None:
            await self.clock.sleep(60.0)

        @COUNT.serve()
        async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
            yield Done(result(0))

    await hosts.start(Slow)
    client = await hosts.start(Node)
    with pytest.raises(
        ActionUnavailable, match="/slow, which serves /count, neither accepted nor rejected the goal within 2 s"
    ):
        await client.send_goal(COUNT, order(1), timeout=2.0)


async def test_a_client_that_gives_up_on_a_goal_that_is_rejected_later_leaves_nothing_behind(hosts: Hosts) -> None:
    await hosts.start(Counter)
    client = await hosts.start(Node)
    sending = asyncio.create_task(client.send_goal(COUNT, order(-1)))
    for _ in range(3):
        await asyncio.sleep(0)
    sending.cancel()
    await client.quiet()
    assert client.system.graph.actions["/count"].server.active == 0  # type: ignore[union-attr]


async def test_a_client_that_gives_up_while_it_cancels_drops_the_answer(hosts: Hosts) -> None:
    await hosts.start(Counter)
    client = await hosts.start(Node)
    goal = await client.send_goal(COUNT, order(5))
    canceling = asyncio.create_task(goal.cancel())
    await asyncio.sleep(0)
    canceling.cancel()
    await client.quiet()
    assert goal.status is GoalStatus.CANCELED


async def test_a_node_that_waits_for_the_acceptance_of_its_goal_elsewhere_is_part_of_a_cycle(hosts: Hosts) -> None:
    ask = Service(Trigger, "ask")
    said: list[str] = []

    class Client(Node):
        @ask.serve()
        async def asked(self, request: Trigger.Request) -> Trigger.Response:
            await self.send_goal(COUNT, order(1)).send()
            return Trigger.Response()

    class Server(Node):
        @COUNT.accepts
        async def check(self, goal: Fibonacci.Goal) -> None:
            try:
                await self.call(ask, Trigger.Request())
            except CallCycle as cycle:
                said.append(str(cycle.nodes))

        @COUNT.serve()
        async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
            yield Done(result(0))

    client, _ = await hosts.start(Client), await hosts.start(Server)
    await client.call(ask, Trigger.Request())
    assert (said, client.now) == (["('/client', '/server')"], 0.0)


async def test_a_goal_whose_result_is_gone_has_ended_as_its_status_says_and_gives_no_result(hosts: Hosts) -> None:
    """The question for the result is held up until the server has thrown it away, as on a link that was cut."""

    class Forgetful(Node):
        @COUNT.serve(result_timeout=1.0)
        async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
            yield Done(result(goal.order))

    await hosts.start(Forgetful)
    client = await hosts.start(Node)
    end, held = hosts.ends[client], []
    ask = end.ask

    def slowly(key: str, payload: bytes, attachment: bytes, timeout: float | None, done: Any) -> Any:
        if "/get_result/" not in key:
            return ask(key, payload, attachment, timeout, done)
        held.append(lambda: ask(key, payload, attachment, timeout, done))
        return None

    end.ask = slowly  # type: ignore[method-assign]
    goal = await client.send_goal(COUNT, order(3))
    await client.advance(5.0)
    assert goal.status is GoalStatus.EXECUTING
    held[0]()
    outcome = await goal.ended()

    reason = "the goal has ended as SUCCEEDED, but /forgetful has not kept its result"
    assert (outcome.status, outcome.result, outcome.reason) == (GoalStatus.SUCCEEDED, None, reason)
    with pytest.raises(GoalAborted) as gone:
        await goal
    assert gone.value.reason == reason
