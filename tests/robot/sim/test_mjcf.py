"""The model text, read back by MuJoCo: obstacles where the scene has them, the ground that was asked for, the arm's own kinematics."""

from __future__ import annotations

import dataclasses
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from robot.geometry.planar import Pose2
from robot.model.arm import JOINTS, LIMITS, MOUNT, forward
from robot.model.parameters import MASS
from robot.scenes.kitchen import kitchen
from robot.scenes.scene import Box, Cylinder, Scene
from robot.sim.arm_mjcf import TORQUES
from robot.sim.ground import Ground
from robot.sim.lidar_rays import cast
from robot.sim.mjcf import OBSTACLE_GROUP, obstacle_names, write_model
from robot.sim.things import tool_point

engine: Any = mujoco
SHAPES = (
    Box(2.0, 1.0, 0.5, 1.5, yaw=0.6, height=1.2),
    Cylinder(-1.5, 0.5, 0.3, height=0.8),
    Box(0.5, -2.0, 2.0, 0.2, yaw=-0.3),
)
SCENE = Scene("shapes", (-6.0, -5.0, 6.0, 5.0), SHAPES, Pose2(0.0, 0.0), Pose2(0.0, 0.0))


def model_of(scene: Scene = SCENE, ground: Ground | None = None, arm: bool = False) -> Any:
    return engine.MjModel.from_xml_string(write_model(scene, ground or Ground(), 0.0025, arm=arm))


PLAIN = model_of()
PLAIN_DATA = engine.MjData(PLAIN)
PLAIN_DATA.qpos[:3] = (0.0, 0.0, 30.0)
engine.mj_forward(PLAIN, PLAIN_DATA)


def test_obstacles_are_named_by_kind_and_place_in_the_scene() -> None:
    assert obstacle_names(SCENE) == ("box_0", "cylinder_1", "box_2")
    groups = {PLAIN.geom(name).group[0] for name in obstacle_names(SCENE)}
    assert groups == {OBSTACLE_GROUP}


@settings(deadline=None, max_examples=20)
@given(x=st.floats(-4.0, 4.0), y=st.floats(-4.0, 4.0), yaw=st.floats(-3.0, 3.0), height=st.floats(0.1, 1.4))
def test_the_lidar_without_mujoco_sees_what_mujocos_rays_meet(x: float, y: float, yaw: float, height: float) -> None:
    shown = cast(SCENE, x, y, yaw, beams=24, height=height)
    if not shown.any():
        return  # inside of an obstacle
    group = np.zeros(6, dtype=np.uint8)
    group[OBSTACLE_GROUP] = 1
    for beam, angle in enumerate(yaw - np.pi + np.arange(24) * 2 * np.pi / 24):
        hit = np.zeros(1, dtype=np.int32)
        met = engine.mj_ray(
            PLAIN, PLAIN_DATA, (x, y, height), (np.cos(angle), np.sin(angle), 0.0), group, 1, -1, hit, None
        )
        assert shown[beam] == pytest.approx(met if 0.0 <= met < 10.0 else 10.0, abs=1e-6)


@pytest.mark.parametrize("slope", [(0.2, 0.0), (0.0, -0.3), (0.1, 0.25)])
def test_the_floor_rises_by_its_slope(slope: tuple[float, float]) -> None:
    model = model_of(ground=Ground(slope=slope))
    data = engine.MjData(model)
    engine.mj_forward(model, data)
    normal = data.geom_xmat[model.geom("floor").id].reshape(3, 3)[:, 2]
    assert (-normal[0] / normal[2], -normal[1] / normal[2]) == pytest.approx(slope)


