"""The run behind a picture: the whole robot on the virtual clock, watched until it is caught in mid-stride.

The watcher reads the true body, which pictures may and controllers may not.
"""

from __future__ import annotations

import asyncio

import numpy as np

from actors import Child, Node, every, execute, run
from actors.interfaces.nav_msgs.msg import Path
from robot.assembly import Robot
from robot.contracts import PATH
from robot.geometry.vectors import Vector, rotation_of
from robot.model.kinematics import feet
from robot.model.parameters import FOOT_RADIUS
from robot.picture.recording import Recording
from robot.sim.simulation import Simulation, Truth

RATE = 50.0
STRIDE = 0.5
"""A little more than the period of the trot, s: within it every leg swings once."""
GROUNDED = FOOT_RADIUS + 0.004
"""A foot whose centre is lower than this has come down, m; lifted again above `RAISED`."""
RAISED = FOOT_RADIUS + 0.02


def record(robot: Robot, *, seed: int, at: float) -> Recording:
    """Run the robot on its mission and catch it within the half second after `at` (s), when its raised feet are highest.

    Raises `StartFailed` or `SupervisorGaveUp` when the robot cannot be run.
    """
    return execute(lambda: _watch(robot, seed, at), clock="virtual")


async def _watch(robot: Robot, seed: int, at: float) -> Recording:
    body = robot.body
    recording = Recording(body.scene, body.backend, body.truth())
    async with run(robot.tree, seed=seed, sinks=()) as system:
        await system.join(Child(Watcher, args=(body, recording, at)))
        ended = asyncio.ensure_future(system.wait())
        try:
            await asyncio.wait([ended], timeout=at + STRIDE)
            if ended.done():
                ended.result()
        finally:
            ended.cancel()
    _cut(recording)
    return recording


class Watcher(Node):
    """Fills a recording. Not a part of the robot."""

    def __init__(self, body: Simulation, recording: Recording, at: float) -> None:
        self._body, self._recording, self._at = body, recording, at
        self._path: tuple[tuple[float, float], ...] = ()
        self._down = np.ones(4, dtype=np.bool_)
        self._lift = -1.0

    @PATH.on()
    def path(self, message: Path) -> None:
        self._path = tuple((pose.pose.position.x, pose.pose.position.y) for pose in message.poses)

    @every(hz=RATE)
    def look(self) -> None:
        now, recording = self.clock.now(), self._recording
        self._body.advance(now)
        truth = self._body.truth()
        x, y, _ = truth.position.tolist()
        recording.times.append(now)
        recording.trail.append((x, y))
        places = truth.position + feet(truth.joints) @ rotation_of(truth.quaternion).T
        self._tread(places)
        if now >= self._at - 1e-9:
            self._catch(truth, places, now)

    def _tread(self, places: Vector) -> None:
        landed = ~self._down & (places[:, 2] < GROUNDED)
        self._recording.footprints.extend((float(x), float(y)) for x, y, _ in places[landed])
        self._down = (self._down | landed) & (places[:, 2] < RAISED)

    def _catch(self, truth: Truth, places: Vector, now: float) -> None:
        """Keep this instant if no earlier one of the stride had its raised feet higher."""
        lift = float(np.sort(places[:, 2])[2:].sum())
        if lift > self._lift + 1e-6:
            self._lift, recording = lift, self._recording
            recording.truth, recording.time = truth, now
            recording.path = self._path
            recording.things, arm = self._body.things(), self._body.arm
            recording.arm = None if arm is None else tuple(arm.state().position.tolist())


def _cut(recording: Recording) -> None:
    """Drop what was seen after the instant of the picture."""
    seen = sum(time <= recording.time for time in recording.times)
    del recording.times[seen:], recording.trail[seen:]
