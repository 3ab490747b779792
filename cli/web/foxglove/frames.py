"""The binary frames of the Foxglove WebSocket protocol: little endian, the first byte says which one it is."""

from __future__ import annotations

from struct import Struct, error
from typing import Final, NamedTuple

from cli.web.clients.errors import BadRequest
from cli.web.clients.outbox import Spliced
from cli.web.recordings.playback import PlaybackRequest, PlaybackState

_MESSAGE: Final = Struct("<BIQ")
_TIME: Final = Struct("<BQ")
_RESPONSE: Final = Struct("<BIII")
_ASSET: Final = Struct("<BIBI")
_CLIENT_MESSAGE: Final = Struct("<BI")
_REQUEST: Final = Struct("<BIII")
_PLAYBACK_STATE: Final = Struct("<BBQfBI")
_PLAYBACK_REQUEST: Final = Struct("<BBfBQI")


class ClientMessage(NamedTuple):
    """A message that a client publishes."""

    channel: int
    payload: bytes


class ServiceRequest(NamedTuple):
    """A request of a client."""

    service: int
    call: int
    encoding: str
    payload: bytes


def playback_frame(state: PlaybackState, *, sought: bool, request: str = "") -> bytes:
    """How a recording is played now; `sought` if its time has jumped, `request` if this answers one."""
    id = request.encode()
    return _PLAYBACK_STATE.pack(5, state.status, max(0, state.at_ns), state.rate, sought, len(id)) + id


def message_frame(subscription: int, at_ns: int, payload: bytes) -> Spliced:
    """A message for a subscription; `at_ns` are nanoseconds since 1970."""
    return Spliced(_MESSAGE.pack(1, subscription, max(0, at_ns)), payload)


def time_frame(at_ns: int) -> bytes:
    """The time, in nanoseconds."""
    return _TIME.pack(2, max(0, at_ns))


def response_frame(service: int, call: int, encoding: str, payload: bytes) -> bytes:
    """The response of a service."""
    name = encoding.encode()
    return _RESPONSE.pack(3, service, call, len(name)) + name + payload


def asset_frame(request: int, data: bytes) -> bytes:
    """A file that was asked for."""
    return _ASSET.pack(4, request, 0, 0) + data


def asset_failure(request: int, why: str) -> bytes:
    """Why a file cannot be had."""
    text = why.encode()
    return _ASSET.pack(4, request, 1, len(text)) + text


def read_frame(data: bytes) -> ClientMessage | ServiceRequest | PlaybackRequest:
    """What a client has sent. Raises `BadRequest`."""
    try:
        if data[:1] == b"\x01":
            _, channel = _CLIENT_MESSAGE.unpack_from(data)
            return ClientMessage(channel, data[_CLIENT_MESSAGE.size :])
        if data[:1] == b"\x02":
            _, service, call, length = _REQUEST.unpack_from(data)
            begin = _REQUEST.size + length
            if begin > len(data):
                raise BadRequest(f"a service request of {len(data)} bytes has an encoding of {length}")
            return ServiceRequest(service, call, data[_REQUEST.size : begin].decode(), data[begin:])
        if data[:1] == b"\x03":
            return _playback_request(data)
    except (error, UnicodeDecodeError) as problem:
        raise BadRequest(f"a binary frame of {len(data)} bytes: {problem}") from None
    raise BadRequest(
        f"a binary frame of {len(data)} bytes begins with {data[:1].hex() or 'nothing'}, not with 01, 02 or 03"
    )


def _playback_request(data: bytes) -> PlaybackRequest:
    _, command, rate, sought, seek_ns, length = _PLAYBACK_REQUEST.unpack_from(data)
    id = data[_PLAYBACK_REQUEST.size :]
    if command > 1 or len(id) != length:
        raise BadRequest(
            f"a playback request of {len(data)} bytes has the command {command} and an id of {length} bytes"
        )
    return PlaybackRequest(command == 0, rate, seek_ns if sought else None, id.decode())
