"""Things in the world: who may grip them, where they fall, and that a body without an arm is the same as ever."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest

from robot.geometry.planar import Pose2
from robot.model.arm import MOUNT, STOWED, Tip, inverse
from robot.scenes.scene import Box, Cylinder, Scene, Thing
from robot.sim.ground import Ground
from robot.sim.kinematic import KinematicBody
from robot.sim.mjcf import write_model
from robot.sim.physics import PhysicsBody
from robot.sim.simulation import Simulation
from robot.sim.things import Things, centre, tool_point
from tests.robot.stage import floor

engine: Any = mujoco
TABLE = Box(0.95, 0.0, 0.3, 0.3, yaw=0.4, height=0.3)
CUP = Thing("cup", Cylinder(0.9, 0.0, 0.035, 0.1), (200, 20, 20), z=0.3)
BRICK = Thing("brick", Box(0.95, 0.08, 0.05, 0.08, height=0.06), (20, 200, 20), z=0.3)
SCENE = Scene(
    "table", (-5.0, -5.0, 5.0, 5.0), (TABLE, Cylinder(-1.0, 0.0, 0.2, height=0.5)), Pose2(0.0, 0.0), Pose2(0.0, 0.0), things=(CUP, BRICK)
)  # fmt: skip


def over(height: float) -> np.ndarray:
    return np.array([0.0, 0.0, height])


BODIES = [KinematicBody, PhysicsBody]


def test_only_a_thing_within_two_centimeters_of_the_tip_is_near() -> None:
    things = Things(SCENE)
    assert things.near(centre(CUP) + over(0.0199)) == 0
    assert things.near(centre(CUP) + over(0.0201)) is None
    assert things.near(centre(BRICK)) == 1
    assert Things(floor()).near(np.zeros(3)) is None


def test_jaws_close_on_the_thinner_side() -> None:
    assert (CUP.thickness, BRICK.thickness) == (0.07, 0.05)


@pytest.mark.parametrize(
    ("x", "y", "z", "rests"),
    [(0.9, 0.05, 0.4, 0.3), (1.3, 0.0, 0.4, 0.0), (-1.1, 0.1, 0.9, 0.5), (-1.1, 0.1, 0.4, 0.0), (0.9, 0.0, 0.29, 0.3)],
)
def test_what_is_let_go_comes_to_rest_on_what_is_below_it(x: float, y: float, z: float, rests: float) -> None:
    things = Things(SCENE)
    things.put(0, np.array([x, y, z + 0.05]))
    things.drop(0)
    assert things[0].z == rests
    assert (things[0].shape.x, things[0].shape.y) == (x, y)


@pytest.mark.parametrize("kind", BODIES)
def test_the_arm_takes_a_thing_and_puts_it_elsewhere(kind: type[KinematicBody] | type[PhysicsBody]) -> None:
    body = kind(SCENE, seed=1, noise=False, arm=True)
    assert body.arm is not None
    body.advance(0.5)

    def reach(point: np.ndarray) -> None:
        assert body.arm is not None
        offset = point - body.truth().position - np.array(MOUNT)
        body.advance(body.time + body.arm.move(inverse(Tip(*offset.tolist(), 0.3))) + 0.4)

    reach(centre(CUP) + over(0.06))
    body.arm.grip(True)
    body.advance(body.time + 0.5)
    assert (body.arm.held, body.arm.gripper.gripping) == (None, False), "6 cm is not near enough"
    body.arm.grip(False)
    body.advance(body.time + 0.5)
    for _ in range(2):  # the second time the body has leaned already
        reach(centre(CUP))
    tip = tool_point(body.truth().position, body.truth().quaternion, body.arm.state().position)
    assert np.linalg.norm(tip - centre(CUP)) < 0.02
    body.arm.grip(True)
    body.advance(body.time + 0.5)
    assert body.arm.held == "cup"
    assert body.arm.gripper.opening == pytest.approx(0.07)
    body.advance(body.time + body.arm.move(STOWED) + 0.5)
    tip = tool_point(body.truth().position, body.truth().quaternion, body.arm.state().position)
    assert np.linalg.norm(tip - centre(body.things()[0])) < 0.022
    body.arm.grip(False)
    body.advance(body.time + 2.0)
    assert body.arm.held is None
    assert centre(body.things()[0])[2] < 0.06, "it stands on the floor, or lies there"
    assert body.things()[1].z == pytest.approx(0.3, abs=2e-3)
    assert body.truth().touching == ()
    body.place(Pose2(0.0, 0.0))
    assert body.things()[0].z == pytest.approx(CUP.z)


@pytest.mark.parametrize("kind", BODIES)
def test_without_an_arm_things_stay_where_they_are(kind: type[KinematicBody] | type[PhysicsBody]) -> None:
    body: Simulation = kind(SCENE, seed=1)
    assert body.arm is None
    body.advance(0.1)
    assert body.things() == SCENE.things


def test_a_table_that_the_arm_hits_is_reported_and_things_on_it_are_not() -> None:
    body = PhysicsBody(SCENE, seed=1, arm=True)
    assert body.arm is not None
    body.advance(0.5)
    assert body.truth().touching == ()
    body.arm.move((0.0, 0.3, 0.6, 0.3))
    body.advance(3.0)
    assert body.truth().touching == ("box_0",)


def test_without_an_arm_the_model_is_the_one_that_was_walked_with() -> None:
    bare, armed = write_model(SCENE, Ground(), 0.0025), write_model(SCENE, Ground(), 0.0025, arm=True)
    assert "arm_" not in bare
    assert "thing_" not in bare
    assert "equality" not in bare
    for word in ("arm_hand", "thing_0", "thing_1", "<weld"):
        assert word in armed
    lighter, heavier = (engine.MjModel.from_xml_string(text).body_subtreemass[0] for text in (bare, armed))
    assert heavier - lighter == pytest.approx(6.2 + 2 * 0.3), "the arm and two things"
