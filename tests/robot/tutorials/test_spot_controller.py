"""The joints of a quadruped (Y-34), the inertial sensor (Y-31), and both with the voice (X-18)."""

from __future__ import annotations

import statistics
from collections.abc import Iterable
from itertools import pairwise
from math import cos, nan, sin

import pytest

from actors import Child, Service
from actors.interfaces.geometry_msgs.msg import Quaternion, Twist, Vector3
from actors.interfaces.sensor_msgs.msg import Imu, JointState
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import SetBool, Trigger, Trigger_Request, Trigger_Response
from actors.testing import Rig
from robot.contracts import CMD_VEL as DRIVEN
from robot.contracts import ENABLE, VOICE
from robot.tutorials import imu_publisher, spot_by_voice
from robot.tutorials.spot_controller import (
    CMD_VEL,
    IMU,
    JOINT_STATES,
    SIT,
    STAND,
    WALK,
    SpotController,
    tilt_of,
    tree,
    trot,
)
from tests.robot.stage import said, twist, warnings

LEGS = ("fl", "fr", "rl", "rr")
NAMES = [f"{leg}_{joint}" for leg in LEGS for joint in ("hip", "shoulder", "knee")]
SITTING = [0.0, -1.2, 2.4] * 4


async def ask(rig: Rig, service: Service[Trigger_Request, Trigger_Response]) -> str:
    reply = await rig.call(service, Trigger.Request())
    assert reply.success
    return reply.message


async def walking(rig: Rig) -> None:
    """Start, stand up, and walk."""
    await rig.start(SpotController)
    await ask(rig, STAND)
    await rig.advance(2.0)
    await ask(rig, WALK)


def tilted(roll: float = 0.0, pitch: float = 0.0) -> Imu:
    cr, sr, cp, sp = cos(roll / 2), sin(roll / 2), cos(pitch / 2), sin(pitch / 2)
    return Imu(orientation=Quaternion(x=sr * cp, y=cr * sp, z=-sr * sp, w=cr * cp))


def positions(states: Iterable[JointState]) -> dict[str, list[float]]:
    """Name of each joint -> where it was."""
    return {name: [float(state.position[k]) for state in states] for k, name in enumerate(NAMES)}


def cycles(values: list[float], seconds: float = 5.0) -> float:
    """How often a sine swings in so many seconds, from its first to its last way up through zero."""
    ups = [k - b / (b - a) for k, (a, b) in enumerate(pairwise(values), start=1) if a <= 0.0 < b]
    return (len(ups) - 1) / ((ups[-1] - ups[0]) / 100.0) * seconds


async def test_it_sits_at_first_and_publishes_twelve_joints_a_hundred_times_a_second(rig: Rig) -> None:
    await rig.start(tree())
    states = rig.probe(JOINT_STATES)
    await rig.advance(5.0)
    assert len(states) == 500
    assert all(list(state.name) == NAMES and state.position.tolist() == SITTING for state in states)


async def test_stand_sit_and_walk_say_what_they_do(rig: Rig) -> None:
    await rig.start(SpotController)
    spot = rig.node(SpotController)
    for service, text, mode in (
        (STAND, "Robot is now standing", "stand"),
        (WALK, "Robot is now walking", "walk"),
        (SIT, "Robot is now sitting", "sit"),
    ):
        assert await ask(rig, service) == text
        assert spot.mode == mode


@pytest.mark.parametrize("speed", [None, 1.0])
async def test_five_seconds_of_walk_are_ten_cycles_of_a_trot(rig: Rig, speed: float | None) -> None:
    await walking(rig)
    states = rig.probe(JOINT_STATES)
    for _ in range(50):
        if speed is not None:
            rig.publish(CMD_VEL, twist(speed))
        await rig.advance(0.1)
    assert len(states) == 500
    joint = positions(states)
    for values in joint.values():
        assert max(map(abs, values)) <= 0.3
        assert cycles(values) == pytest.approx(10.0, abs=0.2)
    for part in ("hip", "shoulder", "knee"):
        fl, fr, rl, rr = (joint[f"{leg}_{part}"] for leg in LEGS)
        assert fl == rr
        assert fr == rl == [-value for value in fl]
    assert max(joint["fl_knee"]) == pytest.approx(0.3, abs=1e-3)


