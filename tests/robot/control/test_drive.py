"""The targets of one control step, and joint speeds from foot speeds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.control.drive import Targets, joint_speeds
from robot.model.kinematics import leg_jacobian

knee = st.floats(-2.4, -0.4)
sides = st.sampled_from((1.0, -1.0))


@given(side=sides, hip=st.floats(-0.6, 0.6), shoulder=st.floats(-0.5, 1.5), bend=knee, data=st.data())
def test_joint_speeds_are_the_solution_of_the_jacobian(
    side: float, hip: float, shoulder: float, bend: float, data: st.DataObject
) -> None:
    jacobian = leg_jacobian(side, hip, shoulder, bend)
    if abs(np.linalg.det(jacobian)) < 1e-4:
        return
    foot = data.draw(st.tuples(*[st.floats(-1.0, 1.0)] * 3))
    wanted = np.clip(np.linalg.solve(jacobian, foot), -15.0, 15.0)
    assert joint_speeds(jacobian, *foot) == pytest.approx(wanted, abs=1e-6)


@given(foot=st.tuples(*[st.floats(-500.0, 500.0)] * 3))
def test_no_joint_is_asked_to_turn_faster_than_the_bound(foot: tuple[float, float, float]) -> None:
    speeds = joint_speeds(leg_jacobian(-1.0, 0.1, 0.8, -1.6), *foot)
    assert max(abs(speed) for speed in speeds) <= 15.0


def test_a_bound_of_one_joint_leaves_the_others_alone() -> None:
    jacobian = leg_jacobian(-1.0, 0.1, 0.8, -1.6)
    wanted = np.linalg.solve(jacobian, (0.0, 100.0, 0.0))
    assert abs(wanted).max() > 15.0
    assert joint_speeds(jacobian, 0.0, 100.0, 0.0) == pytest.approx(np.clip(wanted, -15.0, 15.0), abs=1e-9)


@pytest.mark.parametrize("bend", [0.0, 1e-6])
def test_a_stretched_leg_is_told_no_speeds(bend: float) -> None:
    assert joint_speeds(leg_jacobian(1.0, 0.0, bend, -bend), 0.1, 0.1, 0.1) == (0.0, 0.0, 0.0)


def test_joints_that_nobody_set_are_free() -> None:
    frozen = Targets().freeze()
    for values in (frozen.position, frozen.velocity, frozen.effort, frozen.kp, frozen.kd):
        assert values.tolist() == [0.0] * 12


@pytest.mark.parametrize("leg", range(4))
def test_a_leg_fills_its_own_three_joints_and_no_others(leg: int) -> None:
    targets = Targets()
    targets.leg(leg, effort=(1.0, 2.0, 3.0), velocity=(4.0, 5.0, 6.0), position=(7.0, 8.0, 9.0), kp=10.0, kd=11.0)
    frozen = targets.freeze()
    expected = {
        "effort": (1.0, 2.0, 3.0),
        "velocity": (4.0, 5.0, 6.0),
        "position": (7.0, 8.0, 9.0),
        "kp": (10.0,) * 3,
        "kd": (11.0,) * 3,
    }
    for name, three in expected.items():
        whole = np.zeros(12)
        whole[3 * leg : 3 * leg + 3] = three
        assert getattr(frozen, name).tolist() == whole.tolist(), name


def test_a_force_alone_has_neither_place_nor_gains() -> None:
    targets = Targets()
    targets.leg(2, effort=(1.0, 1.0, 1.0), position=(1.0, 1.0, 1.0), kp=5.0, kd=1.0)
    targets.leg(2, effort=(2.0, 3.0, 4.0))
    assert targets.effort[6:9] == [2.0, 3.0, 4.0]
    assert targets.kp == targets.kd == targets.position == [0.0] * 12


def test_what_was_frozen_does_not_change_any_more() -> None:
    targets = Targets()
    frozen = targets.freeze()
    targets.leg(0, effort=(1.0, 1.0, 1.0), kp=1.0)
    assert not frozen.effort.any()
    assert not frozen.kp.any()
