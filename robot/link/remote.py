"""A body in another process, as controllers meet it in theirs: it has the body's interface, and crosses to other processes as a name.

LiDAR and camera see a mirror of the scene: their rays are cast in the process that asks, from where the body says it is.
"""

from __future__ import annotations

import asyncio
import os
import time
from collections.abc import Callable, Sequence
from math import inf
from typing import Any, Final

import numpy as np

from actors.time.lockstep import Lockstep, Simulated
from robot.geometry.planar import Pose2
from robot.geometry.vectors import Vector, rotation_of
from robot.hardware.arm import ArmBusy, ArmState, GripperState
from robot.hardware.beams import BEAMS, MAX_RANGE, beam_angles
from robot.hardware.body import (
    NO_REPLAY,
    ActuatorState,
    BodySilent,
    Capabilities,
    ImuSample,
    JointSample,
    MotorTargets,
    Sample,
    Sweep,
)
from robot.hardware.sensors import Sensors
from robot.link.phase import Phase
from robot.link.records import (
    Call,
    Command,
    Order,
    State,
    arm_of,
    command_record,
    held_of,
    read_power,
    read_state,
    read_truth,
    sample_of,
    things_of,
)
from robot.link.segment import CALL, Segment, attached
from robot.model.arm import check_angles
from robot.model.robot import SPOT, RobotModel
from robot.scenes.scene import Obstacle, Scene, Thing
from robot.sim.depth_rays import sight
from robot.sim.lidar_rays import cast
from robot.sim.mjcf import obstacle_names
from robot.sim.noise import LidarNoise
from robot.sim.simulation import SimulationArm, Truth
from robot.sim.spin import beam_directions

SILENT: Final = 1.0
"""Seconds without news after which a body counts as gone."""
ANSWER: Final = 0.5
"""Seconds that the arm may take to answer a call."""
POLL: Final = 0.0005
AHEAD: Final = 0.02
"""Seconds by which the clock of a controller may be ahead of what the body has told: some of its periods, for turns that come late."""
ROUND: Final = 0.006
"""Seconds by which what is known of the arm may be old."""


_NOT_HERE: Final = "{}() moves a body by force, and this one lives in another process: run it in one process"


