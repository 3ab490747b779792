"""The gaits on the physics body: how fast, how level, how they are changed, and what slippery or uneven ground does to them."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

from robot.control.gaits import GAITS
from robot.estimation.leg_odometry import Estimator
from robot.hardware.body import ImuSample, JointSample, MotorTargets
from robot.model.kinematics import inverse
from robot.model.parameters import GRAVITY, STAND_HEIGHT
from robot.model.stance import nominal_feet
from robot.scenes.scene import Box
from robot.testing import PERIOD, Conditions, Trial
from tests.robot.stage import floor

SLOW = pytest.mark.slow(reason="more gaits, speeds and seeds")


def walking(gait: str = "trot", speed: float = 0.0, seconds: float = 2.5, friction: float = 0.8) -> Trial:
    trial = Trial(1, conditions=Conditions(friction=friction), gait=gait)
    trial.stand_up()
    trial.run(seconds, (speed, 0.0, 0.0))
    return trial


def in_the_air(targets: MotorTargets) -> list[bool]:
    """Legs that are led by position: those whose feet swing. A leg that stands is told forces only."""
    return [bool(gain > 0.0) for gain in targets.kp[::3]]


class Listener:
    """Reads along what the motors are told."""

    def __init__(self, trial: Trial) -> None:
        self.targets: MotorTargets | None = None
        self._command = trial.body.command
        trial.body.command = self  # type: ignore[method-assign]

    def __call__(self, targets: MotorTargets) -> None:
        self.targets = targets
        self._command(targets)


# -- each gait ------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("gait", "speed", "sd"),
    [
        ("crawl", 0.3, 2.0),
        ("bound", 0.8, 2.0),
        pytest.param("crawl", 0.1, 2.0, marks=SLOW),
        pytest.param("pace", 0.3, 1.0, marks=SLOW),
        pytest.param("pace", 0.8, 1.0, marks=SLOW),
        pytest.param("bound", 0.3, 2.0, marks=SLOW),
        pytest.param("pronk", 0.8, 2.0, marks=SLOW),
    ],
)
def test_every_gait_reaches_its_speed_and_stays_level(gait: str, speed: float, sd: float) -> None:
    trial = walking(gait, speed, 3.0)
    record = trial.run(4.0, (speed, 0.0, 0.0))
    assert not trial.fallen
    assert record.velocity[:, 0].mean() == pytest.approx(speed, rel=0.1)
    assert np.degrees(record.lean.std(axis=0)).max() < sd


def test_a_crawl_has_three_feet_on_the_ground() -> None:
    trial = walking("crawl", 0.2)
    down: list[int] = []
    for _ in range(400):
        trial.step()
        down.append(int(trial.body.joints().contact.sum()))
    assert np.mean(np.array(down) >= 3) > 0.98
    assert set(down) >= {3, 4}


def test_a_gait_is_not_asked_for_more_than_it_is_good_for() -> None:
    trial = walking("crawl", 1.2, 3.5)
    most = GAITS["crawl"].most
    assert most is not None
    assert trial.gait.velocity_command[0] == pytest.approx(most.forward)


# -- changing the gait ----------------------------------------------------------------------------------------------------------


def test_a_gait_changes_in_a_moment_when_all_feet_stand() -> None:
    trial = walking("trot", 0.6, 2.1)
    listener = Listener(trial)
    for gait in ("pace", "crawl", "trot"):
        trial.gait.select_gait(gait)
        for _ in range(400):
            before = listener.targets
            trial.step()
            if trial.gait.gait == gait:
                break
        assert trial.gait.gait == gait
        assert before is not None
        assert not any(in_the_air(before))
    assert not trial.fallen


def test_a_gait_chosen_at_rest_is_the_next_walks() -> None:
    trial = Trial(1)
    trial.stand_up()
    trial.gait.select_gait("pace")
    assert trial.gait.gait == "pace"
    trial.run(1.0, (0.3, 0.0, 0.0))
    assert (trial.gait.mode, trial.gait.gait) == ("walk", "pace")


@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=SLOW) for seed in range(2, 8))])
def test_any_order_of_gaits_at_any_moment_is_survived(seed: int) -> None:
    random = np.random.default_rng([seed, 9])
    names = list(GAITS)
    trial = Trial(seed, gait=names[random.integers(5)])
    trial.stand_up()
    left = 10.0 if seed == 1 else 60.0
    story: list[str] = []
    while left > 0.0 and not trial.fallen:
        command = (random.uniform(-0.5, 1.4), random.uniform(-0.4, 0.4), random.uniform(-1.2, 1.2))
        gait, seconds = names[random.integers(5)], random.uniform(0.05, 3.0)
        story.append(f"{gait} {seconds:.2f} s")
        trial.gait.select_gait(gait)
        if random.random() < 0.2:
            trial.gait.request("stand")
            trial.run(seconds)
        else:
            trial.run(seconds, command)
        left -= seconds
    assert not trial.fallen, story


@SLOW
@pytest.mark.parametrize(("before", "after"), list(permutations(GAITS, 2)))
def test_every_gait_changes_into_every_other(before: str, after: str) -> None:
    trial = walking(before, 0.5, 2.2)
    trial.gait.select_gait(after)
    trial.run(3.0, (0.5, 0.0, 0.2))
    assert not trial.fallen
    assert trial.gait.gait == after


def test_a_crawl_that_is_pushed_trots_until_it_has_its_balance_again() -> None:
    trial = walking("crawl", 0.2)
    trial.body.push((0.0, 35.0, 0.0))
    used: list[str] = []
    for _ in range(round(4.0 / PERIOD)):
        trial.step()
        if not used or used[-1] != trial.gait.gait:
            used.append(trial.gait.gait)
    assert not trial.fallen
    assert used == ["crawl", "trot", "crawl"]


def test_a_crawl_that_was_pushed_before_it_ended_begins_the_next_time_as_a_crawl() -> None:
    trial = walking("crawl", 0.2)
    trial.body.push((0.0, 35.0, 0.0))
    while trial.gait.gait != "trot":
        trial.step()
    trial.gait.request("stand")
    trial.run(3.0)
    assert trial.gait.mode == "stand"
    trial.gait.request("walk")
    for _ in range(300):
        trial.step()
        assert trial.gait.gait == "crawl"
    assert not trial.fallen


# -- the ground -----------------------------------------------------------------------------------------------------------------


def test_a_foot_that_touches_late_in_its_swing_stands_at_once() -> None:
    trial = walking("trot", 0.4, 2.0)
    listener = Listener(trial)
    duration = (1.0 - GAITS["trot"].duty) * GAITS["trot"].period
    swung, touched = 0.0, False

    def touch(imu: ImuSample, joints: JointSample) -> tuple[ImuSample, JointSample]:
        """The front left foot meets something after 60 per cent of its swing."""
        nonlocal touched
        contact = joints.contact.copy()
        touched = touched or swung > 0.6 * duration
        contact[0] = contact[0] or touched
        return imu, JointSample(joints.position, joints.velocity, joints.effort, contact)

    trial.spoil(touch)
    for _ in range(200):
        trial.step()
        assert listener.targets is not None
        if touched:
            assert not in_the_air(listener.targets)[0]
            break
        swung = swung + PERIOD if in_the_air(listener.targets)[0] else 0.0
    assert touched


def test_a_foot_that_finds_no_ground_goes_on_downwards() -> None:
    """Down from a step: the ground comes later than expected."""
    step = Box(1.6, 0.0, 1.6, 4.0, height=0.1)
    scene = floor(step)
    trial = Trial(2, scene)
    trial.stand_up()
    for _ in range(40):
        trial.run(0.2, (0.5, 0.0, -0.8 * trial.pose()[2]))
    assert not trial.fallen
    assert trial.pose()[0] > 3.0


@pytest.mark.parametrize("friction", [0.2])
def test_slippery_ground_is_walked(friction: float) -> None:
    trial = walking("trot", 0.6, 2.0, friction=friction)
    record = trial.run(3.0, (0.6, 0.0, 0.0))
    assert not trial.fallen
    assert record.velocity[:, 0].mean() == pytest.approx(0.6, abs=0.06)


def test_a_standing_foot_that_slides_is_noticed() -> None:
    estimator = Estimator()
    position = inverse(nominal_feet(STAND_HEIGHT)).joints
    imu = ImuSample(np.zeros(3), np.array((0.0, 0.0, GRAVITY)))
    still, sliding = np.zeros(12), np.zeros(12)
    sliding[4] = 1.5
    for _ in range(40):
        estimator.update(PERIOD, imu, JointSample(position, still, still, np.ones(4, dtype=np.bool_)))
    assert not any(estimator.slipping)
    for _ in range(6):
        estimator.update(PERIOD, imu, JointSample(position, sliding, still, np.ones(4, dtype=np.bool_)))
    assert estimator.slipping == [False, True, False, False]
    assert np.hypot(*estimator.velocity[:2]) < 0.05
