"""The sensor drivers: they read the body at their rates and publish what they read. They compute nothing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from actors import Node, every, publishes
from actors.interfaces.geometry_msgs.msg import Vector3
from actors.interfaces.sensor_msgs.msg import Imu, JointState, LaserScan
from actors.interfaces.std_msgs.msg import Header
from robot.contracts import CONTACTS, IMU, JOINT_STATES, SCAN
from robot.interfaces.robactor_msgs.msg import FootContacts
from robot.world.body import JOINT_NAMES

if TYPE_CHECKING:
    from robot.world.body import Body

__all__ = ["BEAMS", "MAX_RANGE", "RATE", "Lidar", "Proprioception"]

RATE: Final = 200.0
"""Samples of IMU and encoders per second."""
BEAMS: Final = 360
MAX_RANGE: Final = 10.0

NOT_MEASURED = np.array([-1.0] + [0.0] * 8)
"""An orientation covariance that says: no orientation here (sensor_msgs/Imu)."""
NOT_MEASURED.flags.writeable = False


class Proprioception(Node):
    """IMU, joint encoders and foot contacts of one instant at 200 Hz: imu/data, foot_contacts, then joint_states."""

    imu = publishes(IMU)
    contacts = publishes(CONTACTS)
    joints = publishes(JOINT_STATES)

    def __init__(self, body: Body) -> None:
        self._body = body

    async def on_start(self) -> None:
        self._body.advance(self.clock.now())
        self._body.sample(RATE)

    @every(hz=RATE, late="catch_up")
    def read(self) -> None:
        """Publish the next sample. A loop that was held up publishes those it owes one by one: the sensors have not waited for it."""
        self._body.advance(self.clock.now())
        sample = self._body.next_sample()
        if sample is None:
            return
        stamp, imu, joints = self.clock.stamp(sample.time), sample.imu, sample.joints
        self.imu(
            Imu(
                header=Header(stamp=stamp, frame_id="imu_link"),
                orientation_covariance=NOT_MEASURED,
                angular_velocity=_vector3(imu.gyro.tolist()),
                linear_acceleration=_vector3(imu.accel.tolist()),
            )
        )
        self.contacts(FootContacts(stamp=stamp, contact=joints.contact))
        self.joints(
            JointState(
                header=Header(stamp=stamp, frame_id="base_link"),
                name=JOINT_NAMES,
                position=joints.position,
                velocity=joints.velocity,
                effort=joints.effort,
            )
        )


class Lidar(Node):
    """One revolution of 360 beams at 10 Hz: lidar/scan. Beam i looks along -pi + i 2 pi / 360 in the body's yaw frame."""

    scan = publishes(SCAN)

    def __init__(self, body: Body) -> None:
        self._body = body

    @every(hz=10)
    def turn(self) -> None:
        self._body.advance(self.clock.now())
        step = 2.0 * np.pi / BEAMS
        self.scan(
            LaserScan(
                header=Header(stamp=self.clock.stamp(), frame_id="base_link"),
                angle_min=-np.pi,
                angle_max=np.pi - step,
                angle_increment=step,
                scan_time=0.1,
                range_min=0.05,
                range_max=MAX_RANGE,
                ranges=self._body.lidar(BEAMS, MAX_RANGE),
            )
        )


def _vector3(values: list[float]) -> Vector3:
    x, y, z = values
    return Vector3(x=x, y=y, z=z)