class LinkedBody(Simulated):
    """The physics body of the segment `name`; implements `Simulation`.

    Its `advance` waits for nothing: the body advances by itself. What it says is of the newest instant that it has told, at most a sample
    period old. Everything that reads raises `BodySilent` when that is a second old.

    `epoch` numbers the processes that may command the body, in the order in which they are launched: a copy for another process has the next.
    """

    no_replay = NO_REPLAY

    def __init__(
        self,
        name: str,
        scene: Scene,
        *,
        seed: int,
        arm: bool,
        epoch: int | None = None,
        sensors: Sensors | None = None,
        model: RobotModel = SPOT,
    ) -> None:
        self._model = model
        self._name, self._scene, self._seed, self._has_arm = name, scene, seed, arm
        self._sensors = sensors or Sensors.ideal()
        self._segment: Segment = attached(name, len(scene.things))
        self._epoch = self._segment.next_epoch() if epoch is None else epoch
        self._obstacles = obstacle_names(scene)
        self._noise = LidarNoise(seed, self._sensors.lidar)
        self._offset = -inf
        self._taken = self._segment.samples.written
        self._phase: Phase | None = None
        self._arm = LinkedArm(self) if arm else None
        self._now: Callable[[], float] = time.monotonic
        """The body's clock, as this process has it."""
        self._commands = False

    def __repr__(self) -> str:
        return f"LinkedBody({self._name!r}, scene={self._scene.name!r})"

    def __reduce__(self) -> tuple[Any, ...]:
        epoch = self._segment.next_epoch()
        return _linked, (
            self._name,
            self._scene,
            self._seed,
            self._has_arm,
            epoch,
            self._sensors,
            self._model,
            self.real_time,
        )

    @property
    def backend(self) -> str:
        return "physics"

    @property
    def capabilities(self) -> Capabilities:
        """Those of the physics body."""
        return Capabilities()

    @property
    def scene(self) -> Scene:
        return self._scene

    @property
    def model(self) -> RobotModel:
        return self._model

    @property
    def sensors(self) -> Sensors:
        return self._sensors

    @property
    def time(self) -> float:
        """The instant of what is known, on the clock of the caller of `advance`."""
        return self.state().at + self._shift()

    @property
    def arm(self) -> LinkedArm | None:
        return self._arm

    @property
    def charger(self) -> bool:
        return self.state().charger

    @property
    def segment(self) -> Segment:
        """Where it is linked."""
        return self._segment

    def things(self) -> tuple[Thing, ...]:
        """Where they were last seen."""
        return things_of(self.scenery(), self._scene.things)

    def obstacles(self) -> tuple[Obstacle, ...]:
        """The scene's."""
        return self._scene.obstacles

    def keep_step(self, loop: asyncio.AbstractEventLoop) -> None:
        """Let the loop's clock go with the body's, which is that of its process and may be slower than real time."""
        if (step := Lockstep.of(loop)) is not None:
            step.follow(self._world)
            self._now = loop.time

    def _world(self) -> tuple[float, float]:
        at = self._segment.state.latest()
        return inf if at is None else float(at[0]) + AHEAD, self._segment.slipped

    def advance(self, until: float) -> None:
        """Learn how the caller's clock goes: `until` is its present."""
        self._offset = max(
            self._offset, until - self._now()
        )  # a reader that is held up between the two reads is behind, never ahead

    def command(self, targets: MotorTargets) -> None:
        """Send targets; the drives take them as of now."""
        if not self._commands:
            self._commands, self._segment.commander = True, os.getpid()
        command = Command(Order.TARGETS, self._now(), self._epoch, targets=targets)
        self._segment.commands.write(command_record(command))

    def supply(self, voltage: float) -> None:
        """Tell the drives what the battery gives them; the process that has the battery may, also if another one commands."""
        command = Command(Order.SUPPLY, self._now(), self._epoch, voltage=voltage)
        self._segment.commands.write(command_record(command))

    def actuators(self) -> ActuatorState:
        """What the drives have told last."""
        return self.state().actuators

    def sample(self, hz: float) -> None:
        """Ask for samples. Their instants are shifted a little later, so that each is there when its reader comes for it."""
        self._phase = Phase(hz)
        self._ask(hz, self._now())
        self._taken = self._segment.samples.written

    def next_sample(self) -> Sample | None:
        """The oldest sample that has not been taken here."""
        if self._phase is not None and (begin := self._phase.tick(self._now())) is not None:
            self._ask(self._phase.hz, begin)
            self._phase = None
        if self._segment.samples.written == self._taken:
            return None  # as every second time: the reader comes until there is none
        found = next(self._segment.samples.after(self._taken), None)
        if found is None:
            return None
        self._taken, record = found
        return sample_of(record, self._shift())

    def imu(self) -> ImuSample:
        """The newest sample. Raises `BodySilent` before the first."""
        record = self._segment.samples.latest()
        if record is None:
            raise BodySilent(f"{self!r} has taken no sample yet: call sample() first")
        return sample_of(record, 0.0).imu

    def joints(self) -> JointSample:
        return self.state().joints

    def lidar(self, beams: int = BEAMS, max_range: float = MAX_RANGE) -> Vector:
        """Rays through the mirrored scene from where the body is now, by its place and speed of its newest instant."""
        state = self.state()
        truth, passed = state.truth, self._now() - state.at
        x, y, z = (truth.position + passed * truth.velocity).tolist()
        yaw = truth.yaw + passed * float(truth.angular_velocity[2])
        return self._noise.apply(cast(self._scene, x, y, yaw, beams, max_range, height=z), max_range)

    def sweep(self) -> Sweep | None:
        """The revolution that ends now, each beam from where the body was then, by its place and speed of its newest instant.

        Its own legs are not seen.
        """
        taken = self._sensors.lidar.sweep
        if taken == 0.0:
            return None
        state = self.state()
        truth, now = state.truth, self._now()
        attitude = rotation_of(truth.quaternion)
        turning, mount = attitude @ truth.angular_velocity, attitude @ self._noise.mount
        passed = now - state.at - taken * (1.0 - (np.arange(BEAMS)[:, np.newaxis] + 0.5) / BEAMS)
        rays = beam_directions(beam_angles(BEAMS)) @ mount.T
        rays = rays + passed * np.cross(turning, rays)
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        eyes = truth.position + passed * truth.velocity
        met = sight(self._scene.obstacles, self._scene.pits, eyes, rays, MAX_RANGE, self._scene.terrain)
        return Sweep(now - taken + self._shift(), taken, self._noise.apply(np.minimum(met, MAX_RANGE), MAX_RANGE))

    def truth(self) -> Truth:
        return read_truth(self._told(), self._obstacles)

    @property
    def power(self) -> float:
        """Electrical motor power, W."""
        return read_power(self._told())

    def push(self, impulse: tuple[float, float, float], duration: float = 0.1) -> None:
        """Not over a link. Raises `NotImplementedError`."""
        raise NotImplementedError(_NOT_HERE.format("push"))

    def place(self, pose: Pose2) -> None:
        """Not over a link. Raises `NotImplementedError`."""
        raise NotImplementedError(_NOT_HERE.format("place"))

    def close(self) -> None:
        """Let go of the shared memory."""
        self._segment.close()

    def state(self) -> State:
        """What the body has told last. Raises `BodySilent` when that is a second old."""
        return read_state(self._told(), self._obstacles)

    def scenery(self) -> Vector:
        """Arm and things, as the body has told them last. Raises `BodySilent` before that."""
        record = self._segment.scenery.latest()
        if record is None:
            raise BodySilent(f"{self!r} has never been heard")
        return record

    def _told(self) -> Vector:
        record = self._segment.state.latest()
        if record is None or self._now() - record[0] > SILENT:
            raise BodySilent(f"{self!r} has not been heard for {SILENT:g} s: its process has ended, or stands still")
        return record

    def _ask(self, hz: float, begin: float) -> None:
        command = Command(Order.SAMPLE, self._now(), self._epoch, hz=hz, begin=begin)
        self._segment.commands.write(command_record(command))

    def _shift(self) -> float:
        """How far the caller's clock is ahead of the machine's."""
        return self._offset if self._offset > -inf else 0.0


