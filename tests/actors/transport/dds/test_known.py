"""What is known of other participants, in whatever order it is told; and what our own processes add to messages."""

from __future__ import annotations

from typing import Any

import pytest

from actors.transport.dds import known as of_known
from actors.transport.dds.discovery import RemoteEndpoint, RemoteParticipant
from actors.transport.dds.endpoints import Status
from actors.transport.dds.format.participants import NodeEntities, ParticipantEntities
from actors.transport.dds.format.qos import EndpointQos
from actors.transport.dds.format.user_data import Process, parse_process, write_process
from actors.transport.dds.known import BARE, Known, NodeHere
from actors.transport.dds.services import Extra, add_extra, split_extra

PREFIX = b"\x01\x10" + bytes(10)
PARTICIPANT = PREFIX + bytes.fromhex("000001c1")


class Told:
    """Writes down what it is told."""

    def __init__(self) -> None:
        self.log: list[tuple[str, Any]] = []

    def node(self, node: Any, there: bool) -> None:
        self.log.append(("node" if there else "no node", node.fqn))

    def appeared(self, endpoint: Any) -> None:
        self.log.append(("appeared", (endpoint.node.fqn, endpoint.kind.name, endpoint.name)))

    def vanished(self, endpoint: Any) -> None:
        self.log.append(("vanished", (endpoint.node.fqn, endpoint.kind.name, endpoint.name)))

    def link(self, session: str, up: bool) -> None:
        self.log.append(("link" if up else "no link", session))

    def liveliness(self, gid: bytes) -> None:
        self.log.append(("liveliness", gid[12:]))

    def unreadable(self, what: str, place: str, error: Exception, **fields: object) -> None:
        self.log.append(("unreadable", what))

    def take(self) -> list[tuple[str, Any]]:
        log, self.log = self.log, []
        return log


def participant(user_data: bytes = b"enclave=/;") -> RemoteParticipant:
    return RemoteParticipant(PARTICIPANT, user_data)


def end(number: int, topic: str = "rt/x", type: str = "std_msgs::msg::dds_::Int32_", **qos: Any) -> RemoteEndpoint:
    guid = PREFIX + number.to_bytes(4, "big")
    return RemoteEndpoint(guid, PARTICIPANT, number % 2 == 1, topic, type, EndpointQos(**qos), number)


def info(*ends: RemoteEndpoint, name: str = "a") -> ParticipantEntities:
    node = NodeEntities("/", name, (), tuple(one.guid for one in ends))
    return ParticipantEntities(PARTICIPANT, (node,))


def test_nodes_may_be_told_of_before_their_participant_is_found_and_endpoints_after_both() -> None:
    told = Told()
    known = Known(0, told)  # type: ignore[arg-type]
    known.told(info(end(1)))
    assert (told.take(), known.complete) == ([], True)
    known.participant_appeared(participant())
    assert (told.take(), known.complete) == ([("node", "/a")], False)
    known.endpoint_appeared(end(1))
    assert told.take() == [("appeared", ("/a", "PUBLISHER", "/x")), ("link", known.peers[PARTICIPANT].session)]
    known.endpoint_appeared(end(1))
    assert (told.take(), known.complete) == ([], True), "told twice, it is there once"
    known.endpoint_changed(end(1, reliable=False))
    assert [kind for kind, _ in told.take()] == ["vanished", "appeared"]
    known.participant_vanished(PARTICIPANT)
    assert [kind for kind, _ in told.take()] == ["vanished", "no link", "no node"]
    known.participant_vanished(PARTICIPANT)
    known.endpoint_appeared(end(1))
    known.endpoint_vanished(end(1))
    assert (told.take(), known.ours(end(1).guid)) == ([], False)


def test_so_many_participants_that_are_not_found_are_remembered_and_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(of_known, "_MOST_EARLY", 0)
    told = Told()
    known = Known(0, told)  # type: ignore[arg-type]
    known.told(info())
    known.participant_appeared(participant())
    assert (told.take(), known.complete) == ([], False)
    known.participant_vanished(PARTICIPANT)
    assert told.take() == [], "it was never complete, so its link was never told"


