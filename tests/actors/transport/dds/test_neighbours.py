"""Neighbours on DDS that are none of this library: Cyclone DDS's and Fast DDS's middlewares, Humble, programs without ROS, and liars.

They are played by bare participants, which write what the captures of the real ones in `tests/conformance/vectors` hold.
"""

from __future__ import annotations

import asyncio
import struct
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from dataclasses import replace
from typing import Any

import pytest

from actors import Child, Node, ServiceFailed, System, Topic, run
from actors.interfaces import decode, encode, type_hash
from actors.interfaces.std_msgs.msg import Int32
from actors.qos.policies import Liveliness, QoS
from actors.transport.dds import domain as of_domain
from actors.transport.dds import known
from actors.transport.dds.endpoints import Reader, Sample, Status, Writer
from actors.transport.dds.format.names import DISCOVERY_TOPIC
from actors.transport.dds.format.participants import (
    NodeEntities,
    ParticipantEntities,
    parse_participant,
    write_participant,
)
from actors.transport.dds.format.qos import EndpointQos
from actors.transport.dds.format.requests import RequestId, parse_request, write_request
from actors.transport.dds.participant import Participant
from tests.actors.transport.dds.meeting import HERE, MeetingTransport, free_domain
from tests.stage import ADD, NUMBERS, events, number, total, two

pytest.importorskip("cyclonedds")

INT32 = "std_msgs::msg::dds_::Int32_"
REQUEST = "rq/addRequest", "example_interfaces::srv::dds_::AddTwoInts_Request_"
REPLY = "rr/addReply", "example_interfaces::srv::dds_::AddTwoInts_Response_"
HEAD = b"\0\1\0\0"
KEPT = EndpointQos(transient_local=True, keep_all=True, depth=100)


class Neighbour:
    """A participant that does what a test says. It is of ROS if it has an enclave."""

    def __init__(self, domain: int, user_data: bytes = b"enclave=/;") -> None:
        self.participant = Participant(replace(HERE, domain=domain), user_data)
        self.infos: list[ParticipantEntities] = []
        self.samples: list[Sample] = []
        self.info: Writer

    def participant_appeared(self, found: Any) -> None: ...
    def participant_vanished(self, found: Any) -> None: ...
    def endpoint_appeared(self, found: Any) -> None: ...
    def endpoint_changed(self, found: Any) -> None: ...
    def endpoint_vanished(self, found: Any) -> None: ...

    async def open(self) -> None:
        await self.participant.open(self)
        self.info = self.participant.writer(*DISCOVERY_TOPIC, KEPT)
        self.participant.reader(
            *DISCOVERY_TOPIC, KEPT, lambda samples: self.infos.extend(parse_participant(one.payload) for one in samples)
        )

    def reader(self, topic: str, type: str, user_data: bytes = b"") -> Reader:
        return self.participant.reader(topic, type, EndpointQos(depth=100, user_data=user_data), self.samples.extend)

    def writer(self, topic: str, type: str, user_data: bytes = b"") -> Writer:
        return self.participant.writer(topic, type, EndpointQos(depth=100, user_data=user_data))

    def tell(self, name: str, *ends: Reader | Writer, gid_size: int = 16) -> None:
        """Publish that a node has these endpoints."""
        readers = tuple(end.guid for end in ends if isinstance(end, Reader))
        writers = tuple(end.guid for end in ends if isinstance(end, Writer))
        nodes = (NodeEntities("/", name, readers, writers),)
        self.info.put(write_participant(ParticipantEntities(self.participant.guid, nodes, gid_size)))


@asynccontextmanager
async def beside(node: type[Node] = Node, user_data: bytes = b"enclave=/;") -> AsyncIterator[tuple[System, Neighbour]]:
    """A system with one node, and a neighbour."""
    place = free_domain()
    neighbour = Neighbour(place, user_data)
    async with run(Child(node, name="here"), transport=MeetingTransport(place), sinks=(LOGS.append,)) as system:
        await neighbour.open()
        try:
            yield system, neighbour
        finally:
            await neighbour.participant.close()


LOGS: list[Any] = []


@pytest.fixture(autouse=True)
def logs() -> list[Any]:
    LOGS.clear()
    return LOGS


async def until(condition: Callable[[], object]) -> None:
    async with asyncio.timeout(20.0):
        while not condition():
            await asyncio.sleep(0.005)