class LinkedArm(SimulationArm):
    """The arm of a linked body. A call waits for its answer, a few milliseconds. Raises `BodySilent` without one."""

    def __init__(self, body: LinkedBody) -> None:
        self._body = body

    def move(self, target: Sequence[float]) -> float:
        """Begin a motion."""
        return self._call(Call.MOVE, check_angles(target)) + ROUND

    def stop(self) -> float:
        """Brake within limits."""
        seconds = self._call(Call.STOP, ())
        return seconds + ROUND if seconds > 0.0 else 0.0

    def state(self) -> ArmState:
        return arm_of(self._body.scenery())[0]

    def grip(self, closing: bool) -> None:
        """Close or open the gripper."""
        self._call(Call.GRIP, (float(closing),))

    @property
    def gripper(self) -> GripperState:
        return arm_of(self._body.scenery())[1]

    @property
    def held(self) -> str | None:
        index = held_of(self._body.scenery())
        return None if index is None else self._body.scene.things[index].name

    def _call(self, call: Call, values: Sequence[float]) -> float:
        segment, record = self._body.segment, np.zeros(CALL)
        record[0] = call
        record[1 : 1 + len(values)] = values
        number = segment.calls.write(record)
        deadline = time.monotonic() + ANSWER
        while time.monotonic() < deadline:
            answer = segment.replies.latest()
            if answer is not None and int(answer[0]) == number:
                if answer[1]:
                    raise ArmBusy("The arm is still moving: cancel that motion or wait for its end.")
                return float(answer[2])
            time.sleep(POLL)
        raise BodySilent(f"{self._body!r}: its arm has not answered for {ANSWER:g} s")


def _linked(
    name: str, scene: Scene, seed: int, arm: bool, epoch: int, sensors: Sensors, model: RobotModel, real_time: bool
) -> LinkedBody:
    """The other end, in the process that takes it out of its envelope."""
    body = LinkedBody(name, scene, seed=seed, arm=arm, epoch=epoch, sensors=sensors, model=model)
    body.real_time = real_time
    return body
