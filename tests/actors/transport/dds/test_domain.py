"""The handles of a participant, used as the graph does not use them: closed twice, used after that, without a node."""

from __future__ import annotations

import asyncio
import time
import uuid
from collections.abc import AsyncIterator, Callable
from functools import partial
from typing import Any, cast

import pytest

from actors.qos import DEFAULT, LATCHED, SERVICES
from actors.transport.dds import DdsConfig, DdsTransport, services, topics
from actors.transport.dds.domain import Domain
from actors.transport.dds.endpoints import Sample, Status
from actors.transport.dds.format.requests import RequestId, write_request
from actors.transport.protocol import NoAnswer, Participant, TypeInfo
from tests.actors.transport.dds.meeting import MeetingTransport, free_domain
from tests.actors.transport.dds.peers import deaf, numbered, settings
from tests.actors.transport.dds.test_known import Told, end, participant

pytest.importorskip("cyclonedds")
INT32 = TypeInfo("std_msgs/msg/Int32", "TypeHashNotSupported")
UNKNOWN = TypeInfo("nobody/srv/Knows", "TypeHashNotSupported")
ONE = b"\0\1\0\0\1\0\0\0"


class Owner(Told):
    def __init__(self) -> None:
        super().__init__()
        self.messages: list[tuple[Any, ...]] = []

    def wanted(self, publisher: Any) -> None:
        self.log.append(("wanted", publisher.wanted))

    def told(self, data: bytes) -> None:
        self.log.append(("told", data))

    def lost(self, taker: Any, messages: int) -> None:
        self.log.append(("lost", (taker, messages)))

    def arrived(self, *message: Any) -> None:
        self.messages.append(message)

    def has(self, kind: str, what: Any) -> bool:
        return (kind, what) in self.log


@pytest.fixture
async def both() -> AsyncIterator[tuple[Any, Owner, Any, Owner, MeetingTransport]]:
    place = free_domain()
    transports, owners = [MeetingTransport(place) for _ in "ab"], [Owner() for _ in "ab"]
    joined: list[Participant] = [await one.join(0, own) for one, own in zip(transports, owners, strict=True)]
    yield joined[0], owners[0], joined[1], owners[1], transports[1]
    for one in transports:
        await one.close()


async def until(condition: Callable[[], object]) -> None:
    async with asyncio.timeout(20.0):
        while not condition():
            await asyncio.sleep(0.005)


async def test_one_without_a_node_is_heard_and_not_shown_and_a_closed_one_sends_nothing(both: Any) -> None:
    here, owner, there, other, _ = both
    hidden = here.publisher(None, "/hidden", INT32, DEFAULT)
    hidden.put(ONE, 1, 0)
    assert (hidden.gid, hidden.wanted) == (b"", False)
    hidden.show()
    hidden.open()
    hidden.open()
    takes = [there.subscription(None, "/hidden", INT32, DEFAULT, other.arrived, taker, 0.01) for taker in "xy"]
    await until(lambda: hidden.wanted)
    hidden.put(ONE, 1, 0)
    await until(lambda: other.messages)
    (message,) = other.messages
    assert (message[0], message[2], message[4], message[5] is not None) == (("x", "y"), 1, ONE, True)
    for one in takes:
        one.close()
        one.close()
    await until(lambda: owner.has("wanted", False))
    hidden.close()
    hidden.close()
    hidden.put(ONE, 2, 0)
    assert not [one for one in other.log if one[0] == "appeared"]


