"""The judge of a run: reads the true state, which no controller may, and records how well the goals were met."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, hypot, sin
from typing import TypeAlias

import numpy as np

from actors import Node, every
from actors.interfaces.sensor_msgs.msg import BatteryState
from robot.contracts import BATTERY_STATE, DRIVE_STATUS, GAIT_STATUS, GOAL_REPORT, SAFETY_STATE
from robot.geometry.planar import Pose2, placed
from robot.interfaces.robactor_msgs.msg import DriveStatus, GaitStatus, GoalReport, SafetyState
from robot.model.footprint import Footprint
from robot.model.modes import ON_ITS_FEET
from robot.planning.errors import ErrorCode
from robot.planning.grid import signed_distance
from robot.scenes.scene import Cylinder, Obstacle
from robot.sim.simulation import Simulation

RATE = 50.0
BELIEVED = 0.2
"""A gait that has not said for so long that it stands or walks may have sat down, s."""


@dataclass(frozen=True, slots=True)
class ScoredGoal:
    """One goal of the mission and how well the true body met it."""

    name: str
    x: float
    y: float
    outcome: str
    reason: str
    at: float
    """When it ended, seconds on the run's clock."""
    seconds: float
    true_error: float
    """Distance of the true body from the goal when it ended, m."""
    behind_obstacle: bool
    error_code: int = ErrorCode.NONE

    @property
    def succeeded(self) -> bool:
        return self.outcome == "succeeded"

    @property
    def for_want_of_charge(self) -> bool:
        """Whether navigation refused it because the charge would not last."""
        return self.error_code == ErrorCode.LOW_BATTERY


@dataclass(frozen=True, slots=True)
class SafetyStop:
    """When the safety monitor stopped the robot, and why."""

    at: float
    reasons: tuple[str, ...]


@dataclass(slots=True)
class Score:
    """What the judge has recorded so far."""

    walked: float = 0.0
    falls: int = 0
    fallen_at: float | None = None
    """When the robot fell for the first time, s."""
    contacts: dict[str, float] = field(default_factory=lambda: {})
    """Obstacle -> when it was first touched, s."""
    clearance: float = float("inf")
    """Smallest distance of the body's outline to an obstacle, m."""
    goals: list[ScoredGoal] = field(default_factory=lambda: [])
    charge: float | None = None
    """Coulomb count, 0..1."""
    charging: bool = False
    drove: dict[str, float] = field(default_factory=lambda: {})
    """Source of the commands -> for how many seconds it drove."""
    stops: list[SafetyStop] = field(default_factory=lambda: [])


class Judge(Node):
    """Looks at the true body 50 times a second. Not a part of the robot."""

    def __init__(self, body: Simulation, score: Score) -> None:
        self._body = body
        self._score = score
        self._last: tuple[float, float] | None = None
        self._down = False
        self._on_its_feet = float("-inf")
        self._driver = ""
        self._stopped: tuple[str, ...] = ()
        self._outline = Footprint.of(body.model).outline
        self._reach = float(np.hypot(*self._outline.T).max())
        self._obstacles = [(one, _frame(one)) for one in body.scene.obstacles]

    @every(hz=RATE)
    def look(self) -> None:
        self._body.advance(self.clock.now())
        truth, score = self._body.truth(), self._score
        x, y = float(truth.position[0]), float(truth.position[1])
        if self._last is not None:
            step = hypot(x - self._last[0], y - self._last[1])
            if step > 0.002:  # below this it is the sway of standing, not walking
                score.walked += step
                self._last = (x, y)
        else:
            self._last = (x, y)
        upright = self.clock.now() - self._on_its_feet < BELIEVED
        down = truth.fallen or (truth.lying and upright)
        if down and not self._down:
            score.falls += 1
            if score.fallen_at is None:
                score.fallen_at = round(self.clock.now(), 3)
        self._down = down
        if self._driver:
            score.drove[self._driver] = score.drove.get(self._driver, 0.0) + 1.0 / RATE
        for name in truth.touching:
            score.contacts.setdefault(name, round(self.clock.now(), 3))
        score.clearance = min(score.clearance, self._clearance(x, y, truth.yaw))

    def _clearance(self, x: float, y: float, yaw: float) -> float:
        """The outline's distance to the nearest obstacle if it is the smallest so far; otherwise that, or more."""
        least = self._score.clearance
        near = [one for one, frame in self._obstacles if _beside(frame, x, y) - self._reach < least]
        if near:
            px, py = placed(Pose2(x, y, yaw), self._outline[:, 0], self._outline[:, 1])
            least = min(float(signed_distance(one, px, py).min()) for one in near)
        return least

    @GAIT_STATUS.on()
    def gait(self, message: GaitStatus) -> None:
        if message.mode in ON_ITS_FEET:
            self._on_its_feet = self.clock.now()

    @DRIVE_STATUS.on()
    def drive(self, message: DriveStatus) -> None:
        self._driver = message.source

    @SAFETY_STATE.on()
    def safety(self, message: SafetyState) -> None:
        if message.stopped and message.reasons != self._stopped:
            self._score.stops.append(SafetyStop(round(self.clock.now(), 3), message.reasons))
        self._stopped = message.reasons

    @GOAL_REPORT.on()
    def goal(self, message: GoalReport) -> None:
        self._body.advance(self.clock.now())
        position = self._body.truth().position
        error = hypot(float(position[0]) - message.x, float(position[1]) - message.y)
        self._score.goals.append(
            ScoredGoal(
                message.name, message.x, message.y, message.outcome, message.reason, round(self.clock.now(), 3), round(message.seconds, 3),
                round(error, 4), message.behind_obstacle, message.error_code,
            )
        )  # fmt: skip

    @BATTERY_STATE.on()
    def battery(self, message: BatteryState) -> None:
        self._score.charge = message.percentage
        self._score.charging = message.power_supply_status == BatteryState.POWER_SUPPLY_STATUS_CHARGING


_Frame: TypeAlias = tuple[float, float, float, float, float, float]


def _frame(obstacle: Obstacle) -> _Frame:
    """Its middle, cosine and sine of its yaw, and half of its length and width, m."""
    if isinstance(obstacle, Cylinder):
        return obstacle.x, obstacle.y, 1.0, 0.0, obstacle.radius, obstacle.radius
    return obstacle.x, obstacle.y, cos(obstacle.yaw), sin(obstacle.yaw), obstacle.length / 2, obstacle.width / 2


def _beside(frame: _Frame, x: float, y: float) -> float:
    """At most the distance of a place from what has this frame, m; it costs no arrays."""
    middle_x, middle_y, c, s, half_length, half_width = frame
    dx, dy = x - middle_x, y - middle_y
    return max(abs(c * dx + s * dy) - half_length, abs(c * dy - s * dx) - half_width)
