"""Topics and services of ROS as topics of DDS.

======================================  =====================  ==================================================
of ROS                                  topic                  type
======================================  =====================  ==================================================
topic ``/chatter``, std_msgs/msg/String ``rt/chatter``         ``std_msgs::msg::dds_::String_``
request of ``/add``, pkg/srv/Add        ``rq/addRequest``      ``pkg::srv::dds_::Add_Request_``
its reply                               ``rr/addReply``        ``pkg::srv::dds_::Add_Response_``
none                                    any other, unchanged   as it is
======================================  =====================  ==================================================

An action has three services and two topics (see `actors.names.names.action_names`). Hidden names are written like others.
"""

from __future__ import annotations

import re
from enum import StrEnum
from functools import lru_cache
from typing import Final, NamedTuple

from actors.logs.terminal import CONTROLS
from actors.transport.format.errors import WireFormatError, refuse
from actors.transport.format.names import check_name, parse_type, write_type


class Role(StrEnum):
    """What is sent on a topic of DDS; the value is the first part of its name."""

    TOPIC = "rt"
    REQUEST = "rq"
    REPLY = "rr"
    OTHER = ""
    """Nothing of ROS."""


class RosNames(NamedTuple):
    """A topic, or one direction of a service."""

    role: Role
    name: str
    """The full name of the topic or service; for `Role.OTHER` the topic of DDS."""
    type: str
    """``package/kind/Name`` of the message or service; the type of DDS where it is none of ROS."""


class DdsNames(NamedTuple):
    """A topic of DDS."""

    topic: str
    type: str


DISCOVERY_TOPIC: Final = DdsNames("ros_discovery_info", "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_")
"""The topic of `participants`."""

_PARTS: Final = {Role.TOPIC: ("", ""), Role.REQUEST: ("Request", "_Request"), Role.REPLY: ("Reply", "_Response")}
"""The ends of the topic and of the type."""
_PLAIN: Final = re.compile(rf"[^\ud800-\udfff{CONTROLS}]{{1,512}}\Z")


@lru_cache(maxsize=4096)
def write_names(names: RosNames) -> DdsNames:
    """Return the topic of DDS for a topic or for one direction of a service. Raises WireFormatError."""
    role, name, type_name = names
    if role is Role.OTHER:
        return DdsNames(_check_plain(name, "the name of a topic"), _check_plain(type_name, "the name of a type"))
    topic_end, type_end = _PARTS[role]
    return DdsNames(f"{role}{check_name(name)}{topic_end}", write_type(f"{type_name}{type_end}"))


@lru_cache(maxsize=4096)
def parse_names(topic: str, type_name: str) -> RosNames:
    """Return what a topic of DDS is in ROS. Raises WireFormatError.

    A topic of ROS may have a type that is none of ROS, a service may not. ``rq/x`` and ``rr/x`` without their endings are no services.
    """
    prefix, slash, rest = topic.partition("/")
    role = Role(prefix) if slash and prefix in tuple(Role) else Role.OTHER
    end = _PARTS.get(role, ("", ""))[0]
    if role is Role.OTHER or not rest.removesuffix(end) or not rest.endswith(end):
        return RosNames(
            Role.OTHER, _check_plain(topic, "the name of a topic"), _check_plain(type_name, "the name of a type")
        )
    return RosNames(role, check_name(f"/{rest.removesuffix(end)}"), _parse_type(role, type_name))


def _parse_type(role: Role, type_name: str) -> str:
    try:
        found = parse_type(type_name)
    except WireFormatError:
        if role is Role.TOPIC:
            return _check_plain(type_name, "the name of a type")
        raise
    end = _PARTS[role][1]
    if not found.endswith(end) or found.endswith(f"/{end}"):
        raise refuse(type_name, f"the type of a {role.name.lower()}", f"it would end with {end}_")
    return found.removesuffix(end)


def _check_plain(text: str, what: str) -> str:
    if not _PLAIN.match(text):
        raise refuse(text, what, "it is empty or too long, or holds control characters")
    return text
