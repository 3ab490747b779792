"""The measurements behind `tests.figures walk`, each for one seed on the physics back end. Seconds of simulation, not of your time.

`given` is what every robot has to cope with: motor delay, sensors, drives. Speeds, pushes and heights that are given as numbers are those of the
reference body; for another `model` they are those that are alike for its size and mass (docs/concepts/control.md#other-bodies). What is largest
or highest is found by bisection: nothing smaller was seen to fail, though something larger may succeed, too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import atan2, cos, hypot, pi, radians, sin, sqrt, tan
from time import process_time
from typing import TypeAlias

import numpy as np

from robot.control.command import CommandLimits
from robot.geometry.angles import wrap
from robot.geometry.planar import Pose2
from robot.model.kinematics import leg_forward, leg_inverse, leg_jacobian
from robot.model.modes import Mode
from robot.model.parameters import GRAVITY, JOINT_LIMITS
from robot.model.power import electrical_power
from robot.model.robot import SPOT, RobotModel
from robot.scenes.scene import Box, Scene
from robot.testing import PERIOD, Conditions, Trial

Command: TypeAlias = tuple[float, float, float]
"""Forward and to the left, m/s, and turning, rad/s."""
Place: TypeAlias = tuple[float, float, float]
"""x and y, m, and yaw, rad."""

WINDOW = 0.5
"""Speeds are averaged over one gait period before they are compared, s."""
LAIN = 0.3
"""A trial's robot lies for so long before it is asked to stand, s."""
HELD = 2.0
"""A speed is held that is not missed by more than a tenth over any such time, s: four strides."""
YARD = 4.0
"""Half the side of a rough yard, m."""
HOMEWARD = 0.7
"""From so far out, as a share of `YARD`, a course leads back."""
FAST = CommandLimits(forward=6.0, backward=1.5, sideways=1.2, turn=3.2)


def _walking(seed: int, given: Conditions, command: Command, model: RobotModel = SPOT) -> Trial:
    """A robot that walks at `command` and has settled."""
    trial = Trial(seed, conditions=given, limits=FAST.of(model), model=model)
    trial.stand_up()
    trial.run(2.0 + hypot(command[0], command[1]) / 1.5, command)
    return trial


def rise(seed: int, given: Conditions, model: RobotModel = SPOT) -> float:
    """Seconds from the request until a robot that lay stands at its height, within 2 %; infinite if it does not."""
    trial = Trial(seed, conditions=given, model=model)
    trial.stand_up()
    seconds = trial.body.time - LAIN
    height = trial.run(1.0).height
    wanted = model.stand_height + model.foot_radius
    if trial.fallen or trial.gait.mode is not Mode.STAND or abs(float(height[-1]) / wanted - 1.0) > 0.02:
        return float("inf")
    return seconds


def speed_error(seed: int, given: Conditions, command: Command, model: RobotModel = SPOT) -> float:
    """Root mean square error of the gait-averaged true speed along the commanded axis, over 7 s; infinite after a fall."""
    trial = _walking(seed, given, command, model)
    record = trial.run(7.0, command)
    if trial.fallen:
        return float("inf")
    axis = int(np.argmax(np.abs(command)))
    error = record.averaged(WINDOW * model.speed)[:, axis] - command[axis]
    return float(np.sqrt((error * error).mean()))


def largest_push(
    seed: int, given: Conditions, direction: tuple[float, float], most: int = 200, model: RobotModel = SPOT
) -> float:
    """The largest impulse (N s, in steps of 1 N s up to `most`, within 0.1 s, at the body) survived at each of four gait phases of a trot in place."""
    unit = model.force * model.speed

    def survives(impulse: int) -> bool:
        for quarter in range(4):
            trial = Trial(seed, conditions=given, model=model)
            trial.stand_up()
            trial.run(1.0 + quarter * WINDOW * model.speed / 4, (0.0, 0.0, 0.0))
            trial.body.push((direction[0] * impulse * unit, direction[1] * impulse * unit, 0.0))
            trial.run(2.5, (0.0, 0.0, 0.0))
            if trial.fallen:
                return False
        return True

    return _largest(most, survives) * unit