def names(system: System) -> list[str]:
    return [node.name for node in system.snapshot().nodes if node.state == "elsewhere"]


class Adder(Node):
    @ADD.serve()
    async def add(self, request: Any) -> Any:
        return total(request.a + request.b)


async def test_a_node_and_its_endpoints_are_seen_when_it_is_told_who_has_them_and_gone_when_it_is_not() -> None:
    async with beside() as (system, neighbour):
        hashed = f"typehash={type_hash(Int32)};".encode()
        out = neighbour.writer("rt/numbers", INT32, hashed)
        async with system.node("here").subscribe(NUMBERS) as stream:
            await until(lambda: out.matched)
            assert names(system) == [], "nobody has said yet whose it is"
            neighbour.tell("talker", out)
            await until(lambda: names(system) == ["/talker"])
            await until(lambda: [one.node.fqn for one in system.graph.topic("/numbers").publishers] == ["/talker"])
            out.put(encode(number(5)))
            assert (await stream.next()).data == 5
            neighbour.tell("another", out)
            await until(lambda: [one.node.fqn for one in system.graph.topic("/numbers").publishers] == ["/another"])
            out.close()
            await until(lambda: not system.graph.topic("/numbers").publishers)
        mine = [info for info in neighbour.infos if info.nodes]
        assert mine[-1].nodes[0][:2] == ("/", "here")


async def test_humble_is_told_of_with_24_bytes_and_tells_so_and_has_no_hashes() -> None:
    async with beside() as (system, neighbour):
        out = neighbour.writer("rt/numbers", INT32)
        neighbour.tell("humble", out, gid_size=24)
        async with system.node("here").subscribe(NUMBERS) as stream:
            await until(lambda: names(system) == ["/humble"] and out.matched)
            await until(lambda: neighbour.infos and neighbour.infos[-1].gid_size == 24)
            await until(lambda: stream.publisher_count == 1)
            out.put(encode(number(7)))
            assert (await stream.next()).data == 7


async def test_gids_have_24_bytes_until_somebody_is_there_who_reads_16_as_humble_may_end_at_those() -> None:
    async with beside() as (system, neighbour):
        await until(lambda: any(info.nodes for info in neighbour.infos))
        assert {info.gid_size for info in neighbour.infos} == {24}
        out = neighbour.writer("rt/numbers", INT32)
        neighbour.tell("newer", out)
        await until(lambda: names(system) == ["/newer"] and neighbour.infos[-1].gid_size == 16)
        await neighbour.participant.close()
        await until(lambda: names(system) == [])
        late = Neighbour(neighbour.participant._config.domain)
        await late.open()
        try:
            await until(lambda: late.infos)
            assert late.infos[0].gid_size == 24
        finally:
            await late.participant.close()


async def test_a_big_endian_neighbour_is_known_by_what_it_tells_of_its_nodes() -> None:
    """Cyclone DDS gives each message the head of this machine, whatever the order of its bytes is."""
    async with beside(Adder) as (system, neighbour):
        out = neighbour.writer("rt/numbers", INT32)
        requests = neighbour.writer(*REQUEST)
        replies = neighbour.reader(*REPLY)
        entities = [neighbour.participant.guid, struct.pack(">I", 1), struct.pack(">I2s2x", 2, b"/")]
        entities += [
            struct.pack(">I4s", 4, b"big"),
            struct.pack(">I", 1),
            replies.guid,
            struct.pack(">I", 2),
            out.guid,
            requests.guid,
        ]
        async with system.node("here").subscribe(NUMBERS) as stream:
            neighbour.info.put(HEAD + b"".join(entities))
            await until(lambda: names(system) == ["/big"] and stream.publisher_count == 1 and out.matched)
            out.put(HEAD + struct.pack(">i", 7))
            assert (await stream.next()).data == 7
        await until(lambda: requests.matched and replies.matched)
        requests.put(HEAD + struct.pack(">Qqqq", 5, 1, 40, 2))
        await until(lambda: neighbour.samples)
        identity, answer = parse_request(neighbour.samples[0].payload)
        assert (identity, decode(ADD.type.Response, answer)) == (RequestId(5, 1), total(42))


