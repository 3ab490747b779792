"""The keys by which Zenoh's advanced publishers keep messages for late subscribers. They carry TRANSIENT_LOCAL over the network.

Below the data key ``K``, each side declares a liveliness token ``K/@adv/<pub|sub>/<session>/<id>/_``. A late subscription queries the last
messages of all publishers, or of a publisher that was added after it. While a reliable publisher has nothing to publish, it repeats the
number of its last message on its own key (the heartbeat), so that subscriptions notice losses. The ids are those of Zenoh's entities, and
the numbers those of Zenoh's samples, from 0; they are unrelated to the ids of tokens and to the sequence numbers of attachments.
"""

from __future__ import annotations

import re
from typing import Final, Literal, NamedTuple

from actors.transport.format.errors import refuse
from actors.transport.format.keys import DataKey, parse_key, write_key
from actors.transport.format.names import check_number, check_session, parse_number

_BELOW: Final = "/@adv/"
_PARAMETERS: Final = re.compile(r"_max=([0-9]{1,20});_anyke\Z")


class Presence(NamedTuple):
    """One advanced publisher or subscription."""

    data_key: DataKey
    role: Literal["pub", "sub"]
    session: str
    entity_id: int


class HistoryQuery(NamedTuple):
    """A query for the last messages of a topic."""

    data_key: DataKey
    depth: int
    publisher: Presence | None = None
    """The publisher that is queried; None for all."""


def write_presence(presence: Presence) -> str:
    """Write the key expression of a presence, which is also that of a publisher's heartbeats. Raises WireFormatError."""
    key = write_key(presence.data_key)
    session = check_session(presence.session)
    return f"{key}{_BELOW}{presence.role}/{session}/{check_number(presence.entity_id, 'an entity id')}/_"


def parse_presence(text: str) -> Presence:
    """Parse the key expression of a presence. Raises WireFormatError."""
    key, _, below = text.partition(_BELOW)
    role, *parts = below.split("/")
    if len(parts) != 3 or parts[2] != "_":
        raise refuse(text, "the key of an advanced publisher or subscription", "it would end /@adv/pub/SESSION/ID/_")
    session, entity_id = check_session(parts[0]), parse_number(parts[1], "an entity id")
    if role == "pub":
        return Presence(parse_key(key), "pub", session, entity_id)
    if role == "sub":
        return Presence(parse_key(key), "sub", session, entity_id)
    raise refuse(text, "the key of an advanced publisher or subscription", f"{role!r:.20} is neither pub nor sub")


def write_history_query(query: HistoryQuery) -> str:
    """Write a history query as a selector. Raises WireFormatError."""
    if query.publisher is None:
        key = f"{write_key(query.data_key)}{_BELOW}**"
    elif query.publisher.role == "pub" and query.publisher.data_key == query.data_key:
        key = write_presence(query.publisher)
    else:
        raise refuse(query, "a query for history", "it asks one who is no publisher of that topic")
    return f"{key}?_max={check_number(query.depth, 'a depth')};_anyke"


def parse_history_query(text: str) -> HistoryQuery:
    """Parse the selector of a history query. Raises WireFormatError."""
    key, _, parameters = text.partition("?")
    found = _PARAMETERS.match(parameters)
    if found is None:
        raise refuse(text, "a query for history", "it would end ?_max=DEPTH;_anyke")
    depth = parse_number(found[1], "a depth")
    if key.endswith(f"{_BELOW}**"):
        return HistoryQuery(parse_key(key.removesuffix(f"{_BELOW}**")), depth)
    publisher = parse_presence(key)
    if publisher.role != "pub":
        raise refuse(text, "a query for history", "it asks a subscription, which has none")
    return HistoryQuery(publisher.data_key, depth, publisher)


def write_heartbeat(last: int) -> bytes:
    """Write the payload of a heartbeat: the number of the publisher's last message. Raises WireFormatError."""
    if not 0 <= last < 2**32:
        raise refuse(last, "the number of a message", "it has 32 bits")
    return last.to_bytes(4, "little")


def parse_heartbeat(payload: bytes) -> int:
    """Parse the payload of a heartbeat. Returns the number of the publisher's last message. Raises WireFormatError."""
    if len(payload) != 4:
        raise refuse(payload, "a heartbeat", "it has 4 bytes")
    return int.from_bytes(payload, "little")
