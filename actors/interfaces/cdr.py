"""Messages as bytes: classic CDR (XCDR1, plain), as all ROS 2 middlewares write it.

Encoder and decoder of a type are generated and compiled when it is first encoded or decoded.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any, Final, TypeAlias, cast

from actors.interfaces.cdr_decode import Decoder, compile_decoder
from actors.interfaces.cdr_encode import compile_encoder
from actors.interfaces.cdr_layout import WStrings
from actors.interfaces.errors import CdrError, InterfaceError
from actors.interfaces.message import M, Message

Bytes: TypeAlias = bytes | bytearray | memoryview
"""Encoded messages, as `decode` takes them."""

UNUSUAL: Final = (CdrError, struct.error, InterfaceError)

_encoders: dict[tuple[type[Message], WStrings], Callable[[Any], bytes]] = {}
_decoders: dict[tuple[type[Message], WStrings, str], Decoder] = {}
_usual_encoders: dict[type[object], Callable[[Any], bytes]] = {}
_usual_decoders: dict[type[object], Decoder] = {}


def encode(message: Message, *, wstrings: WStrings = "zenoh") -> bytes:
    """The message in little-endian CDR with its 4-byte header.

    `wstrings` chooses how `wstring` fields are written: as rmw_zenoh does, or as Cyclone DDS does.

    Raises:
        CdrError: a text holds lone surrogates, which no ROS string can carry; names the field.
    """
    encoder = _usual_encoders.get(type(message)) if wstrings == "zenoh" else None
    if encoder is None:
        encoder = _encoder(type(message), wstrings)
    try:
        return encoder(message)
    except UnicodeEncodeError as error:
        raise CdrError(f"{_unencodable(message, type(message).__name__)}: {error}") from None


def decode(cls: type[M], data: Bytes, *, wstrings: WStrings = "zenoh") -> M:
    """The message of type `cls` that these bytes hold, in either byte order. Bytes after its last field are ignored.

    Time and memory are bounded by the length of the data, whatever they say. Arrays of small numbers may be views of
    `data` (of a copy, unless it is `bytes`). Text that is not UTF-8 gets U+FFFD where it is not, as in rclpy.

    Raises:
        CdrError: the data are too short, are not plain CDR, or break a bound of the type.
    """
    if type(data) is not bytes:
        data = bytes(data)
    if data[:2] == b"\x00\x01":
        decoder = _usual_decoders.get(cls) if wstrings == "zenoh" else None
        if decoder is None:
            decoder = _decoder(cls, wstrings, "<")
    else:
        _check_header(cls, data)
        decoder = _decoder(cls, wstrings, ">")
    try:
        return cast(M, decoder(data, len(data)))
    except CdrError:
        raise
    except struct.error as error:
        raise CdrError(f"{cls.__ros_type__}: the data end too early ({len(data)} bytes): {error}") from None
    except InterfaceError as error:
        raise CdrError(str(error)) from None


def encoder(cls: type[M]) -> Callable[[M], bytes]:
    """What `encode` does for messages of one type, but for the errors: it raises UnicodeEncodeError, where `encode` says which field it is."""
    return _encoder(cls, "zenoh")


def decoder(cls: type[M]) -> Callable[[bytes, int], M]:
    """What `decode` does for messages of one type as they usually come, from the data and their length.

    It raises one of `UNUSUAL` for all others, of which `decode` says what they are.
    """
    return _decoder(cls, "zenoh", "<")


def _check_header(cls: type[Message], data: bytes) -> None:
    if len(data) < 4:
        raise CdrError(f"{cls.__ros_type__}: {len(data)} bytes are too few for a CDR header (4 bytes)")
    if data[:2] not in (b"\x00\x00", b"\x00\x01"):
        raise CdrError(
            f"{cls.__ros_type__}: header {data[:4].hex(' ')} is not that of plain CDR (00 01 00 00 or 00 00 00 00); "
            "parameter lists and XCDR2 are not used by ROS 2"
        )


def _encoder(cls: type[Message], wstrings: WStrings) -> Callable[[Any], bytes]:
    encoder = _encoders.get((cls, wstrings))
    if encoder is None:
        _check_class(cls)
        encoder = _encoders[cls, wstrings] = compile_encoder(cls, wstrings)
        if wstrings == "zenoh":
            _usual_encoders[cls] = encoder
    return encoder


def _decoder(cls: type[Message], wstrings: WStrings, order: str) -> Decoder:
    decoder = _decoders.get((cls, wstrings, order))
    if decoder is None:
        _check_class(cls)
        decoder = _decoders[cls, wstrings, order] = compile_decoder(cls, wstrings, order)
        if wstrings == "zenoh" and order == "<":
            _usual_decoders[cls] = decoder
    return decoder


def _check_class(cls: object) -> None:
    if not (isinstance(cls, type) and issubclass(cls, Message)):
        raise TypeError(f"{cls!r} is not a message class; for a service or action take one of its parts")


def _unencodable(value: object, where: str) -> str:
    """The path of the first text in a message that cannot be encoded."""
    if isinstance(value, str):
        try:
            value.encode()
        except UnicodeEncodeError:
            return where
    elif isinstance(value, Message):
        parts = [(f"{where}.{field.name}", getattr(value, field.name)) for field in value.__ros_fields__]
        return next(filter(None, (_unencodable(part, path) for path, part in parts)), "")
    elif isinstance(value, tuple):
        items: tuple[object, ...] = value  # pyright: ignore[reportUnknownVariableType]
        return next(filter(None, (_unencodable(item, f"{where}[{i}]") for i, item in enumerate(items))), "")
    return ""
