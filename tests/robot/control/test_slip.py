"""Ice is felt by feet that slide though little was asked of them, and the robot sits down before it falls."""

from __future__ import annotations

from math import radians, tan

import numpy as np
import pytest

from robot.control.slip import (
    CERTAIN,
    CERTAIN_THEN,
    FIRM,
    GAP,
    LITTLE,
    MEMORY,
    SLIDING,
    UNHURRIED,
    SlipWatch,
    friction_of,
)
from robot.geometry.planar import Pose2
from robot.hardware.sensors import Sensors
from robot.model.actuators import ActuatorDesign
from robot.model.modes import Mode
from robot.scenes.scene import Scene
from robot.sim.ground import Ice
from robot.testing import Conditions, Trial
from tests.figures.walk_measures import low_boxes

DT = 0.005
FAST, HERE = 1.0, Pose2(0.0, 0.0)


def felt(
    seconds: float, *, asked: float = 0.2, stands: bool = True, contact: bool = True, speed: float = 1.0
) -> SlipWatch:
    """After a foot has been like that for so long."""
    watch = SlipWatch()
    for _ in range(round(seconds / DT)):
        watch.asked(0, asked)
        watch.forget(DT)
        watch.feel(DT, 0, stands=stands, contact=contact, speed=speed)
    return watch


def test_a_foot_that_slides_for_a_while_though_little_is_asked_of_it_stands_on_ice() -> None:
    assert not felt(FIRM + 0.8 * CERTAIN).slippery(FAST)
    assert felt(FIRM + 1.5 * CERTAIN).slippery(FAST)


def test_a_slow_walk_is_given_up_only_for_much_sliding() -> None:
    assert not felt(FIRM + 0.8 * CERTAIN_THEN).slippery(UNHURRIED)
    assert felt(FIRM + 1.5 * CERTAIN_THEN).slippery(UNHURRIED)


@pytest.mark.parametrize(
    "how",
    [{"asked": LITTLE + 0.01}, {"stands": False}, {"contact": False}, {"speed": 0.9 * SLIDING}],
    ids=["much is asked", "it swings", "it is in the air", "it is still"],
)
def test_and_not_when(how: dict[str, float]) -> None:
    assert not felt(1.0, **how).slippery(FAST)  # type: ignore[arg-type]


def test_contacts_that_are_missed_now_and_then_do_not_hide_it() -> None:
    watch = SlipWatch()
    for number in range(20):
        watch.asked(0, 0.1)
        watch.feel(DT, 0, stands=True, contact=number % round(GAP / DT) == 0, speed=1.0)
    assert watch.slippery(FAST)


def test_it_is_forgotten_within_a_second() -> None:
    watch = felt(FIRM + 2.0 * CERTAIN)
    assert watch.slippery(FAST)
    for _ in range(round(3.0 * MEMORY / DT)):
        watch.forget(DT)
    assert not watch.slippery(FAST)


def test_friction_counts_along_the_ground() -> None:
    assert friction_of((3.0, 4.0, 10.0), (0.0, 0.0)) == pytest.approx(0.5)
    rise = tan(radians(20.0))
    assert friction_of((0.0, 0.0, 80.0), (rise, 0.0)) == pytest.approx(rise)
    assert friction_of((-rise * 80.0, 0.0, 80.0), (rise, 0.0)) == pytest.approx(0.0, abs=1e-9)


def walked(seed: int, speed: float, conditions: Conditions, seconds: float) -> Trial:
    trial = Trial(seed, conditions=conditions)
    trial.stand_up()
    trial.run(seconds, (speed, 0.0, 0.0))
    return trial


def real(friction: float = 0.8, ice: Ice | None = None) -> Conditions:
    return Conditions(friction=friction, ice=ice, actuators=ActuatorDesign(), sensors=Sensors.of("real"))


@pytest.mark.slow(reason="seconds of walking on real drives")
@pytest.mark.parametrize("speed", [1.0, 1.6])
def test_on_sudden_ice_a_robot_sits_down_and_does_not_fall(speed: float) -> None:
    pytest.importorskip("mujoco")
    trial = walked(1, speed, real(ice=Ice(0.1, 2.0, 100.0)), 6.5)
    assert (trial.fallen, trial.gait.slips, trial.gait.mode) == (False, 1, Mode.SIT)


@pytest.mark.slow(reason="seconds of walking on real drives")
@pytest.mark.parametrize(("friction", "speed"), [(0.2, 0.6), (0.8, 1.6)])
def test_where_it_can_walk_it_walks_on(friction: float, speed: float) -> None:
    pytest.importorskip("mujoco")
    trial = walked(1, speed, real(friction), 5.0)
    assert (trial.fallen, trial.gait.slips, trial.gait.mode) == (False, 0, Mode.WALK)


@pytest.mark.parametrize("seed", [3, pytest.param(7, marks=pytest.mark.slow(reason="another seed"))])
def test_on_rubble_feet_slip_off_edges_and_the_robot_walks_on(seed: int) -> None:
    pytest.importorskip("mujoco")
    rubble = Scene("rubble", (-8.0, -8.0, 8.0, 8.0), low_boxes(np.random.default_rng([seed, 61])), HERE, HERE)
    trial = Trial(seed, rubble, real())
    trial.stand_up()
    for turn in (0.2, -0.3, 0.4, -0.1):
        trial.run(3.0, (0.5, 0.0, turn))
        assert (trial.fallen, trial.gait.slips, "gyro" in trial.gait.lost) == (False, 0, False)
