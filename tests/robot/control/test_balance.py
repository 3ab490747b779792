"""The force distribution against linear algebra, a general optimiser, and the laws of statics."""

from __future__ import annotations

from math import hypot, pi

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

from robot.control.balance import (
    EFFORT,
    FRICTION,
    IMPORTANCE,
    LEAST,
    MOST,
    STEEP_FRICTION,
    distribute,
    solve_definite,
)
from robot.geometry.vectors import Floats, Triple
from robot.model.parameters import GRAVITY, MASS
from tests.robot.control.kit import turned_about_z

FEET: list[Triple] = [(0.30, 0.17, -0.5), (0.30, -0.17, -0.5), (-0.30, 0.17, -0.5), (-0.30, -0.17, -0.5)]
SHIFTED: list[Triple] = [(0.33, 0.20, -0.48), (0.27, -0.13, -0.5), (-0.31, 0.18, -0.53), (-0.25, -0.17, -0.47)]
WEIGHT = (0.0, 0.0, MASS * GRAVITY, 0.0, 0.0, 0.0)

small = st.floats(-20.0, 20.0)
gentle = st.tuples(
    small, small, st.floats(250.0, 400.0), st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.floats(-5.0, 5.0)
)
"""Wrenches at which no foot of `SHIFTED` comes near a bound."""
rough = st.tuples(*[st.floats(-500.0, 500.0)] * 2, st.floats(-100.0, 900.0), *[st.floats(-100.0, 100.0)] * 3)
share = st.floats(0.1, 1.0)
slope = st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))


def hat(arm: Triple) -> Floats:
    x, y, z = arm
    return np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))


def wrench_map(arms: list[Triple]) -> Floats:
    """A of docs/concepts/control.md: from the feet's forces to the wrench."""
    return np.hstack([np.vstack((np.eye(3), hat(arm))) for arm in arms])


def cost(forces: Floats, arms: list[Triple], wrench: tuple[float, ...]) -> float:
    miss = wrench_map(arms) @ forces - np.array(wrench)
    return float(miss @ np.diag(IMPORTANCE) @ miss + EFFORT * forces @ forces)


def parts(force: Floats, ground: tuple[float, float]) -> tuple[float, float]:
    """A force along the normal of the ground and across it."""
    normal = np.array((-ground[0], -ground[1], 1.0))
    normal /= np.linalg.norm(normal)
    pressing = float(force @ normal)
    return pressing, float(np.linalg.norm(force - pressing * normal))


# -- the unconstrained problem ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("legs", [(0, 1, 2, 3), (0, 1, 2), (1, 2, 3), (0, 3), (1, 2)])
@given(wrench=gentle)
@settings(max_examples=25, suppress_health_check=[HealthCheck.filter_too_much])
def test_the_dual_form_is_the_solution_of_the_normal_equations(
    legs: tuple[int, ...], wrench: tuple[float, ...]
) -> None:
    arms = [SHIFTED[leg] for leg in legs]
    a, weights = wrench_map(arms), np.diag(IMPORTANCE)
    wanted = np.linalg.solve(a.T @ weights @ a + EFFORT * np.eye(3 * len(legs)), a.T @ weights @ np.array(wrench))
    bounded = [parts(force, (0.0, 0.0)) for force in wanted.reshape(-1, 3)]
    assume(all(LEAST < down < MOST and across < FRICTION * down for down, across in bounded))
    assert np.ravel(distribute(arms, wrench)) == pytest.approx(wanted, abs=1e-6)


@given(wrench=gentle)
def test_where_no_bound_is_met_the_gradient_of_the_cost_vanishes(wrench: tuple[float, ...]) -> None:
    forces = np.ravel(distribute(SHIFTED, wrench))
    a, weights = wrench_map(SHIFTED), np.diag(IMPORTANCE)
    gradient = a.T @ weights @ (a @ forces - np.array(wrench)) + EFFORT * forces
    assert np.abs(gradient).max() < 1e-8 * np.abs(a.T @ weights @ np.array(wrench)).max()


@given(wrench=gentle)
@settings(max_examples=10)
def test_a_general_optimiser_with_friction_cones_finds_nothing_better(wrench: tuple[float, ...]) -> None:
    """While no foot meets a bound, the optimum within the cones is the same: the KKT multipliers of the cones are zero."""
    forces = np.ravel(distribute(SHIFTED, wrench))

    a, weights = wrench_map(SHIFTED), np.diag(IMPORTANCE)

    def gradient(f: Floats, *_: object) -> Floats:
        return np.asarray(2.0 * (a.T @ weights @ (a @ f - np.array(wrench)) + EFFORT * f))

    cones = [
        {"type": "ineq", "fun": lambda f, k=k: (FRICTION * f[3 * k + 2]) ** 2 - f[3 * k] ** 2 - f[3 * k + 1] ** 2}
        for k in range(4)
    ]
    start = np.tile((0.0, 0.0, MASS * GRAVITY / 4), 4)
    bounds = [(None, None), (None, None), (LEAST, MOST)] * 4
    found = minimize(cost, start, (SHIFTED, wrench), jac=gradient, bounds=bounds, constraints=cones, method="SLSQP")
    assert cost(forces, SHIFTED, wrench) <= found.fun * (1.0 + 1e-6) + 1e-9


