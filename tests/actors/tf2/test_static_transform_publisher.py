"""One static transform, from parameters or from the words of tf2_ros' program; also in launch files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from actors import Child, StartFailed, Supervisor
from actors.nodes import StaticTransformPublisher
from actors.testing import Rig
from actors.tf2 import TF_STATIC, InvalidArgumentException, Transform
from tests.actors.launch.files import launch, python


def words(text: str) -> dict[str, Any]:
    return StaticTransformPublisher.arguments_as_parameters(text.split())


def test_words_become_parameters_and_what_is_not_said_keeps_its_default() -> None:
    assert words("--x 1 --z -0.5 --frame-id map --child-frame-id lamp") == {
        "translation.x": 1.0,
        "translation.z": -0.5,
        "frame_id": "map",
        "child_frame_id": "lamp",
    }
    turned = words("--yaw 3.141592653589793 --frame-id a --child-frame-id b")
    assert [turned[f"rotation.{axis}"] for axis in "wxyz"] == pytest.approx([0.0, 0.0, 0.0, 1.0], abs=1e-9)
    assert words("--qx 1 --qw 0")["rotation.x"] == 1.0


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("--qz 1 --yaw 0", "by angles or as a quaternion, not both"),
        ("--yaw inf", "roll, pitch and yaw must be finite"),
        ("0 0 1 map lamp", "unrecognized arguments: 0 0 1 map lamp; it takes --x"),
        (
            "0 0 -1 3 2 1 map lamp",
            "write --x 0 --y 0 --z -1 --yaw 3 --pitch 2 --roll 1 --frame-id map --child-frame-id lamp$",
        ),
        ("0 0 1 0 0 0 1 map lamp", "write .* --qx 0 --qy 0 --qz 0 --qw 1 --frame-id map --child-frame-id lamp$"),
        ("--x far", "invalid float value: 'far'"),
    ],
)
def test_words_that_are_none_are_refused(text: str, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        words(text)


async def test_the_transform_is_latched(rig: Rig) -> None:
    given = words("--x 1 --roll 0.3 --frame-id map --child-frame-id lamp")
    await rig.start(Supervisor("room", children=[Child(StaticTransformPublisher, parameters=given)]))
    told = rig.probe(TF_STATIC)
    await rig.quiet()
    ((transform,),) = [message.transforms for message in told]
    assert (transform.header.frame_id, transform.child_frame_id) == ("map", "lamp")
    assert Transform.from_msg(transform).rpy == pytest.approx((0.3, 0.0, 0.0))


@pytest.mark.parametrize(
    ("parameters", "why"),
    [
        ({"frame_id": "map"}, "needs two frames"),
        ({"frame_id": "map", "child_frame_id": "lamp", "rotation.w": 0.0}, "rotation not of length 0"),
    ],
)
async def test_a_start_without_frames_or_rotation_fails(rig: Rig, parameters: dict[str, Any], why: str) -> None:
    rig.expect_failure(InvalidArgumentException)
    with pytest.raises(StartFailed, match=why):
        await rig.start(Supervisor("room", children=[Child(StaticTransformPublisher, parameters=parameters)]))


async def test_two_of_them_stand_in_a_launch_file_with_their_words(rig: Rig, tmp_path: Path) -> None:
    nodes = "".join(
        f"""
        Node(package='tf2_ros', executable='static_transform_publisher', name='{child}_mount',
             arguments=['--z', '0.5', '--frame-id', '{parent}', '--child-frame-id', '{child}']),
        """
        for parent, child in (("map", "lamp"), ("lamp", "bulb"))
    )
    await rig.start(launch(python(tmp_path, nodes)).tree())
    told = rig.probe(TF_STATIC)
    await rig.until(lambda: len(told) == 2)
    found = {
        (one.header.frame_id, one.child_frame_id, one.transform.translation.z)
        for (one,) in (m.transforms for m in told)
    }
    assert found == {("map", "lamp", 0.5), ("lamp", "bulb", 0.5)}
