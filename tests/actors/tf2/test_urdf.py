"""Joints of a URDF, against scipy's rotations and the URDF specification; what is none is refused with the reason."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from actors.tf2 import DescriptionError, Joint, Mimic, Transform, joints_of


def _links(*names: str) -> str:
    return "".join(f'<link name="{name}"/>' for name in names)


JOINED = _links("a", "b") + '<joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>'


@settings(deadline=None, max_examples=50)
@given(
    rpy=st.tuples(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1)),
    axis=st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda axis: sum(abs(one) for one in axis) > 0.1),
    angle=st.floats(-3.0, 3.0),
)
def test_a_joint_of_any_urdf_stands_and_turns_as_scipy_says(
    rpy: tuple[float, float, float], axis: tuple[float, float, float], angle: float
) -> None:
    numbers = [" ".join(map(repr, one)) for one in (rpy, axis)]
    (joint,) = joints_of(
        f'<robot><link name="a"/><link name="b"/><joint name="j" type="revolute"><parent link="a"/><child link="b"/>'
        f'<origin xyz="1 2 3" rpy="{numbers[0]}"/><axis xyz="{numbers[1]}"/></joint></robot>'
    )
    unit = np.array(axis) / np.linalg.norm(axis)
    meant = Rotation.from_euler("xyz", rpy) * Rotation.from_rotvec(angle * unit)
    assert joint.at(angle).matrix == pytest.approx(meant.as_matrix(), abs=1e-9)
    assert joint.at(angle).translation == (1.0, 2.0, 3.0)


def test_a_joint_without_origin_and_axis_has_those_of_the_urdf_specification() -> None:
    text = '<robot><link name="a"/><link name="b"/><joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint></robot>'
    assert joints_of(text) == (Joint("j", "a", "b", Transform(), (1.0, 0.0, 0.0), "continuous"),)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("no xml", "the robot's description is no XML"),
        (
            '<robot><joint name="j" type="fixed"><parent link="a"/></joint></robot>',
            "'j' .* lacks its parent or its child",
        ),
        (
            '<robot><joint name="lift" type="helical"><parent link="a"/><child link="b"/></joint></robot>',
            "'lift' is 'helical'; a joint is fixed, revolute, continuous, prismatic, floating, planar",
        ),
        ("<sdf/>", "is a <sdf>, and no URDF, which is a <robot>"),
        (
            '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:leg side="left"/></robot>',
            r"is xacro, and has to be expanded first: run `xacro robot\.urdf\.xacro",
        ),
        ('<robot><link name="${prefix}leg"/></robot>', "is xacro"),
        ('<robot><link name="a"/><xacro:macro name="leg"><link name="leg"/></xacro:macro></robot>', "is xacro"),
        (
            '<robot><link name="a"/><joint name="j" type="fixed"><parent link="a"/><child link="b"/><origin xyz="${x} 0 0"/></joint></robot>',
            "is xacro",
        ),
        (
            '<robot><joint name="j" type="revolute"><parent link="a"/><child link="b"/><mimic joint="k" offset="x"/></joint></robot>',
            "multiplier and offset of the mimic of 'j' are numbers",
        ),
        (
            '<robot><joint name="j" type="fixed"><parent link="a"/><child link="b"/><origin xyz="1 2"/></joint></robot>',
            "origin xyz='1 2' of 'j' is not three numbers",
        ),
        (
            '<robot><joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 0"/></joint></robot>',
            "an axis of length 0",
        ),
    ],
)
def test_what_is_no_description_is_refused_with_the_reason(text: str, why: str) -> None:
    with pytest.raises(DescriptionError, match=why):
        joints_of(text)


def test_a_sliding_joint_slides_along_its_axis_and_a_fixed_or_free_one_stays() -> None:
    text = "".join(
        f'<joint name="{kind}" type="{kind}"><parent link="a"/><child link="{kind}"/>'
        f'<origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/><axis xyz="2 0 0"/></joint>'
        for kind in ("prismatic", "fixed", "floating", "planar")
    )
    sliding, *others = joints_of(f"<robot>{_links('a', 'prismatic', 'fixed', 'floating', 'planar')}{text}</robot>")
    assert sliding.at(0.5).translation == pytest.approx((1.0, 0.5, 0.0))
    for joint in others:
        assert joint.axis is None
        assert joint.at(0.5).translation == pytest.approx((1.0, 0.0, 0.0))


def test_a_joint_may_mimic_another() -> None:
    text = (
        '<joint name="j" type="revolute"><parent link="a"/><child link="b"/><mimic joint="k" multiplier="-1"/></joint>'
    )
    (joint,) = joints_of(f"<robot>{_links('a', 'b')}{text}</robot>")
    assert joint.mimic == Mimic("k", -1.0, 0.0)


@pytest.mark.parametrize(
    "text",
    [
        f"<robot>{JOINED}<!-- <origin xyz='${{w}} 0 0'/>: an old place, <xacro:leg/> --></robot>",
        f"\n  <?xml version='1.0'?>\n<robot>{JOINED}</robot>",
        f"<robot>{JOINED}<gazebo><sensor:camera name='x' sensor:rate='3'/></gazebo></robot>",
        f"<robot xmlns='http://drake.mit.edu'>{JOINED}</robot>",
        f"<robot xmlns:xacro='http://www.ros.org/wiki/xacro'>{JOINED}</robot>",
        f"<?xml version='1.0' encoding='utf-8'?><robot name='Käfer'>{JOINED}</robot>",
        f"<robot xmlns:xacro='http://www.ros.org/wiki/xacro'>{JOINED}<xacro:camera side='left'/></robot>",
        f"<robot>{JOINED}<ros2_control><param name='max'>${{2*pi}}</param><limit at='${{pi}}'/></ros2_control></robot>",
        f"<robot>{JOINED}</robot><robot><link name='other'/></robot>",
    ],
    ids=[
        "a comment about xacro",
        "a blank line first",
        "a prefix without xmlns",
        "a namespace",
        "what xacro leaves",
        "umlaut",
        "a call that xacro left",
        "an expression in what is not read",
        "a second robot",
    ],
)
def test_a_urdf_is_read_as_urdfdom_reads_it(text: str) -> None:
    (joint,) = joints_of(text)
    assert (joint.parent, joint.child) == ("a", "b")


@pytest.mark.parametrize(
    ("inside", "why"),
    [
        ("", "has no link"),
        (_links("a", "b"), "needs one root, .* it has a, b: join them by fixed joints"),
        (_links("a", "a"), "more than one link 'a'"),
        (
            JOINED + '<joint name="j" type="fixed"><parent link="b"/><child link="a"/></joint>',
            "more than one joint 'j'",
        ),
        (
            JOINED + '<joint name="k" type="fixed"><parent link="a"/><child link="b"/></joint>',
            "'b' .* child of more than",
        ),
        (JOINED + '<joint name="k" type="fixed"><parent link="b"/><child link="a"/></joint>', "it has none"),
        (JOINED + '<joint name="k" type="fixed"><parent link="b"/><child link="c"/></joint>', "'k' is at the link 'c'"),
    ],
)
def test_links_that_are_no_tree_are_refused(inside: str, why: str) -> None:
    with pytest.raises(DescriptionError, match=why):
        joints_of(f"<robot>{inside}</robot>")
