"""The robot's own gait node (X-08b, F-07, S-34): modes by service, gaits by parameter, commands that end, sensors that fail."""

from __future__ import annotations

from copy import deepcopy
from functools import cache

import numpy as np
import pytest

from actors import Child, Node, Supervisor, every, publishes
from actors.interfaces.geometry_msgs.msg import Vector3
from actors.interfaces.sensor_msgs.msg import Imu, JointState
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.std_srvs.srv import Trigger
from actors.testing import Rig
from robot import Robot
from robot.contracts import (
    CMD_VEL,
    CONTACTS,
    GAIT_STATUS,
    IMU_RAW,
    JOINT_STATES,
    MOTOR_TARGETS,
    ODOMETRY,
    SAFETY_STATE,
    SIT,
    STAND,
    WALK,
)
from robot.control.gait_controller import GaitController
from robot.geometry.vectors import Vector
from robot.hardware.body import JOINT_NAMES, ImuSample, JointSample
from robot.interfaces.robactor_msgs.msg import FootContacts, GaitStatus, SafetyState
from robot.model.legs import leg_state
from robot.model.parameters import GRAVITY
from robot.nodes.gait import Gait
from robot.run.tree_nodes import nodes_of, only
from robot.sim.physics import PhysicsBody
from robot.sim.simulation import Simulation
from robot.testing import FLAT
from tests.robot.stage import floor, said, twist

DELAY = 0.008


class Senses(Node):
    """IMU, contacts and encoders at 200 Hz, each of which can be silenced; those of the encoders can be kept."""

    imu = publishes(IMU_RAW)
    contacts = publishes(CONTACTS)
    joints = publishes(JOINT_STATES)

    def __init__(self, body: Simulation) -> None:
        self._body = body
        self.silent: set[str] = set()
        self.kept: list[JointState] | None = None

    @every(hz=200)
    def read(self) -> None:
        self._body.advance(self.clock.now())
        stamp, imu, joints = self.clock.stamp(), self._body.imu(), self._body.joints()
        turn, force = (Vector3(x=x, y=y, z=z) for x, y, z in (imu.gyro.tolist(), imu.accel.tolist()))
        header = Header(stamp=stamp)
        if "imu" not in self.silent:
            self.imu(Imu(header=header, angular_velocity=turn, linear_acceleration=force))
        if "contacts" not in self.silent:
            self.contacts(FootContacts(stamp=stamp, contact=joints.contact))
        if "joints" not in self.silent:
            sample = JointState(
                header=header,
                name=JOINT_NAMES,
                position=joints.position,
                velocity=joints.velocity,
                effort=joints.effort,
            )
            (self.joints if self.kept is None else self.kept.append)(sample)


class Stage:
    """Body, motors, senses and gait; nobody else."""

    def __init__(self, rig: Rig, robot: Robot) -> None:
        self.rig, self.robot, self.body = rig, robot, robot.body

    async def begin(self) -> None:
        motors, gait = nodes_of(only(self.robot.tree, ["motors", "gait"]))
        await self.rig.start(Supervisor("legs", children=[motors, Child(Senses, args=(self.body,)), gait]))
        self.status = self.rig.probe(GAIT_STATUS)
        self.odometry = self.rig.probe(ODOMETRY)
        await self.rig.advance(0.15)

    @property
    def silent(self) -> set[str]:
        return self.rig.node(Senses).silent

    def now(self) -> GaitStatus:
        status = self.status.last
        assert status is not None
        return status

    async def stand(self) -> None:
        await self.rig.call(STAND, Trigger.Request())
        await self.rig.until(lambda: self.now().mode == "stand", within=6.0, step=0.05)

    async def walk(self, seconds: float, vx: float = 0.0, wz: float = 0.0) -> None:
        """Walk at a velocity that is repeated five times a second."""
        if self.now().goal != "walk":
            assert (await self.rig.call(WALK, Trigger.Request())).success
        for _ in range(round(seconds / 0.2)):
            self.rig.publish(CMD_VEL, twist(vx, wz=wz))
            await self.rig.advance(0.2)

    async def speed(self, seconds: float) -> tuple[float, float]:
        """Mean forward and turning speed by odometry from now on."""
        self.odometry.clear()
        await self.rig.advance(seconds)
        twists = [message.twist.twist for message in self.odometry]
        return (
            float(np.mean([twist.linear.x for twist in twists])),
            float(np.mean([twist.angular.z for twist in twists])),
        )


@pytest.fixture
async def physics(rig: Rig) -> Stage:
    stage = Stage(rig, Robot(floor(), seed=1, motor_delay=DELAY))
    await stage.begin()
    return stage


