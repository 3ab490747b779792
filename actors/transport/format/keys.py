"""The key expression on which the messages of a topic, or the requests and replies of a service, travel.

It is ``<domain>/<name without its first slash>/<type>/<type hash>``, always exact and never a wildcard: two endpoints communicate if and only
if their keys are equal. An action has five keys, those of its three services and two topics (see `actors.names.names.action_names`).
"""

from __future__ import annotations

from typing import NamedTuple

from actors.transport.format.errors import refuse
from actors.transport.format.names import check_chunk, check_name, check_number, parse_number
from actors.transport.format.types import parse_type, write_type

__all__ = ["DataKey", "parse_key", "write_key"]


class DataKey(NamedTuple):
    """What a data key says."""

    domain_id: int
    """ROS_DOMAIN_ID: a prefix that keeps systems apart, and no protection."""
    name: str
    """The full name of the topic or service, ``/robot1/cmd_vel``."""
    type: str
    """``package/kind/Name``; for the parts of an action ``package/action/Name_SendGoal`` and so on."""
    type_hash: str
    """``RIHS01_`` and 64 hex digits, or `NO_TYPE_HASH`. A peer with another definition of the type has another key."""


def write_key(key: DataKey) -> str:
    """The key expression. Raises WireFormatError."""
    domain = check_number(key.domain_id, "a domain id")
    type_hash = check_chunk(key.type_hash, "a type hash")
    return f"{domain}{check_name(key.name)}/{write_type(key.type)}/{type_hash}"


def parse_key(text: str) -> DataKey:
    """What this data key says. Raises WireFormatError, also for the further keys that stand under a data key."""
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
