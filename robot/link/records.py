"""What the numbers of a record mean: commands, samples, states, the arm and the scene's things, there and back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Final

import numpy as np

from robot.geometry.vectors import Vector
from robot.hardware.arm import ArmState, GripperState
from robot.hardware.body import ImuSample, JointSample, MotorTargets, Sample, Truth
from robot.link.segment import ARM, COMMAND, THING
from robot.scenes.scene import Thing

__all__ = [
    "Call", "Command", "Order", "State", "arm_of", "command_record", "held_of", "read_command", "read_state", "sample_of", "sample_record",
    "scenery_record", "state_record", "things_of",
]  # fmt: skip

TOUCHED: Final = 4
"""So many obstacles are told of those that are touched at once."""
_NONE: Final = -1.0


class Order(IntEnum):
    """The kinds of commands."""

    TARGETS = 1
    SAMPLE = 2


class Call(IntEnum):
    """What the arm's driver asks for."""

    MOVE = 1
    STOP = 2
    GRIP = 3


@dataclass(frozen=True, slots=True, eq=False)
class Command:
    """One command; instants are those of the clock that all processes of a machine share (`time.monotonic`)."""

    order: Order
    at: float
    """When it was given."""
    epoch: int
    """The number of the process that gave it, among all that were launched."""
    targets: MotorTargets | None = None
    hz: float = 0.0
    begin: float = 0.0
    """From this instant on samples are taken, `hz` times a second."""


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """The body at one instant."""

    at: float
    truth: Truth
    joints: JointSample
    charger: bool
    stopping: bool = False
    """Whether the drives act by themselves, as nobody commands them."""


def command_record(command: Command) -> Vector:
    """As numbers."""
    record = np.zeros(COMMAND)
    record[0], record[1], record[2] = command.order, command.at, command.epoch
    targets = command.targets
    if targets is not None:
        record[3:] = np.concatenate((targets.position, targets.velocity, targets.effort, targets.kp, targets.kd))
    else:
        record[3], record[4] = command.hz, command.begin
    return record


def read_command(record: Vector) -> Command:
    """And back."""
    order, at, epoch = Order(int(record[0])), float(record[1]), int(record[2])
    if order is Order.TARGETS:
        return Command(order, at, epoch, targets=MotorTargets(*(record[3 + 12 * k : 15 + 12 * k] for k in range(5))))
    return Command(order, at, epoch, hz=float(record[3]), begin=float(record[4]))


def sample_record(sample: Sample, at: float) -> Vector:
    """A sample of the instant `at`."""
    return np.concatenate(([at], sample.imu.gyro, sample.imu.accel, *_joint_parts(sample.joints)))


def sample_of(record: Vector, offset: float) -> Sample:
    """And back, in the time of a clock that is `offset` ahead of that instant."""
    return Sample(float(record[0]) + offset, ImuSample(record[1:4], record[4:7]), _joints(record[7:47]))


def state_record(state: State, obstacles: Sequence[str]) -> Vector:
    """As numbers; obstacles that are touched by their place in `obstacles`."""
    truth = state.truth
    touched = [float(obstacles.index(name)) for name in truth.touching[:TOUCHED]]
    touched += [_NONE] * (TOUCHED - len(touched))
    motion = (truth.position, truth.quaternion, truth.velocity, truth.angular_velocity, truth.joints)
    flags = [float(truth.fallen), float(truth.lying), truth.power, float(state.charger), float(state.stopping)]
    return np.concatenate(([state.at], *motion, *_joint_parts(state.joints), flags, touched))


def read_state(record: Vector, obstacles: Sequence[str]) -> State:
    """And back."""
    truth = Truth(
        position=record[1:4],
        quaternion=record[4:8],
        velocity=record[8:11],
        angular_velocity=record[11:14],
        joints=record[14:26],
        fallen=bool(record[66]),
        lying=bool(record[67]),
        touching=tuple(obstacles[int(one)] for one in record[71:75] if one != _NONE),
        power=float(record[68]),
    )
    return State(float(record[0]), truth, _joints(record[26:66]), bool(record[69]), bool(record[70]))


def scenery_record(
    arm: ArmState | None, gripper: GripperState | None, held: int | None, things: Sequence[Thing]
) -> Vector:
    """The arm, if there is one, and where the things are."""
    record = np.zeros(ARM + THING * len(things))
    if arm is not None and gripper is not None:
        record[:4], record[4:8] = arm.position, arm.velocity
        record[8:10] = arm.moving, arm.progress
        record[10:14] = gripper.opening, gripper.closing, gripper.moving, gripper.gripping
        record[14] = _NONE if held is None else held
    for index, thing in enumerate(things):
        at = ARM + THING * index
        record[at : at + THING] = thing.shape.x, thing.shape.y, thing.z
    return record


def arm_of(record: Vector) -> tuple[ArmState, GripperState]:
    """The arm and its gripper."""
    moving, progress, opening, closing, gripper_moving, gripping = record[8:14].tolist()
    state = ArmState(record[:4], record[4:8], bool(moving), progress)
    return state, GripperState(opening, bool(closing), bool(gripper_moving), bool(gripping))


def held_of(record: Vector) -> int | None:
    """The thing in the gripper, by its place in the scene."""
    return None if record[14] == _NONE else int(record[14])


def things_of(record: Vector, things: Sequence[Thing]) -> tuple[Thing, ...]:
    """The scene's things where the record has them."""
    places = record[ARM:].reshape(-1, THING).tolist()
    return tuple(
        replace(thing, shape=replace(thing.shape, x=x, y=y), z=z)
        for thing, (x, y, z) in zip(things, places, strict=True)
    )


def _joint_parts(joints: JointSample) -> tuple[Vector, Vector, Vector, Vector]:
    return joints.position, joints.velocity, joints.effort, joints.contact.astype(np.float64)


def _joints(record: Vector) -> JointSample:
    return JointSample(record[:12], record[12:24], record[24:36], record[36:40] != 0.0)
