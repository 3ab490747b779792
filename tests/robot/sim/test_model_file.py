"""A robot's figures from MJCF and URDF: what was written is read back, whatever a file calls, counts and signs its joints; wrong files are named."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path

import pytest

from robot.geometry.planar import Pose2
from robot.model.bodies import B2, GO2
from robot.model.robot import SPOT, ModelError, RobotModel
from robot.scenes.scene import Scene
from robot.sim.ground import Ground
from robot.sim.mjcf import write_model
from robot.sim.model_file import MOST_BYTES, read_model
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
        if one.name not in {"name"} | but:
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
            'axis="0 1 0" range="-2.793 -0.247"',
            'axis="0 1 0" range="0.247 2.793"',
            "joint 'fl_knee': the knee bends forwards",
        ),
        ('<joint name="rl_hip" axis="1 0 0"', '<joint type="slide" name="rl_hip" axis="1 0 0"', "joint 'rl_knee'"),
        ('forcerange="-45 45"', "", "joint 'fl_hip': no motor with a limit of its torque"),
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


def test_a_file_that_is_not_there_is_refused_by_its_name(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"absent\.xml: No such file"):
        read_model(tmp_path / "absent.xml")
