"""The arm without forces: what it grips goes with the tool's tip as MuJoCo's rotations turn it, and falls where it is let go."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from robot.geometry.planar import Pose2
from robot.hardware.arm import ArmBusy
from robot.model.arm import MOUNT, STOWED, forward
from robot.scenes.scene import Box, Cylinder, Scene, Thing
from robot.sim.gripper import SPEED, WIDEST
from robot.sim.kinematic_arm import KinematicArm

REACH = (0.0, 0.2, 0.9, -0.5)
STAND = 0.486


class Carried:
    """An arm on a body that is put where the test wants it, at a time that the test tells."""

    def __init__(self, *obstacles: Box, reached: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> None:
        tip = forward(REACH)
        middle = np.array((tip.x, tip.y, tip.z)) + MOUNT + (0.0, 0.0, STAND) + reached
        cup = Thing(
            "cup", Cylinder(float(middle[0]), float(middle[1]), 0.03, 0.1), (200, 0, 0), z=float(middle[2]) - 0.05
        )
        crate = Thing("crate", Box(3.0, 3.0, 0.05, 0.05, height=0.05), (0, 0, 200))
        self.scene = Scene("cup", (-5, -5, 5, 5), obstacles, Pose2(0, 0), Pose2(0, 0), things=(crate, cup))
        self.time, self.position, self.rotation = 0.0, np.array((0.0, 0.0, STAND)), Rotation.identity()
        self.arm = KinematicArm(self.scene, lambda: self.time, self._pose)

    def _pose(self) -> tuple[np.ndarray, np.ndarray]:
        x, y, z, w = self.rotation.as_quat()
        return self.position, np.array((w, x, y, z))

    def wait(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.005)):
            self.time += 0.005
            self.arm.step(0.005)

    def reach_and_grip(self) -> None:
        self.wait(self.arm.move(REACH) + 0.01)
        self.arm.grip(True)
        self.wait(WIDEST / SPEED)

    @property
    def cup(self) -> np.ndarray:
        thing = self.arm.things()[1]
        return np.array((thing.shape.x, thing.shape.y, thing.z + thing.shape.height / 2))


def test_it_grips_what_its_tip_is_at_and_holds_it_by_its_thickness() -> None:
    robot = Carried(reached=(0.0, 0.015, 0.0))
    assert robot.arm.held is None
    robot.reach_and_grip()
    assert robot.arm.held == "cup"
    assert robot.arm.gripper.gripping
    assert robot.arm.gripper.opening == pytest.approx(0.06)
    assert repr(robot.arm) == "<KinematicArm at (0.00, 0.20, 0.90, -0.50) rad, holding cup>"


def test_two_centimetres_beside_it_closes_on_nothing() -> None:
    robot = Carried(reached=(0.0, 0.025, 0.0))
    before = robot.cup
    robot.reach_and_grip()
    assert robot.arm.held is None
    assert robot.arm.gripper.opening == 0.0
    assert robot.cup == pytest.approx(before)


@settings(deadline=None, max_examples=20)
@given(x=st.floats(-2, 2), yaw=st.floats(-3, 3), roll=st.floats(-0.3, 0.3), aside=st.floats(-0.01, 0.01))
def test_what_is_held_goes_with_the_tip(x: float, yaw: float, roll: float, aside: float) -> None:
    robot = Carried(reached=(0.0, aside, 0.0))
    robot.reach_and_grip()
    robot.position, robot.rotation = np.array((x, 1.0, 0.4)), Rotation.from_euler("ZYX", (yaw, 0.0, roll))
    tip = robot.position + robot.rotation.apply(np.array(forward(REACH)[:3]) + MOUNT)
    assert robot.cup == pytest.approx(tip + np.array((0.0, aside, 0.0)), abs=1e-9)


def test_let_go_it_falls_onto_the_table_below_or_the_floor() -> None:
    tip = np.array(forward(REACH)[:3]) + MOUNT + (0.0, 0.0, STAND)
    table = Box(float(tip[0]), float(tip[1]), 0.3, 0.3, height=float(tip[2]) - 0.1)
    for obstacles, rests in (((table,), table.height), ((), 0.0)):
        robot = Carried(*obstacles)
        robot.reach_and_grip()
        robot.arm.grip(False)
        assert robot.arm.held is None
        assert robot.cup[2] == pytest.approx(rests + 0.05)
        robot.wait(1.0)
        assert robot.arm.gripper.opening == WIDEST


def test_a_motion_lasts_as_long_as_it_says_and_can_be_braked() -> None:
    robot = Carried()
    seconds = robot.arm.move(REACH)
    robot.wait(seconds / 2)
    halfway = robot.arm.state()
    assert halfway.moving
    assert halfway.progress == pytest.approx(0.5, abs=0.02)
    assert halfway.position == pytest.approx((np.array(STOWED) + REACH) / 2, abs=0.05)
    with pytest.raises(ArmBusy):
        robot.arm.move(STOWED)
    left = robot.arm.stop()
    assert 0.0 < left < seconds
    robot.wait(left + 0.01)
    stopped = robot.arm.state()
    assert not stopped.moving
    assert stopped.velocity.tolist() == [0.0] * 4
    assert robot.arm.stop() == 0.0, "at rest nothing changes"


def test_put_back_it_is_stowed_and_empty_and_all_things_are_where_they_were() -> None:
    robot = Carried()
    before = robot.cup
    robot.reach_and_grip()
    robot.position = np.array((1.0, 1.0, STAND))
    assert np.abs(robot.cup - before).max() > 0.5
    robot.arm.reset()
    assert robot.arm.held is None
    assert robot.cup == pytest.approx(before)
    assert robot.arm.state().position == pytest.approx(STOWED)
    assert robot.arm.gripper.opening == WIDEST


def test_an_impossible_target_is_refused_before_anything_moves() -> None:
    robot = Carried()
    with pytest.raises(ValueError, match="arm_elbow"):
        robot.arm.move((0.0, 0.0, -1.0, 0.0))
    assert not robot.arm.state().moving
    assert dataclasses.is_dataclass(robot.arm.state())
