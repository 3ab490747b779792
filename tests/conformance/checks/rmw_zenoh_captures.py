"""Keys, tokens, attachments, payloads and GIDs of `rmw_zenoh`: each is parsed, and written again byte for byte."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from actors import QoS
from actors.interfaces import decode, encode, get_message, get_service, type_hash
from actors.qos import Durability, History, Liveliness, QoSWarning, Reliability
from actors.transport.format.attachments import Attachment, parse_attachment, write_attachment
from actors.transport.format.buffers import parse_backends, write_backends
from actors.transport.format.gids import GID_SIZE, gid_of
from actors.transport.format.keys import DataKey, parse_key, write_key
from actors.transport.format.names import NO_TYPE_HASH
from actors.transport.format.qos import parse_qos, write_qos
from actors.transport.format.tokens import (
    EndpointKind,
    EndpointToken,
    NodeToken,
    graph_of,
    parse_token,
    write_token,
)
from tests.conformance.checks.common import Case, Vector, Watched, meet, same

Section = Callable[[Vector], Iterator[tuple[str, Any, Callable[[Any], None]]]]


def cases(path: Path) -> Iterator[Case]:
    document = json.loads(path.read_text(encoding="utf-8"))
    unknown = document.keys() - SECTIONS.keys() - {"format", "produced"}
    assert not unknown, f"unsupported section {', '.join(sorted(unknown))}: no check looks at it"
    for section, found in SECTIONS.items():
        facts = Watched(document[section])
        for name, vector, check in found(facts):
            run = partial(meet, check, vector) if isinstance(vector, dict) else partial(check, vector)
            yield f"{path.stem}/{section}/{name}", "core", run
        unknown = document[section].keys() - facts.read - {"provenance"}
        assert not unknown, f"unsupported facts {', '.join(sorted(unknown))} in {section}: no check looks at them"


# What a peer of another make has sent -------------------------------------------------------------------------------


def peer(found: Vector) -> Iterator[tuple[str, Any, Callable[[Any], None]]]:
    for fact in ("liveliness_put", "liveliness_delete_after_exit"):
        for number, text in enumerate(found[fact]):
            yield f"{fact}/{number}", text, token
    for number, sample in enumerate(found["topic_samples"]):
        yield f"topic_samples/{number}", sample, message
    for number, query in enumerate(found["service_request_from_client"]):
        yield f"service_request_from_client/{number}", query, request
    yield "service_reply_from_server", found["service_reply_from_server"], reply


def token(text: str) -> None:
    """A token that is written back as it was read, and is matched by the key expression of its domain's graph."""
    said = parse_token(text)
    same("token", write_token(said), text)
    domain = said.domain_id if isinstance(said, NodeToken) else said.node.domain_id
    assert text.startswith(graph_of(domain).removesuffix("**")), f"{text} is not below {graph_of(domain)}"


def data_key(text: str) -> DataKey:
    """The data key, which must be written back as it was read, and hold the hash of the type as it is known here."""
    key = parse_key(text)
    same("key", write_key(key), text)
    same("type hash", type_hash(key.type), key.type_hash)
    return key


def attachment(vector: Vector) -> Attachment:
    """The attachment, written back as it was read, and as decoded in the vector if it is."""
    data = bytes.fromhex(vector["attachment_hex"])
    said = parse_attachment(data)
    same("attachment", write_attachment(said).hex(), data.hex())
    same("extension", said.extension, b"")
    if "attachment" in vector:
        wanted = vector["attachment"]
        same("sequence number", said.sequence_number, wanted["sequence_number"])
        same("source time", said.source_time, wanted["source_timestamp_ns"])
        same("gid", said.gid.hex(), wanted["gid_hex"])
        same("size of the gid", GID_SIZE, wanted["gid_len"])
    return said


def payload(cls: type[Any], text: str) -> Any:
    """The message, which must be encoded as it was received."""
    found = decode(cls, bytes.fromhex(text))
    same("payload", encode(found).hex(), text)
    return found


def sent(vector: Vector, encoding: str) -> None:
    """The settings of Zenoh with which a sample was sent; they are no part of the format, and the same in all captures."""
    settings = {key: vector[key] for key in ("kind", "encoding", "priority", "express")}
    wanted: Vector = {"kind": "PUT", "encoding": encoding, "priority": "DATA", "express": False}
    same("settings", settings, wanted)


def message(vector: Vector) -> None:
    sent(vector, "application/cdr")
    same("congestion control", vector["congestion_control"], "DROP")
    assert payload(get_message(data_key(vector["key"]).type), vector["payload_hex"]).data.startswith("Hello World")
    attachment(vector)


