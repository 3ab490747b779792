"""Names, numbers, types and sessions as parts of a key expression.

In a token every slash of a name is written as ``%``, so that a name is one part: ``/robot1/arm`` becomes ``%robot1%arm``, and the root
``%``. Parsers accept names that ROS 2 refuses (``/camera-1``), because other peers may use them. They refuse names that could be taken for
several parts, for a wildcard, or for one of Zenoh's verbatim parts, which begin with ``@``.

A type such as ``std_msgs/msg/String`` is written ``std_msgs::msg::dds_::String_``; a service by its own name, an action by those of its parts:
``pkg::action::dds_::Name_SendGoal_``, ``..Name_GetResult_``, ``..Name_FeedbackMessage_``.
"""

from __future__ import annotations

import re
from functools import lru_cache
from random import Random
from typing import Final

from actors.logs.terminal import CONTROLS
from actors.transport.format.errors import refuse

_CHUNK: Final = rf"[^/%*$?#@\ud800-\udfff{CONTROLS}][^/%*$?#\ud800-\udfff{CONTROLS}]*"
"""A part of a name that is written unchanged: no separator, no wildcard, not verbatim, encodable, and nothing that controls a terminal."""
_LONGEST: Final = 512
"""Characters; those of ROS 2 have 255 at most."""
_WHOLE_CHUNK: Final = re.compile(rf"{_CHUNK}\Z")
_WHOLE_NAME: Final = re.compile(rf"(?:/{_CHUNK})+\Z")
_SESSION: Final = re.compile(r"[0-9a-f]{1,32}\Z")
_NUMBER: Final = re.compile(r"(?:0|[1-9][0-9]{0,19})\Z")
_LIMIT: Final = 2**64


def check_chunk(text: str, what: str) -> str:
    """Return ``text`` if it can be one part of a key. Raises WireFormatError, which calls it ``what``, if it cannot."""
    if len(text) > _LONGEST or not _WHOLE_CHUNK.match(text):
        raise refuse(text, what, "it is empty or too long, or holds a character that no part of a key may hold")
    return text


def check_name(name: str) -> str:
    """Return ``name`` if it is absolute, has at least one part and can be written in a key. Raises WireFormatError if not."""
    if len(name) > _LONGEST or not _WHOLE_NAME.match(name):
        raise refuse(
            name,
            "an absolute name",
            "write /name, without empty parts, control characters, any of % * $ ? # and a leading @, and not too long",
        )
    return name


def check_namespace(namespace: str) -> str:
    """Return a namespace or enclave if it is ``/`` or an absolute name. Raises WireFormatError if it is not."""
    return namespace if namespace == "/" else check_name(namespace)


def write_name(name: str) -> str:
    """Write an absolute name, or ``/``, as one part of a token: ``/robot1/arm`` becomes ``%robot1%arm``. Raises WireFormatError."""
    return check_namespace(name).replace("/", "%")


@lru_cache(maxsize=4096)
def parse_name(text: str) -> str:
    """Parse an absolute name written as one part of a token. Raises WireFormatError."""
    if "/" in text:
        raise refuse(text, "a name in a token", "a slash separates parts; in a name it is written %")
    return check_name(text.replace("%", "/"))


def parse_namespace(text: str) -> str:
    """Parse a namespace or enclave written as one part of a token; ``%`` is ``/``. Raises WireFormatError."""
    return "/" if text == "%" else parse_name(text)


def check_session(session: str) -> str:
    """Return a Zenoh id as printed by Zenoh, if it has 1 to 32 lower-case hex digits. Raises WireFormatError if not."""
    if not _SESSION.match(session):
        raise refuse(session, "a Zenoh id", "it has 1 to 32 digits 0-9 and a-f")
    return session


def check_number(number: int, what: str) -> int:
    """Return ``number`` if it is at least 0 and below 2**64. Raises WireFormatError, which calls it ``what``, if it is not."""
    if not 0 <= number < _LIMIT:
        raise refuse(number, what, "it must be at least 0 and below 2**64")
    return number


@lru_cache(maxsize=4096)
def parse_number(text: str, what: str) -> int:
    """Parse a decimal number below 2**64 without sign or padding. Raises WireFormatError, which calls it ``what``."""
    if not _NUMBER.match(text):
        raise refuse(text, what, "it is not a decimal number without sign and padding, below 2**64")
    return check_number(int(text), what)


NO_TYPE_HASH: Final = "TypeHashNotSupported"
"""What ROS 2 Humble writes instead of a type hash."""

_WORD: Final = "[A-Za-z][A-Za-z0-9_]{0,254}"
_ROS: Final = re.compile(rf"({_WORD})/({_WORD})/({_WORD})\Z")
_DDS: Final = re.compile(rf"({_WORD})::({_WORD})::dds_::({_WORD})_\Z")


@lru_cache(maxsize=1024)
def write_type(name: str) -> str:
    """Write the type ``package/kind/Name`` as part of a key. Raises WireFormatError."""
    found = _ROS.match(name)
    if found is None:
        raise refuse(name, "the name of a type", "write package/kind/Name, as in std_msgs/msg/String")
    return f"{found[1]}::{found[2]}::dds_::{found[3]}_"


@lru_cache(maxsize=1024)
def parse_type(text: str) -> str:
    """Parse a type written as part of a key. Returns ``package/kind/Name``. Raises WireFormatError."""
    found = _DDS.match(text)
    if found is None:
        raise refuse(text, "a type of ROS in a key", "it would read package::kind::dds_::Name_")
    return f"{found[1]}/{found[2]}/{found[3]}"


_MARK: Final = "b0bac708"
"""How the sessions of this library begin; one of four billion others does, too."""


def new_session(rng: Random) -> str:
    """A session that no other process has: 32 digits of hex, the first of them not 0."""
    return f"{_MARK}{rng.getrandbits(96):024x}"


def is_ours(session: str) -> bool:
    """Whether the process is one of this library."""
    return len(session) == 32 and session.startswith(_MARK)