async def test_cmd_vel_counts_in_walk_mode_only(rig: Rig) -> None:
    await rig.start(SpotController)
    rig.publish(CMD_VEL, twist(1.0))
    await rig.quiet()
    assert warnings(rig, "spot_controller") == ["Not in walk mode, ignoring cmd_vel"]
    await ask(rig, STAND)
    await rig.advance(2.0)
    await ask(rig, WALK)
    assert rig.node(SpotController).velocity == Vector3()


async def test_the_velocity_changes_the_gait_and_zero_is_stepping_in_place(rig: Rig) -> None:
    await walking(rig)
    states = rig.probe(JOINT_STATES)

    async def half_a_second_of(command: Twist) -> dict[str, list[float]]:
        rig.publish(CMD_VEL, command)
        await rig.advance(0.2)
        states.clear()
        rig.publish(CMD_VEL, command)
        await rig.advance(0.5)
        return {name: [max(values) - min(values), *values] for name, values in positions(states).items()}

    still, ahead, left = (
        await half_a_second_of(twist()),
        await half_a_second_of(twist(1.0)),
        await half_a_second_of(twist(wz=1.0)),
    )
    assert still["fl_shoulder"][0] == pytest.approx(0.3, abs=0.01)  # lifted only
    assert ahead["fl_shoulder"][0] > still["fl_shoulder"][0] + 0.1
    assert left["fl_shoulder"][1:] != left["rr_shoulder"][1:]  # turning: the two of a pair differ
    assert still["fl_knee"][0] == pytest.approx(ahead["fl_knee"][0], abs=0.01)


async def test_a_velocity_is_forgotten_after_half_a_second_and_when_the_walk_ends(rig: Rig) -> None:
    await walking(rig)
    spot = rig.node(SpotController)
    rig.publish(CMD_VEL, twist(1.0))
    await rig.advance(0.4)
    assert spot.velocity.x == 1.0
    await rig.advance(0.2)
    assert spot.velocity.x == 0.0
    rig.publish(CMD_VEL, twist(1.0))
    await rig.quiet()
    await ask(rig, STAND)
    await ask(rig, WALK)
    assert spot.velocity.x == 0.0


async def test_a_velocity_that_is_not_a_number_is_dropped(rig: Rig) -> None:
    await walking(rig)
    rig.publish(CMD_VEL, twist(nan))
    await rig.advance(0.1)
    assert rig.node(SpotController).velocity == Vector3()
    assert "cmd_vel is not a number, ignoring it" in warnings(rig, "spot_controller")


@pytest.mark.parametrize(("joint", "tilt"), [(0, "roll"), (1, "pitch")])
async def test_standing_leans_against_the_tilt(rig: Rig, joint: int, tilt: str) -> None:
    await rig.start(SpotController)
    await ask(rig, STAND)
    leans = []
    for angle in (0.1, -0.1):
        for _ in range(20):
            rig.publish(IMU, tilted(**{tilt: angle}))
            await rig.advance(0.1)
        leans.append([rig.node(SpotController).angles[k] for k in range(12)])
    one, other = leans
    assert one[joint::3] == pytest.approx([-0.05] * 4)
    assert other[joint::3] == pytest.approx([0.05] * 4)
    assert one[1 - joint :: 3] == pytest.approx([0.0] * 4)


def test_a_sensor_without_orientation_still_feels_gravity() -> None:
    force = Vector3(x=-9.81 * sin(0.1), y=0.0, z=9.81 * cos(0.1))
    assert tilt_of(Imu(orientation_covariance=[-1.0] + [0.0] * 8, linear_acceleration=force)) == pytest.approx(
        (0.0, 0.1)
    )
    assert tilt_of(tilted(0.2, -0.1)) == pytest.approx((0.2, -0.1))


