"""Laws of the format of `rmw_zenoh`: writers and parsers are inverse, and no input makes either raise anything but its one error."""

from __future__ import annotations

import contextlib
import string
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from actors import QoS
from actors.errors import CallCycle, NodeRestarting, NotRunning, ServiceFailed
from actors.qos import BEST_AVAILABLE_DURATION, Durability, History, Liveliness, Reliability
from actors.transport.format import attachments, buffers, extensions, keys, names, qos, replies, tokens
from actors.transport.format.errors import WireFormatError
from actors.transport.format.gids import GID_SIZE, gid_of

NANOSECONDS_OF_50_DAYS = 50 * 86400 * 10**9

numbers = st.integers(0, 2**64 - 1)
sessions = st.text("0123456789abcdef", min_size=1, max_size=32)
gids = st.binary(min_size=GID_SIZE, max_size=GID_SIZE)
chunks = st.text(
    st.characters(exclude_characters="/%*$?#@", exclude_categories=("Cs", "Cc", "Cf", "Zl", "Zp")),
    min_size=1,
    max_size=12,
)
full_names = st.lists(chunks, min_size=1, max_size=4).map(lambda parts: "/" + "/".join(parts))
namespaces = st.just("/") | full_names
words = st.builds(
    str.__add__, st.sampled_from(string.ascii_letters), st.text(string.ascii_letters + string.digits + "_", max_size=8)
)
type_names = st.tuples(words, st.sampled_from(["msg", "srv", "action"]), words).map("/".join)
hashes = st.just(names.NO_TYPE_HASH) | st.text("0123456789abcdef", min_size=64, max_size=64).map("RIHS01_".__add__)
seconds = st.none() | st.integers(1, NANOSECONDS_OF_50_DAYS).map(lambda nanoseconds: nanoseconds / 10**9)
may_follow = seconds | st.just(BEST_AVAILABLE_DURATION)
known = [Liveliness.AUTOMATIC, Liveliness.MANUAL_BY_TOPIC, Liveliness.BEST_AVAILABLE, Liveliness.UNKNOWN]
profiles = st.builds(
    QoS,
    history=st.sampled_from([History.KEEP_LAST, History.UNKNOWN]),
    depth=st.integers(1, 2**64 - 1),
    reliability=st.sampled_from([one for one in Reliability if one is not Reliability.SYSTEM_DEFAULT]),
    durability=st.sampled_from([one for one in Durability if one is not Durability.SYSTEM_DEFAULT]),
    deadline=may_follow,
    lifespan=seconds,
    liveliness=st.sampled_from(known),
    liveliness_lease=may_follow,
) | st.just(QoS(history=History.KEEP_ALL, liveliness=Liveliness.AUTOMATIC))
data_keys = st.builds(keys.DataKey, numbers, full_names, type_names, hashes)
fields = st.text(st.characters(exclude_characters="*$?#", exclude_categories=("Cs",)), max_size=8)
backends = st.lists(st.builds(buffers.Backend, fields, fields), min_size=1, max_size=3).map(
    lambda some: tuple(sorted(some))
)
nodes = st.builds(tokens.NodeToken, numbers, sessions, numbers, chunks, namespaces, namespaces)
endpoints = st.builds(
    tokens.EndpointToken,
    nodes,
    numbers,
    st.sampled_from(tokens.EndpointKind),
    full_names,
    type_names,
    hashes,
    profiles,
    st.just(()) | backends,
)
int64 = st.integers(-(2**63), 2**63 - 1)
unicode = st.text(st.characters(exclude_categories=("Cs",)), max_size=20)
waiting = st.builds(extensions.Waiting, session=unicode, node_id=numbers, name=unicode)

PAIRS: dict[str, tuple[st.SearchStrategy[Any], Callable[[Any], Any], Callable[[Any], Any]]] = {
    "name": (namespaces, names.write_name, names.parse_namespace),
    "type": (type_names, names.write_type, names.parse_type),
    "key": (data_keys, keys.write_key, keys.parse_key),
    "qos": (profiles, qos.write_qos, qos.parse_qos),
    "backends": (backends, buffers.write_backends, buffers.parse_backends),
    "node token": (nodes, tokens.write_token, tokens.parse_token),
    "endpoint token": (endpoints, tokens.write_token, tokens.parse_token),
    "attachment": (
        st.builds(attachments.Attachment, int64, int64, gids, st.binary(max_size=40)),
        attachments.write_attachment,
        attachments.parse_attachment,
    ),
    "extension": (
        st.builds(extensions.Extension, chain=st.lists(waiting, max_size=3), reason=unicode),
        extensions.write_extension,
        extensions.parse_extension,
    ),
}
TEXTS = [name for name in PAIRS if name not in ("attachment", "extension")]


@pytest.mark.parametrize("name", PAIRS)
@given(data=st.data())
def test_what_is_written_is_read_as_it_was_and_written_again_the_same(name: str, data: st.DataObject) -> None:
    values, write, parse = PAIRS[name]
    value = data.draw(values)

    written = write(value)

    assert parse(written) == value
    assert write(parse(written)) == written


