"""The format of `rmw_zenoh` where a property does not say it: what is refused and how, and what other peers may write."""

from __future__ import annotations

import subprocess
import sys

import pytest

from actors import QoS, qos
from actors.names.names import action_names
from actors.qos import Durability, History, Liveliness, Reliability
from actors.transport.format.buffers import CPU, Backend
from actors.transport.format.errors import WireFormatError
from actors.transport.format.gids import gid_of
from actors.transport.format.keys import DataKey, parse_key, write_key
from actors.transport.format.names import NO_TYPE_HASH, parse_name, parse_namespace, parse_type, write_name, write_type
from actors.transport.format.qos import parse_qos, write_qos
from actors.transport.format.tokens import EndpointKind, EndpointToken, NodeToken, graph_of, parse_token, write_token

SESSION = "8b20917502ee955ac4476e0266340d5c"
NODE = NodeToken(0, SESSION, 3, "talker", "/robot1")
KEY = DataKey(0, "/chatter", "std_msgs/msg/String", NO_TYPE_HASH)
WRITTEN_KEY = f"0/chatter/std_msgs::msg::dds_::String_/{NO_TYPE_HASH}"
AUTOMATIC = QoS(depth=10, liveliness=Liveliness.AUTOMATIC)
ENDPOINT = EndpointToken(NODE, 4, EndpointKind.SUBSCRIPTION, "/chatter", KEY.type, KEY.type_hash, AUTOMATIC)
WRITTEN_NODE = f"@ros2_lv/0/{SESSION}/3/3/NN/%/%robot1/talker"
WRITTEN_ENDPOINT = (
    f"@ros2_lv/0/{SESSION}/3/4/MS/%/%robot1/talker/%chatter/std_msgs::msg::dds_::String_/{NO_TYPE_HASH}/::,10:,:,:,,"
)


# Names and keys --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["/camera-1/image", "/9lives", "/gr\u00fcn", "/a b", "/x:y;z,w", "/a@b"])
def test_names_that_ros_would_refuse_are_carried_because_other_peers_may_use_them(name: str) -> None:
    assert parse_name(write_name(name)) == name
    assert parse_key(write_key(KEY._replace(name=name))).name == name


@pytest.mark.parametrize(
    "name",
    [
        "",
        "chatter",
        "/",
        "/a/",
        "//a",
        "/a//b",
        "/a*",
        "/**",
        "/$*",
        "/a?b",
        "/a#b",
        "/a%b",
        "/@adv",
        "/\ud800",
        "/\x00",
        "/a\x1b[31m",
        "/a\nb",
        "/a\x9b",
        "/a\u202e",
        "/" + "a" * 600,
    ],
)
def test_names_that_no_exact_key_can_hold_are_refused(name: str) -> None:
    with pytest.raises(WireFormatError, match="absolute name"):
        write_key(KEY._replace(name=name))
    with pytest.raises(WireFormatError):
        write_token(ENDPOINT._replace(name=name))


def test_the_root_is_a_namespace_and_no_name() -> None:
    assert write_name("/") == "%"
    assert parse_namespace("%") == "/"
    with pytest.raises(WireFormatError, match="absolute name"):
        parse_name("%")


def test_a_slash_in_a_name_of_a_token_is_refused() -> None:
    with pytest.raises(WireFormatError, match="in a name it is written %"):
        parse_name("%a/b")


@pytest.mark.parametrize(
    "name", ["String", "std_msgs/String", "std_msgs/msg/detail/String", "9/msg/A", "a/msg/A::B", "a/msg/", ""]
)
def test_what_is_no_name_of_a_type_is_refused(name: str) -> None:
    with pytest.raises(WireFormatError, match="write package/kind/Name"):
        write_type(name)


@pytest.mark.parametrize(
    "text", ["std_msgs/msg/String", "std_msgs::msg::String_", "std_msgs::msg::dds_::String", "_buf_cpu", ""]
)
def test_what_is_no_type_in_a_key_is_refused(text: str) -> None:
    with pytest.raises(WireFormatError, match="package::kind::dds_::Name_"):
        parse_type(text)


def test_an_action_has_five_keys() -> None:
    names = action_names("/fibonacci")
    types = ("_SendGoal", "", "_GetResult", "_FeedbackMessage", "")
    written = [
        write_key(DataKey(7, name, f"example_interfaces/action/Fibonacci{part}" if part else "action_msgs/msg/X", "H"))
        for name, part in zip(names, types, strict=True)
    ]
    assert written[0] == "7/fibonacci/_action/send_goal/example_interfaces::action::dds_::Fibonacci_SendGoal_/H"
    assert written[3] == "7/fibonacci/_action/feedback/example_interfaces::action::dds_::Fibonacci_FeedbackMessage_/H"
    assert [parse_key(text).name for text in written] == list(names)


@pytest.mark.parametrize(
    "text",
    [
        "0/std_msgs::msg::dds_::String_/H",
        "00/chatter/std_msgs::msg::dds_::String_/H",
        "-1/chatter/std_msgs::msg::dds_::String_/H",
        "\u0663/chatter/std_msgs::msg::dds_::String_/H",
        "18446744073709551616/chatter/std_msgs::msg::dds_::String_/H",
        "0/chatter//std_msgs::msg::dds_::String_/H",
        "0/chatter/std_msgs::msg::dds_::String_/",
        f"{WRITTEN_KEY}/@adv/pub/{SESSION}/6/_",
        f"{WRITTEN_KEY}/_buf_cpu",
    ],
)
def test_what_is_no_data_key_is_refused(text: str) -> None:
    with pytest.raises(WireFormatError):
        parse_key(text)