async def test_a_program_without_ros_is_heard_and_not_listed() -> None:
    async with beside(user_data=b"") as (system, neighbour):
        out, heard = neighbour.writer("rt/numbers", INT32), neighbour.reader("rt/numbers", INT32)
        node = system.node("here")
        publisher = node.publisher(NUMBERS)
        async with node.subscribe(NUMBERS) as stream:
            await until(lambda: stream.publisher_count == 2 and publisher.subscription_count == 2 and heard.matched)
            out.put(encode(number(1)))
            while (await stream.next()).data != 1:
                pass
            publisher.publish(number(2))
            await until(lambda: neighbour.samples)
            assert decode(Int32, neighbour.samples[0].payload).data == 2
        assert names(system) == []


async def test_a_topic_of_ros_with_a_type_that_is_none_of_ros_is_shown_as_it_is_and_hides_nothing() -> None:
    async with beside(user_data=b"") as (system, neighbour):
        for type in ("Hello", "a::b", "../../msg/Hello"):
            neighbour.writer("rt/odd", type)
        neighbour.writer("rt/numbers", INT32)
        await until(lambda: [one.node.fqn for one in system.graph.topic("/numbers").publishers] == [known.BARE])
        types = {one.type.__ros_type__ for one in system.graph.topic("/odd").publishers}
        assert types == {"Hello", "a::b", "../../msg/Hello"}


async def test_a_client_of_cyclone_gets_its_reply_with_the_head_of_its_request_also_if_it_is_matched_late() -> None:
    async with beside(Adder) as (system, neighbour):
        mine = b"clientid= 1.2.3.4.5.6.7.8.9.a.b.c.0.0.0.1;"
        asks = neighbour.writer(*REQUEST, mine)
        neighbour.tell("client", asks)
        await until(lambda: asks.matched)
        asks.put(write_request(RequestId(2**63 + 5, 3), encode(two(1, 2))))
        await until(lambda: system.node("here").fqn and system.graph.service("/add").clients)
        await asyncio.sleep(0.1)
        neighbour.reader(*REPLY, mine)
        await until(lambda: neighbour.samples)
        request, message = parse_request(neighbour.samples[0].payload)
        assert (request, decode(ADD.type.Response, message)) == (RequestId(2**63 + 5, 3), total(3))


async def test_a_reply_whose_client_is_never_matched_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    from actors.transport.dds import services

    monkeypatch.setattr(services, "_PATIENCE", 0.1)
    async with beside(Adder) as (system, neighbour):
        asks = neighbour.writer(*REQUEST, b"clientid= 1.2.3.4.5.6.7.8.9.a.b.c.0.0.0.1;")
        neighbour.tell("client", asks)
        await until(lambda: asks.matched and system.graph.service("/add").clients)
        asks.put(write_request(RequestId(5, 3), encode(two(1, 2))))
        await asyncio.sleep(0.5)
        neighbour.reader(*REPLY, b"clientid= 1.2.3.4.5.6.7.8.9.a.b.c.0.0.0.1;")
        await asyncio.sleep(0.3)
        assert neighbour.samples == []


