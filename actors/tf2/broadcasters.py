"""Broadcasters of transforms for one node, made in its `on_start`."""

from __future__ import annotations

from collections.abc import Iterable

from actors.contracts.contracts import Topic
from actors.interfaces.geometry_msgs.msg import TransformStamped
from actors.interfaces.tf2_msgs.msg import TFMessage
from actors.qos import STATE
from actors.qos.policies import Durability, QoS
from actors.runtime.node import Node

TF = Topic(TFMessage, "/tf", QoS(depth=100))
"""Transforms that change."""
TF_STATIC = Topic(TFMessage, "/tf_static", QoS(depth=100, durability=Durability.TRANSIENT_LOCAL))
"""Transforms that hold at all times; late subscribers get them, too."""


class TransformBroadcaster:
    """Publishes transforms that change on `/tf`. Lives as long as its node's incarnation."""

    def __init__(self, node: Node, *, qos: QoS | int | None = None) -> None:
        self._publisher = node.publisher(TF, qos=qos)

    def __repr__(self) -> str:
        return f"<TransformBroadcaster of {self._publisher.node.fqn}>"

    def send_transform(self, transform: TransformStamped | Iterable[TransformStamped]) -> None:
        """Publish one transform, or several in one message."""
        self._publisher(TFMessage(transforms=_several(transform)))

    sendTransform = send_transform
    """The name that rclpy's has."""


class StaticTransformBroadcaster:
    """Publishes transforms that never change on `/tf_static`, latched, so that late subscribers get all of them.

    A latched topic keeps one message for each publisher, so every message of a broadcaster holds all of its transforms. Several
    broadcasters, of one node or of many, do not touch each other's.
    """

    def __init__(self, node: Node, *, qos: QoS | int | None = None) -> None:
        self._publisher = node.publisher(TF_STATIC, qos=STATE if qos is None else qos)
        self._told: dict[str, TransformStamped] = {}

    def __repr__(self) -> str:
        return f"<StaticTransformBroadcaster of {self._publisher.node.fqn}: {', '.join(self._told) or 'nothing told'}>"

    def send_transform(self, transform: TransformStamped | Iterable[TransformStamped]) -> None:
        """Add one transform, or several, to what was told before; one of the same child frame replaces the older one."""
        self._told |= {each.child_frame_id: each for each in _several(transform)}
        self._publisher(TFMessage(transforms=tuple(self._told.values())))

    sendTransform = send_transform
    """The name that rclpy's has."""


def _several(transform: TransformStamped | Iterable[TransformStamped]) -> tuple[TransformStamped, ...]:
    return (transform,) if isinstance(transform, TransformStamped) else tuple(transform)
