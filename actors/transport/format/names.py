"""Names and numbers as parts of a key expression.

In a token every slash of a name is written as ``%``, so that a name is one part: ``/robot1/arm`` becomes ``%robot1%arm``, and the root
``%``. Parsers accept names that ROS 2 refuses (``/camera-1``), because other peers may use them. They refuse names that could be taken for
several parts, for a wildcard, or for one of Zenoh's verbatim parts, which begin with ``@``.
"""

from __future__ import annotations

import re
from functools import lru_cache
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
