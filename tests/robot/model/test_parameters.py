"""The robot's figures: they agree with each other, with MuJoCo's model and with the data sheet."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import mujoco
import numpy as np
import pytest

from robot.geometry.planar import Pose2
from robot.hardware.body import JOINT_NAMES
from robot.model import parameters as figures
from robot.model.kinematics import inverse, within_limits
from robot.model.modes import GOALS, Mode
from robot.model.stance import NOMINAL, nominal_feet
from robot.scenes.scene import Scene
from robot.sim.ground import Ground
from robot.sim.mjcf import write_model

engine: Any = mujoco


def test_the_links_add_up_to_the_net_weight_of_the_data_sheet() -> None:
    legs = 4 * (1.68 + 2.34 + 0.35)
    assert pytest.approx(32.5) == figures.MASS == figures.BODY_MASS + legs
    assert legs / figures.MASS == pytest.approx(0.54, abs=0.005), "as the documents say"


def test_hips_and_sides_are_in_the_order_front_left_front_right_rear_left_rear_right() -> None:
    assert [(x > 0, y > 0) for x, y in figures.HIPS] == [(True, True), (True, False), (False, True), (False, False)]
    assert [np.sign(y) for _, y in figures.HIPS] == list(figures.SIDES)
    assert np.array(figures.HIPS).sum(axis=0) == pytest.approx((0.0, 0.0)), (
        "the body's origin is the middle of the hips"
    )


def test_mujoco_has_the_same_joints_in_the_same_order_with_the_same_limits() -> None:
    flat = Scene("flat", (-5.0, -5.0, 5.0, 5.0), (), Pose2(0, 0), Pose2(0, 0))
    model = engine.MjModel.from_xml_string(write_model(flat, Ground(), 0.0025))
    hinges = [model.joint(number) for number in range(1, 13)]
    assert tuple(joint.name for joint in hinges) == JOINT_NAMES
    assert np.array([joint.range for joint in hinges]) == pytest.approx(np.array(figures.JOINT_LIMITS))
    assert -model.opt.gravity[2] == pytest.approx(figures.GRAVITY)


def test_a_trunk_is_a_uniform_box() -> None:
    sides = np.array(figures.TRUNK)
    samples = (np.indices((40, 40, 40)).reshape(3, -1).T + 0.5) / 40.0 - 0.5
    x, y, z = (samples * sides).T
    inertia = figures.BODY_MASS * np.array((y * y + z * z, x * x + z * z, x * x + y * y)).mean(axis=1)
    assert inertia == pytest.approx(figures.BODY_INERTIA, rel=2e-3)


def test_links_of_no_shape_at_all_obey_the_triangle_inequality_of_inertia() -> None:
    for inertia in (figures.HIP_INERTIA, figures.THIGH_INERTIA, figures.CALF_INERTIA, figures.BODY_INERTIA):
        a, b, c = sorted(inertia)
        assert a > 0.0
        assert c <= a + b


def test_the_knees_curve_rises_to_one_peak_and_covers_the_joints_range() -> None:
    angles, torques = zip(*figures.KNEE_TORQUE, strict=True)
    assert (angles[0], angles[-1]) == figures.KNEE_LIMITS
    assert list(angles) == sorted(angles)
    rises = [b > a for a, b in pairwise(torques)]
    assert rises == sorted(rises, reverse=True)
    assert max(torques) == 113.2


@pytest.mark.parametrize("height", [0.15, 0.3, 0.45, 0.52])
def test_the_nominal_stance_is_straight_below_the_shoulders_and_can_be_taken(height: float) -> None:
    joints, reachable = inverse(nominal_feet(height))
    assert reachable == (True,) * 4
    assert joints[::3] == pytest.approx(np.zeros(4)), "no hip is turned"
    assert within_limits(joints) == (height > 0.2 or height == figures.SIT_HEIGHT)
    assert nominal_feet(height)[:, :2].tolist() == [list(place) for place in NOMINAL]
    assert nominal_feet(height)[:, 2].tolist() == [-height] * 4


def test_sitting_it_lies_as_high_as_the_data_sheet_says() -> None:
    assert pytest.approx(0.191, abs=0.006) == figures.SIT_HEIGHT + figures.FOOT_RADIUS


def test_a_mode_is_its_word_and_three_can_be_asked_for() -> None:
    assert [Mode(word) for word in ("sit", "stand", "walk")] == list(GOALS)
    assert {mode.value for mode in Mode} - set(GOALS) == {"rising", "stopping", "lowering"}
    with pytest.raises(ValueError, match="'run' is not a valid Mode"):
        Mode("run")
