"""Object confirmation (X-03): when detections of the camera agree, when they do not, and when there are none."""

from __future__ import annotations

import asyncio
from math import nan

import pytest

from actors import Child
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import Point
from actors.interfaces.std_msgs.msg import Header
from actors.testing import Rig
from robot.contracts import CONFIRM_OBJECT, DETECTIONS
from robot.interfaces.robactor_msgs.msg import Detection
from robot.interfaces.robactor_msgs.srv import ConfirmObject, ConfirmObject_Response
from robot.nodes.confirm import ObjectConfirmation
from robot.scenes.objects import Look

LOOKS = {"cup": Look("red", 0.07, 0.10)}


AT_FIRST = Time()


def seen(x: float, y: float = 0.0, label: str = "red", frame: str = "base_link", stamp: Time = AT_FIRST) -> Detection:
    return Detection(header=Header(stamp=stamp, frame_id=frame), label=label, position=Point(x=x, y=y, z=0.1))


async def asked(rig: Rig, *detections: Detection, name: str = "cup") -> ConfirmObject_Response:
    """What is answered when these are seen, five a second."""
    await rig.start(Child(ObjectConfirmation, args=(LOOKS,)))
    answer = asyncio.ensure_future(rig.call(CONFIRM_OBJECT, ConfirmObject.Request(object_name=name), timeout=3.0))
    for detection in detections:
        await rig.advance(0.2)
        rig.publish(DETECTIONS, detection)
    return await answer


async def test_three_detections_in_one_place_confirm_and_tell_the_objects_middle(rig: Rig) -> None:
    answer = await asked(rig, seen(1.0), seen(1.01), seen(1.0, label="blue"), seen(nan), seen(1.02))
    assert (answer.success, answer.message) == (True, "cup confirmed")
    assert rig.now == pytest.approx(1.0)
    assert answer.position.header.frame_id == "base_link"
    point = answer.position.point
    assert (point.x, point.y, point.z) == pytest.approx((1.01 + 0.8 * 0.035, 0.0, 0.1))


async def test_the_answer_is_stamped_with_the_picture_that_confirmed_it(rig: Rig) -> None:
    answer = await asked(rig, seen(1.0), seen(1.0), seen(1.0, stamp=Time(sec=7)))
    assert answer.position.header.stamp == Time(sec=7)


@pytest.mark.parametrize(
    ("places", "words"),
    [
        ((), "cup is not in sight"),
        ((1.0, 1.0), "cup was seen 2 times, but not 3 times in one place"),
        ((1.0, 1.3, 1.6, 1.9), "cup was seen 4 times, but not 3 times in one place"),
    ],
)
async def test_what_is_not_seen_steadily_is_not_confirmed(rig: Rig, places: tuple[float, ...], words: str) -> None:
    answer = await asked(rig, *(seen(x) for x in places))
    assert (answer.success, answer.message) == (False, words)
    assert rig.now == pytest.approx(1.5)


async def test_an_object_that_has_moved_is_where_it_was_seen_last(rig: Rig) -> None:
    answer = await asked(rig, *(seen(x) for x in (2.0, 2.0, 1.0, 1.0, 1.0)))
    assert answer.success
    assert answer.position.point.x == pytest.approx(1.0 + 0.8 * 0.035)


async def test_detections_in_a_frame_that_nobody_knows_do_not_count(rig: Rig) -> None:
    answer = await asked(rig, *(seen(1.0, frame="camera_link") for _ in range(3)))
    assert not answer.success
    assert answer.message.startswith("cup is not in sight: there is no frame 'base_link'")


async def test_an_object_of_another_name_is_not_looked_for(rig: Rig) -> None:
    answer = await asked(rig, name="mug")
    assert answer.message == "there is no object called 'mug'; known are: cup"
    assert rig.now == 0.0
