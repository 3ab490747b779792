"""The robot state publisher tells where links are, as often and in the way that ROS 2's does."""

from __future__ import annotations

from math import cos, sin
from typing import Any

import pytest

from actors import Child, StartFailed, Supervisor
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.sensor_msgs.msg import JointState
from actors.interfaces.std_msgs.msg import Header
from actors.nodes import JOINT_STATES, ROBOT_DESCRIPTION, RobotStatePublisher
from actors.testing import Rig
from actors.tf2 import TF, TF_STATIC, DescriptionError
from actors.time import stamp_of

ARM = """
<robot name="arm">
  <link name="base"/><link name="upper"/><link name="hand"/><link name="left"/><link name="right"/><link name="ball"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/><origin xyz="0 0 1"/><axis xyz="0 0 1"/>
  </joint>
  <joint name="wrist" type="fixed"><parent link="upper"/><child link="hand"/><origin xyz="0.5 0 0"/></joint>
  <joint name="grip" type="prismatic"><parent link="hand"/><child link="left"/><axis xyz="0 1 0"/></joint>
  <joint name="grip_too" type="prismatic">
    <parent link="hand"/><child link="right"/><axis xyz="0 1 0"/><mimic joint="grip" multiplier="-1" offset="0.01"/>
  </joint>
  <joint name="throw" type="floating"><parent link="hand"/><child link="ball"/></joint>
</robot>
"""


def tree(**parameters: Any) -> Supervisor:
    given = {"robot_description": ARM, **parameters}
    return Supervisor("robot", children=[Child(RobotStatePublisher, parameters=given)])


def state(seconds: float, **positions: float) -> JointState:
    stamp = stamp_of(round(seconds * 1e9))
    return JointState(header=Header(stamp=stamp), name=tuple(positions), position=list(positions.values()))


async def test_the_description_and_the_fixed_links_are_latched(rig: Rig) -> None:
    await rig.start(tree())
    described, fixed = rig.probe(ROBOT_DESCRIPTION), rig.probe(TF_STATIC)
    await rig.quiet()
    assert [one.data for one in described] == [ARM]
    ((wrist,),) = [one.transforms for one in fixed]
    assert (wrist.header.frame_id, wrist.child_frame_id, wrist.transform.translation.x) == ("upper", "hand", 0.5)


async def test_each_joint_state_tells_the_links_of_its_joints_and_of_those_that_mimic_them(rig: Rig) -> None:
    await rig.start(tree())
    told = rig.probe(TF)
    rig.publish(JOINT_STATES, state(1.0, shoulder=0.4, grip=0.03, wheel=7.0))
    await rig.quiet()
    ((shoulder, left, right),) = [one.transforms for one in told]
    assert (shoulder.header.frame_id, shoulder.child_frame_id) == ("base", "upper")
    assert shoulder.header.stamp == Time(sec=1)
    rotation = shoulder.transform.rotation
    assert (rotation.w, rotation.z) == pytest.approx((cos(0.2), sin(0.2)))
    assert left.transform.translation.y == pytest.approx(0.03)
    assert (right.child_frame_id, right.transform.translation.y) == ("right", pytest.approx(-0.02))


async def test_a_joint_is_told_as_often_as_the_parameter_says_and_again_after_a_jump_back(rig: Rig) -> None:
    await rig.start(tree(publish_frequency=10.0))
    told = rig.probe(TF)
    for seconds in (1.0, 1.05, 1.1, 1.1, 1.15, 1.21, 0.5):
        rig.publish(JOINT_STATES, state(seconds, shoulder=0.0))
    await rig.quiet()
    stamps = [one.transforms[0].header.stamp for one in told]
    assert [stamp.sec + 1e-9 * stamp.nanosec for stamp in stamps] == pytest.approx([1.0, 1.1, 1.21, 0.5])


async def test_unstamped_states_and_those_whose_stamps_are_ignored_are_all_told(rig: Rig) -> None:
    await rig.start(tree(publish_frequency=0.0, ignore_timestamp=True))
    told = rig.probe(TF)
    for _ in range(3):
        rig.publish(JOINT_STATES, state(1.0, shoulder=0.0))
    await rig.quiet()
    assert len(told) == 3


async def test_without_a_frequency_every_later_state_is_told(rig: Rig) -> None:
    await rig.start(tree(publish_frequency=0.0))
    told = rig.probe(TF)
    for seconds in (1.0, 1.0, 1.000001):
        rig.publish(JOINT_STATES, state(seconds, shoulder=0.0))
    await rig.quiet()
    assert len(told) == 2


async def test_a_prefix_stands_before_every_frame(rig: Rig) -> None:
    await rig.start(tree(frame_prefix="left_arm/"))
    told, fixed = rig.probe(TF), rig.probe(TF_STATIC)
    rig.publish(JOINT_STATES, state(1.0, grip=0.0))
    await rig.quiet()
    frames = {
        name
        for message in (*told, *fixed)
        for one in message.transforms
        for name in (one.header.frame_id, one.child_frame_id)
    }
    assert frames == {f"left_arm/{link}" for link in ("upper", "hand", "left", "right")}


async def test_states_that_do_not_fit_are_left_out_and_said(rig: Rig) -> None:
    system = await rig.start(tree())
    told = rig.probe(TF)
    rig.publish(JOINT_STATES, JointState(name=("shoulder",), position=[]))
    rig.publish(JOINT_STATES, state(1.0, wheel=1.0))  # no joint of this robot
    rig.publish(JOINT_STATES, JointState())
    await rig.quiet()
    assert len(told) == 0
    lines = [(one.event, one.fields["names"]) for one in system.records if one.node == "/robot_state_publisher"]
    assert lines == [("joint states have as many names as positions", 1)]


@pytest.mark.parametrize(
    ("text", "why"), [("", "give it the text of a URDF by the parameter robot_description"), ("no", "no XML")]
)
async def test_a_start_without_a_description_fails_with_the_remedy(rig: Rig, text: str, why: str) -> None:
    rig.expect_failure(DescriptionError)
    with pytest.raises(StartFailed, match=why):
        await rig.start(tree(robot_description=text))
