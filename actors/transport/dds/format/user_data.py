"""USER_DATA: what ROS adds to the discovery data of participants and endpoints, as ``key=value;`` pairs.

A participant has ``enclave=/;``. An endpoint has ``typehash=RIHS01_...;``, the hash of its message type, but in Humble. With Cyclone DDS
the reader and the writer of one server or client have the same ``serviceid=...;`` or ``clientid=...;`` before it.
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from actors.transport.format.errors import refuse
from actors.transport.format.names import NO_TYPE_HASH, check_namespace

_LONGEST: Final = 4096
"""Bytes that are looked at."""
_PAIRS: Final = re.compile(r"(?<![A-Za-z0-9])([A-Za-z0-9]+)=([^;=\x00-\x1f\x7f-\xff]+)(?:;|\Z)")
_HASH: Final = re.compile(r"RIHS01_[0-9a-f]{64}\Z")
_PAIR_ID: Final = re.compile(r"[ 0-9a-f][0-9a-f](?:\.[0-9a-f]{1,2}){15}\Z")


class EndpointData(NamedTuple):
    """What ROS adds to a reader or writer."""

    type_hash: str = NO_TYPE_HASH
    """``RIHS01_`` and 64 hex digits, of the message; of a service that of its request or response."""
    server: str = ""
    """The same for the reader of requests and the writer of replies of one server; empty for others, and with Fast DDS. See `write_pair_id`."""
    client: str = ""
    """The same for the writer of requests and the reader of replies of one client."""


def write_participant_data(enclave: str = "/") -> bytes:
    """Write the USER_DATA of a participant with this enclave. Raises WireFormatError."""
    if ";" in check_namespace(enclave) or "=" in enclave or not enclave.isascii():
        raise refuse(enclave, "an enclave", "it is ASCII, without ; and =")
    return f"enclave={enclave};".encode()


def parse_participant_data(data: bytes) -> str | None:
    """Return the enclave of a participant; None if it has none, so is none of ROS. Never raises."""
    return _parse(data).get("enclave")


def write_endpoint_data(data: EndpointData) -> bytes:
    """Write the USER_DATA of an endpoint. Raises WireFormatError."""
    pairs: list[str] = []
    for key, value in (("serviceid", data.server), ("clientid", data.client)):
        if value and not _PAIR_ID.match(value):
            raise refuse(value, f"a {key}", "it has 16 bytes in hex, with dots between them")
        pairs += (f"{key}={value};",) * bool(value)
    if data.type_hash != NO_TYPE_HASH:
        if not _HASH.match(data.type_hash):
            raise refuse(data.type_hash, "a type hash", "it is RIHS01_ and 64 digits of hex")
        pairs.append(f"typehash={data.type_hash};")
    return "".join(pairs).encode()


def parse_endpoint_data(data: bytes) -> EndpointData:
    """Return what ROS has added to an endpoint; the defaults for what is not there or not in the format. Never raises."""
    found = _parse(data)
    type_hash = found.get("typehash", "")
    server, client = (value if _PAIR_ID.match(value := found.get(key, "")) else "" for key in ("serviceid", "clientid"))
    return EndpointData(type_hash if _HASH.match(type_hash) else NO_TYPE_HASH, server, client)


def write_pair_id(participant: bytes, number: int) -> str:
    """Write the id by which peers know that a reader and a writer belong to one server or client. Raises WireFormatError.

    Its 16 bytes are the first 12 of the participant's GID, and a number that the participant gives to each of its servers and clients.
    """
    if len(participant) != 16 or not 0 <= number < 2**32:
        raise refuse((participant, number), "a server or client", "a GID has 16 bytes, and the number 32 bits")
    first, *others = participant[:12] + number.to_bytes(4, "big")
    return f"{first:2x}" + "".join(f".{byte:x}" for byte in others)


def _parse(data: bytes) -> dict[str, str]:
    """The pairs in the order of the text; others may write other things than ROS, also between them."""
    return dict(_PAIRS.findall(data[:_LONGEST].decode("latin-1")))


class Process(NamedTuple):
    """What a process of this library tells of itself, by ``robactor=<session>.<process id>.<host>;`` after the enclave; others read past it."""

    session: str
    process: int
    host: str


_PROCESS: Final = re.compile(r"([1-9a-f][0-9a-f]{0,31})\.([0-9]{1,10})\.([A-Za-z0-9_.-]{1,255})\Z")


def write_process(process: Process) -> bytes:
    """Write what a process of this library adds to the USER_DATA of its participant."""
    host = re.sub("[^A-Za-z0-9_.-]", "_", process.host)[:255] or "_"
    return f"robactor={process.session}.{process.process}.{host};".encode()


def parse_process(data: bytes) -> Process | None:
    """Return what a process of this library tells of itself; None of others. Never raises."""
    found = _PROCESS.match(_parse(data).get("robactor", ""))
    return None if found is None else Process(found[1], int(found[2]), found[3])
