"""rosgraph_msgs/msg. Generated from its definitions in share; do not edit."""

from typing import Annotated, ClassVar

from actors.interfaces.builtin_interfaces.msg import Duration, Time
from actors.interfaces.message import Message
from actors.interfaces.rcl_interfaces.msg import ParameterDescriptor, ParameterValue
from actors.interfaces.types import Exactly, Many, default, string, uint8, uint8_array, uint32

__all__ = [
    "Action",
    "Clock",
    "Graph",
    "InterfaceType",
    "Node",
    "QoSProfile",
    "Service",
    "Topic",
    "TypeHash",
]


class TypeHash(Message, frozen=True, kw_only=True):
    """rosgraph_msgs/msg/TypeHash"""

    version: uint8 = 1
    value: Annotated[uint8_array, Exactly(32)] = default()


class InterfaceType(Message, frozen=True, kw_only=True):
    """rosgraph_msgs/msg/InterfaceType"""

    name: string = ""
    hash: TypeHash = default()


class QoSProfile(Message, frozen=True, kw_only=True):
    """rosgraph_msgs/msg/QoSProfile"""

    HISTORY_SYSTEM_DEFAULT: ClassVar[uint8] = 0
    HISTORY_KEEP_LAST: ClassVar[uint8] = 1
    HISTORY_KEEP_ALL: ClassVar[uint8] = 2
    HISTORY_UNKNOWN: ClassVar[uint8] = 3
    RELIABILITY_SYSTEM_DEFAULT: ClassVar[uint8] = 0
    RELIABILITY_RELIABLE: ClassVar[uint8] = 1
    RELIABILITY_BEST_EFFORT: ClassVar[uint8] = 2
    RELIABILITY_UNKNOWN: ClassVar[uint8] = 3
    RELIABILITY_BEST_AVAILABLE: ClassVar[uint8] = 4
    DURABILITY_SYSTEM_DEFAULT: ClassVar[uint8] = 0
    DURABILITY_TRANSIENT_LOCAL: ClassVar[uint8] = 1
    DURABILITY_VOLATILE: ClassVar[uint8] = 2
    DURABILITY_UNKNOWN: ClassVar[uint8] = 3
    DURABILITY_BEST_AVAILABLE: ClassVar[uint8] = 4
    LIVELINESS_SYSTEM_DEFAULT: ClassVar[uint8] = 0
    LIVELINESS_AUTOMATIC: ClassVar[uint8] = 1
    LIVELINESS_MANUAL_BY_TOPIC: ClassVar[uint8] = 3
    LIVELINESS_UNKNOWN: ClassVar[uint8] = 4
    LIVELINESS_BEST_AVAILABLE: ClassVar[uint8] = 5

    depth: uint32 = 0
    deadline: Duration = default()
    lifespan: Duration = default()
    history: uint8 = 0
    reliability: uint8 = 0
    durability: uint8 = 0
    liveliness: uint8 = 0
    liveliness_lease_duration: Duration = default()


class Service(Message, frozen=True, kw_only=True):
    """rosgraph_msgs/msg/Service"""

    name: string = ""
    request_type: InterfaceType = default()
    request_qos: QoSProfile = default()
    response_type: InterfaceType = default()
    response_qos: QoSProfile = default()


class Topic(Message, frozen=True, kw_only=True):
    """rosgraph_msgs/msg/Topic"""

    name: string = ""
    type: InterfaceType = default()
    qos: QoSProfile = default()


class Action(Message, frozen=True, kw_only=True):
    """rosgraph_msgs/msg/Action"""

    name: string = ""
    send_goal: Service = default()
    get_result: Service = default()
    cancel_goal: Service = default()
    feedback: Topic = default()
    status: Topic = default()


class Clock(Message, frozen=True, kw_only=True):
    """rosgraph_msgs/msg/Clock"""

    clock: Time = default()


class Node(Message, frozen=True, kw_only=True):
    """rosgraph_msgs/msg/Node"""

    name: string = ""
    parameters: Many[ParameterDescriptor] = default()
    parameter_values: Many[ParameterValue] = default()
    publishers: Many[Topic] = default()
    subscriptions: Many[Topic] = default()
    service_clients: Many[Service] = default()
    service_servers: Many[Service] = default()
    action_clients: Many[Action] = default()
    action_servers: Many[Action] = default()


class Graph(Message, frozen=True, kw_only=True):
    """rosgraph_msgs/msg/Graph"""

    nodes: Many[Node] = default()
