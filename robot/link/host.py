"""The process of a body: physics, sensors and the drives' firmware in real time, with or without listeners. It has no event loop and no nodes."""

from __future__ import annotations

import os
import select
import time
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from actors.processes.signals import leave_to_parent
from actors.time.processor import is_runnable
from robot.hardware.arm import ArmBusy
from robot.link.firmware import Drives
from robot.link.priority import favour
from robot.link.records import Call, Command, Order, State, read_command, sample_record, scenery_record, state_record
from robot.link.segment import Segment, attached
from robot.model.robot import SPOT, RobotModel
from robot.sim.charger import charger_connected
from robot.sim.mjcf import obstacle_names
from robot.sim.simulation import Simulation

if TYPE_CHECKING:
    from robot.hardware.sensors import Sensors
    from robot.model.actuators import ActuatorDesign
    from robot.scenes.scene import Scene
    from robot.sim.ground import Ground

IDLE: Final = 0.005
"""Seconds between two rounds while nobody has asked for samples."""
BEHIND: Final = 0.01
"""Seconds of the body's time that a round makes up for, two samples; what is more is lost: the controller must not be left behind."""
AHEAD: Final = 0.03
"""Seconds that it goes on without targets before it looks whether the controller has no processor; the drives act by themselves after `SILENCE`."""
PATIENCE: Final = 0.5
"""Seconds of the machine for which time waits for it."""
WAIT: Final = 0.001
"""Seconds between two looks whether it has one."""
SLACK: Final = 0.0001
"""Seconds after a sample is due at which it is taken, so that no rounding makes a round too early."""
ORPHANED: Final = 6.0
"""Seconds that a body outlives the process that made it, at most: time to sit."""
ABANDONED: Final = 1.0
"""Seconds without a commander after which an orphan that rests has nobody left."""


@dataclass(frozen=True, slots=True)
class BodySpec:
    """What a body's process needs to make it."""

    scene: Scene
    seed: int
    delay: float
    arm: bool
    ground: Ground | None
    actuators: ActuatorDesign | None = None
    sensors: Sensors | None = None
    model: RobotModel = SPOT


class Pace:
    """How far the body's time may go. It runs as that of the machine, but the world waits for a process that is late.

    What a round is late by more than `BEHIND` is lost: the body's time has slipped then, and all clocks that go with it. While the process that
    commands could run and has no processor, time does not leave its last targets behind, for `PATIENCE` seconds of the machine at most: a robot
    falls by what its controllers do, not because this machine is busy. One that hangs, sleeps or has ended is not waited for.
    """

    def __init__(self, segment: Segment) -> None:
        self._segment = segment
        self._slipped = 0.0
        self._waiting_since: float | None = None

    def present(self, real: float) -> float:
        """The body's time, if it is not late, at the machine's time `real`."""
        return real - self._slipped

    @property
    def waits(self) -> bool:
        """Whether it waits for the controller."""
        return self._waiting_since is not None

    def until(self, real: float, reached: float, heard: float | None) -> float:
        """Up to where to go in this round, at the machine's time `real`, for a body at `reached` whose last targets are of the time `heard`."""
        until = min(self.present(real), reached + BEHIND)
        if heard is None or until <= heard + AHEAD:
            self._waiting_since = None
        elif self._is_waited_for(real):
            until = max(reached, heard + AHEAD)
        if self.present(real) > until:
            self._slipped = real - until
            self._segment.slipped = self._slipped
        return until

    def _is_waited_for(self, real: float) -> bool:
        if not is_runnable(self._segment.commander):
            self._waiting_since = None
        elif self._waiting_since is None:
            self._waiting_since = real
        return self._waiting_since is not None and real - self._waiting_since < PATIENCE