async def test_without_an_imu_it_stands_neutrally_and_warns_once(rig: Rig) -> None:
    await rig.start(SpotController)
    await ask(rig, STAND)
    await rig.advance(5.0)
    assert rig.node(SpotController).angles == (0.0,) * 12
    assert warnings(rig, "spot_controller") == ["No IMU data, standing in the neutral pose"]
    rig.publish(IMU, tilted(roll=0.2))
    await rig.advance(0.1)
    assert rig.node(SpotController).angles[0] == pytest.approx(-0.1)


async def test_sitting_down_and_standing_up_are_motions_not_jumps(rig: Rig) -> None:
    await rig.start(SpotController)
    states = rig.probe(JOINT_STATES)
    for service in (STAND, SIT, STAND, WALK, SIT):
        await ask(rig, service)
        await rig.advance(1.0)
    for values in positions(states).values():
        assert max(abs(b - a) for a, b in pairwise(values)) <= 0.04 + 1e-9  # 4 rad/s
    assert rig.node(SpotController).angles == pytest.approx(SITTING)


def test_no_angle_exceeds_the_amplitude_at_any_velocity() -> None:
    for k in range(100):
        assert max(map(abs, trot(k / 100, 3.0, -3.0, 5.0))) <= 0.3 + 1e-12


# -- the inertial sensor ----------------------------------------------------------------------------------------------------


async def test_two_hundred_readings_a_second_with_the_noise_that_was_asked_for(rig: Rig) -> None:
    await rig.start(imu_publisher.tree())
    data = rig.probe(imu_publisher.IMU)
    await rig.advance(10.0)
    assert len(data) == 2000
    assert said(rig, "imu_publisher") == ["IMU Publisher started @ 200 Hz"]
    accelerations = [reading.linear_acceleration for reading in data]
    turns = [reading.angular_velocity for reading in data]
    assert statistics.mean(a.z for a in accelerations) == pytest.approx(9.81, abs=0.002)
    for noise, deviation in (
        ([a.x for a in accelerations], 0.01),
        ([a.y for a in accelerations], 0.01),
        ([a.z - 9.81 for a in accelerations], 0.01),
        ([w.x for w in turns], 0.001),
        ([w.y for w in turns], 0.001),
        ([w.z for w in turns], 0.001),
    ):
        assert statistics.stdev(noise) == pytest.approx(deviation, rel=0.1)
        assert statistics.mean(noise) == pytest.approx(0.0, abs=deviation / 5)
    last = data[-1]
    assert last.header.frame_id == "imu_link"
    assert last.orientation == Quaternion(x=0.0, y=0.0, z=0.0, w=1.0)
    assert (last.header.stamp.sec, last.header.stamp.nanosec) == (10, 0)


@pytest.mark.parametrize("rate", [100.0, 200.0])
async def test_its_rate_is_a_parameter(rig: Rig, rate: float) -> None:
    await rig.start(Child(imu_publisher.ImuPublisher, parameters={"rate": rate}))
    data = rig.probe(imu_publisher.IMU)
    await rig.advance(10.0)
    assert len(data) == pytest.approx(10.0 * rate, rel=0.02)
    assert said(rig, "imu_publisher") == [f"IMU Publisher started @ {rate:g} Hz"]


# -- all together -----------------------------------------------------------------------------------------------------------


async def test_the_gait_obeys_the_voice(rig: Rig) -> None:
    await rig.start(spot_by_voice.tree())
    spot = rig.node(SpotController)
    commands = rig.probe(DRIVEN)
    assert (await rig.call(ENABLE, SetBool.Request(data=True))).message == "Robot enabled successfully"
    await ask(rig, STAND)
    await rig.advance(1.0)
    await ask(rig, WALK)
    assert not warnings(rig, "spot_controller")  # it has felt the IMU
    for word, vx in (("frente", 1.0), ("parar", 0.0), ("frente", 1.0)):
        rig.publish(VOICE, String(data=word))
        await rig.advance(0.1)
        assert commands.last == twist(vx)
        assert spot.velocity.x == vx
    begun = rig.now
    assert (await rig.call(ENABLE, SetBool.Request(data=False))).message == "Robot disabled, stopping motors"
    await rig.quiet()
    assert commands.last == twist()
    assert spot.velocity.x == 0.0
    assert rig.now - begun <= 0.1
