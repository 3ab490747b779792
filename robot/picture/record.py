"""The run behind a picture: the whole robot on the virtual clock, watched until it is caught in mid-stride.

The watcher reads the true body, which pictures may and controllers may not.
"""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field
from math import cos, sin

import numpy as np

from actors import Child, Node, every, execute, run
from actors.interfaces.geometry_msgs.msg import Twist
from actors.interfaces.nav_msgs.msg import Path
from actors.interfaces.sensor_msgs.msg import LaserScan
from robot.battery.model import Pack
from robot.contracts import CMD_VEL, PATH, SCAN
from robot.gait.figures import FOOT_RADIUS
from robot.gait.kinematics import feet
from robot.tree import robot_tree
from robot.world.body import Body, Truth, Vector
from robot.world.dock import heading
from robot.world.scene import Pose2, Scene

__all__ = ["Recording", "record", "rotation"]

RATE = 50.0
STRIDE = 0.5
"""A little more than the period of the trot, s: within it every leg swings once."""
GROUNDED = FOOT_RADIUS + 0.004
"""A foot whose centre is lower than this has come down, m; lifted again above `RAISED`."""
RAISED = FOOT_RADIUS + 0.02


@dataclass(slots=True)
class Recording:
    """A run up to the instant of the picture. World frame, SI units; lists hold one entry per watched instant, 50 a second."""

    scene: Scene
    backend: str
    truth: Truth
    """The body at the instant of the picture."""
    time: float = 0.0
    """That instant, s."""
    times: list[float] = field(default_factory=lambda: [])
    trail: list[tuple[float, float]] = field(default_factory=lambda: [])
    heights: list[float] = field(default_factory=lambda: [])
    """Of the body's origin over the floor, m."""
    speeds: list[float] = field(default_factory=lambda: [])
    """Forward, in the body's heading, m/s."""
    commands: list[float] = field(default_factory=lambda: [])
    """The forward speed asked for on /cmd_vel, m/s; it is forgotten after 0.5 s."""
    footprints: list[tuple[float, float]] = field(default_factory=lambda: [])
    """Where a foot came down, in the order of time."""
    path: tuple[tuple[float, float], ...] = ()
    """The newest /plan, frame `map`; empty without one."""
    returns: tuple[tuple[float, float], ...] = ()
    """Ends of the beams of the newest scan that met something, as seen from the true pose at that time."""

    @property
    def pose(self) -> Pose2:
        """The body on the floor at the instant of the picture."""
        return Pose2(float(self.truth.position[0]), float(self.truth.position[1]), heading(self.truth))


def record(body: Body, *, seed: int, at: float) -> Recording:
    """Run the robot around `body` on its patrol and catch it within the half second after `at` (s), when its raised feet are highest.

    Raises `StartFailed` or `SupervisorGaveUp` when the robot cannot be run.
    """
    return execute(lambda: _watch(body, seed, at), clock="virtual")


async def _watch(body: Body, seed: int, at: float) -> Recording:
    patrol = [(f"patrol_{number}", pose) for number, pose in enumerate(body.scene.patrol, start=1)]
    recording = Recording(body.scene, body.backend, body.truth())
    async with run(robot_tree(body, Pack(90.0), patrol), seed=seed, sinks=()) as system:
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

    def __init__(self, body: Body, recording: Recording, at: float) -> None:
        self._body, self._recording, self._at = body, recording, at
        self._path: tuple[tuple[float, float], ...] = ()
        self._returns: tuple[tuple[float, float], ...] = ()
        self._command, self._commanded = 0.0, float("-inf")
        self._down = np.ones(4, dtype=np.bool_)
        self._lift = -1.0

    @PATH.on()
    def path(self, message: Path) -> None:
        self._path = tuple((pose.pose.position.x, pose.pose.position.y) for pose in message.poses)

    @CMD_VEL.on(qos=1)
    def command(self, message: Twist) -> None:
        self._command, self._commanded = message.linear.x, self.clock.now()

    @SCAN.on()
    def scan(self, message: LaserScan) -> None:
        self._body.advance(self.clock.now())
        truth = self._body.truth()
        ranges = message.ranges.astype(np.float64)
        angles = heading(truth) + message.angle_min + message.angle_increment * np.arange(len(ranges))
        met = ranges < message.range_max
        x = truth.position[0] + ranges[met] * np.cos(angles[met])
        y = truth.position[1] + ranges[met] * np.sin(angles[met])
        self._returns = tuple(zip(x.tolist(), y.tolist(), strict=True))

    @every(hz=RATE)
    def look(self) -> None:
        now, recording = self.clock.now(), self._recording
        self._body.advance(now)
        truth = self._body.truth()
        yaw = heading(truth)
        vx, vy, _ = truth.velocity.tolist()
        x, y, z = truth.position.tolist()
        recording.times.append(now)
        recording.trail.append((x, y))
        recording.heights.append(z)
        recording.speeds.append(vx * cos(yaw) + vy * sin(yaw))
        recording.commands.append(self._command if now - self._commanded <= 0.5 else 0.0)
        places = truth.position + feet(truth.joints) @ rotation(truth.quaternion).T
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
            recording.path, recording.returns = self._path, self._returns


def _cut(recording: Recording) -> None:
    """Drop what was seen after the instant of the picture."""
    seen = sum(time <= recording.time for time in recording.times)
    for series in (recording.times, recording.trail, recording.heights, recording.speeds, recording.commands):
        del series[seen:]


def rotation(quaternion: Vector) -> Vector:
    """The matrix that turns body axes into the world's, shape (3, 3), for a unit quaternion (w, x, y, z)."""
    w, x, y, z = quaternion.tolist()
    return np.array(
        (
            (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
            (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
            (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
        )
    )