def falls(seed: int, given: Conditions, seconds: float, push: float = 0.0, model: RobotModel = SPOT) -> float:
    """Falls while random commands change every 4 s; with `push` (N s) in a random direction every 10 s. The robot is put up again."""
    random = np.random.default_rng([seed, 77])
    fallen, left = 0, seconds
    trial = Trial(seed, conditions=given, model=model)
    trial.stand_up()
    until_push, fast = 10.0, model.speed
    while left > 0.0:
        ahead, aside, turn = random.uniform(-0.5, 1.2), random.uniform(-0.3, 0.3), random.uniform(-1.0, 1.0)
        command = (ahead * fast, aside * fast, turn / fast)
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
            trial = Trial(seed + 1000 * fallen, conditions=given, model=model)
            trial.stand_up()
    return float(fallen)


def steepest(seed: int, given: Conditions, direction: str, most: int = 44, model: RobotModel = SPOT) -> float:
    """The steepest slope (whole degrees up to `most`) walked for 8 s at 0.4 m/s, `up`, `down` or `across`; friction 1.0, started aligned with it."""

    def walks(degrees: int) -> bool:
        rise = tan(radians(degrees))
        slope = {"up": (rise, 0.0), "down": (-rise, 0.0), "across": (0.0, rise)}[direction]
        trial, speed = Trial(seed, conditions=replace(given, slope=slope, friction=1.0), model=model), 0.4 * model.speed
        trial.stand_up()
        trial.run(1.5, (0.0, 0.0, 0.0))
        record = trial.run(8.0, (speed, 0.0, 0.0))
        return not trial.fallen and record.distance > 0.6 * speed * 8.0

    return float(_largest(most, walks))


def step_up(seed: int, given: Conditions, most: int = 40, model: RobotModel = SPOT) -> float:
    """The highest single step (m, in steps of 1 cm up to `most`) climbed blind at 0.4 m/s."""

    def climbs(centimetres: int) -> bool:
        step = Box(4.0, 0.0, 4.0, 4.0, height=centimetres / 100 * model.length)
        return _reaches(seed, given, (step,), 0.4 * model.speed, 3.5, model)

    return _largest(most, climbs) / 100 * model.length


def box_field(seed: int, given: Conditions, most: int = 30) -> float:
    """The height (m, in whole cm up to `most`) of random low boxes, 60 of up to so much, crossed for 6.6 m at 0.5 m/s."""

    def crosses(centimetres: int) -> bool:
        random = np.random.default_rng([seed, 60])
        boxes = tuple(_low_box(random, centimetres / 100, (1.0, 7.5), (-0.8, 0.8)) for _ in range(60))
        return _reaches(seed, given, boxes, 0.5, 6.6)

    return _largest(most, crosses) / 100


def _low_box(
    random: np.random.Generator, height: float, across: tuple[float, float], along: tuple[float, float]
) -> Box:
    """A box of 0.3 to 1 times `height` (m), somewhere in a rectangle."""
    return Box(
        x=random.uniform(*across), y=random.uniform(*along), length=random.uniform(0.1, 0.5), width=random.uniform(0.1, 0.5),
        yaw=random.uniform(-pi, pi), height=random.uniform(0.3, 1.0) * height,
    )  # fmt: skip


def low_boxes(random: np.random.Generator) -> tuple[Box, ...]:
    """A yard of boxes of up to 5 cm, four on a square metre. What the robot stands up on is level."""
    boxes = tuple(_low_box(random, 0.05, (-YARD, YARD), (-YARD, YARD)) for _ in range(round(4.0 * (2.0 * YARD) ** 2)))
    return tuple(box for box in boxes if hypot(box.x, box.y) > 1.0)


def _rough(boxes: tuple[Box, ...]) -> Scene:
    return Scene("rough", (-20.0, -20.0, 20.0, 20.0), boxes, Pose2(0.0, 0.0), Pose2(0.0, 0.0))


def _reaches(
    seed: int, given: Conditions, boxes: tuple[Box, ...], speed: float, distance: float, model: RobotModel = SPOT
) -> bool:
    """Whether a robot that is steered back to y = 0 walks `distance` m over `boxes` within twice the nominal time."""
    trial = Trial(seed, _rough(boxes), given, model=model)
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