async def test_losses_are_told_to_those_for_whom_the_messages_were(both: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    here, owner, there, _other, _ = both
    monkeypatch.setattr(topics, "_MOST_WRITERS", 1)
    node = here.node("/node")
    heard = here.subscription(node, "/lossy", INT32, DEFAULT, owner.arrived, "x")
    (receiver,) = here._receivers.values()
    receiver._changed(Status("matched", 1, 1))
    receiver._changed(Status("sample_lost", 3, 3))
    assert owner.has("lost", ("x", 3))
    outs = [there.publisher(there.node(f"/out{index}"), "/lossy", INT32, DEFAULT) for index in range(2)]
    for out in outs:
        out.open()
        await until(partial(getattr, out, "wanted"))
        out.put(ONE, 1, 0)
    await until(lambda: len(owner.messages) == 2)
    assert len(receiver._numbers) == 1, "of so many writers the numbers are kept"
    heard.close()
    receiver._arrived([Sample(ONE, bytes(16), 0, 0, 0.0)])
    assert len(owner.messages) == 2, "nobody is left for whom it could be"


class Together:
    """Takes messages together, too, if `takes`."""

    def __init__(self, takes: bool) -> None:
        self.takes = takes
        self.numbers: list[int] = []

    def __call__(self, takers: object, gid: bytes, number: int, *more: object) -> None:
        self.numbers.append(number)

    def together(self, takers: object, gid: bytes, number: int, payloads: list[bytes]) -> bool:
        if self.takes:
            self.numbers += range(number, number + len(payloads))
        return self.takes


@pytest.mark.parametrize("takes", [True, False])
async def test_samples_of_one_writer_that_come_together_are_handed_on_together(both: Any, takes: bool) -> None:
    here, *_ = both
    take = Together(takes)
    here.subscription(here.node("/node"), "/together", INT32, DEFAULT, take, "x")
    (receiver,) = here._receivers.values()
    one, other = bytes(15) + b"1", bytes(15) + b"2"
    receiver._arrived([Sample(ONE, one, 0, 0, 0.0)] * 2)
    receiver._arrived([Sample(ONE, one, 0, 0, 0.0)] * 3)
    receiver._arrived([Sample(ONE, one, 0, 0, 0.0), Sample(ONE, other, 0, 0, 0.0)])
    assert take.numbers == [1, 2, 3, 4, 5, 6, 1]
    assert dict(receiver._numbers) == {one: 6, other: 1}


async def test_each_of_several_equal_subscriptions_is_seen_by_others_and_each_message_comes_once(both: Any) -> None:
    here, _, there, other, _ = both
    out = here.publisher(here.node("/out"), "/shared", INT32, DEFAULT)
    out.open()
    seen = here.known

    def nodes() -> list[str]:
        ends = [end.endpoint for peer in seen.peers.values() for end in peer.ends.values()]
        return sorted(end.node.fqn for end in ends if end is not None and end.name == "/shared")

    first, second, third = (
        there.subscription(there.node(f"/in{taker}"), "/shared", INT32, DEFAULT, other.arrived, taker)
        for taker in "abc"
    )
    await until(lambda: nodes() == ["/ina", "/inb", "/inc"] and out._writer.matched == 3)
    for number in range(200):
        out.put(ONE, number, 0)
    first.close()
    await until(lambda: nodes() == ["/inb", "/inc"])
    third.close()
    await until(lambda: nodes() == ["/inb"] and out._writer.matched == 1)
    out.put(ONE, 1, 0)
    await until(lambda: other.messages and other.messages[-1][0] == ("b",))
    assert sorted({number for _, _, number, *_ in other.messages}) == list(range(1, len(other.messages) + 1))
    second.close()
    await until(lambda: not out.wanted)
    assert nodes() == []


async def test_what_a_writer_keeps_is_taken_once_although_the_writer_was_lost_and_is_found_again() -> None:
    tag, owners = uuid.uuid4().hex, [Owner(), Owner()]
    transports = [DdsTransport(DdsConfig(discovery_range="LOCALHOST", uri=settings(tag))) for _ in "ab"]
    here, there = [
        cast(Domain, await one.join(domain, own)) for one, domain, own in zip(transports, (7, 8), owners, strict=True)
    ]
    out = here.publisher(here.node("/out"), "/kept", INT32, LATCHED.replace(depth=3))
    out.open()
    for number in (1, 2, 3):
        out.put(numbered(number), number, 0)
    there.subscription(there.node("/in"), "/kept", INT32, LATCHED.replace(depth=3), owners[1].arrived, "x")
    shown = ("appeared", ("/out", "PUBLISHER", "/kept"))
    await until(lambda: len(owners[1].messages) == 3 and shown in owners[1].log)
    deaf(there.engine, True)
    await until(lambda: owners[1].has("no node", "/out"))
    owners[1].log.clear()
    deaf(there.engine, False)
    await until(lambda: shown in owners[1].log)
    out.put(numbered(4), 4, 0)
    await until(lambda: any(message[4] == numbered(4) for message in owners[1].messages))
    assert [message[4] for message in owners[1].messages] == [numbered(number) for number in (1, 2, 3, 4)]
    for one in transports:
        await one.close()


async def test_a_process_tells_another_one_and_nobody_else(both: Any) -> None:
    here, owner, _there, other, transport = both
    await until(lambda: other.log and owner.log and here._tells.matched)
    here.tell("ab", b"not for anybody here")
    here.tell(transport.session, b"hello")
    await until(lambda: other.has("told", b"hello"))
    assert not [one for one in owner.log if one[0] == "told"]


async def test_a_request_is_given_up_by_its_end_its_time_and_its_client(both: Any) -> None:
    here, owner, there, _other, _ = both
    node = here.node("/asks")
    client = here.client(node, "/nobody", UNKNOWN, SERVICES)
    answers: list[Any] = []
    client.ask(ONE, 1, time.time_ns(), b"", None, answers.append)
    await until(lambda: answers)
    requests: list[Any] = []
    serving = there.server(there.node("/serves"), "/nobody", UNKNOWN, SERVICES, requests.append)
    await until(lambda: owner.has("appeared", ("/serves", "SERVER", "/nobody")))
    client.ask(ONE, 2, time.time_ns(), b"", 0.05, answers.append)
    await until(lambda: len(answers) == 2)
    assert answers == [NoAnswer(timed_out=False), NoAnswer(timed_out=True)]
    asked = client.ask(ONE, 3, time.time_ns(), b"", 5.0, answers.append)
    asked.close()
    asked.close()
    client.ask(ONE, 4, time.time_ns(), b"", 5.0, answers.append)
    await until(lambda: len(requests) >= 2)
    serving.close()
    serving.close()
    for request in requests:
        request.reply(ONE, 0, b"")
        request.reply(ONE, 0, b"")
        request.drop()
    client.close()
    client.close()
    serving.look()
    client.look()
    node.close()
    node.close()
    assert len(answers) == 2


ASKS = "rq/addRequest", "example_interfaces::srv::dds_::AddTwoInts_Request_"
CLIENT = b"clientid= 1.2.3.4.5.6.7.8.9.a.b.c.0.0.0.1;"


def asked(number: int, writer: int) -> Sample:
    """A request, of the writer of that number of a participant that a test tells of."""
    return Sample(write_request(RequestId(7, number), ONE), end(writer).guid, 0, writer, 0.0)


async def test_a_request_that_is_faster_than_the_discovery_of_its_client_waits_for_it(
    both: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    here, _, _, _, _ = both
    monkeypatch.setattr(services, "_PATIENCE", 0.05)
    monkeypatch.setattr(services, "_MOST_WAITING", 2)
    requests: list[Any] = []
    serving = here.server(here.node("/serves"), "/add", UNKNOWN, SERVICES, requests.append)
    here.participant_appeared(participant())
    serving._arrived([asked(1, 1)])
    await asyncio.sleep(0.1)
    monkeypatch.setattr(services, "_PATIENCE", 30.0)
    here.endpoint_appeared(end(1, *ASKS))
    assert requests == [], "its client has come too late"
    serving._arrived([asked(2, 3), asked(3, 3), asked(4, 3)])
    serving._expire()
    here.endpoint_changed(end(1, *ASKS, depth=5))
    assert requests == [], "it is not that client for which they wait"
    here.endpoint_appeared(end(3, *ASKS))
    assert [(one.number, one.payload) for one in requests] == [(2, ONE), (3, ONE)], "so many wait and no more"


async def test_a_server_that_is_closed_by_a_request_takes_no_more_of_them(both: Any) -> None:
    here, _, _, _, _ = both
    requests: list[Any] = []

    def take(request: Any) -> None:
        requests.append(request)
        serving.close()

    serving = here.server(here.node("/serves"), "/add", UNKNOWN, SERVICES, take)
    here.participant_appeared(participant())
    here.endpoint_appeared(end(1, *ASKS))
    serving._arrived([asked(1, 1), asked(2, 1)])
    assert [one.number for one in requests] == [1]


async def test_replies_wait_for_a_client_that_is_not_matched_and_no_more_than_so_many(
    both: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    here, _, _, _, _ = both
    monkeypatch.setattr(services, "_MOST_WAITING", 1)
    requests: list[Any] = []
    serving = here.server(here.node("/serves"), "/add", UNKNOWN, SERVICES, requests.append)
    here.participant_appeared(participant())
    here.endpoint_appeared(end(1, *ASKS, user_data=CLIENT))
    here.endpoint_appeared(end(3, *ASKS))
    serving._arrived([asked(1, 1), asked(2, 1), asked(3, 1), asked(4, 3)])
    written: list[bytes] = []
    monkeypatch.setattr(serving._ends.writer, "put", written.append)
    for request in requests[:2]:
        request.reply(ONE, 0, b"")
    serving.look()
    requests[2].fail(b"only processes of this library are told why")
    assert written == []
    requests[3].reply(ONE, 0, b"")
    assert written == [write_request(RequestId(7, 4), ONE)], "one without an id is answered at once"
    assert [reply.data for reply in serving._waiting] == [write_request(RequestId(7, 1), ONE)]


async def test_each_request_is_sent_once_when_its_server_is_there(both: Any) -> None:
    here, owner, there, _other, _ = both
    client = here.client(here.node("/asks"), "/knows", UNKNOWN, SERVICES)
    requests: list[Any] = []
    there.server(there.node("/serves"), "/knows", UNKNOWN, SERVICES, requests.append)
    await until(lambda: owner.has("appeared", ("/serves", "SERVER", "/knows")))
    client.ask(ONE, 1, 0, b"", None, lambda answer: None)
    await until(lambda: requests)
    client.ask(ONE, 2, 0, b"", None, lambda answer: None)
    await until(lambda: len(requests) == 2)
    assert [one.number for one in requests] == [1, 2]


async def test_a_request_waits_for_a_server_that_is_discovered_and_not_matched(
    both: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    here, _, _, _, _ = both
    here.participant_appeared(participant())
    here.endpoint_appeared(end(2, *ASKS))
    client = here.client(here.node("/asks"), "/add", UNKNOWN, SERVICES)
    written: list[bytes] = []
    monkeypatch.setattr(client._ends.writer, "put", written.append)
    answers: list[Any] = []
    client.ask(ONE, 1, 0, b"", 0.05, answers.append)
    await until(lambda: answers)
    assert (written, answers) == ([], [NoAnswer(timed_out=True)])


async def test_what_is_open_when_a_process_leaves_is_closed_with_it(both: Any) -> None:
    here, owner, there, _other, transport = both
    there.server(there.node("/serves"), "/add", UNKNOWN, SERVICES, lambda request: None)
    await until(lambda: owner.has("appeared", ("/serves", "SERVER", "/add")) and here.complete and there.complete)
    assert [link.session for link in here.links()] == [transport.session]
    peers = dict(here.known.peers)
    here.known.peers.clear()
    assert list(here.links()) == [], "it is discovered already, and not known yet"
    here.known.peers.update(peers)
    there.node("/late")
    await transport.close()
    await until(lambda: owner.has("no node", "/serves"))
    assert (list(here.links()), there.services) == ([], set())


async def test_a_reader_more_changes_nothing_for_a_publisher_that_has_one(both: Any) -> None:
    here, owner, there, other, _ = both
    out = here.publisher(here.node("/out"), "/heard", INT32, DEFAULT)
    out.open()
    for taker in "ab":
        there.subscription(there.node("/in"), "/heard", INT32, DEFAULT, lambda *message: None, taker)
        await until(lambda: out.wanted)
    await until(lambda: out._writer.matched == 2)
    assert [one for one in owner.log if one[0] == "wanted"] == [("wanted", True)]
    assert other.messages == []


async def test_a_request_that_nobody_can_answer_ends_once(both: Any) -> None:
    here, _, _, _, _ = both
    client, answers = here.client(here.node("/asks"), "/nobody", UNKNOWN, SERVICES), list[Any]()
    client.ask(ONE, 1, 0, b"", None, answers.append)
    client.look()
    client.look()
    await until(lambda: answers)
    await asyncio.sleep(0.01)
    assert answers == [NoAnswer(timed_out=False)]


async def test_a_publisher_that_is_not_open_shows_no_sign_of_life(both: Any) -> None:
    here, _, _, _, _ = both
    out = here.publisher(here.node("/out"), "/beat", INT32, DEFAULT)
    out.assert_liveliness()
    assert out.gid == b""
    out.open()
    out.assert_liveliness()
    assert len(out.gid) == 16
    out.close()
    out.assert_liveliness()


async def test_a_process_of_this_one_joins_the_same_domain() -> None:
    config = DdsConfig(discovery_range="LOCALHOST", enclave="/x")
    assert DdsTransport(config).sibling()()._config == config
