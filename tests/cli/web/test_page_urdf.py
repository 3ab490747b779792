"""The page's reader of robot descriptions, run by node: each kind of joint moves its link as URDF says."""

from __future__ import annotations

import json
import math
import shutil
import subprocess
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

NODE = shutil.which("node")
PROGRAM = Path(__file__).with_name("place_links.mjs")
TURNED = math.sqrt(0.5)

pytestmark = pytest.mark.skipif(NODE is None, reason="node is not installed: the page's reader of robots is not run")


def plain(element: ElementTree.Element) -> dict[str, Any]:
    return {"name": element.tag, "attributes": dict(element.attrib), "children": [plain(child) for child in element]}


def placed(joints: str, **positions: float) -> dict[str, Any]:
    """Each link with its place in the root link."""
    assert NODE is not None
    links = "".join(f'<link name="{name}"/>' for name in ("base", "a", "b", "c"))
    robot = plain(ElementTree.fromstring(f"<robot>{links}{joints}</robot>"))
    question = json.dumps({"robot": robot, "positions": positions})
    done = subprocess.run([NODE, PROGRAM], input=question, capture_output=True, text=True, timeout=60, check=True)
    return dict(json.loads(done.stdout))


def joint(name: str, kind: str, parent: str, child: str, axis: str, more: str = "") -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="1 0 0" rpy="0 0 {math.pi / 2}"/><axis xyz="{axis}"/>{more}</joint>'
    )


def test_a_prismatic_joint_moves_its_link_along_its_axis_and_does_not_turn_it() -> None:
    found = placed(joint("j", "prismatic", "base", "a", "1 0 0"), j=0.5)
    assert found["a"]["p"] == pytest.approx([1.0, 0.5, 0.0])  # its x is the y of the base
    assert found["a"]["q"] == pytest.approx([0.0, 0.0, TURNED, TURNED])


@pytest.mark.parametrize("kind", ["revolute", "continuous"])
def test_a_turning_joint_turns_its_link_about_its_axis_however_long_that_is(kind: str) -> None:
    found = placed(
        joint("j", kind, "base", "a", "0 0 3") + joint("k", "fixed", "a", "b", "0 0 1"), j=math.pi / 2, k=9.0
    )
    assert found["a"]["q"] == pytest.approx([0.0, 0.0, 1.0, 0.0], abs=1e-9)
    assert found["b"]["p"] == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)


def test_a_mimic_joint_follows_its_joint_also_that_which_mimics_itself_another_one() -> None:
    joints = (
        joint("j", "prismatic", "base", "a", "0 0 1")
        + joint("k", "prismatic", "base", "b", "0 0 1", '<mimic joint="j" multiplier="-2" offset="0.1"/>')
        + joint("m", "prismatic", "base", "c", "0 0 1", '<mimic joint="k"/>')
    )
    found = placed(joints, j=0.5)
    assert [found[name]["p"][2] for name in "abc"] == pytest.approx([0.5, -0.9, -0.9])


def test_joints_that_mimic_each_other_and_links_in_a_circle_are_drawn_somewhere() -> None:
    joints = (
        joint("j", "prismatic", "base", "a", "0 0 1", '<mimic joint="k"/>')
        + joint("k", "prismatic", "b", "c", "0 0 1", '<mimic joint="j"/>')
        + joint("m", "fixed", "c", "b", "0 0 1")
    )
    assert set(placed(joints)) == {"base", "a", "b", "c"}
