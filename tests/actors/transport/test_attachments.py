"""The format of `rmw_zenoh` beside the graph: attachments, errors, and the keys of buffers and history."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from actors.errors import CallCycle, NodeRestarting, NotRunning, ServiceFailed
from actors.transport.format.attachments import (
    ATTACHMENT_SIZE,
    Attachment,
    attaching,
    parse_attachment,
    write_attachment,
)
from actors.transport.format.buffers import (
    Backend,
    BufferKey,
    parse_backends,
    write_backends,
    write_buffer_key,
)
from actors.transport.format.errors import WireFormatError
from actors.transport.format.extensions import Extension, Waiting, parse_extension, write_extension
from actors.transport.format.keys import DataKey
from actors.transport.format.names import NO_TYPE_HASH
from actors.transport.format.replies import parse_reply_error, write_reply_error

SESSION = "8b20917502ee955ac4476e0266340d5c"
KEY = DataKey(0, "/chatter", "std_msgs/msg/String", NO_TYPE_HASH)
WRITTEN_KEY = f"0/chatter/std_msgs::msg::dds_::String_/{NO_TYPE_HASH}"
GID = bytes(range(16))


# Attachments and what stands behind them -----------------------------------------------------------------------------------


def test_an_attachment_of_ros_has_33_bytes() -> None:
    written = write_attachment(Attachment(1, 1_700_000_000_000_000_000, GID))

    assert written.hex() == "010000000000000000002a36fe9c971710000102030405060708090a0b0c0d0e0f"
    assert len(written) == ATTACHMENT_SIZE == 33


def test_the_attachments_of_one_publisher_are_written_as_single_ones_are() -> None:
    written: list[tuple[bytes, bytes]] = []
    attaching(GID, lambda *put: written.append(put))(b"payload", 7, 1_700_000_000_000_000_000)

    assert written == [(b"payload", write_attachment(Attachment(7, 1_700_000_000_000_000_000, GID)))]
    with pytest.raises(WireFormatError, match="it has 16 bytes"):
        attaching(GID[:-1], lambda *put: None)


def test_an_extension_stands_behind_the_33_bytes_and_changes_none_of_them() -> None:
    plain = Attachment(5, 6, GID)
    chain = (Waiting(session=SESSION, node_id=3, name="/robot1/talker"), Waiting(session="ff", node_id=0, name="/b"))
    extension = Extension(chain=chain, reason="too far")

    written = write_attachment(plain._replace(extension=write_extension(extension)))

    assert written[:ATTACHMENT_SIZE] == write_attachment(plain)
    assert parse_extension(parse_attachment(written).extension) == extension


def test_bytes_that_are_not_ours_behind_an_attachment_are_no_extension() -> None:
    assert parse_extension(b"") is None
    assert parse_extension(b"RBA\x02whatever") is None
    with pytest.raises(WireFormatError, match="extension of an attachment"):
        parse_extension(b"RBA\x01\x00\x01\x00\x00")
    with pytest.raises(WireFormatError, match="100004 is not the length of an extension of an attachment"):
        parse_extension(write_extension(Extension())[:4].ljust(100_004, b"\0"))
    with pytest.raises(WireFormatError, match="reason"):
        write_extension(Extension(reason="\ud800"))


@pytest.mark.parametrize("data", [b"", bytes(33), write_attachment(Attachment(1, 2, GID))[:-1]])
def test_what_is_no_attachment_is_refused(data: bytes) -> None:
    with pytest.raises(WireFormatError, match="is not an attachment"):
        parse_attachment(data)


@pytest.mark.parametrize(
    "attachment", [Attachment(1, 2, GID[:-1]), Attachment(2**63, 0, GID), Attachment(0, -(2**63) - 1, GID)]
)
def test_what_no_attachment_can_say_is_refused(attachment: Attachment) -> None:
    with pytest.raises(WireFormatError):
        write_attachment(attachment)


@pytest.mark.parametrize(
    "error",
    [
        CallCycle(("/a", "/b")),
        NodeRestarting("/a", 3),
        ServiceFailed("/a", "OSError", "no such file: '\udcff'"),
        NotRunning("/a has stopped"),
    ],
)
def test_an_error_of_a_service_crosses(error: CallCycle | NodeRestarting | ServiceFailed | NotRunning) -> None:
    found = parse_reply_error(write_reply_error(error))

    assert type(found) is type(error)
    assert str(found) == str(error).replace("\udcff", "\\udcff")


@pytest.mark.parametrize(
    "payload", [b"", b"Timeout", b"RBE\x02", b"RBE\x01", write_reply_error(CallCycle(("/a",)))[:-1]]
)
def test_what_is_no_error_of_ours_is_refused(payload: bytes) -> None:
    with pytest.raises(WireFormatError, match="error of one of our peers"):
        parse_reply_error(payload)


def test_an_unknown_kind_of_error_is_refused_by_name() -> None:
    payload = write_reply_error(NotRunning("/a")).replace(b"NotRunning", b"NotWalking")
    with pytest.raises(WireFormatError, match="there is no kind 'NotWalking'"):
        parse_reply_error(payload)


# Buffers and history ---------------------------------------------------------------------------------------------------------


def test_backends_are_sorted_and_escaped() -> None:
    written = write_backends([Backend("cuda", "a/b:50%;"), Backend("cpu")])

    assert written == "backends:cpu:;cuda:a%2Fb%3A50%25%3B"
    assert parse_backends(written) == (Backend("cpu"), Backend("cuda", "a/b:50%;"))
    assert parse_backends("backends:cuda:%2f;cpu:") == (Backend("cpu"), Backend("cuda", "/"))


@pytest.mark.parametrize(
    "text",
    [
        "",
        "cpu:",
        "backends:",
        "backends:cpu",
        "backends:a:b:c",
        "backends:a:%",
        "backends:a:%2A",
        "backends:a:%FF",
        "backends:a:b/c",
    ],
)
def test_what_is_no_list_of_backends_is_refused(text: str) -> None:
    with pytest.raises(WireFormatError):
        parse_backends(text)


def test_no_backends_are_written_as_no_part_at_all() -> None:
    with pytest.raises(WireFormatError, match="it is empty"):
        write_backends([])


def test_the_keys_of_buffers_stand_below_the_data_key() -> None:
    assert write_buffer_key(BufferKey(KEY, None)) == f"{WRITTEN_KEY}/_buf_cpu"
    assert write_buffer_key(BufferKey(KEY, GID)) == f"{WRITTEN_KEY}/_buf/{GID.hex()}"
    with pytest.raises(WireFormatError, match="GID"):
        write_buffer_key(BufferKey(KEY, b""))


def check_refused(call: Callable[[], Any]) -> None:
    with pytest.raises(WireFormatError):
        call()
