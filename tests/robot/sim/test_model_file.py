"""A robot's figures from MJCF and URDF: what was written is read back, whatever a file calls, counts and signs its joints; wrong files are named."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path

import pytest

from robot.control.command import CommandLimits
from robot.control.gaits import gaits_of
from robot.control.walk_config import WalkConfig
from robot.geometry.planar import Pose2
from robot.model.bodies import B2, GO2
from robot.model.robot import SPOT, ModelError, RobotModel
from robot.scenes.scene import Scene
from robot.sim.ground import Ground
from robot.sim.mjcf import write_model
from robot.sim.model_file import find_model, read_model
from robot.sim.model_text import MOST_BYTES
from robot.urdf import write_urdf

NOWHERE = Scene("nowhere", (-1.0, -1.0, 1.0, 1.0), (), Pose2(0.0, 0.0), Pose2(0.0, 0.0))
DRIVES = {"knee_torque", "torque_limit"}
"""What is written otherwise than as a figure: the drives' limits change with the knee's angle, and the simulation sets them."""


def mjcf(model: RobotModel = SPOT) -> str:
    return write_model(NOWHERE, Ground(), 0.0025, model=model)


def stored(folder: Path, text: str, name: str = "made.xml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def flat(value: object) -> list[float]:
    return [one for part in value for one in flat(part)] if isinstance(value, tuple) else [value]  # type: ignore[list-item]


def check(read: RobotModel, written: RobotModel, but: set[str]) -> None:
    for one in fields(RobotModel):
        if one.name not in {"name", "assumed"} | but:
            theirs, ours = getattr(read, one.name), getattr(written, one.name)
            assert (theirs is None) == (ours is None), one.name
            if ours is not None:
                assert flat(theirs) == pytest.approx(flat(ours), abs=2e-6, rel=1e-4), one.name


@pytest.mark.parametrize("model", [SPOT, GO2, B2])
def test_a_robot_that_was_written_as_mjcf_is_read_back(tmp_path: Path, model: RobotModel) -> None:
    check(read_model(stored(tmp_path, mjcf(model))), model, DRIVES)


def test_a_robot_that_was_written_as_urdf_is_read_back_with_its_torques(tmp_path: Path) -> None:
    read = read_model(stored(tmp_path, write_urdf(), "made.urdf"))
    check(read, SPOT, {"knee_torque"})
    assert read.knee_torque[0][1] == 113.2
    assert read.name == "made"


@pytest.mark.parametrize("turn", [-1.2, 0.5, 2.5])
def test_a_file_may_call_the_pose_that_it_draws_any_angle(tmp_path: Path, turn: float) -> None:
    def counted_from(joint: re.Match[str]) -> str:
        return f'axis="0 1 0" ref="{turn}" range="{float(joint[1]) + turn} {float(joint[2]) + turn}"'

    text = re.sub(r'axis="0 1 0" range="(\S+) (\S+)"', counted_from, mjcf())
    assert text.count(" ref=") == 8
    check(read_model(stored(tmp_path, text)), SPOT, DRIVES)


def test_names_order_signs_and_zero_angles_of_joints_are_the_files(tmp_path: Path) -> None:
    text = mjcf()
    text = text.replace(
        'name="fl_knee" axis="0 1 0" range="-2.793 -0.247"', 'name="K1" axis="0 -1 0" range="0.247 2.793"'
    )
    text = text.replace('joint="fl_knee"', 'joint="K1"')
    # the front right knee counts from a bend of 1 rad
    bent = 'quat="0.877582562 0 -0.479425539 0"'
    text = re.sub(r'<body name="fr_calf" (pos="[^"]*")>', rf'<body name="fr_calf" \1 {bent}>', text)
    text = text.replace(
        'name="fr_knee" axis="0 1 0" range="-2.793 -0.247"', 'name="fr_knee" axis="0 1 0" range="-1.793 0.753"'
    )
    legs = re.findall(r'<body name="\w\w_hip".*?</body>\s*</body>\s*</body>', text, re.DOTALL)
    assert len(legs) == 4
    turned = "".join(reversed(legs))
    text = text.replace(legs[0], turned, 1)
    for leg in legs[1:]:
        text = "".join(text.rsplit(leg, 1)) if text.count(leg) > 1 else text
    check(read_model(stored(tmp_path, text)), SPOT, DRIVES)


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ('name="rr_knee" axis="0 1 0"', 'name="rr_knee" axis="0 0 1"', "joint 'rr_knee': it does not turn about y"),
        (
            'name="rr_knee" axis="0 1 0" range="-2.793 -0.247"',
            'name="rr_knee" axis="0 1 0" range="0.247 2.793"',
            "legs of 'rl_hip' and 'rr_hip': the limits of their knees have nothing in common",
        ),
        ('<joint name="rl_hip" axis="1 0 0"', '<joint type="slide" name="rl_hip" axis="1 0 0"', "joint 'rl_knee'"),
        ('<geom name="fr_foot" type="sphere"', '<geom name="fr_foot" type="ellipsoid"', "fr_foot"),
        ('name="rl_thigh" pos="0 0.1108 0"', 'name="rl_thigh" pos="0 0.2 0"', "the hip differs; legs must be alike"),
        ("<mujoco model", "<mujoco modle", "modle"),
    ],
)
def test_a_robot_that_is_none_of_this_kind_is_refused_with_the_element_that_is_wrong(
    tmp_path: Path, old: str, new: str, named: str
) -> None:
    text = mjcf()
    assert old in text
    path = stored(tmp_path, text.replace(old, new))
    with pytest.raises(ModelError) as refused:
        read_model(path)
    assert str(path) in str(refused.value)
    assert named in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (b"<mujoco", "it is no XML"),
        (b"<svg/>", "its first element is <svg>"),
        (b"\xff\xfe\x00", "it is not text"),
        (b"<!DOCTYPE x [<!ENTITY a 'b'>]><mujoco>&a;</mujoco>", "DOCTYPE"),
        (b"<mujoco/>", "0 legs"),
        (b"<robot name='x'/>", "wrong.xml"),
        (b" " * (MOST_BYTES + 1), "larger than"),
    ],
)
def test_a_file_that_describes_no_robot_is_refused_in_one_line(tmp_path: Path, content: bytes, why: str) -> None:
    path = tmp_path / "wrong.xml"
    path.write_bytes(content)
    with pytest.raises(ModelError, match=re.escape(why)) as refused:
        read_model(path)
    assert str(path) in str(refused.value)
    assert "\n" not in str(refused.value)


def changed(text: str, *pairs: tuple[str, str]) -> str:
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    return text


def test_what_only_the_eye_sees_and_what_refers_to_it_is_left_out(tmp_path: Path) -> None:
    text = changed(
        mjcf(),
        ("<default>", '<default><default class="eye"><geom type="mesh" contype="0" material="steel"/></default>'),
        ("<worldbody>", '<worldbody><camera name="above" pos="0 0 9"/><geom class="eye" mesh="hull"/>'),
        ("<sensor>", '<sensor><framepos objtype="camera" objname="above"/>'),
        (
            "</mujoco>",
            '<asset><mesh name="hull" file="hull.stl"/><material name="steel" texture="none"/></asset><keyframe><key qpos="1"/></keyframe>'
            '<contact><pair geom1="trunk" geom2="floor"/></contact></mujoco>',
        ),
    )
    check(read_model(stored(tmp_path, text)), SPOT, DRIVES)


def test_a_scene_that_includes_the_robot_is_read_and_one_that_includes_itself_is_refused(tmp_path: Path) -> None:
    stored(tmp_path, mjcf(), "robot.xml")
    scene = '<mujoco><include file="robot.xml"/><worldbody><geom type="plane" size="1 1 1"/></worldbody></mujoco>'
    check(read_model(stored(tmp_path, scene, "scene.xml")), SPOT, DRIVES)
    with pytest.raises(ModelError, match="include each other"):
        read_model(stored(tmp_path, '<mujoco><include file="self.xml"/></mujoco>', "self.xml"))
    with pytest.raises(ModelError, match=r"away\.xml: No such file"):
        read_model(stored(tmp_path, '<mujoco><include file="away.xml"/></mujoco>', "lost.xml"))


def test_a_trunk_that_lies_otherwise_in_its_file_is_turned(tmp_path: Path) -> None:
    """Its x is to the left, its z to the front; its legs hang on a body that is fixed to the first one."""
    text = changed(
        mjcf(),
        ('<freejoint name="body"/>', '<freejoint/><inertial mass="1e-6" pos="0 0 0" diaginertia="1e-6 1e-6 1e-6"/><body quat="0.5 -0.5 -0.5 -0.5">'),
        ("</body>\n  </worldbody>", "</body></body></worldbody>"),
    )  # fmt: skip
    check(read_model(stored(tmp_path, text)), SPOT, DRIVES)


def test_an_arm_is_held_and_belongs_to_the_trunk(tmp_path: Path) -> None:
    arm = (
        '<body><joint axis="0 0 1"/><inertial mass="2" pos="0 0 0" diaginertia="0.01 0.01 0.01"/>'
        '<body><joint axis="0 1 0"/><geom size="0.1" mass="4"/></body></body>'
    )
    read = read_model(stored(tmp_path, changed(mjcf(), ('<site name="imu"/>', arm))))
    assert read.mass == pytest.approx(SPOT.mass + 6.0)


def test_knees_that_bend_forwards_are_read_and_those_that_bend_either_way_bend_backwards(tmp_path: Path) -> None:
    rear = [
        (f'name="{leg}_knee" axis="0 1 0" range="-2.793 -0.247"', f'name="{leg}_knee" axis="0 1 0" range="0.247 2.793"')
        for leg in ("rl", "rr")
    ]
    read = read_model(stored(tmp_path, changed(mjcf(), *rear)))
    assert read.bends == (-1.0, -1.0, 1.0, 1.0)
    assert flat(read.knee_rear_limits) == pytest.approx([0.247, 2.793])
    either = read_model(stored(tmp_path, changed(mjcf(), ('range="-2.793 -0.247"', 'range="-9 9"'))))
    assert (either.bends, either.knee_limits) == ((-1.0,) * 4, SPOT.knee_limits)


def test_feet_are_found_without_a_ball_and_inertias_and_torques_that_are_placeholders_are_the_reference_bodys(
    tmp_path: Path,
) -> None:
    text = re.sub(r"<limit [^>]*/>", '<limit effort="1e9" velocity="1" lower="-7" upper="7"/>', write_urdf())
    text = re.sub(r"<sphere [^>]*/>", '<mesh filename="package://made/foot.dae"/>', text)
    text = re.sub(
        r'ixx="[^"]*" ixy="[^"]*" ixz="[^"]*" iyy="[^"]*" iyz="[^"]*" izz="[^"]*"',
        'ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"',
        text,
    )
    read = read_model(stored(tmp_path, text, "made.urdf"))
    check(read, SPOT, {"knee_torque", "body_inertia", "hip_inertia", "thigh_inertia", "calf_inertia", "trunk"})
    assert read.knee_torque[0][1] == pytest.approx(113.2)
    assert read.assumed == ("torque limits",)
    assert read.thigh_inertia == pytest.approx(SPOT.thigh_inertia)


def test_a_foot_that_is_a_mesh_is_found_in_its_file_and_named_where_that_is_not_there(tmp_path: Path) -> None:
    text = re.sub(r'<geom type="capsule" [^>]*/>|<site name="\w\w_foot"[^>]*/>|<touch [^>]*/>', "", mjcf())
    text = re.sub(
        r'(<geom name="\w\w_foot") type="sphere" size="[^"]*" pos="[^"]*"', r'\1 class="meshes" mesh="ball"', text
    )
    text = changed(
        text,
        ("<default>", '<default><default class="meshes"><geom type="mesh" contype="1" group="2" mass="0"/></default>'),
        ("<worldbody>", '<asset><mesh name="ball" file="foot.obj"/></asset><worldbody>'),
        ("<compiler", '<compiler meshdir="assets"'),
    )
    with pytest.raises(ModelError, match="body 'fl_calf': nothing at its end is its foot"):
        read_model(stored(tmp_path, text))
    (tmp_path / "assets").mkdir()
    corners = [
        (x, y, -0.3365 + z)
        for x, y, z in ((0.036, 0, 0), (-0.036, 0, 0), (0, 0.036, 0), (0, -0.036, 0), (0, 0, 0.036), (0, 0, -0.036))
    ]
    faces = [(a, b, c) for a in (1, 2) for b in (3, 4) for c in (5, 6)]
    shape = [*(f"v {x} {y} {z}" for x, y, z in corners), *(f"f {a} {b} {c}" for a, b, c in faces)]
    stored(tmp_path / "assets", "\n".join(shape), "foot.obj")
    read = read_model(stored(tmp_path, text))
    assert (read.calf, read.foot_radius) == pytest.approx((SPOT.calf, SPOT.foot_radius), rel=1e-3)


def numbers(**data: str) -> str:
    said = "".join(f'<numeric name="{name.replace("_", ".", 1)}" data="{value}"/>' for name, value in data.items())
    return mjcf().replace("</mujoco>", f'<custom>{said}<numeric name="their_own" data="x"/></custom></mujoco>')


def test_a_file_sets_numbers_that_do_not_follow_from_its_figures(tmp_path: Path) -> None:
    text = numbers(
        robot_stand_height="0.42",
        walk_height="0.5",
        walk_turn_spring="200 200 70",
        limits_forward="1.1",
        trot_period="0.44",
    )
    read = read_model(stored(tmp_path, text))
    assert read.stand_height == 0.42
    walk = WalkConfig.of(read)
    assert (walk.height, walk.turn_spring, walk.capture) == (0.5, (200.0, 200.0, 70.0), WalkConfig().capture)
    assert (CommandLimits.usual(read).forward, gaits_of(read)["trot"].period) == (1.1, 0.44)
    for name, value in (
        ("walk_hight", "1"),
        ("robot_hips", "1"),
        ("robot_sit_height", "9"),
        ("walk_height", "x"),
        ("walk_height", "3"),
    ):
        with pytest.raises(ModelError, match=f"numeric '{name.replace('_', '.', 1)}': "):
            read_model(stored(tmp_path, numbers(**{name: value})))


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (
            '<robot name="x" xmlns:xacro="http://ros.org/wiki/xacro"><xacro:macro name="leg"/></robot>',
            "xacro wrong.xml > robot.urdf",
        ),
        ("<mujoco>" + "<body>" * 300 + "</body>" * 300 + "</mujoco>", "deep within each other"),
    ],
)
def test_other_files_of_this_trade_are_refused_with_what_to_do(tmp_path: Path, text: str, why: str) -> None:
    with pytest.raises(ModelError, match=re.escape(why)):
        read_model(stored(tmp_path, text, "wrong.xml"))


def test_a_xacro_that_is_given_by_its_name_is_told_from_a_robot_that_is_not_known(tmp_path: Path) -> None:
    xacro = '<robot name="x" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="leg.xacro"/></robot>'
    with pytest.raises(ModelError, match=re.escape("xacro dog.urdf.xacro > robot.urdf")):
        find_model(str(stored(tmp_path, xacro, "dog.urdf.xacro")))
    with pytest.raises(ModelError, match="no robot is called 'go3'"):
        find_model("go3")


def test_a_file_that_is_not_there_is_refused_by_its_name(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"absent\.xml: No such file"):
        read_model(tmp_path / "absent.xml")
