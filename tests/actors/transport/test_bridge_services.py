"""Services across processes: a call, its errors and its limits are those of a call within one process."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from actors import Backoff, CallTimeout, Child, Done, Node, Service, ServiceFailed, ServiceUnavailable, Steps, parameter
from actors.errors import CallCycle, NodeRestarting, NotRunning, WrongType
from actors.interfaces import Message, decode, encode, load
from actors.interfaces.derived import send_goal_service
from actors.interfaces.errors import CdrError
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.lifecycle_msgs.srv import ChangeState, GetState
from actors.interfaces.rcl_interfaces.srv import GetParameters
from actors.interfaces.std_srvs.srv import SetBool, Trigger
from actors.interfaces.type_description_interfaces.srv import GetTypeDescription
from actors.testing import Rig
from actors.transport.format.attachments import Attachment, parse_attachment, write_attachment
from actors.transport.format.extensions import Extension, parse_extension, write_extension
from actors.transport.format.gids import gid_of
from actors.transport.format.replies import encode_failure, parse_reply_error
from actors.transport.keyed.protocol import Answer, Replied
from actors.transport.protocol import Failed, NoAnswer
from tests.actors.transport.hosts import Hosts
from tests.stage import ADD, COUNT, events, total, two

pytestmark = pytest.mark.virtual

ADD_KEY = "0/add/example_interfaces::srv::dds_::AddTwoInts_/RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"
FIRST, SECOND, THIRD = (Service(Trigger, name) for name in ("first", "second", "third"))


class Adder(Node):
    @ADD.serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        if request.a < 0:
            raise ValueError("too small")
        await self.clock.sleep(request.b / 10.0)
        return total(request.a + request.b)


class Parallel(Node):
    """Ends without waiting for its requests, because each has a task of its own."""

    @ADD.serve(concurrent=2)
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        await self.clock.sleep(request.b / 10.0)
        return total(request.a + request.b)


def asked(hosts: Hosts, rig: Rig, key: str, payload: bytes, attachment: bytes) -> list[Answer]:
    """What a plain client in the process of `rig` gets."""
    answers: list[Answer] = []
    hosts.ends[rig].ask(key, payload, attachment, None, answers.append)
    return answers


# Calls ---------------------------------------------------------------------------------------------------------------------


async def test_a_call_is_answered_by_the_server_of_another_process(hosts: Hosts) -> None:
    server, client = await hosts.start(Adder), await hosts.start(Node)

    assert await client.call(ADD, two(1, 2)) == total(3)
    assert client.now == 0.2
    view = next(view for view in client.system.snapshot().services if view.name == "/add")
    assert (view.server, view.type, view.calls, view.open) == ("/adder", "example_interfaces/srv/AddTwoInts", 1, 0)
    assert view.clients == ("/rig",)
    seen = next(view for view in server.system.snapshot().services if view.name == "/add")
    assert (seen.server, seen.clients) == ("/adder", ("/rig",))


async def test_a_call_waits_for_a_server_that_is_started_later(hosts: Hosts) -> None:
    client = await hosts.start(Node)
    call = asyncio.create_task(client.call(ADD, two(1, 0), timeout=9.0))
    await client.advance(1.0)
    await hosts.start(Adder)

    assert await call == total(1)


async def test_nobody_serves_it(hosts: Hosts) -> None:
    client, _ = await hosts.start(Node), await hosts.start(Node)
    with pytest.raises(ServiceUnavailable):
        await client.call(ADD, two(1, 0), timeout=1.0)


async def test_an_error_of_the_handler_reaches_the_caller_with_its_type_and_text(hosts: Hosts) -> None:
    await hosts.start(Adder)
    client = await hosts.start(Node)
    with pytest.raises(ServiceFailed) as failed:
        await client.call(ADD, two(-1, 0))

    assert (failed.value.node, failed.value.type, failed.value.text) == ("/adder", "ValueError", "too small")


async def test_a_call_that_is_late_names_the_server_and_a_late_answer_is_dropped(hosts: Hosts) -> None:
    await hosts.start(Adder)
    client = await hosts.start(Node)
    with pytest.raises(CallTimeout, match="/adder did not answer /add in time"):
        await client.call(ADD, two(1, 20), timeout=1.0)
    assert client.now == 1.0
    await client.advance(2.0)
    assert await client.call(ADD, two(1, 1)) == total(2)


async def test_a_caller_that_gives_up_closes_its_question(hosts: Hosts) -> None:
    await hosts.start(Adder)
    client = await hosts.start(Node)
    call = asyncio.create_task(client.call(ADD, two(1, 20)))
    await client.advance(0.1)
    server: Any = client.system.graph.services["/add"].server
    assert (repr(server), list(map(repr, server.open()))) == (
        "<server of /add in /adder, elsewhere: 1 open>",
        ["<call of /add in /adder>"],
    )
    call.cancel()
    await client.quiet()
    assert (hosts.ends[client].questions, len(server.open())) == ([], 0)


async def test_a_server_process_that_is_lost_ends_its_calls_with_an_error_that_names_it(hosts: Hosts) -> None:
    server, client = await hosts.start(Adder), await hosts.start(Node)
    call = asyncio.create_task(client.call(ADD, two(1, 30), timeout=9.0))
    await client.advance(1.0)
    hosts.lose(server)
    with pytest.raises(
        NotRunning,
        match="/adder, which serves /add, has ended or is lost, and has not answered",
    ):
        await call
    assert client.now == 1.0
    with pytest.raises(NotRunning, match="/adder, which served /add, has stopped"):
        await client.call(ADD, two(1, 0))


async def test_a_request_that_a_server_of_ros2_drops_is_told_as_that_while_the_server_is_there(hosts: Hosts) -> None:
    _, client = await hosts.start(Adder), await hosts.start(Node)
    call = asyncio.create_task(client.call(ADD, two(1, 30), timeout=9.0))
    await client.advance(1.0)
    hosts.ends[client].questions[0].finish(NoAnswer(timed_out=False))  # its queue is full: Zenoh ends the question

    with pytest.raises(ServiceFailed, match="/adder failed to serve the request: request dropped: /add is served, but"):
        await call
    assert client.now == 1.0


async def test_who_calls_a_node_that_is_being_restarted_is_told_so(hosts: Hosts) -> None:
    server, client = await hosts.start(Child(Parallel, backoff=Backoff(5.0, 5.0))), await hosts.start(Node)
    call = asyncio.create_task(client.call(ADD, two(1, 30), timeout=9.0))
    await client.advance(1.0)
    server.crash(Parallel)
    with pytest.raises(NodeRestarting, match=r"/parallel \(incarnation 1\)"):
        await call
    with pytest.raises(NodeRestarting, match=r"/parallel \(incarnation 1\)"):
        await client.call(ADD, two(1, 0))
    await server.advance(6.0)
    assert await client.call(ADD, two(2, 0)) == total(2)


async def test_who_calls_a_node_that_has_ended_for_good_is_told_so(hosts: Hosts) -> None:
    server, client = await hosts.start(Node), await hosts.start(Node)
    joined = await server.system.join(Child(Parallel))
    call = asyncio.create_task(client.call(ADD, two(1, 30), timeout=9.0))
    await client.advance(1.0)
    await server.system.leave(joined)
    with pytest.raises((NotRunning, NodeRestarting), match="/parallel"):
        await call
    with pytest.raises(NotRunning, match="/parallel, which served /add, has stopped"):
        await client.call(ADD, two(1, 0))


async def test_a_request_that_cannot_be_encoded_does_not_leave_its_caller(hosts: Hosts) -> None:
    switch = Service(SetBool, "switch")

    class Switch(Node):
        @switch.serve()
        async def answer(self, request: SetBool.Request) -> SetBool.Response:
            return SetBool.Response(message="\ud800")

    await hosts.start(Switch)
    client = await hosts.start(Node)
    echo = Service(GetParameters, "switch/get_parameters")
    with pytest.raises(CdrError):
        await client.call(echo, GetParameters.Request(names=("\ud800",)))
    with pytest.raises(ServiceFailed, match="/switch failed to serve the request: CdrError"):
        await client.call(switch, SetBool.Request())


async def test_a_service_of_another_definition_is_refused_with_both_hashes(hosts: Hosts) -> None:
    client, other = await hosts.start(Node), await hosts.start(Node)
    token = f"@ros2_lv/0/2/90/91/SS/%/%/adder/%add/example_interfaces::srv::dds_::AddTwoInts_/RIHS01_{'0' * 64}/::,10:,:,:,,"
    shown = hosts.ends[other].announce(token)
    await client.quiet()
    with pytest.raises(WrongType, match=r"AddTwoInts \(RIHS01_0000.*AddTwoInts \(RIHS01_e118"):
        await client.call(ADD, two(1, 2))
    shown.close()


# Two servers of one name ----------------------------------------------------------------------------------------------------


async def test_the_server_of_ones_own_process_wins_and_both_processes_log_the_other_one(hosts: Hosts) -> None:
    class Wrong(Node):
        @ADD.serve()
        async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            return total(-1)

    first = await hosts.start(Adder)
    second = await hosts.start(Wrong)

    assert (await first.call(ADD, two(1, 1)), await second.call(ADD, two(1, 1))) == (total(2), total(-1))
    for rig, here, elsewhere in ((first, "/adder", "/wrong"), (second, "/wrong", "/adder")):
        (line,) = events(rig.logs, "two servers of one service")
        assert (line.fields["here"], line.fields["elsewhere"]) == (here, elsewhere)


async def test_when_the_server_of_ones_own_process_ends_the_one_elsewhere_takes_its_place(hosts: Hosts) -> None:
    rig = await hosts.start(Node)
    joined = await rig.system.join(Child(Adder))
    await hosts.start(Child(Adder, name="other_adder"))
    await rig.system.leave(joined)

    assert await rig.call(ADD, two(1, 1)) == total(2)
    assert rig.system.graph.services["/add"].server.host == "/other_adder"  # type: ignore[union-attr]


async def test_while_the_server_of_ones_own_process_is_restarted_the_one_elsewhere_does_not_take_its_place(
    hosts: Hosts,
) -> None:
    rig = await hosts.start(Child(Adder, backoff=Backoff(5.0, 5.0)))
    rig.crash(Adder)
    await rig.quiet()
    other = await hosts.start(Child(Adder, name="other_adder"))
    with pytest.raises(NodeRestarting, match="/adder"):
        await rig.call(ADD, two(1, 1))
    hosts.lose(other)
    await rig.advance(6.0)
    assert await rig.call(ADD, two(1, 1)) == total(2)


async def test_another_node_of_a_process_takes_over_a_name_and_is_the_server_elsewhere(hosts: Hosts) -> None:
    rig, client = await hosts.start(Child(Adder, backoff=Backoff(5.0, 5.0))), await hosts.start(Node)
    rig.crash(Adder)
    await rig.quiet()
    await rig.system.join(Child(Parallel))
    await client.quiet()

    assert client.system.graph.services["/add"].server.host == "/parallel"  # type: ignore[union-attr]
    assert await client.call(ADD, two(1, 1)) == total(2)


async def test_the_next_server_elsewhere_takes_the_place_of_one_that_is_lost(hosts: Hosts) -> None:
    client = await hosts.start(Node)
    servers = [await hosts.start(Child(Adder, name=name)) for name in ("one", "two")]
    entry = client.system.graph.services["/add"]
    third = await hosts.start(Child(Adder, name="three"))
    hosts.lose(third)
    hosts.lose(servers[0])
    await client.quiet()
    after_one = entry.server.host  # type: ignore[union-attr]
    hosts.lose(servers[1])
    await client.quiet()

    assert (after_one, entry.server) == ("/two", None)


async def test_a_request_for_a_service_that_has_just_gone_is_told_so(hosts: Hosts) -> None:
    server, client = await hosts.start(Node), await hosts.start(Node)
    joined = await server.system.join(Child(Tuned, name="tuned"))
    await client.quiet()
    (question,) = (one for one in hosts.ends[server].servers if "tuned/get_parameters" in one.key)
    await server.system.leave(joined)
    hosts.ends[server].servers.append(question)  # it was on its way
    ours = write_attachment(Attachment(1, 0, bytes(16), write_extension(Extension())))
    answers = asked(hosts, client, question.key, encode(GetParameters.Request()), ours)
    await client.quiet()
    assert isinstance(answers[0], Failed)
    assert str(parse_reply_error(answers[0].payload)).startswith(
        "/tuned, which served /tuned/get_parameters, has stopped"
    )
    question.close()


# Call cycles ---------------------------------------------------------------------------------------------------------------


def caller_of(name: str, service: Service[Any, Any], calls: Service[Any, Any] | None, concurrent: int = 0) -> Child:
    """A node that serves one service, and calls another one to do so."""

    class Caller(Node):
        @service.serve(concurrent=concurrent)
        async def answer(self, request: Trigger.Request) -> Trigger.Response:
            if calls is not None:
                try:
                    return await self.call(calls, Trigger.Request())  # type: ignore[no-any-return]
                except CallCycle as cycle:
                    return Trigger.Response(message=",".join(cycle.nodes))
            return Trigger.Response(message="done")

    return Child(Caller, name=name)


async def test_a_cycle_of_calls_over_two_processes_is_refused_at_once_and_named(hosts: Hosts) -> None:
    await hosts.start(caller_of("a", FIRST, SECOND))
    other = await hosts.start(caller_of("b", SECOND, FIRST))

    answer = await other.call(FIRST, Trigger.Request())
    assert (answer.message, other.now) == ("/a,/b", 0.0)


async def test_a_cycle_over_three_processes_and_a_call_within_one_of_them_is_refused(hosts: Hosts) -> None:
    inner = Service(Trigger, "inner")
    await hosts.start(caller_of("a", FIRST, inner), caller_of("k", inner, SECOND))
    await hosts.start(caller_of("b", SECOND, THIRD))
    last = await hosts.start(caller_of("c", THIRD, FIRST))

    assert (await last.call(FIRST, Trigger.Request())).message == "/a,/k,/b,/c"


async def test_two_handlers_that_call_each_other_at_the_same_time_are_a_cycle_too(hosts: Hosts) -> None:
    rigs = [await hosts.start(caller_of("a", FIRST, SECOND)), await hosts.start(caller_of("b", SECOND, FIRST))]
    answers = await asyncio.gather(rigs[0].call(FIRST, Trigger.Request()), rigs[1].call(SECOND, Trigger.Request()))
    assert {answer.message for answer in answers} == {"/a,/b", "/b,/a"}
    assert rigs[0].now == 0.0


async def test_a_node_that_waits_by_way_of_another_one_of_its_process_is_part_of_a_cycle(hosts: Hosts) -> None:
    inner = Service(Trigger, "inner")
    first = await hosts.start(caller_of("a", FIRST, inner), caller_of("k", inner, SECOND))
    second = await hosts.start(caller_of("b", SECOND, FIRST))
    answers = await asyncio.gather(first.call(FIRST, Trigger.Request()), second.call(SECOND, Trigger.Request()))
    assert {answer.message for answer in answers} == {"/b,/a,/k", "/a,/k,/b"} or first.now == 0.0
    assert first.now == 0.0


async def test_a_concurrent_server_may_be_called_back(hosts: Hosts) -> None:
    back = Service(Trigger, "back")

    class Both(Node):
        @FIRST.serve()
        async def first(self, request: Trigger.Request) -> Trigger.Response:
            return await self.call(SECOND, Trigger.Request())

        @back.serve(concurrent=1)
        async def answer(self, request: Trigger.Request) -> Trigger.Response:
            return Trigger.Response(message="called back")

    await hosts.start(Both)
    other = await hosts.start(caller_of("b", SECOND, back))
    assert (await other.call(FIRST, Trigger.Request())).message == "called back"


async def test_a_call_from_a_task_that_no_handler_waits_for_has_no_chain(hosts: Hosts) -> None:
    replies: list[Trigger.Response] = []

    class Later(Node):
        asking = False

        @FIRST.serve()
        async def first(self, request: Trigger.Request) -> Trigger.Response:
            if not self.asking:
                self.asking = True
                self.create_task(self.ask())
            return Trigger.Response(message="soon")

        async def ask(self) -> None:
            replies.append(await self.call(SECOND, Trigger.Request()))

    server = await hosts.start(Later)
    other = await hosts.start(caller_of("b", SECOND, FIRST))
    assert (await other.call(FIRST, Trigger.Request())).message == "soon"
    await other.quiet()
    await server.quiet()
    assert [reply.message for reply in replies] == ["soon"]


# What a peer of ROS 2 sees --------------------------------------------------------------------------------------------------


async def test_a_reply_repeats_number_and_gid_of_its_request_and_has_its_own_time(hosts: Hosts) -> None:
    server, other = await hosts.start(Adder), await hosts.start(Node)
    start = server.system.clock.wall_ns_at(0.0)
    answers = asked(hosts, other, ADD_KEY, encode(two(1, 10)), write_attachment(Attachment(7, 5, bytes(range(16)))))
    await server.advance(1.0)

    (answer,) = answers
    assert isinstance(answer, Replied)
    assert decode(AddTwoInts.Response, answer.payload) == total(11)
    assert parse_attachment(answer.attachment) == Attachment(7, start + 1_000_000_000, bytes(range(16)))


async def test_a_request_carries_number_time_gid_of_the_clients_token_and_an_extension(hosts: Hosts) -> None:
    rig, other = await hosts.start(Node), await hosts.start(Node)
    heard: list[Attachment] = []
    token = ADD_KEY.replace("0/add", "@ros2_lv/0/2/90/91/SS/%/%/adder/%add", 1) + "/::,10:,:,:,,"
    shown = hosts.ends[other].announce(token)

    def serve(query: Any) -> None:
        heard.append(parse_attachment(query.attachment))
        query.reply(encode(total(0)), query.attachment)

    hosts.ends[other].serve(ADD_KEY, serve)
    await rig.quiet()
    for _ in range(2):
        await rig.call(ADD, two(1, 2))

    (client,) = (token for token in hosts.network.tokens if "/SC/" in token)
    start = rig.system.clock.wall_ns_at(0.0)
    assert [one._replace(extension=b"") for one in heard] == [
        Attachment(1, start, gid_of(client)),
        Attachment(2, start, gid_of(client)),
    ]
    assert parse_extension(heard[0].extension) == Extension()
    shown.close()


async def test_a_node_is_a_client_until_its_last_client_has_gone(hosts: Hosts) -> None:
    rig, other = await hosts.start(Node), await hosts.start(Node)
    kinds = ("SC", "SC", "SS")
    token = ADD_KEY.replace("0/add", "@ros2_lv/0/2/90/91/SC/%/%/asker/%add", 1) + "/::,10:,:,:,,"
    shown = [
        hosts.ends[other].announce(token.replace("91/SC", f"{91 + number}/{kind}", 1))
        for number, kind in enumerate(kinds)
    ]
    await rig.quiet()
    seen: list[list[str]] = []
    for one in (shown[0], shown[2], shown[1]):
        one.close()
        await rig.quiet()
        seen.append([name for service in rig.system.snapshot().services for name in service.clients])
    assert seen == [["/asker"], ["/asker"], []]


async def test_requests_that_come_faster_than_they_are_answered_are_refused_beyond_a_limit(
    hosts: Hosts, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("actors.transport.local_services._MOST_OPEN", 2)
    server, other = await hosts.start(Adder), await hosts.start(Node)
    ours = write_attachment(Attachment(1, 0, bytes(16), write_extension(Extension())))
    answers = [asked(hosts, other, ADD_KEY, encode(two(1, 10)), ours) for _ in range(3)]
    await server.quiet()
    ((refused,),) = [each for each in answers if each]
    assert isinstance(refused, Failed)
    error = parse_reply_error(refused.payload)
    assert isinstance(error, ServiceFailed)
    assert (error.type, error.text) == (
        "request dropped",
        "2 requests of other processes to /add wait for an answer: send fewer at once",
    )

    await server.advance(2.0)
    answers.append(asked(hosts, other, ADD_KEY, encode(two(1, 0)), ours))
    await server.quiet()
    assert [type(one) for each in answers for one in each] == [Replied, Replied, Failed, Replied]


async def test_a_client_of_ros2_gets_the_text_of_an_error_and_one_of_ours_the_error(hosts: Hosts) -> None:
    server, other = await hosts.start(Adder), await hosts.start(Node)
    plain = write_attachment(Attachment(1, 0, bytes(16)))
    ours = write_attachment(Attachment(1, 0, bytes(16), write_extension(Extension())))
    bad = (
        asked(hosts, other, ADD_KEY, encode(two(-1, 0)), plain),
        asked(hosts, other, ADD_KEY, encode(two(-1, 0)), ours),
    )
    garbled = asked(hosts, other, ADD_KEY, b"", plain), asked(hosts, other, ADD_KEY, b"", ours)
    dropped = asked(hosts, other, ADD_KEY, encode(two(1, 0)), b"")
    await server.advance(1.0)

    assert dropped == [NoAnswer(False)]
    assert [type(one[0]) for one in (*bad, *garbled)] == [Failed] * 4
    assert [answers[0].payload[:42] for answers in (bad[0], garbled[0]) if isinstance(answers[0], Failed)] == [
        b"/adder failed to serve the request: ValueE",
        b"/adder failed to serve the request: CdrErr",
    ]
    assert [type(parse_reply_error(one[0].payload)) for one in (bad[1], garbled[1]) if isinstance(one[0], Failed)] == [
        ServiceFailed
    ] * 2


class Refusing(Node):
    """Each of its handlers raises; the text has a character that no message can carry."""

    @FIRST.serve()
    async def first(self, request: Trigger.Request) -> Trigger.Response:
        raise ValueError("no such robot: \udc80")

    @Service(ChangeState, "change").serve()
    async def change(self, request: ChangeState.Request) -> ChangeState.Response:
        raise ValueError("not now")

    @COUNT.accepts
    async def check(self, goal: Fibonacci.Goal) -> None:
        raise ValueError("not now")

    @COUNT.serve()
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        yield Done(Fibonacci.Result())


async def test_a_response_that_has_a_field_for_it_tells_a_client_of_ros2_that_the_handler_failed(hosts: Hosts) -> None:
    """It would wait for ever otherwise: `ros2 service call` has no timeout."""
    server, other = await hosts.start(Refusing), await hosts.start(Node)
    plain = write_attachment(Attachment(7, 5, bytes(range(16))))

    def ask(key: str, request: Message) -> list[Answer]:
        (served,) = [one.key for one in hosts.ends[server].servers if one.key.startswith(key)]
        return asked(hosts, other, served, encode(request), plain)

    first = ask("0/first/", Trigger.Request())
    change = ask("0/change/", ChangeState.Request())
    goal = ask("0/count/_action/send_goal/", send_goal_service(Fibonacci).Request())
    await server.advance(1.0)

    answers = [one[0] for one in (first, change, goal)]
    assert all(isinstance(one, Replied) for one in answers)
    kinds = (Trigger.Response, ChangeState.Response, send_goal_service(Fibonacci).Response)
    told = [decode(kind, one.payload) for kind, one in zip(kinds, answers, strict=True) if isinstance(one, Replied)]
    text = "/refusing failed to serve the request: ValueError: no such robot: \\udc80"
    assert told[:2] == [Trigger.Response(success=False, message=text), ChangeState.Response(success=False)]
    assert told[2].accepted is False


def test_a_reason_that_is_too_long_for_its_field_is_left_out() -> None:
    kind: Any = load("---\nbool success true\nstring<=4 message", "tests/srv/Short")
    payload = encode_failure(kind.Response, "too long")
    assert payload is not None
    assert decode(kind.Response, payload) == kind.Response(success=False)


@pytest.mark.parametrize(
    ("payload", "error", "text"),
    [
        (b"Timeout", CallTimeout, "did not answer"),
        (b"no such thing\xff", ServiceFailed, r"error reply: no such thing\\xff"),
    ],
)
async def test_an_error_reply_of_another_kind_of_peer_is_an_error_too(
    hosts: Hosts, payload: bytes, error: type[Exception], text: str
) -> None:
    rig, other = await hosts.start(Node), await hosts.start(Node)
    shown = hosts.ends[other].announce(
        ADD_KEY.replace("0/add", "@ros2_lv/0/2/90/91/SS/%/%/adder/%add", 1) + "/::,10:,:,:,,"
    )
    hosts.ends[other].serve(ADD_KEY, lambda query: query.fail(payload))
    await rig.quiet()
    with pytest.raises(error, match=text):
        await rig.call(ADD, two(1, 2))
    shown.close()


async def test_an_answer_that_comes_as_its_caller_gives_up_is_dropped(hosts: Hosts) -> None:
    rig, other = await hosts.start(Node), await hosts.start(Node)
    queries: list[Any] = []
    shown = hosts.ends[other].announce(
        ADD_KEY.replace("0/add", "@ros2_lv/0/2/90/91/SS/%/%/adder/%add", 1) + "/::,10:,:,:,,"
    )
    hosts.ends[other].serve(ADD_KEY, queries.append)
    await rig.quiet()
    call = asyncio.create_task(rig.call(ADD, two(1, 2)))
    await rig.quiet()
    (query,) = queries
    query.reply(encode(total(3)), query.attachment)
    call.cancel()
    with pytest.raises(asyncio.CancelledError):
        await call
    shown.close()


async def test_a_response_that_is_no_message_fails_the_call(hosts: Hosts) -> None:
    rig, other = await hosts.start(Node), await hosts.start(Node)
    shown = hosts.ends[other].announce(
        ADD_KEY.replace("0/add", "@ros2_lv/0/2/90/91/SS/%/%/adder/%add", 1) + "/::,10:,:,:,,"
    )
    hosts.ends[other].serve(ADD_KEY, lambda query: query.reply(b"", query.attachment))
    await rig.quiet()
    with pytest.raises(ServiceFailed, match="CdrError"):
        await rig.call(ADD, two(1, 2))
    shown.close()


async def test_a_description_of_a_type_that_is_too_long_is_not_read(hosts: Hosts) -> None:
    class Owner(Node):
        async def on_start(self) -> None:
            self.serve(Service(GetTypeDescription, "~/get_type_description"), self._describe)

        async def _describe(self, request: GetTypeDescription.Request) -> GetTypeDescription.Response:
            return GetTypeDescription.Response(failure_reason="x" * 3_000_000)

    await hosts.start(Child(Owner, name="owner", parameters={"start_type_description_service": False}))
    client = await hosts.start(Node)
    with pytest.raises(ServiceFailed, match="a reply of 3000"):
        await client.call(Service(GetTypeDescription, "/owner/get_type_description"), GetTypeDescription.Request())


# Standard services and topics -----------------------------------------------------------------------------------------------


class Tuned(Node):
    speed = parameter(0.5)


async def test_the_parameters_of_a_node_elsewhere_are_read_and_the_services_are_shown_before(hosts: Hosts) -> None:
    server, client = await hosts.start(Tuned), await hosts.start(Node)
    shown = sorted(token.split("/")[9] for token in hosts.network.tokens if "/SS/" in token and "/tuned/" in token)
    opened = len(server.system.graph.services)
    get = Service(GetParameters, "tuned/get_parameters")

    assert shown == [
        "%tuned%describe_parameters",
        "%tuned%get_parameter_types",
        "%tuned%get_parameters",
        "%tuned%get_type_description",
        "%tuned%list_parameters",
        "%tuned%set_parameters",
        "%tuned%set_parameters_atomically",
    ]
    (value,) = (await client.call(get, GetParameters.Request(names=("speed",)))).values
    assert value.double_value == 0.5
    assert "/tuned/get_parameters" in server.system.graph.services
    assert opened >= 0


async def test_a_node_that_is_told_not_to_describes_no_types(hosts: Hosts) -> None:
    await hosts.start(Child(Tuned, parameters={"start_type_description_service": False}))
    assert not any("%tuned%get_type_description" in token for token in hosts.network.tokens)


async def test_a_standard_service_of_a_node_that_is_being_restarted_says_so(hosts: Hosts) -> None:
    server, client = await hosts.start(Child(Tuned, backoff=Backoff(5.0, 5.0))), await hosts.start(Node)
    server.crash(Tuned)
    await server.quiet()
    get = Service(GetParameters, "tuned/get_parameters")
    with pytest.raises(NodeRestarting, match=r"/tuned \(incarnation 1\)"):
        await client.call(get, GetParameters.Request())
    await server.advance(6.0)
    assert len((await client.call(get, GetParameters.Request(names=("speed",)))).values) == 1


async def test_the_state_of_a_lifecycle_node_elsewhere_is_read(hosts: Hosts) -> None:
    from actors import LifecycleNode

    class Camera(LifecycleNode):
        pass

    await hosts.start(Camera)
    client = await hosts.start(Node)
    state = await client.call(Service(GetState, "camera/get_state"), GetState.Request())
    assert state.current_state.label in ("unconfigured", "active")


async def test_log_lines_of_another_process_are_read_on_rosout(hosts: Hosts) -> None:
    from actors import Topic, qos
    from actors.interfaces.rcl_interfaces.msg import Log

    server, client = await hosts.start(Node), await hosts.start(Node)
    probe = client.probe(Topic(Log, "/rosout", qos.ROSOUT))
    await client.quiet()
    server.me.log.warning("mind the gap")
    await client.quiet()

    assert "mind the gap" in [line.msg for line in probe]
