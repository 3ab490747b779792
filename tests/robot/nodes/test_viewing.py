"""What the robot publishes for viewers: its description, where its links are, markers, compressed pictures and diagnostics."""

from __future__ import annotations

from collections.abc import AsyncIterator
from math import sin

import pytest

from actors import Child, Supervisor
from actors.interfaces.diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from actors.interfaces.geometry_msgs.msg import Pose, PoseStamped
from actors.interfaces.nav_msgs.msg import Path
from actors.interfaces.sensor_msgs.msg import JointState, LaserScan
from actors.interfaces.std_srvs.srv import Trigger
from actors.interfaces.visualization_msgs.msg import Marker
from actors.testing import Rig
from actors.tf2 import Transform
from actors.tf2.broadcasters import TF, TF_STATIC
from robot import Robot
from robot.contracts import (
    BATTERY_STATUS,
    CAMERA_RGB,
    CONTACTS,
    DIAGNOSTICS,
    GAIT_STATUS,
    JOINT_STATES,
    MARKERS,
    PATH,
    ROBOT_DESCRIPTION,
    SAFETY_STATE,
    SCAN,
    STAND,
)
from robot.interfaces.robactor_msgs.msg import BatteryStatus, FootContacts, GaitStatus, SafetyState
from robot.model.kinematics import feet
from robot.nodes.compressed import compressed_topic
from robot.nodes.diagnostics import Diagnostics
from robot.nodes.markers import Markers
from robot.nodes.robot_state_publisher import RobotStatePublisher
from robot.urdf import write_urdf
from tests.robot.stage import Eyes, robot

LEGS = ("fl", "fr", "rl", "rr")


async def test_late_comers_get_the_description_and_find_the_feet_where_the_legs_kinematics_puts_them(rig: Rig) -> None:
    await rig.start(robot())
    await rig.advance(1.0)
    await rig.call(STAND, Trigger.Request())
    await rig.system.join(Child(Eyes))
    await rig.advance(2.0)
    described, states = rig.probe(ROBOT_DESCRIPTION), rig.probe(JOINT_STATES)
    await rig.advance(0.1)

    assert described.last is not None
    assert described.last.data == write_urdf()
    tf = rig.node(Eyes).tf
    stamp = tf.get_latest_common_time("base_link", "fl_foot").to_msg()
    state = next(one for one in states if one.header.stamp == stamp)
    for leg, foot in zip(LEGS, feet(state.position), strict=True):
        there = Transform.from_msg(tf.lookup_transform("base_link", f"{leg}_foot", stamp))
        assert there.translation == pytest.approx(foot.tolist(), abs=1e-9)


async def test_links_are_told_twenty_times_a_second_and_only_while_somebody_listens(rig: Rig) -> None:
    await rig.start(robot())
    await rig.advance(1.0)
    topic = rig.system.snapshot().topics
    assert not [
        edge for one in topic if one.name == "/joint_states" for edge in one.subscriptions if "state_pub" in edge.node
    ]

    told = rig.probe(TF)
    await rig.advance(2.0)

    links = [message for message in told if len(message.transforms) == 12]
    assert len(links) == pytest.approx(40, abs=1)
    assert {one.child_frame_id for one in links[0].transforms} == {
        f"{leg}_{link}" for leg in LEGS for link in ("hip", "thigh", "calf")
    }


async def test_the_arms_links_move_with_the_arm_and_a_joint_that_is_not_described_is_left_out(rig: Rig) -> None:
    with_arm = Robot("kitchen", body="kinematic", arm=True)
    await rig.start(with_arm.tree)
    told, fixed = rig.probe(TF), rig.probe(TF_STATIC)
    await rig.advance(1.0)
    links = {one.child_frame_id for message in told for one in message.transforms}
    assert {"arm_turret", "arm_upper", "arm_fore", "arm_hand", "fl_calf"} <= links
    assert {"arm_tool", "rr_foot"} <= {one.child_frame_id for message in fixed for one in message.transforms}


async def test_a_joint_that_is_not_described_is_left_out(rig: Rig) -> None:
    await rig.start(Supervisor("viewing", children=[Child(RobotStatePublisher, args=(write_urdf(),))]))
    told = rig.probe(TF)
    await rig.advance(0.1)
    rig.publish(JOINT_STATES, JointState(name=("wheel", "fl_knee"), position=[1.0, -2.0]))
    await rig.advance(0.1)
    (knee,) = told[-1].transforms
    assert (knee.header.frame_id, knee.child_frame_id) == ("fl_thigh", "fl_calf")
    assert knee.transform.rotation.y == pytest.approx(-sin(1.0))


