"""The forms that ROS 2 has on DDS: both ways, with what peers of another make write, and with bytes that lie."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors import QoS
from actors.interfaces import decode, encode
from actors.interfaces.rmw_dds_common.msg import ParticipantEntitiesInfo
from actors.qos import BEST_AVAILABLE_DURATION, Durability, History, Liveliness, Reliability
from actors.transport.dds.format.names import DdsNames, Role, RosNames, parse_names, write_names
from actors.transport.dds.format.participants import (
    OLD_GID_SIZE,
    NodeEntities,
    ParticipantEntities,
    parse_participant,
    write_participant,
)
from actors.transport.dds.format.qos import EndpointQos, parse_qos, write_qos
from actors.transport.dds.format.requests import RequestId, parse_request, write_request
from actors.transport.dds.format.user_data import (
    EndpointData,
    parse_endpoint_data,
    parse_participant_data,
    write_endpoint_data,
    write_pair_id,
    write_participant_data,
)
from actors.transport.format.errors import WireFormatError
from actors.transport.format.names import NO_TYPE_HASH

HASH = "RIHS01_" + "ab" * 32
GIDS = [bytes((number,)) * 16 for number in range(1, 6)]
TALKER = NodeEntities("/", "talker", tuple(GIDS[1:2]), tuple(GIDS[2:4]))
PARTICIPANT = ParticipantEntities(GIDS[0], (TALKER, NodeEntities("/robot1/arm", "_hidden")))

NAMES = [
    (RosNames(Role.TOPIC, "/chatter", "std_msgs/msg/String"), "rt/chatter", "std_msgs::msg::dds_::String_"),
    (RosNames(Role.TOPIC, "/a/_hidden", "a/msg/B"), "rt/a/_hidden", "a::msg::dds_::B_"),
    (RosNames(Role.REQUEST, "/add", "pkg/srv/Add"), "rq/addRequest", "pkg::srv::dds_::Add_Request_"),
    (RosNames(Role.REPLY, "/add", "pkg/srv/Add"), "rr/addReply", "pkg::srv::dds_::Add_Response_"),
    (
        RosNames(Role.REQUEST, "/xRequest", "pkg/srv/X_Request"),
        "rq/xRequestRequest",
        "pkg::srv::dds_::X_Request_Request_",
    ),
    (
        RosNames(Role.REQUEST, "/fib/_action/send_goal", "pkg/action/Fibonacci_SendGoal"),
        "rq/fib/_action/send_goalRequest",
        "pkg::action::dds_::Fibonacci_SendGoal_Request_",
    ),
    (
        RosNames(Role.TOPIC, "/fib/_action/feedback", "pkg/action/Fibonacci_FeedbackMessage"),
        "rt/fib/_action/feedback",
        "pkg::action::dds_::Fibonacci_FeedbackMessage_",
    ),
    (RosNames(Role.TOPIC, "/chatter", "Foreign::Type"), "rt/chatter", "Foreign::Type"),
    (RosNames(Role.OTHER, "ros_discovery_info", "X"), "ros_discovery_info", "X"),
    (RosNames(Role.OTHER, "lf/state 1", "Foreign::Type"), "lf/state 1", "Foreign::Type"),
    (RosNames(Role.OTHER, "rq/add", "pkg::srv::dds_::Add_Request_"), "rq/add", "pkg::srv::dds_::Add_Request_"),
    (RosNames(Role.OTHER, "rr/Reply", "X"), "rr/Reply", "X"),
    (RosNames(Role.OTHER, "rt", "X"), "rt", "X"),
    (RosNames(Role.OTHER, "rt/", "X"), "rt/", "X"),
    (RosNames(Role.OTHER, "/chatter", "X"), "/chatter", "X"),
]


@pytest.mark.parametrize(("ros", "topic", "type_name"), NAMES)
def test_a_topic_of_dds_is_known_by_its_name_and_type(ros: RosNames, topic: str, type_name: str) -> None:
    assert parse_names(topic, type_name) == ros
    if ros.type != "Foreign::Type" or ros.role is Role.OTHER:
        assert write_names(ros) == DdsNames(topic, type_name)


@pytest.mark.parametrize(
    ("topic", "type_name"),
    [
        ("rt/\x1b[2J", "std_msgs::msg::dds_::String_"),
        ("rt//chatter", "std_msgs::msg::dds_::String_"),
        ("rt/chatter", "\x1b[2J"),
        ("other\x1b[2J", "X"),
        ("x" * 600, "X"),
        ("x", ""),
        ("rq/addRequest", "Foreign::Type"),
        ("rq/addRequest", "pkg::srv::dds_::Add_Response_"),
        ("rq/addRequest", "pkg::srv::dds_::Add_"),
    ],
)
def test_names_that_no_terminal_or_service_could_bear_are_refused(topic: str, type_name: str) -> None:
    with pytest.raises(WireFormatError):
        parse_names(topic, type_name)


@pytest.mark.parametrize("names", [RosNames(Role.TOPIC, "chatter", "a/msg/B"), RosNames(Role.OTHER, "", "X")])
def test_names_that_dds_cannot_have_are_not_written(names: RosNames) -> None:
    with pytest.raises(WireFormatError):
        write_names(names)


def test_a_participant_tells_its_enclave() -> None:
    assert write_participant_data() == b"enclave=/;"
    assert parse_participant_data(write_participant_data("/desk")) == "/desk"
    assert parse_participant_data(b"enclave=/;\0") == "/"  # Fast DDS
    assert parse_participant_data(b"something else") is None
    for enclave in ("/a;b", "/a=b", "/\u00e4", "desk"):
        with pytest.raises(WireFormatError):
            write_participant_data(enclave)


@pytest.mark.parametrize(
    "data",
    [
        EndpointData(),
        EndpointData(HASH),
        EndpointData(HASH, server=write_pair_id(GIDS[0], 1)),
        EndpointData(client=write_pair_id(bytes(range(16)), 2**32 - 1)),
    ],
)
def test_an_endpoint_tells_its_type_hash_and_its_other_half(data: EndpointData) -> None:
    assert parse_endpoint_data(write_endpoint_data(data)) == data


def test_the_id_of_a_server_has_the_form_that_cyclone_writes() -> None:
    participant = bytes.fromhex("0110857c9612a18ab3e0a5ff000001c1")
    assert write_pair_id(participant, 1) == " 1.10.85.7c.96.12.a1.8a.b3.e0.a5.ff.0.0.0.1"
    for gid, number in ((participant[:12], 1), (participant, 2**32), (participant, -1)):
        with pytest.raises(WireFormatError):
            write_pair_id(gid, number)


@pytest.mark.parametrize(
    "data",
    [EndpointData("RIHS01_abc"), EndpointData(HASH, server="x;y=z"), EndpointData(HASH, client="1.2.3")],
)
def test_no_endpoint_tells_what_its_peers_could_not_read(data: EndpointData) -> None:
    with pytest.raises(WireFormatError):
        write_endpoint_data(data)


def test_what_others_write_into_user_data_is_left_alone() -> None:
    assert parse_endpoint_data(b"") == EndpointData(NO_TYPE_HASH)
    assert parse_endpoint_data(b"typehash=nonsense;serviceid=x\x1b;clientid=\xff;") == EndpointData(NO_TYPE_HASH)
    assert parse_endpoint_data(b"mine=1;typehash=" + HASH.encode() + b";\0") == EndpointData(HASH)


@given(st.binary(max_size=200))
def test_any_user_data_can_be_looked_at(data: bytes) -> None:
    parse_endpoint_data(data)
    parse_participant_data(data)


@pytest.mark.parametrize("size", [16, OLD_GID_SIZE])
def test_the_nodes_of_a_participant_are_read_with_either_size_of_gids(size: int) -> None:
    participant = PARTICIPANT._replace(gid_size=size)

    assert parse_participant(write_participant(participant)) == participant
    alone = ParticipantEntities(GIDS[0], (), size)
    assert parse_participant(write_participant(alone)) == alone


def test_they_are_a_message_of_ros() -> None:
    message = decode(ParticipantEntitiesInfo, write_participant(PARTICIPANT))

    assert bytes(message.gid.data) == PARTICIPANT.gid
    assert [(node.node_namespace, node.node_name) for node in message.node_entities_info_seq] == [
        ("/", "talker"),
        ("/robot1/arm", "_hidden"),
    ]
    assert tuple(bytes(gid.data) for gid in message.node_entities_info_seq[0].writer_gid_seq) == TALKER.writers
    assert encode(message) == write_participant(PARTICIPANT)


def test_they_are_read_in_big_endian() -> None:
    node = b"\0\0\0\2/\0\0\0\0\0\0\3ab\0\0\0\0\0\1" + GIDS[1] + b"\0\0\0\0"
    data = bytes(4) + GIDS[0] + b"\0\0\0\1" + node

    assert parse_participant(data) == ParticipantEntities(GIDS[0], (NodeEntities("/", "ab", (GIDS[1],)),))


def text(value: bytes) -> bytes:
    return len(value).to_bytes(4, "little") + value + bytes(-len(value) % 4)


@pytest.mark.parametrize(
    "node",
    [
        text(b"/\0") + text(b"a\0") + b"\xff\xff\xff\xff",
        text(b"/\0") + text(b"a\0") + b"\1\0\0\0",
        text(b"/\0") + text(b"\x1b[2J\0") + bytes(8),
        text(b"/\0") + text(b"a" * 300 + b"\0") + bytes(8),
        text(b"/\0") + text(b"no end") + bytes(8),
        text(b"/\0") + text(b"\xff\0") + bytes(8),
        text(b"a/b\0") + text(b"a\0") + bytes(8),
        text(b"/\0") + text(b"a\0") + bytes(8) + b"left over",
    ],
)
def test_nodes_that_lie_are_refused(node: bytes) -> None:
    with pytest.raises(WireFormatError):
        parse_participant(b"\0\1\0\0" + GIDS[0] + b"\1\0\0\0" + node)


@pytest.mark.parametrize(
    "data", [b"", b"\0\1\0\0", b"\0\3\0\0" + bytes(20), b"\0\1\0\0" + b"\xff" * 20, bytes(5 << 20)]
)
def test_bytes_that_are_no_participant_are_refused(data: bytes) -> None:
    with pytest.raises(WireFormatError):
        parse_participant(data)


@given(st.binary(max_size=200))
def test_any_bytes_are_a_participant_or_refused(data: bytes) -> None:
    try:
        parse_participant(b"\0\1\0\0" + data)
    except WireFormatError:
        pass


@pytest.mark.parametrize(
    "participant",
    [
        ParticipantEntities(b"short", ()),
        ParticipantEntities(GIDS[0], (NodeEntities("/", "a", (b"short",)),)),
        ParticipantEntities(GIDS[0], (NodeEntities("/", "x" * 300),)),
        ParticipantEntities(GIDS[0], (NodeEntities("relative", "x"),)),
    ],
)
def test_a_participant_that_peers_could_not_read_is_not_written(participant: ParticipantEntities) -> None:
    with pytest.raises(WireFormatError):
        write_participant(participant)


def test_a_request_carries_its_identity_before_its_message() -> None:
    request, message = RequestId(2**64 - 2, -5), b"\0\1\0\0" + bytes(range(16))

    data = write_request(request, message)

    assert data[4:20] == b"\xfe" + b"\xff" * 7 + b"\xfb" + b"\xff" * 7
    assert data[20:] == message[4:]
    assert parse_request(data) == (request, message)
    assert parse_request(bytes(4) + bytes(7) + b"\2" + bytes(7) + b"\3xyz") == (RequestId(2, 3), bytes(4) + b"xyz")


def test_requests_without_identity_are_refused() -> None:
    for data in (b"", b"\0\1\0\0" + bytes(15), b"\0\7\0\0" + bytes(16)):
        with pytest.raises(WireFormatError):
            parse_request(data)
    for request, message in (
        (RequestId(2**64, 1), b"\0\1\0\0"),
        (RequestId(1, 1), b"\0\1"),
        (RequestId(1, 1), bytes(8)),
    ):
        with pytest.raises(WireFormatError):
            write_request(request, message)


PROFILES = [
    (QoS(depth=7, liveliness=Liveliness.AUTOMATIC), EndpointQos(depth=7)),
    (
        QoS(
            depth=1,
            reliability=Reliability.BEST_EFFORT,
            durability=Durability.TRANSIENT_LOCAL,
            deadline=2.0,
            lifespan=0.5,
            liveliness=Liveliness.MANUAL_BY_TOPIC,
            liveliness_lease=3.0,
        ),
        EndpointQos(
            reliable=False, transient_local=True, deadline=2.0, lifespan=0.5, manual_liveliness=True, lease=3.0
        ),
    ),
    (
        QoS(history=History.KEEP_ALL, liveliness=Liveliness.AUTOMATIC),
        EndpointQos(keep_all=True, depth=10),
    ),
]


@pytest.mark.parametrize(("qos", "policies"), PROFILES)
def test_a_profile_is_a_set_of_policies(qos: QoS, policies: EndpointQos) -> None:
    assert write_qos(qos) == policies
    assert parse_qos(policies) == qos


def test_a_profile_leaves_to_dds_what_it_does_not_specify() -> None:
    default = EndpointQos()
    assert write_qos(QoS(history=History.SYSTEM_DEFAULT, depth=0, reliability=Reliability.SYSTEM_DEFAULT)) == default
    assert write_qos(QoS(depth=7, lifespan=1e300, deadline=1e-12)) == EndpointQos(depth=7, deadline=1e-9)
    assert write_qos(QoS(depth=1, deadline=BEST_AVAILABLE_DURATION)) == default


def test_the_history_of_a_peer_that_does_not_send_it_is_unknown() -> None:
    assert parse_qos(EndpointQos(), history_known=False).history is History.UNKNOWN
    assert parse_qos(EndpointQos(keep_all=True), history_known=False).history is History.UNKNOWN
    assert parse_qos(EndpointQos(depth=-1, deadline=-5.0, lifespan=0.0)) == QoS(
        depth=1, liveliness=Liveliness.AUTOMATIC
    )
