"""The legs in one pass against MuJoCo's model of the same robot: places, Jacobians, centre of mass, weight, speeds."""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from robot.geometry.planar import Pose2
from robot.geometry.vectors import Floats, Triple
from robot.model.kinematics import feet, inverse, leg_forward, leg_jacobian
from robot.model.legs import LEVEL, foot_velocities, leg_state, torques
from robot.model.parameters import FOOT_RADIUS, GRAVITY, JOINT_LIMITS, MASS, SIDES
from robot.model.stance import nominal_feet
from robot.scenes.scene import Scene
from robot.sim.ground import Ground
from robot.sim.mjcf import write_model

engine: Any = mujoco
MODEL = engine.MjModel.from_xml_string(
    write_model(Scene("flat", (-5.0, -5.0, 5.0, 5.0), (), Pose2(0, 0), Pose2(0, 0)), Ground(), 0.0025)
)
FEET = [MODEL.site(f"{leg}_foot").id for leg in ("fl", "fr", "rl", "rr")]
LOW, HIGH = np.array(JOINT_LIMITS).T
seeds = st.integers(0, 100_000)


class Posed:
    """MuJoCo's robot in a random pose, with random speeds."""

    def __init__(self, seed: int, level: bool = False) -> None:
        random = np.random.default_rng(seed)
        self.angles: Floats = random.uniform(LOW, HIGH)
        self.rotation = Rotation.identity() if level else Rotation.random(random_state=seed)
        self.turn: Floats = random.normal(0.0, 1.0, 3)
        self.speeds: Floats = random.normal(0.0, 4.0, 12)
        self.data = engine.MjData(MODEL)
        x, y, z, w = self.rotation.as_quat()
        self.data.qpos[:] = np.concatenate(((0.3, -0.2, 2.0), (w, x, y, z), self.angles))
        self.data.qvel[:] = np.concatenate((np.zeros(3), self.turn, self.speeds))
        engine.mj_forward(MODEL, self.data)
        self.up: Triple = tuple(self.rotation.inv().apply((0.0, 0.0, 1.0)).tolist())
        self.state = leg_state(self.angles.tolist(), self.up)

    def in_body(self, vectors: Floats) -> Floats:
        return np.asarray(self.rotation.inv().apply(vectors))

    def jacobian(self, foot: int) -> tuple[Floats, Floats]:
        """Of a foot's place and of its calf's turning, against all speeds of the robot, world axes."""
        place, turning = np.zeros((3, MODEL.nv)), np.zeros((3, MODEL.nv))
        engine.mj_jacSite(MODEL, self.data, place, turning, FEET[foot])
        return place, turning


@settings(deadline=None, max_examples=25)
@given(seeds)
def test_feet_and_jacobians_are_those_of_mujoco(seed: int) -> None:
    posed = Posed(seed)
    for foot in range(4):
        place = posed.in_body(posed.data.site_xpos[FEET[foot]] - posed.data.qpos[:3])
        assert posed.state.feet[foot] == pytest.approx(place, abs=1e-8)
        own = posed.in_body(posed.jacobian(foot)[0][:, 6 + 3 * foot : 9 + 3 * foot].T).T
        assert np.array(posed.state.jacobians[foot]) == pytest.approx(own, abs=1e-8)


@settings(deadline=None, max_examples=25)
@given(seeds)
def test_the_centre_of_mass_is_mujocos(seed: int) -> None:
    posed = Posed(seed)
    centre = posed.in_body(posed.data.subtree_com[MODEL.body("body").id] - posed.data.qpos[:3])
    assert posed.state.centre == pytest.approx(centre, abs=1e-6)
    assert MODEL.body_subtreemass[0] == pytest.approx(MASS)


@settings(deadline=None, max_examples=25)
@given(seeds)
def test_the_links_weight_is_what_mujoco_needs_to_hold_them_in_any_attitude(seed: int) -> None:
    posed = Posed(seed)
    posed.data.qvel[:] = 0.0
    engine.mj_forward(MODEL, posed.data)
    assert posed.state.weight == pytest.approx(posed.data.qfrc_bias[6:18], abs=1e-5)


@settings(deadline=None, max_examples=25)
@given(seeds, st.tuples(*(st.floats(-200.0, 200.0) for _ in range(3))))
def test_the_torques_of_a_force_on_a_foot_do_its_work(seed: int, force: Triple) -> None:
    """MuJoCo's own transpose: a force that is applied at the foot, as generalised force on the joints, with opposite sign."""
    posed, foot = Posed(seed), seed % 4
    generalised = np.zeros(MODEL.nv)
    body = MODEL.site_bodyid[FEET[foot]]
    world = posed.rotation.apply(force)
    engine.mj_applyFT(MODEL, posed.data, world, np.zeros(3), posed.data.site_xpos[FEET[foot]], body, generalised)
    found = torques(posed.state.jacobians[foot], *force)
    assert found == pytest.approx(-generalised[6 + 3 * foot : 9 + 3 * foot], abs=1e-6)