def test_a_domain_is_a_number_that_can_be_written() -> None:
    assert graph_of(0) == "@ros2_lv/0/**"
    for domain in (-1, 2**64):
        with pytest.raises(WireFormatError, match="domain id"):
            graph_of(domain)


def test_an_error_shows_the_start_of_a_long_text() -> None:
    with pytest.raises(WireFormatError) as caught:
        parse_key("x" * 10_000)
    assert str(caught.value).startswith("'xxx")
    assert len(str(caught.value)) < 500


# Tokens ----------------------------------------------------------------------------------------------------------------


def test_tokens_say_what_their_values_say() -> None:
    assert write_token(NODE) == WRITTEN_NODE
    assert write_token(ENDPOINT) == WRITTEN_ENDPOINT
    assert write_token(ENDPOINT._replace(backends=CPU)) == f"{WRITTEN_ENDPOINT}/backends:cpu:"
    assert write_key(ENDPOINT.key) == WRITTEN_KEY


def test_further_parts_and_the_second_number_of_a_node_are_ignored() -> None:
    assert parse_token(f"{WRITTEN_NODE}/more/parts") == NODE
    assert parse_token(WRITTEN_NODE.replace("/3/3/", "/3/8/")) == NODE
    assert parse_token(f"{WRITTEN_ENDPOINT}/backends:cpu:/more") == ENDPOINT._replace(backends=CPU)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("@ros2_lv", "@ros2"),
        (SESSION, SESSION.upper()),
        (SESSION, ""),
        ("/3/4/", "/x/4/"),
        ("/3/4/", "/3/ 4/"),
        ("/MS/", "/MX/"),
        ("/talker/", "/tal%ker/"),
        ("/talker/", "//"),
        ("/%robot1/", "/robot1/"),
        ("/::,10:,:,:,,", ""),
        (":,10:", ":,ten:"),
        (":,10:", ":9,10:"),
        ("::,10:,:,:,,", "::,10:,:,:,"),
        ("::,10:,:,:,,", "::,10:,:"),
        ("::,10:,:,:,,", "::,10:,:,:,,/backends"),
    ],
)
def test_what_is_no_token_is_refused(old: str, new: str) -> None:
    assert old in WRITTEN_ENDPOINT
    with pytest.raises(WireFormatError):
        parse_token(WRITTEN_ENDPOINT.replace(old, new))


@pytest.mark.parametrize(
    "token",
    [
        NODE._replace(session="XYZ"),
        NODE._replace(name="a/b"),
        NODE._replace(namespace="a"),
        NODE._replace(enclave=""),
        NODE._replace(node_id=-1),
        ENDPOINT._replace(endpoint_id=2**64),
        ENDPOINT._replace(type="String"),
        ENDPOINT._replace(type_hash=""),
        ENDPOINT._replace(backends=(Backend("a*"),)),
    ],
)
def test_what_no_token_can_say_is_refused(token: NodeToken | EndpointToken) -> None:
    with pytest.raises(WireFormatError):
        write_token(token)


def test_a_gid_is_made_of_the_whole_token() -> None:
    assert gid_of(f"@ros2_lv/0/{SESSION}/0/0/NN/%/%/talker").hex() == "82f480988f49d464f0f2c507f2f1a8c6"


# Quality of service ------------------------------------------------------------------------------------------------------


def test_every_profile_can_be_announced() -> None:
    for name in qos.profile_names():
        written = write_qos(qos.profile(name))
        assert write_qos(parse_qos(written)) == written


def test_what_the_format_cannot_say_is_written_as_its_default() -> None:
    assert write_qos(qos.SYSTEM_DEFAULT) == "::,:,:,:,,"
    assert write_qos(QoS(history=History.KEEP_ALL, depth=7, limit=3)) == "::2,:,:,:,,"
    assert write_qos(QoS(depth=1, deadline=float("inf"))) == "::,1:,:,:,,"


def test_best_available_policies_have_numbers_of_their_own() -> None:
    assert write_qos(qos.BEST_AVAILABLE) == "4:4:,10:,854775806:,:5,,854775806"
    assert parse_qos("4:4:,10:,854775806:,:5,,854775806") == qos.BEST_AVAILABLE
    assert parse_qos("::,10:,:,854775806:,,").lifespan is None


def test_numbers_that_ros_never_writes_are_read() -> None:
    said = parse_qos("0:0:0,0:0,0:0,0:0,0,0:further:parts")

    assert (said.reliability, said.durability) == (Reliability.SYSTEM_DEFAULT, Durability.SYSTEM_DEFAULT)
    assert (said.history, said.liveliness, said.depth) == (History.SYSTEM_DEFAULT, Liveliness.SYSTEM_DEFAULT, 42)
    assert (said.deadline, said.lifespan, said.liveliness_lease) == (None, None, None)


def test_the_odd_choice_of_a_peer_warns_nobody_here() -> None:
    said = parse_qos("2::2,:,:,:,,")  # a warning would be an error in this test
    assert said.keep_all
    assert not said.reliable


def test_who_is_not_on_a_network_loads_nothing_for_it() -> None:
    code = "import sys, actors.transport.format.tokens; sys.exit('zenoh' in sys.modules or 'xxhash' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], timeout=60).returncode == 0
