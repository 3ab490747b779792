"""What every arm promises to its driver node, on the body with forces and on the one without."""

from __future__ import annotations

import numpy as np
import pytest

from robot.geometry.planar import Pose2
from robot.hardware.arm import ArmDevice
from robot.model.arm import STOWED
from robot.scenes.scene import Scene
from robot.sim.kinematic import KinematicBody
from robot.sim.physics import PhysicsBody

EMPTY = Scene("empty", (-5.0, -5.0, 5.0, 5.0), (), Pose2(0.0, 0.0), Pose2(0.0, 0.0))
READY = (0.3, -1.5, 1.8, 0.2)
KINDS = [KinematicBody, PhysicsBody]


def with_arm(kind: type[KinematicBody] | type[PhysicsBody]) -> tuple[KinematicBody | PhysicsBody, ArmDevice]:
    body = kind(EMPTY, seed=1, noise=False, arm=True)
    assert body.arm is not None
    return body, body.arm


@pytest.mark.parametrize("kind", KINDS)
def test_progress_never_falls_and_the_arm_is_there_when_the_time_it_said_is_over(kind: type[PhysicsBody]) -> None:
    body, arm = with_arm(kind)
    assert arm.state().position == pytest.approx(STOWED, abs=0.01)
    duration, progress = arm.move(READY), []
    while body.time < duration:
        body.advance(body.time + 0.05)
        progress.append(arm.state().progress)
    assert progress == sorted(progress)
    assert progress[-1] == 1.0
    assert not arm.state().moving
    assert arm.state().position == pytest.approx(READY, abs=0.02)


@pytest.mark.parametrize("kind", KINDS)
def test_a_cancelled_motion_keeps_its_progress_and_comes_to_rest_in_the_time_it_said(kind: type[PhysicsBody]) -> None:
    body, arm = with_arm(kind)
    body.advance(0.5 * arm.move(READY))
    left, reached = arm.stop(), arm.state().progress
    body.advance(body.time + left + 0.2)
    assert arm.state().progress == reached
    assert 0.2 < reached < 0.9
    assert np.abs(arm.state().velocity).max() < 0.05
    assert arm.stop() == 0.0


@pytest.mark.parametrize("kind", KINDS)
def test_the_gripper_closes_on_nothing_in_a_third_of_a_second_and_opens_again(kind: type[PhysicsBody]) -> None:
    body, arm = with_arm(kind)
    opened = arm.gripper.opening
    arm.grip(True)
    body.advance(0.15)
    assert arm.gripper.closing and arm.gripper.moving
    assert arm.gripper.opening == pytest.approx(opened / 2, abs=0.005)
    body.advance(0.31)
    assert (arm.gripper.opening, arm.gripper.moving, arm.gripper.gripping, arm.held) == (0.0, False, False, None)
    arm.grip(False)
    body.advance(0.65)
    assert arm.gripper.opening == opened
