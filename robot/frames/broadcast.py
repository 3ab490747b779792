"""Broadcasters of transforms for one node, made in its `on_start`."""

from __future__ import annotations

from actors import Node, qos
from actors.interfaces.geometry_msgs.msg import TransformStamped
from actors.interfaces.tf2_msgs.msg import TFMessage
from robot.contracts import TF, TF_STATIC

__all__ = ["StaticTfBroadcaster", "TfBroadcaster"]


class TfBroadcaster:
    """Publishes transforms that change on `/tf`. Lives as long as its node's incarnation."""

    def __init__(self, node: Node) -> None:
        self._publisher = node.publisher(TF)

    def __repr__(self) -> str:
        return f"<TfBroadcaster of {self._publisher.node.fqn}>"

    def send(self, *transforms: TransformStamped) -> None:
        """Publish them in one message."""
        self._publisher(TFMessage(transforms=transforms))


class StaticTfBroadcaster:
    """Publishes transforms that never change on `/tf_static`, latched, so that late subscribers get all of them.

    A latched topic keeps one message for each publisher, so every message of a broadcaster holds all of its transforms. Several
    broadcasters, of one node or of many, do not touch each other's.
    """

    def __init__(self, node: Node) -> None:
        self._publisher = node.publisher(TF_STATIC, qos=qos.STATE)
        self._told: dict[str, TransformStamped] = {}

    def __repr__(self) -> str:
        return f"<StaticTfBroadcaster of {self._publisher.node.fqn}: {', '.join(self._told) or 'nothing told'}>"

    def send(self, *transforms: TransformStamped) -> None:
        """Add these to what was told before; one of the same child frame replaces the older one."""
        self._told |= {transform.child_frame_id: transform for transform in transforms}
        self._publisher(TFMessage(transforms=tuple(self._told.values())))