@settings(deadline=None, max_examples=25)
@given(seeds)
def test_a_foot_moves_and_rolls_as_mujocos_does(seed: int) -> None:
    posed = Posed(seed)
    moving, rolling = foot_velocities(
        posed.state, posed.angles.tolist(), posed.speeds.tolist(), tuple(posed.turn.tolist()), posed.up
    )
    for foot in range(4):
        place, turning = posed.jacobian(foot)
        assert moving[foot] == pytest.approx(posed.in_body(place @ posed.data.qvel), abs=1e-6)
        calf = turning @ posed.data.qvel
        rolled = np.cross(calf, (0.0, 0.0, FOOT_RADIUS))
        assert rolling[foot] == pytest.approx(posed.in_body(rolled), abs=1e-6)


@settings(deadline=None, max_examples=25)
@given(seeds)
def test_the_mirrored_robot_is_mirrored(seed: int) -> None:
    mirror = np.array((1.0, -1.0, 1.0))
    angles = np.random.default_rng(seed).uniform(LOW, HIGH)
    other = angles.reshape(4, 3)[[1, 0, 3, 2]] * (-1.0, 1.0, 1.0)
    here, there = leg_state(angles.tolist(), LEVEL), leg_state(other.ravel().tolist(), LEVEL)
    assert np.array(there.feet)[[1, 0, 3, 2]] == pytest.approx(np.array(here.feet) * mirror)
    assert there.centre == pytest.approx(np.array(here.centre) * mirror)
    assert np.array(there.weight).reshape(4, 3)[[1, 0, 3, 2]] == pytest.approx(
        np.array(here.weight).reshape(4, 3) * (-1.0, 1.0, 1.0)
    )


def test_legs_in_one_pass_agree_with_the_leg_functions() -> None:
    angles = [0.2, 0.9, -1.5, -0.1, 0.7, -1.2, 0.0, 1.1, -1.9, 0.3, 0.4, -0.8]
    legs = leg_state(angles, (0.0, 0.0, 1.0))
    np.testing.assert_allclose(legs.feet, feet(angles), atol=1e-12)
    for leg, side in enumerate(SIDES):
        np.testing.assert_allclose(legs.jacobians[leg], leg_jacobian(side, *angles[3 * leg : 3 * leg + 3]), atol=1e-12)


def test_weight_torques_are_the_derivative_of_the_potential_energy() -> None:
    angles = [0.2, 0.9, -1.5, -0.1, 0.7, -1.2, 0.0, 1.1, -1.9, 0.3, 0.4, -0.8]
    up = (0.1, -0.2, math.sqrt(0.95))
    step = 1e-6

    def energy(q: list[float]) -> float:
        return MASS * GRAVITY * sum(a * b for a, b in zip(leg_state(q, up).centre, up, strict=True))

    for joint in range(12):
        high, low = list(angles), list(angles)
        high[joint] += step
        low[joint] -= step
        expected = (energy(high) - energy(low)) / (2 * step)
        assert leg_state(angles, up).weight[joint] == pytest.approx(expected, abs=1e-6)


def test_torques_are_minus_the_transposed_jacobian_times_the_force() -> None:
    jacobian = leg_jacobian(-1.0, 0.1, 0.8, -1.6)
    force = np.array((10.0, -20.0, 150.0))
    np.testing.assert_allclose(torques(jacobian, *force), -np.array(jacobian).T @ force)


def test_a_rolling_foot_moves_with_its_calf() -> None:
    """A ball foot on the ground whose calf turns by w moves by w times its radius, forwards."""
    angles = inverse(nominal_feet(0.45)).joints.tolist()
    speeds = [0.0, 0.4, 0.6] * 4
    up = (0.0, 0.0, 1.0)
    moving, rolling = foot_velocities(leg_state(angles, up), angles, speeds, (0.0, 0.0, 0.0), up)
    for leg in range(4):
        assert rolling[leg] == pytest.approx((0.036 * 1.0, 0.0, 0.0))
    step = 1e-6
    ahead = leg_forward(1.0, *(q + step * v for q, v in zip(angles[:3], speeds[:3], strict=True)))
    behind = leg_forward(1.0, *(q - step * v for q, v in zip(angles[:3], speeds[:3], strict=True)))
    assert moving[0] == pytest.approx(tuple(np.subtract(ahead, behind) / (2 * step)), abs=1e-6)
