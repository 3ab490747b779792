"""The robot's description as viewers read it, held against the model that MuJoCo simulates."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from actors.tf2 import Transform, joints_of
from robot.geometry.planar import Pose2
from robot.hardware.body import JOINT_NAMES
from robot.model import arm as arm_model
from robot.model.parameters import JOINT_LIMITS, MASS
from robot.scenes.scene import Scene
from robot.sim.ground import Ground
from robot.sim.mjcf import write_model
from robot.urdf import ROOT, write_urdf

engine: Any = mujoco
SCENE = Scene("robot", (-1.0, -1.0, 1.0, 1.0), (), Pose2(0.0, 0.0), Pose2(0.0, 0.0))
MODEL = engine.MjModel.from_xml_string(write_model(SCENE, Ground(), 0.0025, arm=True))
URDF = write_urdf(arm=True)
JOINTS = joints_of(URDF)
NAMES = (*JOINT_NAMES, *arm_model.JOINTS)
LIMITS = (*JOINT_LIMITS, *arm_model.LIMITS)


def places(positions: dict[str, float]) -> dict[str, Transform]:
    """Where every link is in the trunk, by the description."""
    found = {ROOT: Transform()}
    for joint in JOINTS:
        found[joint.child] = found[joint.parent] @ joint.at(positions.get(joint.name, 0.0))
    return found


@given(shares=st.lists(st.floats(0.0, 1.0), min_size=16, max_size=16))
def test_every_link_and_foot_is_where_mujoco_has_it_at_any_joint_angles(shares: list[float]) -> None:
    positions = {
        name: low + share * (high - low) for name, share, (low, high) in zip(NAMES, shares, LIMITS, strict=True)
    }
    data = engine.MjData(MODEL)
    data.qpos[:7] = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    for name, position in positions.items():
        data.joint(name).qpos[0] = position
    engine.mj_forward(MODEL, data)

    found = places(positions)

    for name, place in found.items():
        if name.endswith(("_foot", "_tool")):
            where, matrix = data.site(name).xpos, data.site(name).xmat
        else:
            body = data.body("body" if name == ROOT else name)
            where, matrix = body.xpos, body.xmat
        assert place.translation == pytest.approx(where.tolist(), abs=1e-9), name
        assert place.matrix == pytest.approx(matrix.reshape(3, 3), abs=1e-9), name


def test_the_links_weigh_what_the_bodies_weigh_and_turn_as_far() -> None:
    root = ElementTree.fromstring(URDF)
    masses = {
        link.get("name"): float(mass.get("value", "")) for link in root.iter("link") for mass in link.iter("mass")
    }
    bodies = {name if name != "body" else ROOT: MODEL.body(name).mass[0] for name in bodies_of(MODEL)}
    assert masses == pytest.approx(bodies, rel=1e-5)
    limits = {
        joint.get("name"): (float(limit.get("lower", "")), float(limit.get("upper", "")))
        for joint in root.iter("joint")
        for limit in joint.iter("limit")
    }
    assert limits == dict(zip(NAMES, LIMITS, strict=True))
    legs = [link for link in masses if link and not link.startswith("arm_")]
    assert sum(masses[link] for link in legs) == pytest.approx(MASS, abs=1e-3)


def bodies_of(model: Any) -> list[str]:
    return [model.body(number).name for number in range(1, model.nbody)]


def test_every_link_but_a_frame_can_be_seen_and_its_cylinders_lie_along_mujocos_capsules() -> None:
    root = ElementTree.fromstring(URDF)
    seen = {link.get("name") for link in root.iter("link") if link.find("visual") is not None}
    frames = {"fl_foot", "fr_foot", "rl_foot", "rr_foot", "arm_tool"}
    unseen = {link.get("name") for link in root.iter("link")} - seen
    assert unseen == frames | {"arm_turret"}  # the turret is inside the trunk's lid, and has no length
    for link in root.iter("link"):
        for shape in link.iter("collision"):
            cylinder, origin = shape.find("geometry/cylinder"), shape.find("origin")
            if cylinder is None or origin is None:
                continue
            geom = next(one for one in geoms_of(link.get("name", "")) if one.type[0] == engine.mjtGeom.mjGEOM_CAPSULE)
            assert float(cylinder.get("length", "")) == pytest.approx(2 * geom.size[1], abs=1e-6)
            assert float(cylinder.get("radius", "")) == pytest.approx(geom.size[0])
            assert [float(x) for x in origin.get("xyz", "").split()] == pytest.approx(geom.pos.tolist(), abs=1e-6)
            axis = Rotation.from_euler("xyz", [float(x) for x in origin.get("rpy", "").split()]).apply((0, 0, 1))
            w, x, y, z = geom.quat
            meant = Rotation.from_quat((x, y, z, w)).apply((0, 0, 1))
            assert abs(float(np.dot(axis, meant))) == pytest.approx(1.0, abs=1e-9)


def geoms_of(link: str) -> list[Any]:
    body = MODEL.body("body" if link == ROOT else link)
    return [MODEL.geom(number) for number in range(body.geomadr[0], body.geomadr[0] + body.geomnum[0])]


def test_without_an_arm_there_is_none_in_the_description() -> None:
    assert not any("arm" in joint.name for joint in joints_of(write_urdf()))
    assert len(joints_of(write_urdf())) == 16
