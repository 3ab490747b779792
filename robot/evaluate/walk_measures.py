"""The measurements behind `evaluate walk`, each for one seed on the physics back end. Seconds of simulation, not of your time."""

from __future__ import annotations

from collections.abc import Callable
from math import atan2, cos, hypot, pi, radians, sin, sqrt, tan
from time import process_time

import numpy as np

from robot.control.command import CommandLimits
from robot.geometry.planar import Pose2
from robot.model.kinematics import leg_forward, leg_inverse, leg_jacobian
from robot.model.parameters import GRAVITY, JOINT_LIMITS, MASS
from robot.model.power import HOTEL_LOAD
from robot.scenes.scene import Box, Scene
from robot.testing import PERIOD, Conditions, Trial

__all__ = [
    "box_field",
    "control_cost",
    "cost_of_transport",
    "falls",
    "inverse_error",
    "jacobian_error",
    "largest_push",
    "odometry_error",
    "point_error",
    "speed_error",
    "steepest",
    "step_up",
    "top_speed",
]

Command = tuple[float, float, float]

WINDOW = 0.5
"""Speeds are averaged over one gait period before they are compared, s."""
FAST = CommandLimits(forward=3.5, backward=1.5, sideways=1.2, turn=3.2)


def _walking(seed: int, delay: float, command: Command) -> Trial:
    """A robot that walks at `command` and has settled."""
    trial = Trial(seed, conditions=Conditions(delay=delay), limits=FAST)
    trial.stand_up()
    trial.run(2.0 + hypot(command[0], command[1]) / 1.5, command)
    return trial


def speed_error(seed: int, delay: float, command: Command) -> float:
    """Root mean square error of the gait-averaged true speed along the commanded axis, over 7 s; infinite after a fall."""
    trial = _walking(seed, delay, command)
    record = trial.run(7.0, command)
    if trial.fallen:
        return float("inf")
    axis = int(np.argmax(np.abs(command)))
    error = record.averaged(WINDOW)[:, axis] - command[axis]
    return float(np.sqrt((error * error).mean()))


