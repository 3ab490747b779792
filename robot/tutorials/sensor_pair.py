"""A publisher of three kinds of messages, and a subscriber that looks for what is unusual in them."""

from __future__ import annotations

import numpy as np

from actors import ExitReason, Node, Supervisor, Topic, every, publishes, qos
from actors.interfaces.geometry_msgs.msg import Twist, Vector3
from actors.interfaces.sensor_msgs.msg import Image, JointState
from actors.interfaces.std_msgs.msg import Float32, Header
from robot.tutorials.program import main, system, was_interrupted

IMAGE = Topic(Image, "/camera/image_raw", qos.SENSOR_DATA)
JOINT_STATES = Topic(JointState, "/joint_states", 10)
CMD_VEL = Topic(Twist, "/cmd_vel", 1)
"""Depth 1: of velocities only the newest counts."""
PRESSURE = Topic(Float32, "/pressure_sensor", 10)

JOINTS = {"joint1": 0.1, "joint2": 0.2, "joint3": 0.3}
GO = Twist(linear=Vector3(x=0.5), angular=Vector3(z=0.2))
WIDTH, HEIGHT = 320, 240
GREY = np.full(WIDTH * HEIGHT, 128, dtype=np.uint8)
GREY.setflags(write=False)  # so that every message can share it

FARTHEST_JOINT = 3.14
"""rad."""
LOWEST_PRESSURE = 10.0


class SensorPublisher(Node):
    """Publishes /camera/image_raw, /joint_states and /cmd_vel at 10 Hz, always the same values."""

    image = publishes(IMAGE)
    joints = publishes(JOINT_STATES)
    cmd = publishes(CMD_VEL)

    async def on_start(self) -> None:
        self.count = 0

    @every(period=0.1)
    def publish(self) -> None:
        stamp = self.clock.stamp()
        self.joints(JointState(header=Header(stamp=stamp), name=tuple(JOINTS), position=list(JOINTS.values())))
        self.cmd(GO)
        camera = Header(stamp=stamp, frame_id="camera")
        self.image(Image(header=camera, height=HEIGHT, width=WIDTH, encoding="mono8", step=WIDTH, data=GREY))
        self.count += 1
        self.log.info(f"Published sensor data #{self.count}")

    async def on_stop(self, reason: ExitReason) -> None:
        if was_interrupted(reason):
            self.log.info("Shutting down sensor publisher")


class SensorSubscriber(Node):
    """Takes /joint_states, /cmd_vel and /pressure_sensor, and warns of joints beyond 3.14 rad and pressures below 10."""

    async def on_start(self) -> None:
        self.log.info("Sensor subscriber initialized")

    @JOINT_STATES.on()
    def joints(self, message: JointState) -> None:
        positions: list[float] = message.position.tolist()
        self.log.info(f"Joint positions: {[round(position, 3) for position in positions]}")
        for position in positions:
            if abs(position) > FARTHEST_JOINT:
                self.log.warning(f"Unusual joint position: {position}")

    @CMD_VEL.on()
    def velocity(self, message: Twist) -> None:
        self.log.info(f"Received velocity command: linear.x={message.linear.x:.2f}, angular.z={message.angular.z:.2f}")

    @PRESSURE.on()
    def pressure(self, message: Float32) -> None:
        if message.data < LOWEST_PRESSURE:
            self.log.warning(f"Low pressure detected: {message.data:g}")

    async def on_stop(self, reason: ExitReason) -> None:
        if was_interrupted(reason):
            self.log.info("Shutting down sensor subscriber")


def tree() -> Supervisor:
    """A publisher of joints, velocities and images, and a subscriber that looks at them."""
    return system("sensor_pair", SensorPublisher, SensorSubscriber)


if __name__ == "__main__":
    main(tree)