def test_what_is_no_topic_of_ros_is_not_shown_and_what_others_have_is_as_of_one_node() -> None:
    told = Told()
    known = Known(0, told)  # type: ignore[arg-type]
    known.participant_appeared(participant(b""))
    known.endpoint_appeared(end(1, "robot/other"))
    known.endpoint_appeared(end(3, "rt/x", "unknown_pkg::msg::dds_::Nothing_", user_data=b""))
    known.endpoint_appeared(end(4, "rr/addReply", "example_interfaces::srv::dds_::AddTwoInts_Response_"))
    known.endpoint_vanished(end(1, "robot/other"))
    assert told.take()[1:] == [("appeared", (BARE, "PUBLISHER", "/x"))]
    assert known.peers[PARTICIPANT].ends[end(3).guid].endpoint is not None
    known.endpoint_vanished(end(4, "rr/addReply"))
    assert (known.services, told.take()) == ({}, [])


def test_a_service_is_there_as_long_as_one_of_its_servers() -> None:
    known = Known(0, Told())  # type: ignore[arg-type]
    known.participant_appeared(participant())
    first, second = (
        end(number, "rq/addRequest", "example_interfaces::srv::dds_::AddTwoInts_Request_") for number in (2, 4)
    )
    known.endpoint_appeared(first)
    known.endpoint_appeared(second)
    known.endpoint_vanished(first)
    assert [tuple(ends) for ends in known.services.values()] == [(second.guid,)]
    known.endpoint_vanished(second)
    assert known.services == {}


def test_a_process_tells_its_session_and_place_and_what_is_no_process_is_none() -> None:
    written = write_process(Process("ab1", 7, "my host;"))
    assert written == b"robactor=ab1.7.my_host_;"
    assert parse_process(b"enclave=/;" + written) == Process("ab1", 7, "my_host_")
    assert parse_process(b"enclave=/;robactor=nonsense;") is None


def test_what_is_added_to_a_message_is_found_again_and_nothing_else_is_taken_for_it() -> None:
    for content in (b"", b"x", b"four"):
        assert split_extra(add_extra(b"message!", Extra(content))) == (b"message!", Extra(content))
    for other in (b"", b"short", bytes(40), b"\xff\0\0\0" + b"\0robactr"):
        assert split_extra(other) == (other, Extra())


def test_a_reader_that_two_subscriptions_share_stands_under_its_node_until_both_are_closed() -> None:
    changes: list[int] = []
    node = NodeHere("/a/b", lambda: changes.append(1), lambda _: None)
    for _ in "ab":
        node.add(reader=PARTICIPANT)
    node.remove(reader=PARTICIPANT)
    assert node.entities == NodeEntities("/a", "b", (PARTICIPANT,), ())
    node.remove(reader=PARTICIPANT)
    assert (node.entities.readers, len(changes)) == ((), 4)


def test_as_many_writers_are_not_alive_as_their_reader_counts() -> None:
    told = Told()
    known = Known(0, told)  # type: ignore[arg-type]
    known.participant_appeared(participant())
    ends = [end(number, manual_liveliness=True) for number in (1, 3, 5)]
    for one in ends:
        known.endpoint_appeared(one)
    known.told(info(*ends))
    shown = [known.peers[PARTICIPANT].ends[one.guid].endpoint for one in ends]
    guids = frozenset(one.guid for one in ends)

    def alive() -> list[bool]:
        return [one is not None and one.alive is not None and one.alive() for one in shown]

    def counted(not_alive: int, last: RemoteEndpoint) -> None:
        known.judged(guids, Status("liveliness_changed", 3 - not_alive, -1, not_alive=not_alive, peer=last.guid))

    assert alive() == [True, True, True]
    told.take()
    counted(1, ends[1])
    assert alive() == [True, False, True]
    assert told.take() == [("liveliness", ends[1].guid[12:])]
    counted(1, ends[1])  # another reader says the same
    assert told.take() == []
    counted(3, ends[2])  # two at once, of which only the last is named
    assert alive() == [False, False, False]
    counted(2, ends[0])
    assert alive() == [True, False, False]
    known.endpoint_vanished(ends[1])
    known.judged(guids - {ends[1].guid}, Status("liveliness_changed", 2, 1, not_alive=0, peer=ends[2].guid))
    assert alive() == [True, True, True]
    known.endpoint_appeared(end(7))
    assert known.peers[PARTICIPANT].ends[end(7).guid].endpoint is None
