"""What `rmw_cyclonedds_cpp` and `rmw_fastrtps_cpp` write on DDS: each is parsed, compared with what their programs have created, and written again."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from actors.interfaces import decode, encode, get_message, to_plain, type_hash
from actors.transport.dds.format.names import DdsNames, Role, RosNames, parse_names, write_names
from actors.transport.dds.format.participants import parse_participant, write_participant
from actors.transport.dds.format.qos import EndpointQos, parse_qos, write_qos
from actors.transport.dds.format.requests import parse_request, write_request
from actors.transport.dds.format.user_data import (
    parse_endpoint_data,
    parse_participant_data,
    write_endpoint_data,
    write_participant_data,
)
from actors.transport.format.names import parse_type
from tests.conformance.checks.common import Case, Vector, by_kind, same


def cases(path: Path) -> Iterator[Case]:
    return by_kind(path, {"participant": participant, "endpoint": endpoint, "nodes": nodes, "service": service})


def participant(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]
    data = given["user_data"].encode()
    same("enclave", parse_participant_data(data), expect["enclave"])
    same("user data", write_participant_data(expect["enclave"]), data.rstrip(b"\0"))  # Fast DDS writes a NUL
    same("size of the GID", len(bytes.fromhex(given["gid"])), 16)


def endpoint(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]
    wanted = RosNames(Role(expect["role"]), expect["name"], expect["type"])
    same("names", parse_names(given["topic"], given["type"]), wanted)
    same("topic", write_names(wanted), DdsNames(given["topic"], given["type"]))
    data = given["user_data"].encode()
    found = parse_endpoint_data(data)
    same("type hash", found.type_hash, type_hash(parse_type(given["type"])))
    same("is of a server", bool(found.server), expect["pair"] == "serviceid")
    same("is of a client", bool(found.client), expect["pair"] == "clientid")
    same("user data", write_endpoint_data(found), data)
    assert given["gid"].startswith(given["participant"][:24]), "an endpoint has the prefix of its participant"
    policies, times = given["policies"], ("deadline_ns", "lifespan_ns", "lease_ns")
    deadline, lifespan, lease = (None if policies[time] is None else policies[time] / 1e9 for time in times)
    qos = EndpointQos(
        reliable=policies["reliable"],
        transient_local=policies["transient_local"],
        keep_all=policies["depth"] is None,
        depth=policies["depth"] or 10,
        deadline=deadline,
        lifespan=lifespan,
        manual_liveliness=policies["manual"],
        lease=lease,
    )
    same("policies", write_qos(parse_qos(qos)), qos)
    assert given["end"] in ("reader", "writer")


def nodes(vector: Vector) -> None:
    data, expect = bytes.fromhex(vector["input"]["data"]), vector["expect"]
    found = parse_participant(data)
    same("participant", found.gid.hex(), expect["participant"])
    same("size of GIDs", found.gid_size, expect["gid_size"])
    names = expect.get("nodes") or [[expect["namespace"], expect["name"]]]
    same("nodes", [[node.namespace, node.name] for node in found.nodes], names)
    prefix = found.gid[:12]
    for node in found.nodes:
        assert node.readers and node.writers and all(gid.startswith(prefix) for gid in node.readers + node.writers)
    for end, gids in (("readers", found.nodes[0].readers), ("writers", found.nodes[0].writers)):
        if end in expect:
            same(end, [gid.hex() for gid in gids], expect[end])
    if "ends" in expect:
        same("number of ends", [[len(node.readers), len(node.writers)] for node in found.nodes], expect["ends"])
    again = write_participant(found)
    same("written again", parse_participant(again), found)  # what fills up to a number may be anything
    same("size", len(again), len(data))


def service(vector: Vector) -> None:
    """A request or reply; that of Fast DDS is the message alone."""
    given, expect = vector["input"], vector["expect"]
    data = bytes.fromhex(given["data"])
    identity, message = parse_request(data) if expect["identity"] else (None, data)
    found = decode(get_message(parse_type(given["type"])), message)
    same("message", to_plain(found), expect["message"])
    written = encode(found) if identity is None else write_request(identity, encode(found))
    assert data.startswith(written), f"{data.hex()} does not begin with {written.hex()}"
    assert len(data) - len(written) < 4, "DDS fills up to a multiple of 4"
    assert parse_names(given["topic"], given["type"]).role in (Role.REQUEST, Role.REPLY)
