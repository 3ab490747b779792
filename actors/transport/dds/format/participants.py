"""The topic ``ros_discovery_info``: the nodes of each participant, and which of its readers and writers each node has.

A message is a ``rmw_dds_common/msg/ParticipantEntitiesInfo`` in CDR. A GID is the GUID of a participant, reader or writer: 12 bytes of the
participant and 4 of the entity. It is sent as 16 bytes, and in ROS 2 Humble and older as 24, the last 8 of which are 0; the length of a
message tells which.
"""

from __future__ import annotations

import struct
from contextlib import suppress
from typing import Final, NamedTuple

from actors.transport.format.errors import WireFormatError, refuse
from actors.transport.format.names import check_chunk, check_namespace

GUID_SIZE: Final = 16
"""The size of a GID, in bytes."""
OLD_GID_SIZE: Final = 24
"""Its size in messages of ROS 2 Humble and older."""

_ORDERS: Final = {b"\x00\x01": "<I", b"\x00\x00": ">I"}
_LONGEST: Final = 4 << 20
"""Bytes of a message; a thousand nodes of a dozen endpoints each take 300 kB."""
_LONGEST_TEXT: Final = 256
_NUMBER: Final = struct.Struct("<I")


class NodeEntities(NamedTuple):
    """A node, and the GIDs of its endpoints: subscriptions, and both ends of servers and clients, too."""

    namespace: str
    name: str
    readers: tuple[bytes, ...] = ()
    writers: tuple[bytes, ...] = ()


class ParticipantEntities(NamedTuple):
    """All nodes of a participant."""

    gid: bytes
    """That of the participant, 16 bytes; the sender of the message may have written another's."""
    nodes: tuple[NodeEntities, ...]
    gid_size: int = GUID_SIZE
    """The size of GIDs in the message: `GUID_SIZE` or `OLD_GID_SIZE`."""
    swapped: bool = False
    """Whether its bytes are in another order than its head says."""


def write_participant(participant: ParticipantEntities) -> bytes:
    """Write the message of a participant. Raises WireFormatError."""
    rest = bytes(participant.gid_size - GUID_SIZE)
    out = bytearray(b"\x00\x01\x00\x00")
    _write_gid(out, participant.gid, rest)
    out += _NUMBER.pack(len(participant.nodes))
    for node in participant.nodes:
        _write_text(out, check_namespace(node.namespace))
        _write_text(out, check_chunk(node.name, "the name of a node"))
        for gids in (node.readers, node.writers):
            out += _NUMBER.pack(len(gids))
            for gid in gids:
                _write_gid(out, gid, rest)
    return bytes(out)


def _write_gid(out: bytearray, gid: bytes, rest: bytes) -> None:
    if len(gid) != GUID_SIZE:
        raise refuse(gid, "a GID", f"it has {GUID_SIZE} bytes")
    out += gid
    out += rest


def _write_text(out: bytearray, text: str) -> None:
    data = text.encode()
    if len(data) > _LONGEST_TEXT:
        raise refuse(text, "the name or namespace of a node", f"it has at most {_LONGEST_TEXT} bytes")
    out += _NUMBER.pack(len(data) + 1)
    out += data
    out += bytes(4 - len(data) % 4)  # with the NUL at the end


def parse_participant(data: bytes) -> ParticipantEntities:
    """Parse the message of a participant, in either byte order and with either size of GIDs. Raises WireFormatError.

    Cyclone DDS gives every message the head of this machine, and leaves its bytes as they are: what makes no sense as the head says may be of
    a machine with the other order.
    """
    if len(data) > _LONGEST or data[:2] not in _ORDERS:
        raise refuse(data[:40], "a message of ros_discovery_info", f"it is plain CDR, at most {_LONGEST} bytes")
    told = _ORDERS[data[:2]]
    for order in sorted(_ORDERS.values(), key=lambda order: order != told):
        for size in (GUID_SIZE, OLD_GID_SIZE):
            with suppress(WireFormatError):
                return _Reader(data, size, order).participant()._replace(swapped=order != told)
    return _Reader(data, GUID_SIZE, told).participant()


class _Reader:
    """Reads one message from its start, if its GIDs have `size` bytes. What it takes is bounded by the bytes that are there."""

    def __init__(self, data: bytes, size: int, order: str) -> None:
        self.data = data
        self.size = size
        self.order = struct.Struct(order)
        self.at = 4

    def participant(self) -> ParticipantEntities:
        gid = self.take(self.size)[:GUID_SIZE]
        nodes = tuple(self.node() for _ in range(self.number()))
        if len(self.data) - self.at > 3:
            raise refuse(self.data[:40], "a message of ros_discovery_info", "bytes are left over")
        return ParticipantEntities(gid, nodes, self.size)

    def node(self) -> NodeEntities:
        namespace = check_namespace(self.text())
        name = check_chunk(self.text(), "the name of a node")
        return NodeEntities(namespace, name, self.gids(), self.gids())

    def gids(self) -> tuple[bytes, ...]:
        size = self.size
        found = self.take(self.number() * size)
        return tuple([found[at : at + GUID_SIZE] for at in range(0, len(found), size)])

    def text(self) -> str:
        length = self.number()
        text = self.take(length)
        if not text.endswith(b"\0") or length > _LONGEST_TEXT + 1:
            raise refuse(
                text[:40], "a text of ros_discovery_info", f"it ends with a NUL after {_LONGEST_TEXT} bytes at most"
            )
        try:
            return text[:-1].decode()
        except UnicodeDecodeError:
            raise refuse(text, "a text of ros_discovery_info", "it is not UTF-8") from None

    def number(self) -> int:
        self.at += -self.at % 4
        (number,) = self.order.unpack(self.take(4))
        return int(number)

    def take(self, size: int) -> bytes:
        start, self.at = self.at, self.at + size
        if self.at > len(self.data):
            raise refuse(self.data[:40], "a message of ros_discovery_info", f"it ends after {len(self.data)} bytes")
        return self.data[start : self.at]
