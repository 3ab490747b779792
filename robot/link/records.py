"""What the numbers of a record mean: commands, samples, states, the arm and the scene's things, there and back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Final

import numpy as np

from robot.geometry.vectors import Vector
from robot.hardware.arm import ArmState, GripperState
from robot.hardware.body import ActuatorState, ImuSample, JointSample, MotorTargets, Sample
from robot.link.segment import ARM, COMMAND, THING
from robot.scenes.scene import Thing
from robot.sim.simulation import Truth

TOUCHED: Final = 4
"""So many obstacles are reported of those that are touched at once."""
_NONE: Final = -1.0
COLD: Final = ActuatorState(True, np.empty(0), 1.0)
"""Drives with current that do not get warm."""


class Order(IntEnum):
    """The kinds of commands."""

    TARGETS = 1
    SAMPLE = 2
    SUPPLY = 3


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
    voltage: float = 0.0
    """Share of the nominal voltage that the battery gives the drives from now on."""


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """The body at one instant."""

    at: float
    truth: Truth
    joints: JointSample
    charger: bool
    stopping: bool = False
    """Whether the drives act by themselves, as nobody commands them."""
    actuators: ActuatorState = COLD
    """What the drives tell of themselves."""


def command_record(command: Command) -> Vector:
    """As numbers."""
    head, targets = (command.order, command.at, command.epoch), command.targets
    if targets is not None:
        return np.concatenate((head, targets.position, targets.velocity, targets.effort, targets.kp, targets.kd))
    record = np.zeros(COMMAND)
    record[:6] = *head, command.hz, command.begin, command.voltage
    return record


def read_command(record: Vector) -> Command:
    """And back."""
    number, at, epoch, hz, begin, voltage = record[:6].tolist()
    if number == Order.TARGETS:
        return Command(Order.TARGETS, at, int(epoch), targets=MotorTargets(*record[3:].reshape(5, 12)))
    return Command(Order(int(number)), at, int(epoch), hz=hz, begin=begin, voltage=voltage)


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
    drives = state.actuators
    warmth = drives.temperature if drives.temperature.size else np.full(12, np.nan)
    tail = ([float(drives.supplied), drives.left], warmth)
    return np.concatenate(([state.at], *motion, *_joint_parts(state.joints), flags, touched, *tail))


def read_state(record: Vector, obstacles: Sequence[str]) -> State:
    """And back."""
    at, joints = float(record[0]), _joints(record[26:66])
    warmth = record[77:89]
    temperature = np.empty(0) if np.isnan(warmth[0]) else warmth
    actuators = ActuatorState(bool(record[75]), temperature, float(record[76]))
    return State(at, read_truth(record, obstacles), joints, bool(record[69]), bool(record[70]), actuators)


def read_truth(record: Vector, obstacles: Sequence[str]) -> Truth:
    """Only where the body truly is."""
    return Truth(
        position=record[1:4],
        quaternion=record[4:8],
        velocity=record[8:11],
        angular_velocity=record[11:14],
        joints=record[14:26],
        fallen=bool(record[66]),
        lying=bool(record[67]),
        touching=tuple(obstacles[int(one)] for one in record[71:75].tolist() if one != _NONE),
        power=float(record[68]),
    )


def read_power(record: Vector) -> float:
    """Only the power of the motors."""
    return float(record[68])


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