@pytest.fixture
async def kinematic(rig: Rig) -> Stage:
    stage = Stage(rig, Robot(floor(), body="kinematic", seed=1, motor_delay=0.0))
    await stage.begin()
    return stage


# -- modes and commands ---------------------------------------------------------------------------------------------------------


async def test_s_34_sit_and_stand_answer_in_the_tutorials_words_when_they_are_true(rig: Rig, kinematic: Stage) -> None:
    await rig.advance(0.3)
    for service, mode, begun, done in (
        (STAND, "stand", "Robot is standing up", "Robot is now standing"),
        (SIT, "sit", "Robot is sitting down", "Robot is now sitting"),
    ):
        begins = await rig.call(service, Trigger.Request())
        assert (begins.success, begins.message) == (True, begun)
        await rig.until(lambda mode=mode: kinematic.now().mode == mode, within=6.0)  # type: ignore[misc]
        there = await rig.call(service, Trigger.Request())
        assert (there.success, there.message) == (True, done)


async def test_a_robot_on_its_back_says_so_and_does_not_try_to_rise(rig: Rig, physics: Stage) -> None:
    await physics.stand()
    physics.body.push((0.0, 110.0, 0.0))
    await rig.advance(3.0)
    assert physics.body.truth().fallen
    for service in (STAND, WALK, SIT):
        reply = await rig.call(service, Trigger.Request())
        assert not reply.success
        assert "lies on its side or back" in reply.message and "turn it onto its belly" in reply.message
    await rig.advance(0.5)
    assert physics.now().mode in ("sit", "lowering")


async def test_a_stopped_robot_does_not_rise_and_says_what_ends_the_stop(rig: Rig, physics: Stage) -> None:
    rig.publish(SAFETY_STATE, SafetyState(stopped=True, reasons=("emergency stop requested",)))
    await rig.advance(0.3)
    low = float(physics.body.truth().position[2])
    for service in (STAND, WALK):
        reply = await rig.call(service, Trigger.Request())
        assert not reply.success
        assert "emergency stop requested" in reply.message and "/emergency_stop with data false" in reply.message
        await rig.advance(0.5)
        assert physics.body.truth().position[2] == pytest.approx(low, abs=0.01)
    rig.publish(SAFETY_STATE, SafetyState())
    await rig.quiet()
    assert (await rig.call(STAND, Trigger.Request())).success
    await rig.advance(1.0)
    rig.publish(SAFETY_STATE, SafetyState(stopped=True, reasons=("emergency stop requested",)))
    await rig.until(lambda: physics.now().mode == "sit", within=4.0, step=0.05)


async def test_x_08b_the_walk_service_reaches_walk_from_sitting(rig: Rig, physics: Stage) -> None:
    walked = await rig.call(WALK, Trigger.Request())
    assert (walked.success, walked.message) == (True, "Robot begins to walk")
    await rig.until(lambda: physics.now().mode == "walk", within=4.0, step=0.05)
    await rig.advance(1.0)
    assert physics.now().mode == "walk"
    x, y, _ = physics.body.truth().position.tolist()
    assert abs(x) + abs(y) < 0.1, "zero velocity is stepping in place"
    assert not physics.body.truth().fallen


async def test_x_08b_changing_cmd_vel_changes_the_gait(rig: Rig, physics: Stage) -> None:
    await physics.stand()
    targets = rig.probe(MOTOR_TARGETS)
    strides: list[float] = []
    for vx in (0.2, 0.8):
        await physics.walk(1.6, vx)
        targets.clear()
        await physics.walk(1.0, vx)
        shoulders = np.array([message.position[1] for message in targets if message.kp[1] > 0.0])
        strides.append(float(np.ptp(shoulders)))
    assert strides[1] > 1.5 * strides[0]
    await physics.walk(1.0, 0.0, 0.8)
    _, turn = await physics.speed(0.4)
    assert turn == pytest.approx(0.8, abs=0.1)


async def test_x_08b_velocity_is_forgotten_after_half_a_second_without_command(rig: Rig, kinematic: Stage) -> None:
    await kinematic.stand()
    await kinematic.walk(2.0, 0.5)
    assert (await kinematic.speed(0.2))[0] == pytest.approx(0.5, abs=0.05)
    await rig.advance(1.5)
    assert kinematic.now().mode == "walk"
    assert abs((await kinematic.speed(0.4))[0]) < 0.02


