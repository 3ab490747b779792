"""The parts of fetching that need no node: where to stand, how to reach, what is told, what things look like."""

from __future__ import annotations

from itertools import pairwise
from math import hypot

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.tf2 import Transform
from robot.geometry.planar import Pose2
from robot.model.arm import MOUNT, OutOfReach, forward
from robot.nodes.skills import Stalled
from robot.nodes.task_feedback import TaskFeedback
from robot.planning.grasp import ABOVE, STANDING, Spot, approach, stands
from robot.scenes.objects import color_name, looks_of
from robot.scenes.scene import Box, Cylinder, Thing

STAGES = (("first", 0.0), ("second", 10.0), ("third", 60.0))


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(0.05, 0.9))
def test_from_every_standing_place_the_arm_comes_over_the_thing_and_to_it(x: float, y: float, z: float) -> None:
    spot = Spot(x, y, z)
    places = list(stands(spot, Pose2(0.0, 0.0)))
    assert len(places) == 10
    for place in places:
        body = Transform.planar(place.x, place.y, place.yaw)
        seen = Spot(*body.inverse().point((x, y, z - STANDING)))
        way = approach(seen)
        tip = [a - b for a, b in zip(seen, MOUNT, strict=True)]
        assert forward(way.at)[:3] == pytest.approx(tip, abs=1e-9)
        assert forward(way.above)[:3] == pytest.approx((tip[0], tip[1], tip[2] + ABOVE), abs=1e-9)
        assert hypot(place.x - x, place.y - y) > 0.55, "not with its nose over it"


def test_what_is_too_high_has_no_place_and_what_is_too_far_is_out_of_reach() -> None:
    assert list(stands(Spot(1.0, 0.0, 3.0), Pose2(0.0, 0.0))) == []
    with pytest.raises(OutOfReach):
        approach(Spot(2.5, 0.0, 0.3))


@given(st.lists(st.tuples(st.sampled_from(["first", "second", "third"]), st.floats(-1.0, 2.0), st.floats(-1.0, 9.0))))
def test_a_story_never_goes_back(steps: list[tuple[str, float, float]]) -> None:
    story = TaskFeedback(STAGES, 5.0)
    told = [story.tell(*step) for step in steps]
    order = [[name for name, _ in STAGES].index(one.stage) for one in told]
    assert order == sorted(order)
    assert all(a.distance >= b.distance >= 0.0 for a, b in pairwise(told))
    assert all(a.percent <= b.percent <= 100.0 for a, b in pairwise(told))


def test_a_story_tells_each_stage_from_its_beginning_to_its_end() -> None:
    story = TaskFeedback(STAGES, 5.0)
    assert story.tell("first", 1.0) == ("first", 5.0, 10.0)
    assert story.tell("second", 0.5, 2.0) == ("second", 2.0, 35.0)
    assert story.tell("third", 1.0, 0.0) == ("third", 0.0, 100.0)


@pytest.mark.parametrize(
    ("color", "name"),
    [
        ((200, 20, 20), "red"),
        ((220, 20, 60), "red"),
        ((30, 160, 40), "green"),
        ((20, 20, 220), "blue"),
        ((230, 220, 20), "yellow"),
    ],
)
def test_colors_have_the_names_that_detections_use(color: tuple[int, int, int], name: str) -> None:
    assert color_name(color) == name


def test_a_look_is_color_thickness_and_height() -> None:
    cup = Thing("cup", Cylinder(0.0, 0.0, 0.03, 0.1), (200, 20, 20))
    brick = Thing("brick", Box(0.0, 0.0, 0.2, 0.05, height=0.06), (20, 20, 220))
    looks = looks_of((cup, brick))
    assert (looks["cup"].label, looks["cup"].thickness, looks["cup"].height) == ("red", 0.06, 0.1)
    assert (looks["brick"].label, looks["brick"].thickness, looks["brick"].height) == ("blue", 0.05, 0.06)


def test_a_walk_is_stalled_only_near_its_goal_and_when_it_neither_nears_nor_turns() -> None:
    far, near, turning = Stalled(), Stalled(), Stalled()
    for tick in range(100):
        now = tick / 10
        assert not far.at(now, 0.5, 0.0)
        assert not turning.at(now, 0.1, 0.02 * tick)
        assert near.at(now, 0.1, 0.0) == (now > 2.5)