def request(vector: Vector) -> None:
    same("encoding", vector["encoding"], "application/cdr")
    asked = payload(get_service(data_key(vector["selector"]).type).Request, vector["payload_hex"])
    same("request", (asked.a, asked.b), (2, 40))
    attachment(vector)


def reply(vector: Vector) -> None:
    asked = parse_attachment(bytes.fromhex(vector["request_attachment_hex"]))
    same("number of replies", len(vector["replies"]), 1)
    for answer in vector["replies"]:
        sent(answer, "application/cdr")
        same("congestion control", answer["congestion_control"], "BLOCK")
        service = get_service(data_key(answer["key"]).type)
        given = payload(service.Request, vector["request_payload_hex"])
        same("sum", payload(service.Response, answer["payload_hex"]).sum, given.a + given.b)
        said = attachment(answer)
        same("of which request", (said.sequence_number, said.gid), (asked.sequence_number, asked.gid))
        assert said.source_time > asked.source_time, "a reply has a time of its own"


# The traffic of TRANSIENT_LOCAL ---------------------------------------------------------------------------------------


def history(found: Vector) -> Iterator[tuple[str, Any, Callable[[Any], None]]]:
    publisher, subscriber = found["publisher_zid"], found["subscriber_zid"]
    for number, (kind, key) in enumerate(found["adv_liveliness"]):
        yield f"adv_liveliness/{number}", {"kind": kind, "key": key}, partial(presence, publisher, subscriber)
    for number, selector in enumerate(found["history_queries_seen_by_spy"]):
        yield f"history_queries/{number}", selector, partial(history_query, publisher)
    last: list[int] = []
    for number, sample in enumerate(found["samples_and_heartbeats"]):
        if "source_sn" in sample:
            last.append(sample["source_sn"])
            yield f"samples/{number}", sample, kept_message
        else:
            yield f"heartbeats/{number}", sample, partial(heartbeat, publisher, last[-1])
    for number, sample in enumerate(found["late_joiner_received"]):
        yield f"late_joiner/{number}", sample, kept_message


def presence(publisher: str, subscriber: str, vector: Vector) -> None:
    same("kind", vector["kind"], "PUT")
    role, session = below(vector["key"])[:2]
    same("session", session, {"pub": publisher, "sub": subscriber}[role])


def below(text: str) -> list[str]:
    """What Zenoh's advanced classes add to the key of a topic, chunk by chunk."""
    key, _, rest = text.partition("/@adv/")
    data_key(key)
    return rest.split("/")


def history_query(publisher: str, text: str) -> None:
    """A late subscription asks all publishers, and the one that it has found: as `ask_history` does."""
    whom, _, parameters = text.partition("?")
    same("parameters", parameters, "_max=1;_anyke")
    assert below(whom) in (["**"], ["pub", publisher, "6", "_"])


def kept_message(vector: Vector) -> None:
    sent(vector, "zenoh/bytes")
    assert vector["congestion_control"] in ("DROP", "BLOCK")
    same("text", payload(get_message(data_key(vector["key"]).type), vector["payload_hex"]).data, "hi")
    number = attachment(vector).sequence_number
    if "source_sn" in vector:
        same("number of the attachment", number, vector["source_sn"] + 1)
        same("entity", vector["source_eid"], 6)


def heartbeat(publisher: str, last: int, vector: Vector) -> None:
    sent(vector, "zenoh/bytes")
    same("congestion control", vector["congestion_control"], "BLOCK")
    same("whose", below(vector["key"]), ["pub", publisher, "6", "_"])
    same("last", int.from_bytes(bytes.fromhex(vector["payload_hex"]), "little"), last)
    same("attachment", vector["attachment_hex"], None)


# What is computed from ROS 2's own sources ----------------------------------------------------------------------------

NUMBERS: dict[str, dict[int, Any]] = {
    "rel": {1: Reliability.RELIABLE, 2: Reliability.BEST_EFFORT},
    "dur": {1: Durability.TRANSIENT_LOCAL, 2: Durability.VOLATILE},
    "hist": {1: History.KEEP_LAST, 2: History.KEEP_ALL},
    "live": {1: Liveliness.AUTOMATIC, 3: Liveliness.MANUAL_BY_TOPIC},
}
POLICIES = {"rel": "reliability", "dur": "durability", "hist": "history", "live": "liveliness"}
DURATIONS = {"deadline": "deadline", "lifespan": "lifespan", "lease": "liveliness_lease"}


