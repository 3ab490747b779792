"""Commands tried out on paper: exact arcs, and the distances along them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from robot.estimation.movers import Mover
from robot.geometry.planar import Pose2, compose
from robot.geometry.vectors import Floats
from robot.navigation.follow_config import FollowerConfig
from robot.navigation.limits import Limits
from robot.navigation.local_field import LocalField
from robot.navigation.rollout import FORESIGHT, GLIMPSE, HORIZON, clearances, fan_of, rollout
from robot.scenes.scene import Box, Cylinder
from tests.robot.control.kit import field

NOWHERE = Pose2(0.0, 0.0)
speed = st.floats(-1.0, 1.0)
commands = st.tuples(speed, speed, st.floats(-2.0, 2.0))
poses = st.builds(Pose2, st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.floats(-3.0, 3.0))


def end(pose: Pose2, command: tuple[float, ...], seconds: float) -> tuple[float, float, float]:
    x, y, yaw = (float(part[0, 0]) for part in rollout(pose, np.array([command]), np.array([seconds])))
    return x, y, yaw


def with_mover(around: LocalField, mover: Mover) -> LocalField:
    return LocalField(around.grid, around.footprint, around.fine, around.top, around.left, around.changes, (mover,))


@given(pose=poses, command=commands, seconds=st.floats(0.05, 2.5))
def test_a_command_leads_along_the_exponential_of_its_twist(
    pose: Pose2, command: tuple[float, ...], seconds: float
) -> None:
    vx, vy, wz = command
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    start = np.array(((c, -s, pose.x), (s, c, pose.y), (0.0, 0.0, 1.0)))
    there = start @ expm(seconds * np.array(((0.0, -wz, vx), (wz, 0.0, vy), (0.0, 0.0, 0.0))))
    x, y, yaw = end(pose, command, seconds)
    assert (x, y) == pytest.approx(there[:2, 2], abs=1e-9)
    assert yaw == pytest.approx(pose.yaw + wz * seconds)


def test_a_solver_of_differential_equations_goes_the_same_way() -> None:
    def motion(_: float, at: Floats) -> Floats:
        c, s = math.cos(at[2]), math.sin(at[2])
        return np.array((0.6 * c + 0.2 * s, 0.6 * s - 0.2 * c, 0.9))

    found = solve_ivp(motion, (0.0, 1.2), (1.0, 2.0, 0.3), rtol=1e-10, atol=1e-12)
    assert end(Pose2(1.0, 2.0, 0.3), (0.6, -0.2, 0.9), 1.2) == pytest.approx(found.y[:, -1], abs=1e-7)


@given(command=commands, first=st.floats(0.0, 1.0), second=st.floats(0.0, 1.0))
def test_going_on_is_going_at_once(command: tuple[float, ...], first: float, second: float) -> None:
    half = Pose2(*end(NOWHERE, command, first))
    assert end(half, command, second) == pytest.approx(end(NOWHERE, command, first + second), abs=1e-9)


@given(pose=poses, command=commands)
def test_where_it_leads_does_not_depend_on_where_it_begins(pose: Pose2, command: tuple[float, ...]) -> None:
    there = compose(pose, Pose2(*end(NOWHERE, command, 1.2)))
    x, y, yaw = end(pose, command, 1.2)
    assert (x, y) == pytest.approx((there.x, there.y), abs=1e-9)
    assert math.cos(yaw - there.yaw) == pytest.approx(1.0)


@given(command=commands)
def test_a_mirrored_command_leads_to_the_mirrored_place(command: tuple[float, ...]) -> None:
    vx, vy, wz = command
    x, y, yaw = end(NOWHERE, command, 1.2)
    assert end(NOWHERE, (vx, -vy, -wz), 1.2) == pytest.approx((x, -y, -yaw), abs=1e-12)


def test_every_command_is_told_at_every_instant() -> None:
    tried = np.array([(0.5, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, 1.0)])
    x, y, yaw = rollout(Pose2(1.0, 0.0, math.pi / 2), tried, HORIZON)
    assert x.shape == y.shape == (3, 8)
    assert yaw.shape == (3, 8)
    assert y[0] == pytest.approx(0.5 * HORIZON)
    assert x[1] == pytest.approx(1.0 - 0.2 * HORIZON)
    assert yaw[2] == pytest.approx(math.pi / 2 + HORIZON)


def test_the_instants_reach_as_far_as_the_equations_say() -> None:
    assert (len(HORIZON), HORIZON[-1]) == (8, 1.2)
    assert (len(GLIMPSE), GLIMPSE[-1]) == (6, 0.6)
    assert (len(FORESIGHT), FORESIGHT[-1]) == (12, 2.5)
    assert FORESIGHT[:8].tolist() == HORIZON.tolist()


# -- the fan ------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("limits", [Limits(), Limits(vx_min=-0.5, vx_max=1.5, wz_max=1.3)])
def test_the_fan_spreads_over_the_limits_and_is_the_same_to_both_sides(limits: Limits) -> None:
    fan = fan_of(FollowerConfig(), limits)
    assert fan.shape == (8 * 5 * 9, 3)
    assert fan.min(axis=0) == pytest.approx((limits.vx_min, -limits.vy_max, -limits.wz_max))
    assert fan.max(axis=0) == pytest.approx((limits.vx_max, limits.vy_max, limits.wz_max))
    rounded = {tuple(row) for row in np.round(fan, 9).tolist()}
    assert rounded == {(vx, -vy, -wz) for vx, vy, wz in rounded}
    assert (0.0, 0.0, 0.0) in rounded, "to stand is one of them"
    assert len(rounded) == len(fan)


# -- clearances ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("vx", [0.0, 0.2, 0.5, 0.8])
def test_towards_a_wall_the_clearance_falls_with_the_way(vx: float) -> None:
    around = field(Box(2.1, 0.0, 0.2, 6.0))
    found = clearances(NOWHERE, np.array([(vx, 0.0, 0.0)]), around, HORIZON)[0]
    assert found == pytest.approx(2.0 - 0.55 - vx * HORIZON, abs=0.08)
    assert list(found) == sorted(found, reverse=True)


def test_turning_on_the_spot_swings_the_corners_towards_what_stands_beside() -> None:
    around = field(Box(0.0, 0.55, 4.0, 0.1))
    found = clearances(NOWHERE, np.array([(0.0, 0.0, 0.6), (0.0, 0.0, 0.0)]), around, HORIZON)
    assert found[1] == pytest.approx([0.25] * 8, abs=0.06)
    corner = 0.5 - (0.55 * np.sin(0.6 * HORIZON) + 0.25 * np.cos(0.6 * HORIZON))
    assert found[0] == pytest.approx(corner, abs=0.08)


@given(vx=st.floats(-0.3, 0.8), speed=st.floats(-0.8, 0.8))
@settings(max_examples=30)
def test_from_what_moves_the_distance_is_that_to_where_it_will_be(vx: float, speed: float) -> None:
    around = with_mover(field(), Mover(3.0, 0.0, speed, 0.0, 0.3))
    found = clearances(NOWHERE, np.array([(vx, 0.0, 0.0)]), around, HORIZON)[0]
    assert len(found) == 8 + 12
    gap = np.maximum(3.0 + (speed - vx) * FORESIGHT - 0.55, 0.0) - 0.3
    behind = np.maximum(-(3.0 + (speed - vx) * FORESIGHT) - 0.55, 0.0) - 0.3
    assert found[8:] == pytest.approx(np.maximum(gap, behind), abs=1e-9)


def test_without_anything_that_moves_only_what_stands_counts() -> None:
    around = field(Cylinder(0.0, 1.5, 0.2))
    assert clearances(NOWHERE, np.zeros((2, 3)), around, GLIMPSE).shape == (2, 6)
