"""The services and topics that other processes expect of every node of ROS 2."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple, cast

from actors.qos import PARAMETER_EVENTS, PARAMETERS, ROSOUT, SERVICES, TRANSITION_EVENT
from actors.qos.policies import QoS
from actors.runtime.incarnation import Incarnation
from actors.services.peers import Served


class Standard(NamedTuple):
    """A standard endpoint of a node: its full name, its type and its quality of service."""

    name: str
    type: Any
    qos: QoS


def standard_services(life: Incarnation) -> Iterator[Standard]:
    """The services of a node besides those that it declares: those of its parameters, types, loggers and kind."""
    from actors.interfaces.type_description_interfaces.srv import GetTypeDescription
    from actors.parameters.messages import PARAMETER_SERVICES

    for service in PARAMETER_SERVICES:
        yield Standard(f"{life.fqn}/{service.name}", service.type, PARAMETERS)
    if life.parameters.value("start_type_description_service"):
        yield Standard(f"{life.fqn}/get_type_description", GetTypeDescription, SERVICES)
    if life.serves_loggers:
        from actors.logs.services import LOGGER_SERVICES

        for name, (kind, _) in LOGGER_SERVICES.items():
            yield Standard(f"{life.fqn}/{name}", kind, SERVICES)
    for name in life.node.__standard_services__:
        offered = cast("Served", life.node.__standard_service__(name))
        yield Standard(f"{life.fqn}/{name}", offered[0], SERVICES)


def standard_publishers(life: Incarnation) -> Iterator[Standard]:
    """The topics on which every node publishes, and that of the transitions of a lifecycle node."""
    from actors.interfaces.rcl_interfaces.msg import Log, ParameterEvent

    yield Standard("/rosout", Log, ROSOUT)
    yield Standard("/parameter_events", ParameterEvent, PARAMETER_EVENTS)
    if "change_state" in life.node.__standard_services__:
        from actors.interfaces.lifecycle_msgs.msg import TransitionEvent

        yield Standard(f"{life.fqn}/transition_event", TransitionEvent, TRANSITION_EVENT)
