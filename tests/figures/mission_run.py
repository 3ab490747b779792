"""One long mission of the whole robot: a patrol that goes to its dock when the battery is low, and what each leg of it was to take and took."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, field
from math import inf, isfinite
from typing import Any, Final

import numpy as np

from actors import Child, Node, execute, run
from actors.interfaces.geometry_msgs.msg import PoseStamped
from actors.interfaces.nav_msgs.msg import Path
from actors.interfaces.sensor_msgs.msg import BatteryState
from robot.assembly import BodyKind, make_body
from robot.contracts import BATTERY_STATE, GOAL_REPORT, MOTOR_POWER, PATH, POSE
from robot.geometry.messages import from_pose
from robot.geometry.planar import Pose2
from robot.interfaces.robactor_msgs.msg import GoalReport, MotorPower
from robot.model.actuators import MOTOR_DELAY
from robot.model.power import electrical_power
from robot.run.judge import Judge, Score
from robot.run.mission import DOCK_GOAL
from robot.scenes.worlds import get_world
from robot.sim.battery import Pack
from robot.tree import robot_tree
from tests.figures.fidelity import Fidelity
from tests.figures.leg_energy import RouteEnergy, turning

LOW, ENOUGH = 30.0, 50.0
"""Per cent of charge at which the robot goes to the dock, and leaves it again."""
SPEED: Final = 0.7
"""Of a typical walk, m/s: what the first predictions reckon with."""
HOUR: Final = 3600.0
"""s."""


@dataclass(frozen=True, slots=True)
class Leg:
    """One walk to a goal, or to the dock."""

    name: str
    at: float
    """When it ended, s."""
    outcome: str
    length: float
    """Of the path that was planned at first, m."""
    turn: float
    """Along it, rad."""
    predicted: float
    """Wh, when the path was planned."""
    used: float
    """Wh."""
    percent: float
    """Charge at the end."""

    @property
    def error(self) -> float:
        """Of the prediction, per cent of what was used, with its sign; infinite for a leg that ended before anything was."""
        return 100.0 * (self.predicted - self.used) / self.used if self.used > 0.0 else inf

    @property
    def to_dock(self) -> bool:
        """Whether it is a walk to the dock."""
        return self.name == DOCK_GOAL


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a mission went."""

    seed: int
    world: str
    backend: str
    seconds: float
    legs: list[dict[str, Any]]
    """Each a `Leg` as a dict."""
    charges: int
    """Times that charging began."""
    falls: int
    walked: float
    """m."""
    cost: float
    """Wall time for one second of the mission."""


@dataclass(slots=True)
class _Book:
    """What the ledger has written down."""

    legs: list[Leg] = field(default_factory=lambda: [])
    charges: int = 0


def mission(seed: int, seconds: float, backend: BodyKind, fidelity: Fidelity, world: str) -> Outcome:
    """Patrol a world for so many seconds, from a charge of `ENOUGH` per cent on."""
    scene, began = get_world(world), time.monotonic()
    drives = fidelity.drives if backend == "physics" else None
    body = make_body(scene, backend, seed=seed, motor_delay=MOTOR_DELAY, sensors=fidelity.errors, actuators=drives)
    waypoints = [(f"patrol_{number}", pose) for number, pose in enumerate(scene.patrol, start=1)]
    tree = robot_tree(body, Pack(ENOUGH), waypoints, motor_delay=MOTOR_DELAY)
    score, book = Score(), _Book()
    numbers = {"/patrol": {"low_percent": LOW, "resume_percent": ENOUGH}}

    async def main() -> None:
        async with run(tree, seed=seed, sinks=(), parameters=numbers) as system:
            await system.join(Child(Judge, args=(body, score)))
            await system.join(Child(_Ledger, args=(book,)))
            while system.clock.now() < seconds and score.falls == 0:
                await system.clock.sleep(1.0)

    execute(main, clock="virtual")
    legs = [asdict(leg) for leg in book.legs]
    cost = (time.monotonic() - began) / seconds
    return Outcome(
        seed, world, backend, seconds, legs, book.charges, score.falls, round(score.walked, 1), round(cost, 4)
    )


class _Ledger(Node):
    """Predicts what each leg will take when its path is planned, and learns from what it took."""

    def __init__(self, book: _Book) -> None:
        self._book = book
        self._laws = {False: RouteEnergy(SPEED), True: RouteEnergy(SPEED)}
        """Of walks to goals, and of those to the dock, which end in another way."""
        self._here: Pose2 | None = None
        self._planned: tuple[Pose2, np.ndarray] | None = None
        """Where the leg began, and its path."""
        self._used = 0.0
        self._heard: float | None = None
        self._percent, self._charging = 0.0, False

    @POSE.on(qos=1)
    def pose(self, message: PoseStamped) -> None:
        self._here = from_pose(message.pose)

    @PATH.on()
    def path(self, message: Path) -> None:
        """Only the first one of a leg is a prediction."""
        points = np.array([(one.pose.position.x, one.pose.position.y) for one in message.poses])
        if self._planned is None and self._here is not None and len(points) > 1:
            self._planned, self._used = (self._here, points), 0.0

    @MOTOR_POWER.on()
    def power(self, message: MotorPower) -> None:
        now = self.clock.now()
        if self._heard is not None:
            self._used += electrical_power(message.mean) * (now - self._heard) / HOUR
        self._heard = now

    @BATTERY_STATE.on()
    def battery(self, message: BatteryState) -> None:
        charging = message.power_supply_status == BatteryState.POWER_SUPPLY_STATUS_CHARGING
        self._book.charges += charging and not self._charging
        self._charging = charging
        if isfinite(message.percentage):
            self._percent = 100.0 * message.percentage

    @GOAL_REPORT.on()
    def report(self, message: GoalReport) -> None:
        planned, self._planned = self._planned, None
        if planned is None:
            return
        start, points = planned
        length = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
        turn, law = turning(start, points, message.theta), self._laws[message.name == DOCK_GOAL]
        goal = Pose2(message.x, message.y, message.theta)
        predicted = law.predict(start, goal, length, turn)
        if message.outcome == "succeeded":
            law.learn(start, goal, length, turn, self._used)
        self._book.legs.append(
            Leg(
                message.name, round(self.clock.now(), 1), message.outcome, round(length, 2), round(turn, 2),
                round(predicted, 3), round(self._used, 3), round(self._percent, 1),
            )
        )  # fmt: skip