def reference(found: Vector) -> Iterator[tuple[str, Any, Callable[[Any], None]]]:
    for number, vector in enumerate(found["entities"]):
        yield f"entities/{number}", vector, node if vector["kind"] == "NN" else endpoint
    for vector in found["qos_profiles"]:
        yield f"qos_profiles/{vector['name']}", vector, profile
    yield "qos_field_defaults", found["qos_field_defaults"], defaults
    for number, vector in enumerate(found["attachment_vectors"]):
        yield f"attachment_vectors/{number}", vector, written_attachment


def node_of(vector: Vector) -> NodeToken:
    return NodeToken(
        vector["domain_id"],
        vector["zid"],
        vector["node_id"],
        vector["node_name"],
        vector["namespace"],
        vector["enclave"],
    )


def node(vector: Vector) -> None:
    same("ids", vector["entity_id"], vector["node_id"])
    same("kind", vector["kind"], "NN")
    tokens_agree(vector, node_of(vector))


def endpoint(vector: Vector) -> None:
    listed = vector["backends"]
    said = EndpointToken(
        node_of(vector),
        vector["entity_id"],
        EndpointKind(vector["kind"]),
        vector["name"],
        vector["type"],
        vector["type_hash"],
        parse_qos(vector["qos"]),
        () if listed is None else parse_backends(listed),
    )
    same("qos", write_qos(said.qos), vector["qos"])
    same("backends", write_backends(said.backends) if said.backends else None, listed)
    same("key", write_key(said.key), vector["data_key"])
    same("parsed key", parse_key(vector["data_key"]), said.key)
    if said.type_hash != NO_TYPE_HASH:
        same("type hash", type_hash(said.type), said.type_hash)
    tokens_agree(vector, said)


def tokens_agree(vector: Vector, said: NodeToken | EndpointToken) -> None:
    same("token", write_token(said), vector["liveliness_token"])
    same("parsed token", parse_token(vector["liveliness_token"]), said)
    same("gid", gid_of(vector["liveliness_token"]).hex(), vector["gid_hex"])


def profile(vector: Vector) -> None:
    keywords: Vector = {}
    fields = vector["fields"]
    for field, value in fields.items():
        if field in POLICIES:
            keywords[POLICIES[field]] = NUMBERS[field][value]
        elif field in DURATIONS:
            keywords[DURATIONS[field]] = value[0] + value[1] / 1e9
        else:
            keywords[field] = value
    with warnings.catch_warnings():  # a user is warned of a depth of 0, and of KEEP_ALL with best effort
        warnings.simplefilter("ignore", QoSWarning)
        qos = QoS(**keywords)
    same("text", write_qos(qos), vector["string"])
    same("of the text", write_qos(parse_qos(vector["string"])), vector["string"])
    for policy in (*POLICIES.values(), *DURATIONS.values()):
        if policy in keywords:
            same(policy, getattr(parse_qos(vector["string"]), policy), keywords[policy])
    assert vector["name"]


def defaults(vector: Vector) -> None:
    """Written with every number, the defaults are read as what is left out otherwise."""
    numbers = [*(vector[policy] for policy in ("reliability", "durability", "history", "depth"))]
    times = [f"{seconds},{rest}" for seconds, rest in (vector["deadline"], vector["lifespan"], vector["lease"])]
    text = "{}:{}:{},{}".format(*numbers) + f":{times[0]}:{times[1]}:{vector['liveliness']},{times[2]}"
    same("defaults", parse_qos(text), parse_qos("::,:,:,:,,"))
    same("written", write_qos(parse_qos(text)), "::,:,:,:,,")


def written_attachment(vector: Vector) -> None:
    said = Attachment(vector["sequence_number"], vector["source_timestamp_ns"], bytes.fromhex(vector["gid_hex"]))
    same("bytes", write_attachment(said).hex(), vector["attachment_hex"])
    same("said", parse_attachment(bytes.fromhex(vector["attachment_hex"])), said)


# What ROS 2's own document shows --------------------------------------------------------------------------------------


def published(found: Vector) -> Iterator[tuple[str, Any, Callable[[Any], None]]]:
    for number, text in enumerate(found["topic_keys"]):
        yield f"topic_keys/{number}", text, data_key
    for number, text in enumerate(found["tokens"]):
        yield f"tokens/{number}", text, token


SECTIONS: dict[str, Section] = {
    "a_sdk_capture": peer,
    "b_transient_local_capture": history,
    "c_reference_vectors": reference,
    "d_published_examples": published,
}
