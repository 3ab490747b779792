"""Graphs for `doctor` to examine, made of values: no process is needed."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from actors.qos import DEFAULT
from actors.qos.policies import QoS
from actors.transport.figures import (
    HandlerFigures,
    NodeFigures,
    ProcessFigures,
    QueueFigures,
    ServedFigures,
    TimerFigures,
)
from actors.transport.format.tokens import EndpointKind
from actors.transport.protocol import RemoteEndpoint, RemoteNode
from cli.graph.view import Endpoint
from cli.verbs.doctor.observation import Observation, Told

STRING = "std_msgs/msg/String"
SESSION = "a" * 32


def node(name: str, *, session: str = SESSION, domain: int = 0, number: int = 0) -> RemoteNode:
    return RemoteNode(name, session, number, domain)


def end(
    of: str, kind: EndpointKind, name: str, qos: QoS = DEFAULT, type: str = STRING, type_hash: str = "RIHS01_1"
) -> Endpoint:
    """An end of the node `of`."""
    return Endpoint(RemoteEndpoint(node(of), kind, name, type, type_hash, qos, b""))


def graph(*ends: Endpoint, **more: Any) -> Observation:
    """These ends and their nodes, and whatever else is seen."""
    nodes = tuple({one.node: one.about.node for one in ends}.values())
    return replace(Observation(ends=ends, nodes=nodes), **more)


def handler(name: str, mean: float, longest: float) -> HandlerFigures:
    return HandlerFigures(handler=name, mean=mean, longest=longest)


def timer(name: str, hz: float, fired: int, missed: int = 0, blocked: int = 0) -> TimerFigures:
    return TimerFigures(handler=name, hz=hz, fired=fired, missed=missed, blocked=blocked)


def queue(topic: str, dropped: int = 0, waiting: int = 0, depth: int = 10, received: int = 100) -> QueueFigures:
    return QueueFigures(
        topic=topic, handler="Eye.see", received=received, dropped=dropped, waiting=waiting, depth=depth
    )


def served(service: str, calls: int, *clients: str) -> ServedFigures:
    return ServedFigures(service=service, calls=calls, clients=clients)


def figures(name: str, **told: Any) -> NodeFigures:
    usual = {"state": "running", "incarnation": 1, "restarts": 0, "handled": 0, "waiting": 0, "inbox_age": 0.0}
    return NodeFigures(name=name, **{**usual, **told})


def process(before: Iterable[NodeFigures], last: Iterable[NodeFigures], seconds: float = 1.0) -> Told:
    """A process that has told the first figures, and after `seconds` the second."""

    def told(at: float, nodes: Iterable[NodeFigures]) -> ProcessFigures:
        return ProcessFigures(
            host="base", process=7, session=SESSION, program="robot", at=at, cpu=0.0, memory=0, unreadable=0,
            nodes=tuple(nodes),
        )  # fmt: skip

    return Told(told(10.0, before), told(10.0 + seconds, last))
