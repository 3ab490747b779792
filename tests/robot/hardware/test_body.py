"""What controllers meet: the order of joints, and that every back end is a body, an arm and a pair of eyes at the places that are written down."""

from __future__ import annotations

import inspect
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from robot.geometry.planar import Pose2
from robot.hardware.arm import ArmBusy, ArmDevice
from robot.hardware.body import JOINT_NAMES, LEGS, Hardware, SteppingHardware
from robot.hardware.mounts import CAMERA, IMU, LIDAR
from robot.scenes.scene import Box, Scene
from robot.sim.ground import Ground
from robot.sim.kinematic import KinematicBody
from robot.sim.mjcf import write_model
from robot.sim.physics import PhysicsBody
from robot.sim.simulation import Simulation, Truth

engine: Any = mujoco
SCENE = Scene("one box", (-5.0, -5.0, 5.0, 5.0), (Box(2.0, 1.0, 0.5, 0.5),), Pose2(0.3, -0.2, 0.4), Pose2(-3.0, 0.0))
BACKENDS = [KinematicBody, PhysicsBody]


def promised(protocol: type) -> set[str]:
    return {name for name in vars(protocol) if not name.startswith("_")}


@pytest.mark.parametrize("kind", BACKENDS)
def test_a_back_end_has_every_part_of_the_interface_with_the_same_parameters(
    kind: type[KinematicBody] | type[PhysicsBody],
) -> None:
    assert promised(Simulation) | promised(Hardware) >= {
        "advance",
        "command",
        "imu",
        "joints",
        "lidar",
        "truth",
        "push",
        "place",
        "close",
    }
    for name in promised(Simulation) | promised(Hardware):
        ours, theirs = inspect.getattr_static(Simulation, name), inspect.getattr_static(kind, name)
        if inspect.isfunction(ours):
            assert list(inspect.signature(theirs).parameters) == list(inspect.signature(ours).parameters), name
        else:
            assert isinstance(theirs, property), name


@pytest.mark.parametrize("kind", BACKENDS)
def test_its_arrays_have_the_shapes_that_are_stated(kind: type[KinematicBody] | type[PhysicsBody]) -> None:
    body = kind(SCENE, seed=1)
    joints, imu, truth = body.joints(), body.imu(), body.truth()
    assert [part.shape for part in (joints.position, joints.velocity, joints.effort, joints.contact)] == [(12,)] * 3 + [
        (4,)
    ]
    assert joints.contact.dtype == np.bool_
    assert (imu.gyro.shape, imu.accel.shape) == ((3,), (3,))
    assert [p.shape for p in (truth.position, truth.quaternion, truth.velocity, truth.angular_velocity)] == [
        (3,),
        (4,),
        (3,),
        (3,),
    ]
    assert body.lidar().shape == (360,)
    assert body.lidar(36, 5.0).max() <= 5.0
    assert truth.position[:2].tolist() == pytest.approx([0.3, -0.2])
    assert truth.yaw == pytest.approx(0.4)
    assert body.time == 0.0
    body.close()


@pytest.mark.parametrize("kind", BACKENDS)
def test_put_elsewhere_it_lies_there_at_rest(kind: type[KinematicBody] | type[PhysicsBody]) -> None:
    body = kind(SCENE, seed=1, noise=False)
    body.place(Pose2(-1.0, 2.0, -2.5))
    truth = body.truth()
    assert truth.position[:2] == pytest.approx([-1.0, 2.0])
    assert truth.yaw == pytest.approx(-2.5)
    assert np.abs(truth.velocity).max() < 1e-6
    assert not truth.fallen


@pytest.mark.parametrize("kind", BACKENDS)
def test_an_arm_is_an_arm_on_every_body_and_refuses_a_second_target_under_way(
    kind: type[KinematicBody] | type[PhysicsBody],
) -> None:
    body = kind(SCENE, seed=1, arm=True)
    assert body.arm is not None
    for name in promised(ArmDevice):
        assert hasattr(body.arm, name), name
    state = body.arm.state()
    assert (state.position.shape, state.velocity.shape, state.moving) == ((4,), (4,), False)
    body.arm.move((0.0, -1.0, 1.5, 0.2))
    with pytest.raises(ArmBusy):
        body.arm.move((0.0, -1.5, 1.5, 0.2))
    assert kind(SCENE, seed=1).arm is None


def test_only_a_body_that_steps_by_itself_takes_a_velocity() -> None:
    assert isinstance(KinematicBody(SCENE, seed=1), SteppingHardware)
    assert not isinstance(PhysicsBody(SCENE, seed=1), SteppingHardware)


def test_joints_are_named_leg_by_leg_from_the_hip_down() -> None:
    assert JOINT_NAMES[:4] == ("fl_hip", "fl_shoulder", "fl_knee", "fr_hip")
    assert [name.split("_")[0] for name in JOINT_NAMES[::3]] == list(LEGS)


@given(st.floats(-3.0, 3.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_the_true_heading_is_the_yaw_of_the_attitude(yaw: float, pitch: float, roll: float) -> None:
    x, y, z, w = Rotation.from_euler("ZYX", (yaw, pitch, roll)).as_quat()
    zero = np.zeros(3)
    truth = Truth(zero, np.array((w, x, y, z)), zero, zero, np.zeros(12), False, False, (), 0.0)
    assert truth.yaw == pytest.approx(yaw, abs=1e-9)


def test_the_imu_is_at_the_bodys_origin_as_in_mujocos_model_and_the_eyes_look_ahead() -> None:
    model = engine.MjModel.from_xml_string(write_model(SCENE, Ground(), 0.0025))
    sensors = [model.sensor(number) for number in range(model.nsensor)]
    attached = {
        int(s.objid[0])
        for s in sensors
        if s.type[0] in (engine.mjtSensor.mjSENS_GYRO, engine.mjtSensor.mjSENS_ACCELEROMETER)
    }
    for site in attached:
        assert model.site_pos[site] == pytest.approx(IMU.translation)
    assert LIDAR.translation == (0.0, 0.0, 0.0)
    assert CAMERA.point((1.0, 0.0, 0.0)) == pytest.approx((1.45, 0.0, 0.05))
    for mount in (IMU, LIDAR, CAMERA):
        assert mount.rotation == (1.0, 0.0, 0.0, 0.0)