def top_speed(seed: int, given: Conditions, most: int = 60, model: RobotModel = SPOT) -> float:
    """The largest speed (m/s, in tenths, of up to `most` of them) that is held for 20 s: within a tenth, over any four strides."""

    def holds(tenths: int) -> bool:
        speed = tenths / 10 * model.speed
        trial = _walking(seed, given, (speed, 0.0, 0.0), model)
        record = trial.run(20.0, (speed, 0.0, 0.0))
        return (
            not trial.fallen and float(np.abs(record.averaged(HELD * model.speed)[:, 0] - speed).max()) <= 0.1 * speed
        )

    return _largest(most, holds) / 10 * model.speed


def cost_of_transport(seed: int, given: Conditions, speed: float, model: RobotModel = SPOT) -> float:
    """Electrical power, hotel load included, per weight and true speed, over 7 s."""
    trial = _walking(seed, given, (speed, 0.0, 0.0), model)
    record = trial.run(7.0, (speed, 0.0, 0.0))
    if trial.fallen:
        return float("inf")
    power = electrical_power(float(record.power.mean()), model=model)
    return float(power / (model.mass * GRAVITY * record.velocity[:, 0].mean()))


def odometry_error(seed: int, given: Conditions, distance: float = 100.0) -> float:
    """Error of the odometry's end point, per cent of the distance walked on a winding course of at least `distance` m."""
    random = np.random.default_rng([seed, 5])

    def course(pose: Place) -> Command:
        return random.uniform(0.4, 1.0), random.uniform(-0.1, 0.1), random.uniform(-0.4, 0.4)

    return _astray(Trial(seed, conditions=given), distance, 4.0, course)


def rough_odometry_error(seed: int, given: Conditions, distance: float = 100.0) -> float:
    """The same in a yard of low boxes."""
    random = np.random.default_rng([seed, 61])
    trial = Trial(seed, _rough(low_boxes(random)), given)
    return _astray(trial, distance, 1.0, lambda pose: in_yard(random, pose))


def in_yard(random: np.random.Generator, pose: Place) -> Command:
    """The next command of a course at 0.4 to 0.6 m/s that stays in the yard, for a robot at `pose`."""
    x, y, yaw = pose
    turn = random.uniform(-0.4, 0.4)
    if hypot(x, y) > HOMEWARD * YARD:
        turn = max(-0.8, min(0.8, wrap(atan2(-y, -x) - yaw)))
    return random.uniform(0.4, 0.6), 0.0, turn


def _astray(trial: Trial, distance: float, stretch: float, course: Callable[[Place], Command]) -> float:
    """Error of the odometry's end point, per cent of at least `distance` m that are walked; every `stretch` s `course` gives a command."""
    trial.stand_up()
    start, believed, walked = trial.pose(), trial.believed(), 0.0
    while walked < distance and not trial.fallen:
        walked += trial.run(stretch, course(trial.pose())).distance
    if trial.fallen:
        return float("inf")
    return 100.0 * off((start, trial.pose()), (believed, trial.believed())) / walked


def off(true: tuple[Place, Place], believed: tuple[Place, Place]) -> float:
    """How far a walk's end is from where odometry has it, m, when odometry's beginning is laid onto the true one. Both are beginning and end."""
    (start, end), (first, last) = true, believed
    turn = start[2] - first[2]
    dx, dy = last[0] - first[0], last[1] - first[1]
    x, y = start[0] + cos(turn) * dx - sin(turn) * dy, start[1] + sin(turn) * dx + cos(turn) * dy
    return hypot(end[0] - x, end[1] - y)


def control_cost(seed: int, given: Conditions) -> float:
    """Processor time of one control step, estimator included, ms; the quietest of ten stretches of 0.5 s."""
    trial = _walking(seed, given, (0.6, 0.0, 0.3))
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
            one, two, three = (step if index == joint else 0.0 for index in range(3))
            high = leg_forward(side, q[0] + one, q[1] + two, q[2] + three)
            low = leg_forward(side, q[0] - one, q[1] - two, q[2] - three)
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