@pytest.mark.parametrize("size", [1, 2, 3, 6])
@given(data=st.data())
@settings(max_examples=20)
def test_cholesky_agrees_with_scipy(size: int, data: st.DataObject) -> None:
    numbers = st.floats(-3.0, 3.0)
    half = np.array(data.draw(st.lists(numbers, min_size=size * size, max_size=size * size))).reshape(size, size)
    right = np.array(data.draw(st.lists(numbers, min_size=size, max_size=size)))
    matrix = half @ half.T + np.eye(size)
    lower = [tuple(matrix[row, : row + 1].tolist()) for row in range(size)]
    assert solve_definite(lower, right.tolist()) == pytest.approx(cho_solve(cho_factor(matrix), right), abs=1e-9)


# -- statics ------------------------------------------------------------------------------------------------------------------


def test_standing_still_each_foot_bears_a_quarter_of_the_weight_straight_up() -> None:
    for force in distribute(FEET, WEIGHT):
        assert force == pytest.approx((0.0, 0.0, MASS * GRAVITY / 4), abs=0.01)


@given(wrench=gentle)
def test_the_forces_add_up_to_the_wrench(wrench: tuple[float, ...]) -> None:
    forces = np.array(distribute(SHIFTED, wrench))
    assert forces.sum(axis=0) == pytest.approx(wrench[:3], abs=0.15)
    assert np.cross(SHIFTED, forces).sum(axis=0) == pytest.approx(wrench[3:], abs=0.05)


def test_a_foot_nearer_to_the_centre_of_mass_bears_more() -> None:
    forces = distribute([(x - 0.1, y, z) for x, y, z in FEET], WEIGHT)
    front, rear = forces[0][2], forces[2][2]
    assert front / rear == pytest.approx(0.4 / 0.2, rel=0.01)


def test_more_moment_about_x_loads_the_left_feet_and_relieves_the_right_ones() -> None:
    left = [distribute(FEET, (0.0, 0.0, 320.0, moment, 0.0, 0.0))[0][2] for moment in (-10.0, 0.0, 10.0)]
    right = [distribute(FEET, (0.0, 0.0, 320.0, moment, 0.0, 0.0))[1][2] for moment in (-10.0, 0.0, 10.0)]
    assert left == sorted(left)
    assert right == sorted(right, reverse=True)
    assert left[2] - left[1] == pytest.approx(10.0 / (4 * 0.17), rel=0.01)


def test_a_foot_that_would_have_to_pull_is_let_go_and_the_others_still_carry_the_weight() -> None:
    """A body whose centre of mass has left the triangle of its feet: two carry it, and it tips over the line between them."""
    arms = [(x - 0.06, y - 0.04, z) for x, y, z in FEET[1:]]
    forces = np.array(distribute(arms, WEIGHT))
    assert forces[2, 2] == LEAST
    assert forces[:2, 2].sum() == pytest.approx(WEIGHT[2], rel=0.01)
    assert min(forces[:2, 2]) > 100.0


def test_two_feet_carry_the_weight_and_leave_the_moment_about_their_line_alone() -> None:
    arms = [FEET[0], FEET[3]]
    along = np.array(arms[0]) - np.array(arms[1])
    along /= np.linalg.norm(along)
    forces = np.array(distribute(arms, (0.0, 0.0, MASS * GRAVITY, *(20.0 * along))))
    assert forces.sum(axis=0)[2] == pytest.approx(MASS * GRAVITY, rel=1e-3)
    assert abs(np.cross(arms, forces).sum(axis=0) @ along) < 20.0


# -- symmetry -----------------------------------------------------------------------------------------------------------------


@given(wrench=rough, ground=slope)
def test_the_mirrored_robot_pushes_with_mirrored_forces(wrench: tuple[float, ...], ground: tuple[float, float]) -> None:
    fx, fy, fz, mx, my, mz = wrench
    plain = distribute(SHIFTED, wrench, ground)
    mirrored = distribute([(x, -y, z) for x, y, z in SHIFTED], (fx, -fy, fz, -mx, my, -mz), (ground[0], -ground[1]))
    for (ax, ay, az), other in zip(plain, mirrored, strict=True):
        assert other == pytest.approx((ax, -ay, az), abs=1e-6)