def test_friction_and_payload_are_those_that_were_asked_for() -> None:
    light, heavy = model_of(ground=Ground(friction=0.3)), model_of(ground=Ground(payload=8.0))
    assert light.geom("fl_foot").friction[0] == 0.3 == light.geom("floor").friction[0]
    assert light.body_subtreemass[0] == pytest.approx(MASS)
    assert heavy.body_subtreemass[0] == pytest.approx(MASS + 8.0)
    assert heavy.body("payload").pos.tolist() == [0.0, 0.0, 0.14]
    aside = model_of(ground=Ground(payload=8.0, payload_at=(0.1, -0.05)))
    assert aside.body("payload").pos.tolist() == [0.1, -0.05, 0.14]
    assert heavy.body("payload").inertia == pytest.approx(8.0 / 12 * np.array((0.04 + 0.01, 0.16 + 0.01, 0.16 + 0.04)))


@pytest.mark.parametrize("wrong", [{"friction": 0.0}, {"friction": float("nan")}, {"payload": -1.0}])
def test_a_ground_that_cannot_be_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="give a friction above 0 and a payload of at least 0"):
        Ground(**wrong)


def test_parts_of_the_robot_meet_the_world_and_not_each_other() -> None:
    def meet(one: str, other: str) -> bool:
        a, b = PLAIN.geom(one), PLAIN.geom(other)
        return bool((a.contype[0] & b.conaffinity[0]) or (b.contype[0] & a.conaffinity[0]))

    assert meet("fl_foot", "floor") and meet("trunk", "box_0") and meet("skid", "cylinder_1")
    assert not meet("fl_foot", "fr_foot") and not meet("trunk", "skid")
    assert not meet("floor", "box_0")


angles = st.tuples(*(st.floats(low, high) for low, high in LIMITS))


ARMED = model_of(kitchen(), arm=True)
ARMED_DATA = engine.MjData(ARMED)
ARM_JOINTS = [int(ARMED.joint(name).qposadr[0]) for name in JOINTS]


@settings(deadline=None, max_examples=25)
@given(angles, st.integers(0, 1000))
def test_the_tool_is_where_the_arms_closed_form_and_the_cameras_of_judges_have_it(
    q: tuple[float, ...], seed: int
) -> None:
    x, y, z, w = Rotation.random(random_state=seed).as_quat()
    ARMED_DATA.qpos[:7] = (0.5, -0.3, 0.7, w, x, y, z)
    ARMED_DATA.qpos[ARM_JOINTS] = q
    engine.mj_kinematics(ARMED, ARMED_DATA)
    tool = ARMED_DATA.site_xpos[ARMED.site("arm_tool").id]
    body = Rotation.from_quat((x, y, z, w))
    local = body.inv().apply(tool - (0.5, -0.3, 0.7)) - MOUNT
    assert forward(q)[:3] == pytest.approx(local, abs=1e-9)
    assert tool_point(ARMED_DATA.qpos[:3], ARMED_DATA.qpos[3:7], np.array(q)) == pytest.approx(tool, abs=1e-9)


def test_the_arms_joints_have_their_limits_and_drives_their_torques() -> None:
    ranges = [ARMED.joint(name).range for name in JOINTS]
    assert np.array(ranges) == pytest.approx(np.array(LIMITS))
    drives = [ARMED.actuator(name).forcerange[1] for name in JOINTS]
    assert drives == list(TORQUES)


def test_things_lie_where_the_scene_has_them_and_are_welded_to_nothing() -> None:
    data = engine.MjData(ARMED)
    engine.mj_kinematics(ARMED, data)
    for index, thing in enumerate(kitchen().things):
        place = data.xpos[ARMED.body(f"thing_{index}").id]
        assert place == pytest.approx((thing.shape.x, thing.shape.y, thing.z + thing.shape.height / 2))
        assert data.eq_active[ARMED.equality(f"thing_{index}").id] == 0
        assert ARMED.body(f"thing_{index}").mass[0] == pytest.approx(0.3)


def test_a_scene_without_obstacles_is_a_floor_that_is_large_enough() -> None:
    bare = model_of(dataclasses.replace(SCENE, obstacles=(), bounds=(-3.0, -8.0, 5.0, 9.0)))
    assert bare.geom("floor").size[:2].tolist() == [9.5, 9.5]
