"""`RobotStatePublisher`: where the links of a robot are, from its URDF and the positions of its joints."""

from __future__ import annotations

from collections.abc import Iterator

from actors.contracts.contracts import Topic
from actors.interfaces.geometry_msgs.msg import TransformStamped
from actors.interfaces.sensor_msgs.msg import JointState
from actors.interfaces.std_msgs.msg import String
from actors.parameters.declare import parameter
from actors.qos import STATE
from actors.qos.policies import QoS
from actors.runtime.declarations import publishes
from actors.runtime.node import Node
from actors.tf2.broadcasters import StaticTransformBroadcaster, TransformBroadcaster
from actors.tf2.errors import DescriptionError
from actors.tf2.transform import stamped
from actors.tf2.urdf import Joint, joints_of
from actors.time.values import nanoseconds_of

JOINT_STATES = Topic(JointState, "joint_states", QoS(depth=10))
"""The positions of joints, by name."""
ROBOT_DESCRIPTION = Topic(String, "robot_description", STATE)
"""The URDF, latched."""


class RobotStatePublisher(Node):
    """Publishes the URDF, the fixed links on `/tf_static` once, and on `/tf` the links of the joints that each `joint_states` names.

    Parameters, subscriptions and publishers are those of ROS 2's robot_state_publisher. A joint that mimics another follows it. Joints of
    more than one position, floating and planar ones, are left to another node. A start without a description, or with
    xacro, fails with `DescriptionError`.
    """

    node_name = "robot_state_publisher"
    description = publishes(ROBOT_DESCRIPTION)
    robot_description = parameter("", read_only=True, description="The URDF, as text.")
    publish_frequency = parameter(
        20.0, unit="Hz", ge=0.0, le=1000.0, description="How often a joint is published, at most; 0: always."
    )
    ignore_timestamp = parameter(
        False, description="Publish joint states also when they are stamped no later than the last."
    )
    frame_prefix = parameter("", read_only=True, description="What stands before the name of each link.")

    async def on_start(self) -> None:
        if not self.robot_description:
            raise DescriptionError(
                f"{self.fqn} has no description: give it the text of a URDF by the parameter robot_description"
            )
        joints = joints_of(self.robot_description)
        self._moving = {joint.name: joint for joint in joints if joint.axis is not None}
        self._followers: dict[str, list[Joint]] = {}
        for joint in self._moving.values():
            if joint.mimic is not None:
                self._followers.setdefault(joint.mimic.joint, []).append(joint)
        self._published: dict[str, int] = {}
        self._broadcaster = TransformBroadcaster(self)
        self.description(String(data=self.robot_description))
        now, prefix = self.clock.stamp(), self.frame_prefix
        StaticTransformBroadcaster(self).send_transform(
            stamped(prefix + joint.parent, prefix + joint.child, joint.origin, now)
            for joint in joints
            if joint.kind == "fixed"
        )

    @JOINT_STATES.on()
    def joints(self, state: JointState) -> None:
        if len(state.name) != len(state.position):
            self.log.error(
                "joint states have as many names as positions",
                names=len(state.name),
                positions=len(state.position),
                throttle_duration_sec=1.0,
            )
            return
        positions = dict(zip(state.name, state.position.tolist(), strict=True))
        instant = nanoseconds_of(state.header.stamp)
        if not self._is_due(positions, instant):
            return
        self._published.update(dict.fromkeys(positions, instant))
        transforms = [*self._links(positions, state)]
        if transforms:
            self._broadcaster.send_transform(transforms)

    def _is_due(self, positions: dict[str, float], instant: int) -> bool:
        """Whether the oldest of these joints was published long enough ago, or time was set back."""
        last = min((self._published.get(name, 0) for name in positions), default=0)
        if self.ignore_timestamp or not last or instant < last:
            return True
        frequency = self.publish_frequency
        return instant > last and (not frequency or (instant - last) * 1e-9 >= 1.0 / frequency - 1e-9)

    def _links(self, positions: dict[str, float], state: JointState) -> Iterator[TransformStamped]:
        prefix, stamp = self.frame_prefix, state.header.stamp
        for name, position in positions.items():
            joint = self._moving.get(name)
            if joint is not None:
                yield stamped(prefix + joint.parent, prefix + joint.child, joint.at(position), stamp)
            for follower in self._followers.get(name, ()):
                assert follower.mimic is not None
                there = follower.at(follower.mimic.multiplier * position + follower.mimic.offset)
                yield stamped(prefix + follower.parent, prefix + follower.child, there, stamp)
