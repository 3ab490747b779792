"""The driver of IMU, joint encoders and foot contacts: it reads the body at its rate and publishes what it read.

What it computes is to take off the gyro's bias, once a calibration has told it, and to make fewer samples of those that it reads too late
(`robot.hardware.overdue`).
"""

from __future__ import annotations

from math import isclose
from typing import Final

import numpy as np

from actors import Node, every, parameter, publishes
from actors.interfaces.geometry_msgs.msg import Vector3
from actors.interfaces.sensor_msgs.msg import Imu, JointState
from actors.interfaces.std_msgs.msg import Header
from robot.contracts import CONTACTS, IMU, IMU_CALIBRATION, IMU_RAW, JOINT_STATES
from robot.hardware.body import JOINT_NAMES, Hardware, ImuSample, Sample
from robot.hardware.overdue import merged, taken_together
from robot.interfaces.robactor_msgs.msg import FootContacts, ImuCalibration

RATE: Final = 200.0
"""Samples of IMU and encoders per second, unless told otherwise."""

LATE: Final = 0.05
"""Samples that have waited longer than this, in seconds, are warned of: by then the drives have begun to act by themselves."""

NO_BIAS: Final = (0.0, 0.0, 0.0)

NOT_MEASURED = np.array([-1.0] + [0.0] * 8)
"""An orientation covariance that says: no orientation here (sensor_msgs/Imu)."""
NOT_MEASURED.flags.writeable = False


class Proprioception(Node):
    """IMU, joint encoders and foot contacts of one instant at 200 Hz: imu/data_raw, imu/data, foot_contacts, then joint_states.

    There are fewer of them while this loop is held up for longer than 10 ms.
    Takes imu/calibration: its gyro_bias is taken off every sample of imu/data from then on, not of imu/data_raw.
    Parameters: rate, imu_rate (of imu/data: a whole part of rate).
    """

    imu_raw = publishes(IMU_RAW)
    imu = publishes(IMU)
    contacts = publishes(CONTACTS)
    joints = publishes(JOINT_STATES)
    rate = parameter(
        RATE, unit="Hz", ge=50.0, le=1000.0, read_only=True, description="Joint states and foot contacts a second."
    )
    imu_rate = parameter(
        0.0,
        unit="Hz",
        ge=0.0,
        le=1000.0,
        read_only=True,
        description="Messages of imu/data a second: a whole part of rate; 0 is all.",
    )

    def __init__(self, body: Hardware) -> None:
        self._body = body
        self._bias = NO_BIAS
        self._count = 0

    def resume(self, state: tuple[float, float, float]) -> None:
        self._bias = state

    async def on_start(self) -> None:
        self._every = max(1, round(self.rate / self.imu_rate)) if self.imu_rate else 1
        if self.imu_rate and not isclose(self._every * self.imu_rate, self.rate):
            raise ValueError(
                f"imu_rate {self.imu_rate:g} Hz is no whole part of rate {self.rate:g} Hz: "
                f"give {self.rate:g}, {self.rate / 2:g}, {self.rate / 3:g} ..."
            )
        self._feels = self._body.capabilities.contacts
        self._body.advance(self.clock.now())
        self._body.sample(self.rate)

    @IMU_CALIBRATION.on()
    def calibrate(self, message: ImuCalibration) -> None:
        bias = message.gyro_bias
        self._bias = (bias.x, bias.y, bias.z)
        self.checkpoint(self._bias)

    @every(hz="rate")
    async def read(self) -> None:
        """Publish the samples since the last time, which is one, unless this loop or the body was held up: the sensors have not waited for it.

        Each is taken in by those who listen before the next one follows. Samples that have waited too long are merged.
        """
        self._body.advance(self.clock.now())
        waiting = self._waiting()
        while waiting:
            waited = self.clock.now() - waiting[0].time
            together = waiting[: taken_together(self.rate, waited)]
            if len(together) > 1 and waited > LATE:
                self.log.warning("read late: several samples are published as one", once=True, seconds=round(waited, 3))
            self._tell(merged(together))
            waiting = waiting[len(together) :] + self._waiting()
            if waiting:
                await self.clock.sleep(0.0)

    def _waiting(self) -> list[Sample]:
        """The samples that nobody has taken, oldest first."""
        return list(iter(self._body.next_sample, None))

    def _tell(self, sample: Sample) -> None:
        stamp, joints = self.clock.stamp(sample.time), sample.joints
        raw = _message(Header(stamp=stamp, frame_id="imu_link"), sample.imu)
        self.imu_raw(raw)
        if self._count % self._every == 0:
            self.imu(self._corrected(raw))
        self._count += 1
        if self._feels:
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

    def _corrected(self, raw: Imu) -> Imu:
        if self._bias == NO_BIAS:
            return raw
        (bx, by, bz), w = self._bias, raw.angular_velocity
        return raw.replace(angular_velocity=Vector3(x=w.x - bx, y=w.y - by, z=w.z - bz))


def _message(header: Header, imu: ImuSample) -> Imu:
    (wx, wy, wz), (ax, ay, az) = imu.gyro.tolist(), imu.accel.tolist()
    return Imu(
        header=header,
        orientation_covariance=NOT_MEASURED,
        angular_velocity=Vector3(x=wx, y=wy, z=wz),
        linear_acceleration=Vector3(x=ax, y=ay, z=az),
    )
