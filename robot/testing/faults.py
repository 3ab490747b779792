"""Sensors that fail: each fault turns true samples into what a broken sensor would give."""

from __future__ import annotations

from collections.abc import Callable
from types import MappingProxyType
from typing import Final, Literal, TypeAlias, get_args

import numpy as np

from robot.hardware.body import ImuSample, JointSample

Spoil: TypeAlias = Callable[[ImuSample, JointSample], tuple[ImuSample | None, JointSample]]
"""What happens to the samples on their way from the sensors to the controller; no IMU sample: the IMU says nothing."""

GyroFault: TypeAlias = Literal["scaled", "offset", "held", "swapped"]
"""How a gyro can be wrong and yet plausible."""
GYRO_FAULTS: Final[tuple[GyroFault, ...]] = get_args(GyroFault)
"""The names of the faults of a gyro that `wrong_gyro` makes."""

_NAN = np.full(3, np.nan)


def _frozen_imu() -> Spoil:
    held: list[ImuSample] = []

    def spoil(imu: ImuSample, joints: JointSample) -> tuple[ImuSample | None, JointSample]:
        held[:] = held or [imu]
        return ImuSample(held[0].gyro.copy(), held[0].accel.copy()), joints

    return spoil


def _silent_imu() -> Spoil:
    return lambda imu, joints: (None, joints)


def _mad_imu() -> Spoil:
    return lambda imu, joints: (ImuSample(_NAN, _NAN), joints)


def _joint(joint: int, value: float | None) -> Callable[[], Spoil]:
    """An encoder that shows `value`, or what it showed first."""

    def begin() -> Spoil:
        held: list[tuple[float, float]] = [] if value is None else [(value, value)]

        def spoil(imu: ImuSample, joints: JointSample) -> tuple[ImuSample | None, JointSample]:
            held[:] = held or [(float(joints.position[joint]), float(joints.velocity[joint]))]
            position, velocity = joints.position.copy(), joints.velocity.copy()
            position[joint], velocity[joint] = held[0]
            return imu, JointSample(position, velocity, joints.effort, joints.contact)

        return spoil

    return begin


def _contact(feet: tuple[int, ...], closed: bool) -> Callable[[], Spoil]:
    def spoil(imu: ImuSample, joints: JointSample) -> tuple[ImuSample | None, JointSample]:
        contact = joints.contact.copy()
        contact[list(feet)] = closed
        return imu, JointSample(joints.position, joints.velocity, joints.effort, contact)

    return lambda: spoil


FAULTS = MappingProxyType(
    {
        "IMU silent": _silent_imu,
        "IMU not a number": _mad_imu,
        "IMU frozen": _frozen_imu,
        "knee encoder not a number": _joint(2, float("nan")),
        "hip encoder not a number": _joint(6, float("nan")),
        "knee encoder frozen": _joint(5, None),
        "shoulder encoder frozen": _joint(10, None),
        "one contact stuck closed": _contact((0,), True),
        "one contact stuck open": _contact((3,), False),
        "all contacts stuck closed": _contact((0, 1, 2, 3), True),
        "all contacts stuck open": _contact((0, 1, 2, 3), False),
    }
)
"""Name of each fault, and what begins it."""


def wrong_gyro(kind: GyroFault, axis: int, amount: float = 0.0) -> Spoil:
    """A gyro that is wrong about one axis (0 to 2), and shows nothing that could not be.

    `scaled`: `amount` times the truth; `offset`: `amount` more than it, rad/s; `held`: what it showed first; `swapped`: the next axis has it, and it
    that of the next.
    """
    held: list[float] = []

    def spoil(imu: ImuSample, joints: JointSample) -> tuple[ImuSample | None, JointSample]:
        gyro = imu.gyro.copy()
        held[:] = held or [float(gyro[axis])]
        if kind == "scaled":
            gyro[axis] *= amount
        elif kind == "offset":
            gyro[axis] += amount
        elif kind == "held":
            gyro[axis] = held[0]
        else:
            both = [axis, (axis + 1) % 3]
            gyro[both] = gyro[both[::-1]]
        return ImuSample(gyro, imu.accel), joints

    return spoil
