"""The additional keys of topics whose type has an unbounded ``uint8[]`` field, as used by ROS 2 Lyrical and later.

A volatile subscription of such a type may list in its token the memories from which it can read (`Backend`). Its publisher then writes to
one of two kinds of keys below the data key ``K``: ``K/_buf_cpu``, shared by all subscriptions that list only plain CPU memory, or
``K/_buf/<GID>`` for one subscription.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Final, NamedTuple

from actors.transport.format.errors import refuse
from actors.transport.format.gids import GID_SIZE
from actors.transport.format.keys import DataKey, write_key


class Backend(NamedTuple):
    """A kind of memory from which a subscription can read."""

    name: str
    metadata: str = ""


CPU: Final = (Backend("cpu"),)
"""The list of a subscription that reads only ordinary messages."""


class BufferKey(NamedTuple):
    """A key below a data key."""

    data_key: DataKey
    gid: bytes | None
    """The only subscription that reads the key; None for the key shared by those that list `CPU`."""


_PREFIX: Final = "backends:"
_ESCAPES: Final = {character: f"%{ord(character):02X}" for character in "%;:/"}
_ESCAPED: Final = re.compile("[%;:/]")
_UNESCAPED: Final = re.compile(r"%(?:([0-9A-Fa-f]{2})|)")
_FORBIDDEN: Final = re.compile(r"[*$?#\ud800-\udfff]")


def write_backends(backends: Iterable[Backend]) -> str:
    """Write the last part of a token, sorted by name: ``backends:cpu:``. Raises WireFormatError."""
    listed = sorted(backends)
    for backend in listed:
        for field in backend:
            if _FORBIDDEN.search(field):
                raise refuse(backend, "a backend", "no key may hold any of * $ ? #")
    if not listed:
        raise refuse(backends, "a list of backends", "it is empty")
    return _PREFIX + ";".join(
        ":".join(_ESCAPED.sub(lambda it: _ESCAPES[it[0]], field) for field in one) for one in listed
    )


def parse_backends(text: str) -> tuple[Backend, ...]:
    """Parse this part of a token. Returns the memories that it lists, sorted. Raises WireFormatError."""
    if not text.startswith(_PREFIX) or _FORBIDDEN.search(text) or "/" in text:
        raise refuse(text, "a list of backends", "it would read backends:name:metadata, several with ; between them")
    found: list[Backend] = []
    for one in text.removeprefix(_PREFIX).split(";"):
        fields = [_unescape(field) for field in one.split(":")]
        if len(fields) != 2:
            raise refuse(text, "a list of backends", "each would read name:metadata")
        found.append(Backend(*fields))
    return tuple(sorted(found))


def _unescape(field: str) -> str:
    def character(found: re.Match[str]) -> str:
        code = int(found[1] or "0", 16)
        if not 0 < code < 128 or _FORBIDDEN.match(chr(code)):
            raise refuse(field, "a field of a backend", "it has a % that does not begin an escaped character")
        return chr(code)

    return _UNESCAPED.sub(character, field)


def write_buffer_key(key: BufferKey) -> str:
    """Write a buffer key as a key expression. Raises WireFormatError."""
    below = "_buf_cpu"
    if key.gid is not None:
        if len(key.gid) != GID_SIZE:
            raise refuse(key.gid, "a GID", f"it has {GID_SIZE} bytes")
        below = f"_buf/{key.gid.hex()}"
    return f"{write_key(key.data_key)}/{below}"
