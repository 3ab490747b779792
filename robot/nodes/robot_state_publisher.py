"""The robot's description, and where its links are: what viewers need to draw it, as ROS 2's robot_state_publisher tells it."""

from __future__ import annotations

from actors import Node, Topic, background, parameter, publishes
from actors.interfaces.sensor_msgs.msg import JointState
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.tf2_msgs.msg import TFMessage
from actors.tf2 import TF, StaticTransformBroadcaster, joints_of, stamped
from robot.contracts import ARM_JOINT_STATES, JOINT_STATES, ROBOT_DESCRIPTION
from robot.nodes.on_demand import while_heard


class RobotStatePublisher(Node):
    """Publishes robot_description and the fixed links (tf_static) once, latched, and those that turn (tf) while somebody listens to tf.

    Takes joint_states and arm/joint_states. Raises `DescriptionError` at its construction for a description that is no URDF.
    """

    description = publishes(ROBOT_DESCRIPTION)
    moving = publishes(TF)
    publish_frequency = parameter(
        20.0, unit="Hz", ge=0.1, le=200.0, description="How often the links are published, at most."
    )

    def __init__(self, urdf: str) -> None:
        joints = joints_of(urdf)
        self._urdf = urdf
        self._fixed = [joint for joint in joints if joint.axis is None]
        self._turning = {joint.name: joint for joint in joints if joint.axis is not None}

    async def on_start(self) -> None:
        self.description(String(data=self._urdf))
        now = self.clock.stamp()
        StaticTransformBroadcaster(self).send_transform(
            stamped(joint.parent, joint.child, joint.origin, now) for joint in self._fixed
        )

    @background
    async def legs(self) -> None:
        await self._follow(JOINT_STATES)

    @background
    async def arm(self) -> None:
        await self._follow(ARM_JOINT_STATES)

    async def _follow(self, states: Topic[JointState]) -> None:
        """Tell where the links are that these joints carry. Joints that the description does not have are left out."""
        newest = states.qos.replace(depth=1)
        async for state in while_heard(self, self.moving, states, newest, lambda: self.publish_frequency):
            stamp = state.header.stamp
            self.moving(
                TFMessage(
                    transforms=tuple(
                        stamped(joint.parent, joint.child, joint.at(position), stamp)
                        for name, position in zip(state.name, state.position.tolist(), strict=True)
                        if (joint := self._turning.get(name)) is not None
                    )
                )
            )