@given(wrench=rough, ground=slope, yaw=st.floats(-pi, pi))
def test_a_world_that_is_turned_about_the_vertical_turns_the_forces_alone(
    wrench: tuple[float, ...], ground: tuple[float, float], yaw: float
) -> None:
    arms = [tuple(turned_about_z(arm, yaw).tolist()) for arm in SHIFTED]
    across = turned_about_z((*ground, 0.0), yaw)
    turned = distribute(arms, turned_about_z(wrench, yaw).tolist(), (float(across[0]), float(across[1])))  # type: ignore[arg-type]
    assert np.ravel(turned) == pytest.approx(
        turned_about_z(np.ravel(distribute(SHIFTED, wrench, ground)), yaw), abs=1e-6
    )


@given(wrench=rough, order=st.permutations(range(4)))
def test_the_order_of_the_feet_does_not_matter(wrench: tuple[float, ...], order: list[int]) -> None:
    shares = (1.0, 0.7, 0.5, 0.9)
    plain = distribute(SHIFTED, wrench, friction_shares=shares)
    shuffled = distribute([SHIFTED[k] for k in order], wrench, friction_shares=[shares[k] for k in order])
    assert np.ravel(shuffled) == pytest.approx(np.ravel([plain[k] for k in order]), abs=1e-6)


# -- bounds -------------------------------------------------------------------------------------------------------------------


@given(wrench=rough, ground=slope, shares=st.tuples(share, share, share, share))
def test_every_force_lies_in_its_friction_cone_about_the_normal_of_the_ground(
    wrench: tuple[float, ...], ground: tuple[float, float], shares: tuple[float, ...]
) -> None:
    steep = FRICTION + STEEP_FRICTION * hypot(*ground)
    for force, trusted in zip(distribute(SHIFTED, wrench, ground, shares), shares, strict=True):
        pressing, across = parts(np.array(force), ground)
        assert LEAST - 1e-9 <= pressing <= MOST + 1e-9
        assert across <= trusted * steep * pressing + 1e-9


@pytest.mark.parametrize("feet", [1, 2, 3, 4])
@pytest.mark.parametrize("fz", [-1000.0, 0.0, 5.0])
def test_no_standing_foot_pulls_at_the_ground(feet: int, fz: float) -> None:
    assert [force[2] for force in distribute(FEET[:feet], (0.0, 0.0, fz, 0.0, 0.0, 0.0))] == pytest.approx(
        [LEAST] * feet
    )


def test_no_foot_is_asked_for_more_than_the_most() -> None:
    assert [force[2] for force in distribute(FEET[:2], (0.0, 0.0, 5000.0, 0.0, 0.0, 0.0))] == pytest.approx([MOST] * 2)


def test_too_much_sideways_is_cut_to_the_edge_of_the_cone_and_keeps_its_direction() -> None:
    plane: list[Triple] = [(x, y, 0.0) for x, y, _ in FEET]
    for fx, fy, fz in distribute(plane, (300.0, 400.0, 320.0, 0.0, 0.0, 0.0)):
        assert hypot(fx, fy) == pytest.approx(FRICTION * fz)
        assert fy / fx == pytest.approx(4.0 / 3.0, rel=0.01)


@given(trusted=st.floats(0.15, 1.0), fx=st.floats(-500.0, 500.0), fy=st.floats(-500.0, 500.0))
def test_a_foot_that_slid_is_asked_for_less_and_the_other_is_not(trusted: float, fx: float, fy: float) -> None:
    arms, wrench = [(0.3, 0.16, -0.5), (-0.3, -0.16, -0.5)], (fx, fy, 320.0, 0.0, 0.0, 0.0)
    first, second = distribute(arms, wrench, friction_shares=(trusted, 1.0))
    assert hypot(first[0], first[1]) <= trusted * FRICTION * first[2] + 1e-9
    assert second == pytest.approx(distribute(arms, wrench)[1])


@pytest.mark.parametrize("steepness", [0.1, 0.3, 0.5])
def test_a_robot_that_stands_on_a_slope_is_carried_straight_up_within_its_cones(steepness: float) -> None:
    """Friction of 0.6 and more holds on a slope of up to 31 degrees and more: no force is cut."""
    arms = [(x, y, z + steepness * x) for x, y, z in FEET]
    forces = np.array(distribute(arms, WEIGHT, (steepness, 0.0)))
    assert forces.sum(axis=0) == pytest.approx((0.0, 0.0, MASS * GRAVITY), abs=0.05)
    pressing, across = zip(*(parts(force, (steepness, 0.0)) for force in forces), strict=True)
    assert np.divide(across, pressing).max() <= FRICTION + STEEP_FRICTION * steepness