async def test_pictures_come_compressed_ten_times_a_second_while_somebody_wants_them(rig: Rig) -> None:
    await rig.start(robot())
    pictures = rig.probe(compressed_topic(CAMERA_RGB))
    await rig.advance(2.0)
    assert len(pictures) == pytest.approx(20, abs=2)
    assert pictures[0].format == "rgb8; jpeg compressed bgr8"
    assert bytes(pictures[0].data[:3]) == b"\xff\xd8\xff"


async def test_markers_show_which_feet_stand_and_where_the_robot_is_going(rig: Rig) -> None:
    await rig.start(Supervisor("viewing", children=[Child(Markers)]))
    shown = rig.probe(MARKERS)
    poses = tuple(
        PoseStamped(pose=Pose().replace(position=Pose().position.replace(x=x, z=0.4))) for x in (0.0, 1.0, 2.0)
    )
    rig.publish(PATH, Path(poses=poses))
    async for _ in ticks(rig, 40):
        rig.publish(CONTACTS, FootContacts(contact=[True, False, False, True]))

    assert 4 <= len(shown) <= 6
    markers = {(one.ns, one.id): one for one in shown[-1].markers}
    colors = [markers["feet", number].color for number in range(4)]
    assert colors[0] == colors[3] != colors[1] == colors[2]
    assert markers["feet", 1].header.frame_id == "fr_foot"
    assert [(point.x, point.z) for point in markers["path", 0].points] == [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)]
    assert markers["goal", 0].pose.position.x == 2.0

    rig.publish(PATH, Path())
    async for _ in ticks(rig, 20):
        rig.publish(CONTACTS, FootContacts(contact=[True] * 4))
    gone = {(one.ns, one.id): one.action for one in shown[-1].markers}
    assert gone["path", 0] == gone["goal", 0] == Marker.DELETE


async def ticks(rig: Rig, count: int) -> AsyncIterator[int]:
    for number in range(count):
        yield number
        await rig.advance(0.025)


def levels(report: DiagnosticArray) -> dict[str, int]:
    return {status.name.removeprefix("robot: "): status.level for status in report.status}


OK, WARN, ERROR, STALE = range(4)
assert (DiagnosticStatus.OK, DiagnosticStatus.STALE) == (OK, STALE)


async def test_a_healthy_robot_reports_that_all_is_well_once_a_second(rig: Rig) -> None:
    await rig.start(robot())
    reports = rig.probe(DIAGNOSTICS)
    await rig.advance(5.0)
    assert len(reports) == 5
    assert set(levels(reports[-1]).values()) == {OK}
    assert set(levels(reports[-1])) == {
        "battery", "motors", "real time", "gait", "safety", "rate of /odom", "rate of /pose", "rate of /lidar/scan",
    }  # fmt: skip


async def test_what_was_never_heard_is_stale_and_what_goes_wrong_has_its_level_and_its_reason(rig: Rig) -> None:
    await rig.start(Supervisor("viewing", children=[Child(Diagnostics)]))
    reports = rig.probe(DIAGNOSTICS)
    await rig.advance(1.0)
    assert set(levels(reports[-1]).values()) == {STALE}

    rig.publish(BATTERY_STATUS, BatteryStatus(level="low", percent=19.6, charging=True))
    rig.publish(GAIT_STATUS, GaitStatus(mode="sit", sensors_ok=False))
    rig.publish(SAFETY_STATE, SafetyState(stopped=True, reasons=("tilt", "battery")))
    await rig.advance(1.0)

    found = {status.name.removeprefix("robot: "): (status.level, status.message) for status in reports[-1].status}
    assert found["battery"] == (WARN, "low, 20 %, charging")
    assert found["gait"] == (ERROR, "IMU or encoders are silent")
    assert found["safety"] == (ERROR, "tilt; battery")


async def test_a_topic_that_grows_thin_is_warned_of_and_one_that_falls_silent_is_an_error(rig: Rig) -> None:
    await rig.start(Supervisor("viewing", children=[Child(Diagnostics)]))
    reports = rig.probe(DIAGNOSTICS)
    seen: list[tuple[int, str]] = []
    for count in (10, 7, 0):
        for _ in range(count):
            rig.publish(SCAN, LaserScan())
            await rig.advance(0.05)
        await rig.advance(1.0 - 0.05 * count)
        (scans,) = (status for status in reports[-1].status if status.name.endswith("rate of /lidar/scan"))
        seen.append((scans.level, scans.message))
    assert seen == [(OK, "10 Hz"), (WARN, "7 Hz"), (ERROR, "silent")]