async def test_x_08b_velocity_is_forgotten_on_leaving_walk(rig: Rig, kinematic: Stage) -> None:
    await kinematic.stand()
    await kinematic.walk(1.0, 0.5)
    await rig.call(STAND, Trigger.Request())
    await rig.until(lambda: kinematic.now().mode == "stand", within=5.0)
    await rig.call(WALK, Trigger.Request())
    assert abs((await kinematic.speed(1.0))[0]) < 0.05


async def test_x_08b_commands_outside_walk_are_ignored_with_a_warning_once(rig: Rig, kinematic: Stage) -> None:
    await kinematic.stand()
    for _ in range(3):
        rig.publish(CMD_VEL, twist(0.5))
        await rig.advance(0.1)
    assert said(rig, "gait").count("Not in walk mode, ignoring cmd_vel") == 1
    assert abs((await kinematic.speed(0.5))[0]) < 0.01


async def test_x_08b_sitting_and_standing_are_motions_of_bounded_rate(rig: Rig, physics: Stage) -> None:
    joints = rig.probe(JOINT_STATES)
    await physics.stand()
    await rig.call(SIT, Trigger.Request())
    await rig.until(lambda: physics.now().mode == "sit", within=5.0, step=0.05)
    angles = np.array([message.position for message in joints])
    assert np.ptp(angles, axis=0).max() > 0.5
    assert np.abs(np.diff(angles, axis=0)).max() / 0.005 < 2.0, "rad/s"


def turned_over_standing_feet(angles: Vector, turn: Vector) -> Vector:
    """The joints' velocities, rad/s, with which feet stay where they are under a body that turns (rad/s)."""
    legs = leg_state(angles.tolist(), (0.0, 0.0, 1.0))
    return np.concatenate(
        [np.linalg.solve(rows, -np.cross(turn, foot)) for rows, foot in zip(legs.jacobians, legs.feet, strict=True)]
    )


@cache
def stood_up() -> tuple[GaitController, JointSample]:
    """A controller that has made a robot stand, and the joints of that."""
    gait = GaitController(motor_delay=0.0)
    body = PhysicsBody(FLAT, seed=1, delay=0.0, noise=False)
    gait.request("stand")
    for step in range(1, 601):
        body.command(gait.step(0.005, body.imu(), body.joints()))
        body.advance(0.005 * step)
    assert gait.mode == "stand"
    return gait, body.joints()


@pytest.mark.parametrize("axis", ["roll", "pitch"])
def test_x_08b_reactions_to_roll_and_pitch_have_the_right_signs(axis: str) -> None:
    """A body that leans to one side is pushed up by the legs of that side."""
    pushes: list[np.ndarray] = []
    for lean in (0.1, -0.1):
        gait, seen = deepcopy(stood_up())
        turning = np.array((lean, 0.0, 0.0) if axis == "roll" else (0.0, lean, 0.0)) / 0.05
        angles = seen.position
        for step in range(10):
            speeds = turned_over_standing_feet(angles, turning)
            angles = angles + 0.005 * speeds
            joints = JointSample(angles, speeds, seen.effort, seen.contact)
            told = gait.step(0.005, ImuSample(turning * (1.0 + 1e-6 * step), np.array((0.0, 0.0, GRAVITY))), joints)
        pushes.append(told.effort.reshape(4, 3))
    knees = (
        pushes[0][:, 2] - pushes[1][:, 2]
    )  # how much more each leg stretches when leaning one way than when the other
    lower = [1, 3] if axis == "roll" else [0, 1]  # roll to the right lowers fr and rr, pitch forwards fl and fr
    higher = [leg for leg in range(4) if leg not in lower]
    assert knees[lower].max() < knees[higher].min() or knees[lower].min() > knees[higher].max()
    assert np.sign(knees[lower].mean()) == -np.sign(knees[higher].mean())
    standing = (pushes[0][:, 2] + pushes[1][:, 2]) / 2
    assert (np.sign(knees[lower]) == np.sign(standing[lower])).all(), "the lowered legs push harder"


# -- gaits ----------------------------------------------------------------------------------------------------------------------


async def test_a_gait_set_at_run_time_is_taken_up_and_reported(rig: Rig, physics: Stage) -> None:
    await physics.stand()
    await physics.walk(1.2, 0.4)
    assert physics.now().gait == "trot"
    for gait in ("pace", "crawl"):
        assert rig.node(Gait).set_parameter("gait", gait).successful
        await physics.walk(1.6, 0.3)
        assert physics.now().gait == gait
    refused = rig.node(Gait).set_parameter("gait", "gallop")
    assert not refused.successful
    assert physics.now().gait == "crawl"
    assert not physics.body.truth().fallen


# -- sensors --------------------------------------------------------------------------------------------------------------------


