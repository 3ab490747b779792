"""What a gait controller believes of its sensors: samples in, samples that it can go by out, and which sensors are lost."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import dist

import numpy as np

from robot.estimation.leg_odometry import Estimator
from robot.estimation.plausibility import ContactWatch, ImuWatch, JointWatch, SwingSchedule
from robot.estimation.turn_watch import TurnWatch
from robot.geometry.vectors import Vector, to_body
from robot.hardware.body import LEGS, ImuSample, JointSample, MotorTargets
from robot.model.legs import foot_velocities
from robot.model.modes import ON_ITS_FEET, Mode
from robot.model.robot import RobotModel


class Senses:
    """Call `joints`, `contacts`, `imu` and `turn`, in this order, once per control step.

    `own_feet` is false for a body that steps by itself: its contacts are believed, and its feet do not tell of its turn or of the floor.
    Invariant: a sample that is believed is handed on as it came.
    """

    def __init__(self, own_feet: bool, model: RobotModel) -> None:
        self._own_feet = own_feet
        self._imu, self._joints, self._contacts = ImuWatch(), JointWatch(model), ContactWatch(own_feet)
        self._turn = TurnWatch()
        self._gyro = [0.0] * 3
        """What it showed last, rad/s."""

    @property
    def imu_lost(self) -> bool:
        """Whether there is no IMU: its samples do not come, or cannot be."""
        return self._imu.lost

    @property
    def gyro_doubtful(self) -> tuple[bool, bool, bool]:
        """Of which axes (body x, y, z) the gyro shows another turn than the feet do; the accelerometer may be right."""
        return self._turn.doubtful

    @property
    def steady(self) -> bool:
        """Whether there is an IMU to walk by."""
        return not (self._imu.lost or self._turn.wrong)

    @property
    def feels_ground(self) -> bool:
        """Whether feet that seem to slide tell of the floor: they are its own, and what their speed is computed from is believed.

        Feet seem to slide under a gyro that shows a turn which is none; whether it does is known within `turn_watch.LASTING`. They seem to by an encoder
        that sticks, too.
        """
        joints = self._joints
        sure = not joints.bad and not joints.sticking.doubtful
        return self._own_feet and self.steady and not self._turn.differs and sure

    @property
    def joints_lost(self) -> bool:
        return self._joints.lost

    @property
    def doubtful_joints(self) -> Sequence[int]:
        """Joints whose latest sample is not believed."""
        return self._joints.bad

    @property
    def lost(self) -> tuple[str, ...]:
        """The sensors that cannot be relied on: `imu`, `gyro`, `joints`, `contact fl` and so on."""
        lost = ["imu"] if self._imu.lost else []
        if self._turn.wrong:
            lost.append("gyro")
        if self._joints.lost:
            lost.append("joints")
        contacts = zip(LEGS, self._contacts.trusted, strict=True)
        return (*lost, *(f"contact {leg}" for leg, trusted in contacts if not trusted))

    def joints(self, dt: float, sample: JointSample, expected: Callable[[], Vector | None]) -> JointSample:
        """The sample; a joint that cannot be believed is where it is `expected` to be (shape (12,)), or else where it was seen last."""
        return self._joints.check(dt, sample, expected)

    def told(self, targets: MotorTargets, *, stepping: bool) -> None:
        """The drives have been told this: a joint that does not follow is asked why."""
        if self._own_feet:  # else no drive follows them
            self._joints.sticking.told(targets, stepping=stepping)

    def contacts(
        self, dt: float, sample: JointSample, estimate: Estimator, walker: SwingSchedule | None, silent: bool
    ) -> JointSample:
        """The sample with contacts that can be believed; `silent` says that they are too old."""
        contact = self._contacts.check(
            dt, sample, estimate.legs, walker, silent, lambda leg: _foot_speed(leg, sample, estimate)
        )
        if contact is None:
            return sample
        return JointSample(sample.position, sample.velocity, sample.effort, np.array(contact))

    def imu(self, dt: float, sample: ImuSample | None) -> ImuSample | None:
        """The sample, if it can be believed."""
        believed = self._imu.check(dt, sample)
        if believed is not None:
            self._gyro = believed.gyro.tolist()
        return believed

    def turn(self, dt: float, estimate: Estimator, mode: Mode) -> None:
        """Compare the gyro's turn with that of the feet, as `estimate` has taken in both.

        While the robot rises or sits down its feet may slide, and tell nothing. In one that sits, a wrong gyro gets a new chance.
        """
        if mode is Mode.SIT:
            self._turn.sits(dt, self._gyro)
        elif self._own_feet and mode in ON_ITS_FEET and self._imu.fresh:
            feet = [told for leg, told in estimate.firm.items() if self._contacts.trusted[leg]]
            self._turn.check(dt, feet, not self._joints.bad)


def _foot_speed(leg: int, joints: JointSample, estimate: Estimator) -> float:
    """How fast a foot moves over the ground, m/s."""
    turn, up = estimate.attitude.turn, estimate.rotation[2]
    moving, _ = foot_velocities(estimate.legs, joints.position.tolist(), joints.velocity.tolist(), turn, up)
    return dist(moving[leg], [-part for part in to_body(estimate.rotation, estimate.velocity)])