def largest_push(seed: int, delay: float, direction: tuple[float, float], most: int = 120, grid: int = 5) -> float:
    """The largest impulse (N s, within 0.1 s, at the body) survived at each of four gait phases of a trot in place.

    Found by bisection on the grid: some larger push may be survived too, none that is smaller was seen to fell the robot.
    """

    def survives(impulse: float) -> bool:
        for quarter in range(4):
            trial = Trial(seed, conditions=Conditions(delay=delay))
            trial.stand_up()
            trial.run(1.0 + quarter * WINDOW / 4, (0.0, 0.0, 0.0))
            trial.body.push((direction[0] * impulse, direction[1] * impulse, 0.0))
            trial.run(2.5, (0.0, 0.0, 0.0))
            if trial.fallen:
                return False
        return True

    return grid * _largest(most // grid, lambda level: survives(level * grid))


def falls(seed: int, delay: float, seconds: float, push: float = 0.0) -> float:
    """Falls while random commands change every 4 s; with `push` (N s) in a random direction every 10 s. The robot is put up again."""
    random = np.random.default_rng([seed, 77])
    fallen, left = 0, seconds
    trial = Trial(seed, conditions=Conditions(delay=delay))
    trial.stand_up()
    until_push = 10.0
    while left > 0.0:
        command = (random.uniform(-0.5, 1.2), random.uniform(-0.3, 0.3), random.uniform(-1.0, 1.0))
        for _ in range(4):
            trial.run(1.0, command)
            until_push -= 1.0
            angle = random.uniform(-pi, pi)
            if push > 0.0 and until_push <= 0.0:
                until_push = 10.0
                trial.body.push((push * cos(angle), push * sin(angle), 0.0))
        left -= 4.0
        if trial.fallen:
            fallen += 1
            trial = Trial(seed + 1000 * fallen, conditions=Conditions(delay=delay))
            trial.stand_up()
    return float(fallen)


def steepest(seed: int, delay: float, direction: str, steps: tuple[int, ...] = (10, 15, 20, 25, 30)) -> float:
    """The steepest slope (degrees) walked for 8 s at 0.4 m/s, `up`, `down` or `across`; friction 1.0, started aligned with it."""

    def walks(degrees: int) -> bool:
        rise = tan(radians(degrees))
        slope = {"up": (rise, 0.0), "down": (-rise, 0.0), "across": (0.0, rise)}[direction]
        trial = Trial(seed, conditions=Conditions(delay=delay, slope=slope, friction=1.0))
        trial.stand_up()
        trial.run(1.5, (0.0, 0.0, 0.0))
        record = trial.run(8.0, (0.4, 0.0, 0.0))
        return not trial.fallen and record.distance > 0.6 * 0.4 * 8.0

    return float(([0, *steps])[_largest(len(steps), lambda level: walks(steps[level - 1]))])


def step_up(seed: int, delay: float, heights: tuple[int, ...] = (4, 5, 8, 10, 12, 15, 20)) -> float:
    """The highest single step (m) climbed blind at 0.4 m/s."""

    def climbs(centimetres: int) -> bool:
        step = Box(4.0, 0.0, 4.0, 4.0, height=centimetres / 100)
        return _reaches(seed, delay, (step,), 0.4, 3.5)

    return ([0, *heights])[_largest(len(heights), lambda level: climbs(heights[level - 1]))] / 100


def box_field(seed: int, delay: float, heights: tuple[int, ...] = (4, 6, 8, 10, 12)) -> float:
    """The height (m) of random low boxes, 60 of up to so much, crossed for 6.6 m at 0.5 m/s."""

    def crosses(centimetres: int) -> bool:
        random = np.random.default_rng([seed, 60])
        boxes = tuple(
            Box(
                x=random.uniform(1.0, 7.5),
                y=random.uniform(-0.8, 0.8),
                length=random.uniform(0.1, 0.5),
                width=random.uniform(0.1, 0.5),
                yaw=random.uniform(-pi, pi),
                height=random.uniform(0.3, 1.0) * centimetres / 100,
            )
            for _ in range(60)
        )
        return _reaches(seed, delay, boxes, 0.5, 6.6)

    return ([0, *heights])[_largest(len(heights), lambda level: crosses(heights[level - 1]))] / 100


def _reaches(seed: int, delay: float, boxes: tuple[Box, ...], speed: float, distance: float) -> bool:
    """Whether a robot that is steered back to y = 0 walks `distance` m over `boxes` within twice the nominal time."""
    scene = Scene("rough", (-20.0, -20.0, 20.0, 20.0), boxes, Pose2(0.0, 0.0), Pose2(0.0, 0.0))
    trial = Trial(seed, scene, Conditions(delay=delay))
    trial.stand_up()
    for _ in range(int(2.0 * distance / speed / 0.2)):
        x, y, yaw = trial.pose()
        if x >= distance:
            return True
        turn = max(-0.5, min(0.5, 1.5 * (atan2(-y, 1.0) - yaw)))
        trial.run(0.2, (speed, 0.0, turn))
        if trial.fallen:
            return False
    return False


def top_speed(seed: int, delay: float, speeds: tuple[float, ...] = (0.8, 1.0, 1.3, 1.6, 2.0, 2.4, 2.8, 3.2)) -> float:
    """The largest of `speeds` (m/s) that is held for 20 s within 10 per cent."""
    best = 0.0
    for speed in speeds:
        trial = _walking(seed, delay, (speed, 0.0, 0.0))
        record = trial.run(20.0, (speed, 0.0, 0.0))
        if trial.fallen or abs(float(record.velocity[:, 0].mean()) - speed) > 0.1 * speed:
            break
        best = speed
    return best


def cost_of_transport(seed: int, delay: float, speed: float) -> float:
    """Electrical power, hotel load included, per weight and true speed, over 7 s."""
    trial = _walking(seed, delay, (speed, 0.0, 0.0))
    record = trial.run(7.0, (speed, 0.0, 0.0))
    if trial.fallen:
        return float("inf")
    return float((record.power.mean() + HOTEL_LOAD) / (MASS * GRAVITY * record.velocity[:, 0].mean()))


def odometry_error(seed: int, delay: float, distance: float = 100.0) -> float:
    """Error of the odometry's end point, per cent of the distance walked on a winding course of at least `distance` m."""
    random = np.random.default_rng([seed, 5])
    trial = Trial(seed, conditions=Conditions(delay=delay))
    trial.stand_up()
    start, believed, walked = trial.pose(), trial.believed(), 0.0
    while walked < distance and not trial.fallen:
        walked += trial.run(
            4.0, (random.uniform(0.4, 1.0), random.uniform(-0.1, 0.1), random.uniform(-0.4, 0.4))
        ).distance
    if trial.fallen:
        return float("inf")
    end, thought = trial.pose(), trial.believed()
    turn = start[2] - believed[2]
    dx, dy = thought[0] - believed[0], thought[1] - believed[1]
    x, y = start[0] + cos(turn) * dx - sin(turn) * dy, start[1] + sin(turn) * dx + cos(turn) * dy
    return 100.0 * hypot(end[0] - x, end[1] - y) / walked


def control_cost(seed: int, delay: float) -> float:
    """Processor time of one control step, estimator included, ms; the quietest of ten stretches of 0.5 s."""
    trial = _walking(seed, delay, (0.6, 0.0, 0.3))
    best = float("inf")
    for _ in range(10):
        spent = 0.0
        for _ in range(100):
            imu, joints = trial.body.imu(), trial.body.joints()
            began = process_time()
            targets = trial.gait.step(PERIOD, imu, joints)
            spent += process_time() - began
            trial.body.command(targets)
            trial.body.advance(trial.body.time + PERIOD)
        best = min(best, spent / 100)
    return 1000.0 * best


def point_error(seed: int) -> float:
    """Largest |FK(IK(p)) - p| over 2000 poses, m."""
    return max(
        sqrt(sum((a - b) ** 2 for a, b in zip(point, leg_forward(side, *leg_inverse(side, *point)[:3]), strict=True)))
        for side, q in _poses(seed)
        for point in [leg_forward(side, *q)]
    )


def inverse_error(seed: int) -> float:
    """Largest |IK(FK(q)) - q| over 2000 poses, rad."""
    return max(
        max(abs(a - b) for a, b in zip(leg_inverse(side, *leg_forward(side, *q))[:3], q, strict=True))
        for side, q in _poses(seed)
    )


def jacobian_error(seed: int) -> float:
    """Largest difference between the Jacobian and central differences over 2000 poses, m/rad."""
    step, worst = 1e-6, 0.0
    for side, q in _poses(seed):
        rows = leg_jacobian(side, *q)
        for joint in range(3):
            shift = [step if index == joint else 0.0 for index in range(3)]
            high = leg_forward(side, *(a + b for a, b in zip(q, shift, strict=True)))
            low = leg_forward(side, *(a - b for a, b in zip(q, shift, strict=True)))
            for axis in range(3):
                worst = max(worst, abs((high[axis] - low[axis]) / (2 * step) - rows[axis][joint]))
    return worst


def _poses(seed: int) -> list[tuple[float, Command]]:
    """2000 random poses inside the joint limits, feet at least 5 cm below the hip axis; left and right legs."""
    random = np.random.default_rng([seed, 2])
    poses: list[tuple[float, Command]] = []
    while len(poses) < 2000:
        a, b, c = (random.uniform(low, high) for low, high in JOINT_LIMITS[:3])
        _, _, height = leg_forward(1.0, 0.0, b, c)
        if height < -0.05:
            poses.append((1.0 if len(poses) % 2 else -1.0, (a, b, c)))
    return poses


def _largest(count: int, holds: Callable[[int], bool]) -> int:
    """The largest of 1..count for which `holds`, by bisection; 0 if none."""
    low, high = 0, count + 1
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low