async def test_a_server_and_a_client_of_fast_dds_are_explained_once_with_the_remedy(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(known, "FAST_DDS", b"\x01\x10")  # the neighbour is one of Cyclone DDS
    async with beside(Adder) as (system, neighbour):
        there = "rq/otherRequest", REQUEST[1]
        back = "rr/otherReply", REPLY[1]
        serves, asks = neighbour.reader(*there), neighbour.writer(*REQUEST)
        neighbour.tell("fast", serves, neighbour.writer(*back), asks)
        await until(lambda: system.graph.service("/other").remotes and asks.matched)
        from actors import Service

        for _ in "ab":
            with pytest.raises(ServiceFailed, match="RMW_IMPLEMENTATION=rmw_cyclonedds_cpp"):
                await system.node("here").call(Service(ADD.type, "/other"), two(1, 2), timeout=10.0)
            asks.put(encode(two(1, 2)))
        await until(lambda: events(LOGS, "clients of /add are of rmw_fastrtps"))
        assert len(events(LOGS, "rmw_fastrtps")) == 2


async def test_what_lies_is_counted_and_reported_once_and_nothing_honest_is_lost() -> None:
    async with beside(Adder) as (system, neighbour):
        out = neighbour.writer("rt/numbers", INT32, f"typehash={type_hash(Int32)};".encode())
        asks = neighbour.writer(*REQUEST, b"clientid= 1.2.3.4.5.6.7.8.9.a.b.c.0.0.0.1;")
        told = neighbour.writer("robactor/told", "robactor::msg::dds_::Told_")
        neighbour.writer("rq/noRequest", "no service")
        neighbour.tell("honest", out, asks)
        await until(lambda: names(system) == ["/honest"] and asks.matched and told.matched)
        nodes = (NodeEntities("/", "forged"),)
        for _ in range(5):
            neighbour.info.put(write_participant(ParticipantEntities(bytes(16), nodes)))
            neighbour.info.put(b"\0\1\0\0\xff\xff\xff\xff")
            asks.put(b"\0\1\0\0\1\0\0\0")
            told.put(b"\0\1\0\0" + b"x" * 200)
        async with system.node("here").subscribe(NUMBERS) as stream:
            await until(lambda: stream.publisher_count == 1 and out.matched)
            out.put(b"\0\1\0\0")
            out.put(encode(number(9)))
            assert (await stream.next()).data == 9
        neighbour.reader(*REPLY, b"clientid= 1.2.3.4.5.6.7.8.9.a.b.c.0.0.0.1;")
        asks.put(write_request(RequestId(1, 1), encode(two(1, 2))))
        await until(lambda: neighbour.samples)
        assert names(system) == ["/honest"]
        assert len(events(LOGS, "the nodes of a participant cannot be read")) == 1
        assert len(events(LOGS, "a request cannot be read")) == 1
        assert len(events(LOGS, "a topic of DDS cannot be read")) == 1


async def test_replies_that_are_none_or_to_others_are_passed_over() -> None:
    async with beside() as (system, neighbour):
        mine = b"serviceid= 1.2.3.4.5.6.7.8.9.a.b.c.0.0.0.2;"
        serves, answers = neighbour.reader(*REQUEST, mine), neighbour.writer(*REPLY, mine)
        neighbour.tell("server", serves, answers)
        await until(lambda: system.graph.service("/add").remotes)
        call = asyncio.create_task(system.node("here").call(ADD, two(1, 2), timeout=20.0))
        await until(lambda: neighbour.samples)
        request, message = parse_request(neighbour.samples[0].payload)
        assert decode(ADD.type.Request, message) == two(1, 2)
        answers.put(b"\0\1\0\0\1\0\0\0")
        answers.put(write_request(RequestId(request.client + 1, request.number), encode(total(7))))
        answers.put(write_request(request, encode(total(3))))
        assert await call == total(3)
        assert len(events(LOGS, "a reply cannot be read")) == 1


async def test_a_domain_says_nothing_when_its_engine_cannot_be_opened() -> None:
    transport = MeetingTransport(free_domain())
    with suppress(RuntimeError):
        await transport.close()
    assert transport.report() == ()
    with pytest.raises(RuntimeError, match="a transport is opened once"):
        await transport.join(0, of_domain)


async def test_a_neighbour_and_this_library_see_each_others_signs_of_life() -> None:
    qos = EndpointQos(manual_liveliness=True, lease=1.0)
    beat = Topic(NUMBERS.type, "/beat", QoS(depth=1, liveliness=Liveliness.MANUAL_BY_TOPIC, liveliness_lease=1.0))
    async with beside() as (system, neighbour):
        statuses: list[Status] = []
        theirs = neighbour.participant.writer("rt/beat", INT32, qos)
        hears = neighbour.participant.reader("rt/beat", INT32, qos, neighbour.samples.extend, on_status=statuses.append)
        neighbour.tell("neighbour", theirs, hears)

        def alive() -> int:
            return [status.total for status in statuses if status.kind == "liveliness_changed"][-1]

        mine = system.node("here").publisher(beat)
        async with system.node("here").subscribe(beat) as stream:
            await until(lambda: theirs.matched and mine.subscription_count == 2 and stream.status.matched == 2)
            mine.publish(number(1))
            theirs.put(encode(number(2)))
            await until(lambda: statuses and alive() == 1 and stream.status.alive == 2)
            begin, lost = asyncio.get_running_loop().time(), mine.status.liveliness_lost
            while asyncio.get_running_loop().time() < begin + 2.5:  # more than twice the lease
                mine.assert_liveliness()
                theirs.assert_liveliness()
                await asyncio.sleep(0.02)
            if mine.status.liveliness_lost == lost:  # a busy machine may have kept them from that
                assert (alive(), stream.status.alive) == (1, 2)
            await until(lambda: alive() == 0 and stream.status.not_alive == 2)
        assert len(neighbour.samples) == 1
