"""Names and numbers as parts of a key expression.

In a token every slash of a name becomes ``%``, so that a name is one part: ``/robot1/arm`` is ``%robot1%arm``, the root ``%``. Parsers accept
names that ROS 2 would refuse (``/camera-1``), because other peers may use them, but none that could be taken for more than one part, for a
wildcard, or for one of Zenoh's verbatim parts, which begin with ``@``.
"""

from __future__ import annotations

import re
from functools import lru_cache
from typing import Final

from actors.transport.format.errors import refuse

__all__ = [
    "check_chunk",
    "check_name",
    "check_namespace",
    "check_number",
    "check_session",
    "parse_name",
    "parse_namespace",
    "parse_number",
    "write_name",
]

_CHUNK: Final = r"[^/%*$?#@\ud800-\udfff][^/%*$?#\ud800-\udfff]*"
"""A part of a name that stands in a key as it is: no separator, no wildcard, not verbatim, and encodable."""
_WHOLE_CHUNK: Final = re.compile(rf"{_CHUNK}\Z")
_WHOLE_NAME: Final = re.compile(rf"(?:/{_CHUNK})+\Z")
_SESSION: Final = re.compile(r"[0-9a-f]{1,32}\Z")
_NUMBER: Final = re.compile(r"(?:0|[1-9][0-9]{0,19})\Z")
_LIMIT: Final = 2**64


def check_chunk(text: str, what: str) -> str:
    """The text, which must be able to stand in a key as one part. Raises WireFormatError, in which ``what`` names it."""
    if not _WHOLE_CHUNK.match(text):
        raise refuse(text, what, "it is empty, or holds a character that no part of a key may hold")
    return text


def check_name(name: str) -> str:
    """The name, which must be absolute, of at least one part, and able to stand in a key. Raises WireFormatError."""
    if not _WHOLE_NAME.match(name):
        raise refuse(
            name, "an absolute name", "write /name, without empty parts and without any of % * $ ? # and a leading @"
        )
    return name


def check_namespace(namespace: str) -> str:
    """The namespace (or enclave), which is ``/`` or an absolute name. Raises WireFormatError."""
    return namespace if namespace == "/" else check_name(namespace)


def write_name(name: str) -> str:
    """An absolute name, or ``/``, as one part of a token: ``/robot1/arm`` becomes ``%robot1%arm``. Raises WireFormatError."""
    return check_namespace(name).replace("/", "%")


@lru_cache(maxsize=4096)
def parse_name(text: str) -> str:
    """The absolute name that is written as this part of a token. Raises WireFormatError."""
    if "/" in text:
        raise refuse(text, "a name in a token", "a slash separates parts; in a name it is written %")
    return check_name(text.replace("%", "/"))


def parse_namespace(text: str) -> str:
    """The namespace (or enclave) that is written as this part of a token; ``%`` is ``/``. Raises WireFormatError."""
    return "/" if text == "%" else parse_name(text)


def check_session(session: str) -> str:
    """The Zenoh id of a session as Zenoh prints it, 1 to 32 lower-case hex digits. Raises WireFormatError."""
    if not _SESSION.match(session):
        raise refuse(session, "a Zenoh id", "it has 1 to 32 digits 0-9 and a-f")
    return session


def check_number(number: int, what: str) -> int:
    """The number, which must be at least 0 and below 2**64. Raises WireFormatError, in which ``what`` names it."""
    if not 0 <= number < _LIMIT:
        raise refuse(number, what, "it must be at least 0 and below 2**64")
    return number


@lru_cache(maxsize=4096)
def parse_number(text: str, what: str) -> int:
    """A decimal number without sign or padding, below 2**64. Raises WireFormatError, in which ``what`` names it."""
    if not _NUMBER.match(text):
        raise refuse(text, what, "it is not a decimal number without sign and padding, below 2**64")
    return check_number(int(text), what)
