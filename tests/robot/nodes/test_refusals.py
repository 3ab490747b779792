"""What a goal says when the rest of the robot refuses or fails: docking and walking on a gait that does not do its part."""

from __future__ import annotations

import math
import re

import pytest

from actors import Child, Done, GoalAborted, Node, Steps
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.std_srvs.srv import Trigger_Request, Trigger_Response
from actors.testing import Rig
from robot.contracts import AUTONOMY_CMD, DOCK, GAIT_STATUS, NAVIGATE_TO_POSE, POSE, SAFETY_STATE, STAND, UNDOCK, WALK
from robot.geometry.messages import pose_stamped
from robot.geometry.planar import Pose2
from robot.interfaces.nav2_msgs.action import (
    NavigateToPose,
    NavigateToPose_Feedback,
    NavigateToPose_Goal,
    NavigateToPose_Result,
)
from robot.interfaces.robactor_msgs.action import Dock
from robot.interfaces.robactor_msgs.msg import GaitStatus, SafetyState
from robot.nodes.docking import Docking
from robot.nodes.navigation import Navigation
from robot.planning.errors import ErrorCode
from robot.planning.grid import Grid
from robot.scenes.scene import Box
from tests.robot.stage import floor, to_place, warnings

ORIGIN = Pose2(0.0, 0.0)


class Unwilling(Node):
    """A gait that answers every request, and stays as it is."""

    answer = Trigger_Response(success=True)

    @WALK.serve()
    async def walk(self, request: Trigger_Request) -> Trigger_Response:
        return self.answer

    @STAND.serve()
    async def stand(self, request: Trigger_Request) -> Trigger_Response:
        return self.answer


class Refusing(Unwilling):
    answer = Trigger_Response(success=False, message="no IMU: refusing to walk")


class There(Node):
    """Navigation to where the robot is already."""

    @NAVIGATE_TO_POSE.serve()
    async def navigate(self, goal: NavigateToPose_Goal) -> Steps[NavigateToPose_Feedback, NavigateToPose_Result]:
        yield Done(NavigateToPose.Result())


def tell(rig: Rig, mode: str = "stand") -> None:
    rig.publish(POSE, pose_stamped(ORIGIN, Time()))
    rig.publish(GAIT_STATUS, GaitStatus(mode=mode, goal=mode))


@pytest.mark.parametrize(
    ("gait", "words"),
    [
        (Refusing, "not reached: no IMU: refusing to walk"),
        (Unwilling, "not reached: the robot does not walk"),
        (Node, r"not reached: .*/spot/walk"),
    ],
)
async def test_docking_says_why_the_robot_did_not_walk_onto_the_dock(rig: Rig, gait: type[Node], words: str) -> None:
    await rig.start(There, Child(gait, name="gait"), Child(Docking, args=(ORIGIN, False)))
    tell(rig)
    await rig.quiet()
    commands = rig.probe(AUTONOMY_CMD)
    with pytest.raises(GoalAborted, match=words) as failed:
        await (await rig.send_goal(DOCK, Dock.Goal()))
    assert failed.value.result.outcome == "not reached"
    assert all(message.linear.x == 0.0 for message in commands)


async def test_leaving_the_dock_says_why_the_robot_did_not_stand_up(rig: Rig) -> None:
    await rig.start(Child(Refusing, name="gait"), Child(Docking, args=(ORIGIN, False)))
    tell(rig, "sit")
    await rig.quiet()
    with pytest.raises(GoalAborted, match="not reached: no IMU: refusing to walk"):
        await (await rig.send_goal(UNDOCK, Dock.Goal()))


async def test_a_safety_stop_ends_docking_with_its_reasons(rig: Rig) -> None:
    await rig.start(There, Child(Unwilling, name="gait"), Child(Docking, args=(Pose2(1.0, 0.0), False)))
    tell(rig, "walk")
    await rig.quiet()
    commands = rig.probe(AUTONOMY_CMD)
    going = await rig.send_goal(DOCK, Dock.Goal())
    await rig.until(lambda: len(commands) > 0 and commands[-1].linear.x > 0.0)
    rig.publish(SAFETY_STATE, SafetyState(stopped=True, reasons=("emergency stop requested",)))
    with pytest.raises(GoalAborted, match="not reached: safety stop: emergency stop requested"):
        await going
    await rig.quiet()
    assert commands[-1].linear.x == 0.0


@pytest.mark.parametrize(
    ("gait", "words"),
    [
        (Refusing, "no IMU: refusing to walk"),
        (Unwilling, "the robot is not walking 10 s after it was asked to: its gait is 'stand'"),
    ],
)
async def test_a_walk_says_why_it_did_not_begin(rig: Rig, gait: type[Node], words: str) -> None:
    world = floor(half=5.0)
    await rig.start(Child(gait, name="gait"), Child(Navigation, args=(Grid.from_scene(world),)))
    tell(rig)
    await rig.quiet()
    going = await rig.send_goal(NAVIGATE_TO_POSE, to_place(2.0, 0.0))
    with pytest.raises(GoalAborted, match=words):
        await going


async def test_a_goal_whose_outline_is_in_a_wall_is_refused_at_once_with_the_nearest_place_that_is_free(
    rig: Rig,
) -> None:
    world = floor(Box(2.0, 0.0, 0.2, 4.0), half=5.0)
    await rig.start(Child(Unwilling, name="gait"), Child(Navigation, args=(Grid.from_scene(world),)))
    tell(rig)
    await rig.quiet()
    for x, yaw in ((1.5, 0.0), (2.0, 0.0), (1.65, 1.57)):  # the nose in it, in its middle, a side too near
        asked = rig.now
        with pytest.raises(GoalAborted, match=r"GoalBlocked: .*; the nearest place where it fits is \(") as refused:
            await (await rig.send_goal(NAVIGATE_TO_POSE, to_place(x, 0.0, yaw)))
        assert rig.now == asked
        assert ErrorCode.of(refused.value.result) == ErrorCode.GOAL_OCCUPIED
        there = re.search(r"fits is \((\S+), (\S+), yaw (\S+)\)", refused.value.reason)
        assert there is not None
        free = Pose2(*(float(word) for word in there.groups()))
        assert math.hypot(free.x - x, free.y) < 1.2
        accepted = await rig.send_goal(NAVIGATE_TO_POSE, to_place(free.x, free.y, free.yaw))
        await rig.advance(0.5)
        assert not accepted.done
        await accepted.cancel()
    assert warnings(rig, "navigation") == []