@pytest.mark.parametrize("name", TEXTS)
@given(data=st.data())
def test_what_is_written_is_a_key_expression_without_wildcards(name: str, data: st.DataObject) -> None:
    values, write, _ = PAIRS[name]
    written = write(data.draw(values))

    key, _, _parameters = written.partition("?")  # only a query has parameters
    key = key.removesuffix("/**")  # and only a query to all publishers is meant for many
    written.encode()
    assert not set(key) & set("*$?#")
    assert all(key.split("/"))


soup = st.text("/%:;,_@*?=0129ab\x00 ", max_size=40)
PARTS = (
    "@ros2_lv 0 12 ff NN MP % %a a RIHS01_0 ::,10:,:,:,, backends:cpu: _buf _buf_cpu std_msgs::msg::dds_::String_ @adv pub _"
    " _?_max=1;_anyke **?_max=1;_anyke \u0663 999999999999999999999 0123456789abcdef0123456789abcdef"
)
pieces = st.lists(st.sampled_from(["", *PARTS.split()]), max_size=15).map("/".join)


@pytest.mark.parametrize("name", TEXTS)
@given(text=st.text(max_size=40) | soup | pieces)
@example(text="@ros2_lv/0/a/0/0/XX/%/%/a")
@example(text="9" * 5000)
@example(text="0::2,:,:,:,,")
@example(text="\ud800")
def test_no_text_makes_a_parser_raise_anything_but_its_error(name: str, text: str) -> None:
    _, write, parse = PAIRS[name]
    try:
        value = parse(text)
    except WireFormatError:
        return
    assert write(parse(write(value))) == write(value)  # a peer's `system_default` is written as the default


@pytest.mark.parametrize("name", TEXTS)
@given(data=st.data())
def test_no_damage_to_a_written_text_makes_a_parser_raise_anything_but_its_error(
    name: str, data: st.DataObject
) -> None:
    values, write, parse = PAIRS[name]
    written = write(data.draw(values))
    start = data.draw(st.integers(0, len(written)))
    end = data.draw(st.integers(start, len(written)))
    damaged = written[:start] + data.draw(soup) + written[end:]
    try:
        value = parse(damaged)
    except WireFormatError:
        return
    assert write(parse(write(value))) == write(value)


attachment_bytes = st.binary(max_size=60) | st.builds(
    bytes.__add__, st.binary(min_size=16, max_size=16), st.binary(max_size=40).map(b"\x10".__add__)
)
ours = st.builds(
    bytes.__add__,
    st.sampled_from([b"RBA\x01", b"RBE\x01", b"RBE\x01\x00\x01\x00\x00", b"RBA\x01\x00\x00\x00\x00"]),
    st.binary(max_size=60),
)


@given(attachment_bytes | ours)
def test_no_bytes_make_a_parser_raise_anything_but_its_error(data: bytes) -> None:
    for parse in (attachments.parse_attachment, extensions.parse_extension, replies.parse_reply_error):
        with contextlib.suppress(WireFormatError):
            parse(data)


errors = st.one_of(
    st.builds(CallCycle, st.lists(unicode, min_size=1, max_size=3).map(tuple)),
    st.builds(NodeRestarting, unicode, numbers),
    st.builds(ServiceFailed, unicode, unicode, unicode),
    st.builds(NotRunning, unicode),
)


@given(errors)
def test_an_error_of_a_service_arrives_as_it_was_raised(error: replies.ReplyError) -> None:
    found = replies.parse_reply_error(replies.write_reply_error(error))

    assert type(found) is type(error)
    assert str(found) == str(error)
    assert vars(found) == vars(error)


@given(st.text(max_size=20), st.binary(max_size=60), st.integers(0))
def test_damage_to_an_error_of_a_service_is_its_parsers_own_error(text: str, noise: bytes, place: int) -> None:
    payload = bytearray(replies.write_reply_error(ServiceFailed("/n", "KeyError", text)))
    place %= len(payload)
    payload[place : place + len(noise)] = noise
    try:
        found = replies.parse_reply_error(bytes(payload))
    except WireFormatError:
        return
    assert isinstance(found, (CallCycle, NodeRestarting, ServiceFailed, NotRunning))


@given(endpoints | nodes)
def test_a_gid_has_16_bytes_and_belongs_to_one_token(token: tokens.NodeToken | tokens.EndpointToken) -> None:
    written = tokens.write_token(token)

    assert len(gid_of(written)) == GID_SIZE
    assert gid_of(written) == gid_of(str(written))
    assert gid_of(written) != gid_of(written + "0")


@given(endpoints)
def test_the_key_of_an_endpoint_is_that_of_its_topic_in_its_domain(endpoint: tokens.EndpointToken) -> None:
    written = keys.write_key(endpoint.key)

    assert written.startswith(f"{endpoint.node.domain_id}{endpoint.name}/")
    assert keys.parse_key(written) == endpoint.key


@given(st.floats(min_value=1e-9, max_value=1e12) | st.just(1e300))
def test_any_duration_is_written_and_read_again_within_the_precision_of_a_float(duration: float) -> None:
    found = qos.parse_qos(qos.write_qos(QoS(depth=1, deadline=duration))).deadline

    if duration >= 9223372036.85:
        assert found is None
    else:
        assert found == pytest.approx(duration, abs=1e-9, rel=1e-15)