class BodyHost:
    """One body behind one segment. `serve` brings it up to an instant of the machine's clock (`time.monotonic`), at which its time began.

    Commands act at the instant at which they were given, unless the body is past it, so how often `serve` is called makes no difference to
    the motion.
    """

    def __init__(self, body: Simulation, segment: Segment, began: float) -> None:
        self._body, self._segment, self._began = body, segment, began
        self._names = obstacle_names(body.scene)
        self._drives = Drives(body.model)
        self._commands, self._calls = segment.commands.written, segment.calls.written
        self._hz = self._begin = 0.0
        self._asked: Command | None = None
        self._publish_scenery()
        self._publish()

    @property
    def drives(self) -> Drives:
        return self._drives

    @property
    def reached(self) -> float:
        """The present instant of the body."""
        return self._began + self._body.time

    def serve(self, now: float) -> None:
        """Do what has been asked for, let time pass up to `now`, and tell what has become of it."""
        for number, record in self._segment.commands.after(self._commands):
            self._commands = number
            self._follow(read_command(record), now)
        self._advance(now)
        self._answer()
        self._publish()

    def next_round(self, now: float) -> float:
        """When to call `serve` again: when the next sample is due."""
        if self._asked is not None:
            return self._asked.begin + SLACK
        if self._hz == 0.0:
            return now + IDLE
        passed = int((now - SLACK - self._begin) * self._hz) + 1
        return self._begin + max(0, passed) / self._hz + SLACK

    def _follow(self, command: Command, now: float) -> None:
        """Take a command at the instant at which it was given, or now, if it is of an instant that is over or has not come."""
        if command.order is Order.SAMPLE:
            if self._drives.admits(command.epoch):
                self._asked = command
            return
        at = min(command.at, now)
        self._advance(at)
        if command.order is Order.SUPPLY:
            self._body.supply(command.voltage)
            return
        if command.targets is not None and self._drives.obey(at, command.epoch):
            self._body.command(command.targets)

    def _advance(self, until: float) -> None:
        """Time up to `until`, and what is due on the way: a new rate of samples, and the firmware's own targets."""
        if self._asked is not None and self._asked.begin <= until:
            command, self._asked = self._asked, None
            self._advance(command.begin)
            self._body.sample(command.hz)
            self._hz, self._begin = command.hz, self._began + self._body.time
        while (due := self._drives.due()) is not None and due <= until:
            self._move(due)
            self._body.command(self._drives.act(due, self._body.joints(), self._body.imu()))
        self._move(until)

    def _move(self, until: float) -> None:
        """Physics, and the samples on the way."""
        self._body.advance(until - self._began)
        while (sample := self._body.next_sample()) is not None:
            self._segment.samples.write(sample_record(sample, self._began + sample.time))

    def _answer(self) -> None:
        for number, record in self._segment.calls.after(self._calls):
            self._calls = number
            refused, seconds = self._act(Call(int(record[0])), record[1:].tolist())
            self._publish()  # before the answer: who has it finds the arm as it is after the call
            self._segment.replies.write((number, refused, seconds))

    def _act(self, call: Call, values: list[float]) -> tuple[bool, float]:
        """Whether the arm refuses because it is busy, and how long what it does takes, s."""
        arm = self._body.arm
        assert arm is not None
        try:
            if call is Call.MOVE:
                return False, arm.move(values)
            if call is Call.STOP:
                return False, arm.stop()
            arm.grip(bool(values[0]))
        except ArmBusy:
            return True, 0.0
        return False, 0.0

    def _publish(self) -> None:
        """Tell how the body is at its present instant."""
        body = self._body
        truth = body.truth()
        charger = charger_connected(truth, body.scene.dock)
        state = State(self._began + body.time, truth, body.joints(), charger, self._drives.stopping, body.actuators())
        self._segment.state.write(state_record(state, self._names))
        if body.arm is not None:
            self._publish_scenery()

    def _publish_scenery(self) -> None:
        """Tell of the arm, and of the things, which stay where they are without one."""
        things, arm = self._body.things(), self._body.arm
        if arm is None:
            self._segment.scenery.write(scenery_record(None, None, None, things))
            return
        held = None
        if arm.held is not None:
            held = next(index for index, thing in enumerate(things) if thing.name == arm.held)
        self._segment.scenery.write(scenery_record(arm.state(), arm.gripper, held, things))


class Maker:
    """The process that had this one made; it is the parent, unless a zygote has forked this one."""

    def __init__(self, process: int) -> None:
        self._process = process
        self._descriptor: int | None = None
        with suppress(AttributeError, OSError):  # an older system, or it is gone already
            self._descriptor = os.pidfd_open(process)

    @property
    def gone(self) -> bool:
        if self._descriptor is None:
            return os.getppid() != self._process
        return bool(select.select([self._descriptor], [], [], 0)[0])


def serve(spec: BodySpec, name: str, parent: int) -> None:
    """The whole life of a body's process: until it is killed, or the process `parent` is gone and the robot rests."""
    from robot.sim.physics import PhysicsBody

    leave_to_parent()  # the robot sits first
    favour("body")
    maker = Maker(parent)
    segment = attached(name, len(spec.scene.things))
    body = PhysicsBody(
        spec.scene,
        seed=spec.seed,
        delay=spec.delay,
        arm=spec.arm,
        ground=spec.ground,
        actuators=spec.actuators,
        sensors=spec.sensors,
        model=spec.model,
    )
    host, pace = BodyHost(body, segment, time.monotonic()), Pace(segment)
    orphaned: float | None = None
    while True:
        real = time.monotonic()
        now = pace.until(real, host.reached, host.drives.heard)
        host.serve(now)
        if maker.gone:
            orphaned = now if orphaned is None else orphaned
            if now - orphaned > (ABANDONED if host.drives.resting else ORPHANED):
                segment.remove()
                return
        left = host.next_round(now) - pace.present(time.monotonic())
        time.sleep(max(WAIT if pace.waits else 0.0, left))