async def test_f_07_a_silent_imu_makes_a_walk_stand_and_warn_and_it_recovers(rig: Rig, physics: Stage) -> None:
    await physics.stand()
    await physics.walk(1.2, 0.5)
    physics.silent.add("imu")
    await physics.walk(1.6, 0.5)
    assert physics.now().mode == "stand"
    assert not physics.now().sensors_ok
    assert sum("IMU is silent or cannot be believed: standing without it" in event for event in said(rig, "gait")) == 1
    refused = await rig.call(WALK, Trigger.Request())
    assert (refused.success, refused.message) == (False, "no IMU: refusing to walk")
    physics.silent.clear()
    await physics.walk(1.6, 0.3)
    assert "IMU is back" in said(rig, "gait")
    assert physics.now().mode == "walk"
    assert physics.now().sensors_ok
    assert not physics.body.truth().fallen


async def test_x_08b_stand_without_imu_reaches_the_neutral_pose_and_warns(rig: Rig, physics: Stage) -> None:
    physics.silent.add("imu")
    await physics.stand()
    assert any("IMU is silent" in event for event in said(rig, "gait"))
    await rig.advance(0.5)
    assert physics.body.truth().position[2] == pytest.approx(0.486, abs=0.01)
    assert not physics.body.truth().fallen


async def test_silent_encoders_sit_the_robot_down_from_a_walk(rig: Rig, physics: Stage) -> None:
    await physics.stand()
    await physics.walk(1.4, 0.5)
    physics.silent.add("joints")
    for _ in range(20):
        await rig.advance(0.1)
        assert not physics.body.truth().fallen
    assert physics.body.truth().position[2] < 0.22
    assert any("joint encoders are silent" in event for event in said(rig, "gait"))
    assert not physics.now().sensors_ok
    physics.silent.clear()
    await rig.advance(1.6)
    assert (physics.now().mode, physics.now().goal) == ("sit", "sit")
    await physics.stand()
    assert not physics.body.truth().fallen


async def test_silent_contacts_are_walked_without(rig: Rig, physics: Stage) -> None:
    await physics.stand()
    await physics.walk(1.2, 0.5)
    physics.silent.add("contacts")
    await physics.walk(2.0, 0.5)
    assert physics.now().mode == "walk"
    assert (await physics.speed(0.2))[0] == pytest.approx(0.5, abs=0.15)
    assert not physics.body.truth().fallen


async def test_samples_that_wait_for_a_busy_processor_move_no_joint_and_the_walk_goes_on(
    rig: Rig, physics: Stage
) -> None:
    await physics.stand()
    await physics.walk(1.2, 0.5)
    senses, targets = rig.node(Senses), rig.probe(MOTOR_TARGETS)
    senses.kept = []
    await rig.advance(0.1)
    kept, senses.kept = senses.kept, None
    targets.clear()
    for sample in kept:
        rig.publish(JOINT_STATES, sample)
    await rig.quiet()
    assert len(kept) == 20
    assert 1 <= len(targets) <= 5  # of the samples of the last 20 ms
    await physics.walk(2.0, 0.5)
    assert physics.now().mode == "walk"
    assert (await physics.speed(0.2))[0] == pytest.approx(0.5, abs=0.15)
    assert not physics.body.truth().fallen


async def test_a_joint_that_is_no_number_sits_the_robot_down(
    rig: Rig, physics: Stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    await physics.stand()
    await physics.walk(1.2, 0.5)
    true = physics.body.joints

    def broken() -> JointSample:
        sample = true()
        position = sample.position.copy()
        position[5] = np.nan
        return JointSample(position, sample.velocity, sample.effort, sample.contact)

    monkeypatch.setattr(rig.node(Senses), "_body", _Broken(physics.body, broken))
    await rig.advance(2.2)
    assert physics.now().mode == "sit"
    assert any(
        "a joint encoder is silent or cannot be believed, or sticks: sitting down" in event
        for event in said(rig, "gait")
    )
    assert not physics.body.truth().fallen


class _Broken:
    """A body whose joints are read by something else."""

    def __init__(self, body: Simulation, joints: object) -> None:
        self.advance, self.imu, self.joints = body.advance, body.imu, joints


async def test_the_feet_of_a_body_that_steps_by_itself_tell_of_no_ice(rig: Rig) -> None:
    walker = Robot("empty", body="kinematic", seed=1)
    await rig.start(only(walker.tree, ["motors", "proprioception", "gait"]))
    status = rig.probe(GAIT_STATUS)
    assert (await rig.call(WALK, Trigger.Request())).success
    for _ in range(40):
        rig.publish(CMD_VEL, twist(1.6))
        await rig.advance(0.1)
    assert status.newest.goal == "walk"
