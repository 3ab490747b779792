"""A process of zenoh-ros2-sdk: ``python with_zenoh_ros2_sdk.py PORT FOLDER``, where FOLDER has the definitions of the interfaces.

The package has its definitions from the network; here they are those of the folder.
"""

import sys
import threading
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from lines import obey, say
from rosbags.interfaces import Nodetype
from zenoh_ros2_sdk import (
    ROS2Publisher,
    ROS2ServiceClient,
    ROS2ServiceServer,
    ROS2Subscriber,
    ZenohSession,
    get_registry,
    get_service_info,
    get_service_names_and_types,
    get_topic_info,
    get_topic_names_and_types,
)
from zenoh_ros2_sdk.qos import QosDurability, QosHistoryKind, QosProfile, QosReliability
from zenoh_ros2_sdk.utils import get_type_hash

PORT = int(sys.argv[1])
HERE: dict[str, Any] = {"router_ip": "127.0.0.1", "router_port": PORT}
session = ZenohSession.get_instance("127.0.0.1", PORT)
registry = get_registry(sys.argv[2])
things: dict[tuple[str, str], Any] = {}


def of_plain(kind: Nodetype, about: Any, value: Any) -> Any:
    """A value of a field from plain data."""
    if kind == Nodetype.NAME:
        return session.store.types[about](**arguments(about, value))
    if kind == Nodetype.BASE:
        return value
    (inner, of), _ = about
    if inner == Nodetype.BASE and of[0] != "string":
        return np.array(value, dtype=of[0])
    return [of_plain(inner, of, one) for one in value]


def arguments(name: str, plain: dict[str, Any]) -> dict[str, Any]:
    """The arguments of a message's class from plain data."""
    return {field: of_plain(*kind, plain[field]) for field, kind in session.store.fielddefs[name][1]}


def to_plain(value: Any) -> Any:
    if is_dataclass(value):
        return {field.name: to_plain(getattr(value, field.name)) for field in fields(value) if field.name[0] != "_"}
    if isinstance(value, (list, tuple)):
        return [to_plain(one) for one in value]
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value


def profile(reliability: str = "RELIABLE", durability: str = "VOLATILE", depth: int = 10, all: bool = False) -> Any:
    return QosProfile(
        QosReliability[reliability],
        QosDurability[durability],
        QosHistoryKind.KEEP_ALL if all else QosHistoryKind.KEEP_LAST,
        depth,
    )


def publisher(topic: str, type: str, qos: dict[str, Any]) -> None:
    things["publisher", topic] = ROS2Publisher(topic, type, node_name="sdk_talker", qos=profile(**qos), **HERE)


def publish(topic: str, message: dict[str, Any]) -> None:
    one = things["publisher", topic]
    one.publish(**arguments(one.msg_type, message))


class Subscriber(ROS2Subscriber):
    """Zenoh now and then answers at once that there is no token, where it has told of some before. The SDK asks once, so it would never get
    what is kept."""

    def _discover_publishers(self) -> list[str]:
        for _ in range(100):
            if found := super()._discover_publishers():
                return found
        return []


def subscription(topic: str, type: str, qos: dict[str, Any]) -> None:
    def heard(message: Any) -> None:
        say("heard", topic=topic, message=to_plain(message))

    one = Subscriber(topic, type, heard, node_name="sdk_listener", qos=profile(**qos), **HERE)
    things["subscription", topic] = one


def server(service: str, type: str, answers: dict[str, Any]) -> None:
    """Answers requests with `answers`; AddTwoInts with the sum, with an error if it is negative, and not at all if it is 0."""

    def answer(request: Any) -> Any:
        say("asked", service=service, request=to_plain(request))
        given = dict(answers)
        if type.endswith("AddTwoInts"):
            given["sum"] = int(request.a + request.b)
            if given["sum"] < 0:
                raise ValueError("too small")
            if given["sum"] == 0:
                threading.Event().wait()
        return one.response_msg_class(**arguments(one.response_store_type, given))

    one = ROS2ServiceServer(service, type, answer, node_name="sdk_server", **HERE)
    things["server", service] = one


def client(service: str, type: str, timeout: float) -> None:
    one = ROS2ServiceClient(service, type, node_name="sdk_client", timeout=timeout, **HERE)
    things["client", service] = one


def call(service: str, request: dict[str, Any]) -> Any:
    one = things["client", service]
    return to_plain(one.call(**arguments(one.request_store_type, request)))


def token(kind: str, name: str) -> str:
    """The token of an endpoint, and the GID that it sends."""
    from zenoh_ros2_sdk.entity import EndpointEntity, EntityKind, NodeEntity
    from zenoh_ros2_sdk.keyexpr import endpoint_liveliness_keyexpr

    one = things[kind, name]
    node = NodeEntity(one.domain_id, session.session_id, one.node_id, one.node_name, one.namespace)
    end = EndpointEntity(
        node, one.entity_id, EntityKind[kind.upper()], one.topic, one.dds_type_name, one.type_hash, one.qos
    )
    return endpoint_liveliness_keyexpr(end) + " " + one.publisher_gid.hex()


def topics() -> Any:
    return get_topic_names_and_types(timeout=5.0, **HERE)


def services() -> Any:
    return get_service_names_and_types(timeout=5.0, **HERE)


def topic_info(topic: str) -> Any:
    found = get_topic_info(topic, timeout=5.0, verbose=True, **HERE)
    return None if found is None else to_plain(found)


def service_info(service: str) -> Any:
    found = get_service_info(service, timeout=5.0, verbose=True, **HERE)
    return None if found is None else to_plain(found)


def type_hash(definition: str) -> str:
    return get_type_hash("pkg/msg/Name", definition, {})


def close(kind: str, name: str) -> None:
    things.pop((kind, name)).close()


obey(
    {
        one.__name__: one
        for one in (
            publisher,
            publish,
            subscription,
            server,
            client,
            call,
            token,
            topics,
            services,
            topic_info,
            service_info,
            type_hash,
            close,
        )
    }
)
for each in things.values():
    each.close()
session.close()
