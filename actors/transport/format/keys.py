"""The key expression for the messages of a topic, or for the requests and replies of a service.

It is ``<domain>/<name without its first slash>/<type>/<type hash>``, without wildcards. Two endpoints communicate exactly if their keys are
equal. An action has five keys, those of its three services and two topics (see `actors.names.names.action_names`).
"""

from __future__ import annotations

from typing import NamedTuple

from actors.transport.format.errors import refuse
from actors.transport.format.names import check_chunk, check_name, check_number, parse_number, parse_type, write_type


class DataKey(NamedTuple):
    """The content of a data key."""

    domain_id: int
    """ROS_DOMAIN_ID, a prefix that separates systems. It gives no protection."""
    name: str
    """The full name of the topic or service, such as ``/robot1/cmd_vel``."""
    type: str
    """``package/kind/Name``; for the parts of an action ``package/action/Name_SendGoal`` and so on."""
    type_hash: str
    """``RIHS01_`` and 64 hex digits, or `NO_TYPE_HASH`. Peers with another definition of the type use another key."""


def write_key(key: DataKey) -> str:
    """Write a data key as a key expression. Raises WireFormatError."""
    domain = check_number(key.domain_id, "a domain id")
    type_hash = check_chunk(key.type_hash, "a type hash")
    return f"{domain}{check_name(key.name)}/{write_type(key.type)}/{type_hash}"


def parse_key(text: str) -> DataKey:
    """Parse a data key. Raises WireFormatError, also for the additional keys below a data key."""
    parts = text.split("/")
    if len(parts) < 4:
        raise refuse(text, "a data key", "it has fewer than the parts domain, name, type and type hash")
    domain, *name, type_name, type_hash = parts
    return DataKey(
        parse_number(domain, "a domain id"),
        check_name("/" + "/".join(name)),
        parse_type(type_name),
        check_chunk(type_hash, "a type hash"),
    )
