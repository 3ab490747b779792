"""How the standing robot's mass lies, against MuJoCo's own sum over the links of the same robot."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest

from robot.control.gaits import GAITS
from robot.control.walk import WalkController
from robot.control.walk_config import WalkConfig
from robot.estimation.leg_odometry import Estimator
from robot.estimation.predict import PredictedState
from robot.estimation.terrain import TerrainPlane
from robot.hardware.body import ImuSample, JointSample
from robot.model.kinematics import feet, inverse
from robot.model.mass import standing_mass
from robot.model.parameters import GRAVITY, MASS, STAND_HEIGHT
from robot.model.stance import NOMINAL, nominal_feet
from robot.sim.ground import Ground
from robot.sim.mjcf import write_model
from tests.robot.stage import floor

WALK_HEIGHT = WalkConfig().height
engine: Any = mujoco


@pytest.mark.parametrize("height", [0.30, STAND_HEIGHT, 0.48, WALK_HEIGHT])
def test_it_is_what_mujoco_adds_up(height: float) -> None:
    model = engine.MjModel.from_xml_string(write_model(floor(), Ground(), 0.0025))
    data = engine.MjData(model)
    data.qpos[:7] = (0.0, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0)
    data.qpos[7:] = inverse(nominal_feet(height)).joints
    engine.mj_forward(model, data)
    body, found = model.body("body").id, standing_mass(height)
    # The composite inertia of a tree: xx, yy, zz, xy, xz, yz about its centre of mass, world axes.
    assert model.body_subtreemass[body] == pytest.approx(MASS)
    assert found.behind == pytest.approx(-data.subtree_com[body][0], abs=1e-6)
    assert found.inertia == pytest.approx(tuple(data.crb[body][:3]), rel=1e-5)


def test_between_two_heights_it_is_nearly_linear() -> None:
    low, high = standing_mass(STAND_HEIGHT), standing_mass(WALK_HEIGHT)
    middle, found = standing_mass(0.5 * (STAND_HEIGHT + WALK_HEIGHT)), low.between(high, 0.5)
    assert found.behind == pytest.approx(middle.behind, abs=5e-4)
    assert found.inertia == pytest.approx(middle.inertia, rel=5e-3)


def test_a_tall_walk_on_the_spot_sets_its_feet_below_the_centre_of_mass_of_that_height() -> None:
    joints = JointSample(
        inverse(nominal_feet(WALK_HEIGHT)).joints, np.zeros(12), np.zeros(12), np.ones(4, dtype=np.bool_)
    )
    imu = ImuSample(np.zeros(3), np.array((0.0, 0.0, GRAVITY)))
    estimate, terrain = Estimator(), TerrainPlane()
    estimate.update(0.005, imu, joints)
    walker = WalkController(GAITS["trot"], PredictedState(estimate, joints, 0.0, (0.0, 0.0, 0.0)))
    landing: list[float] = []
    for step in range(600):
        joints.contact[:] = [walker.swing(leg) < 0.0 for leg in range(4)]
        estimate.update(0.005, imu, joints)
        terrain.update(0.005, estimate.contacts)
        ahead = PredictedState(estimate, joints, 0.0, (0.0, 0.0, 0.0))
        targets = walker.step(0.005, estimate, ahead, terrain, (0.0, 0.0, 0.0))
        if step > 300 and walker.swing(0) > 0.97:
            landing.append(float(feet(targets.position)[0, 0]))
    assert walker.height == pytest.approx(WALK_HEIGHT)
    assert landing
    behind = standing_mass(WALK_HEIGHT).behind
    assert landing == pytest.approx([NOMINAL[0][0] - behind] * len(landing), abs=1e-3)


@pytest.mark.parametrize("share", [0.0, 0.25, 1.0])
def test_between_two_heights_each_part_is_interpolated_by_itself(share: float) -> None:
    low, high = standing_mass(STAND_HEIGHT), standing_mass(WALK_HEIGHT)
    found = low.between(high, share)
    assert found.behind == pytest.approx(np.interp(share, (0.0, 1.0), (low.behind, high.behind)))
    for mine, ends in zip(found.inertia, zip(low.inertia, high.inertia, strict=True), strict=True):
        assert mine == pytest.approx(np.interp(share, (0.0, 1.0), ends))
