"""The charging station and the kitchen: where things stand, by the beam that meets them."""

from __future__ import annotations

import dataclasses
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from robot.geometry.planar import Pose2
from robot.planning.grid import signed_distance
from robot.scenes.dock import BEFORE, FACE_AHEAD, FACE_WIDTH, has_station, station
from robot.scenes.kitchen import BOARD, OTHER_TABLE, TABLE, kitchen
from robot.scenes.objects import color_name, looks_of
from robot.scenes.scene import Box, Cylinder, Scene, Thing
from robot.scenes.worlds import WORLDS, get_world
from robot.sim.lidar_rays import cast

docks = st.builds(Pose2, st.floats(-9.0, 9.0), st.floats(-9.0, 9.0), st.floats(-3.1, 3.1))


def world(*obstacles: Box | Cylinder) -> Scene:
    return Scene("one", (-20.0, -20.0, 20.0, 20.0), obstacles, Pose2(0.0, 0.0), Pose2(0.0, 0.0))


@given(docks)
def test_the_face_stands_85_cm_ahead_of_the_docked_body_and_is_40_cm_wide(dock: Pose2) -> None:
    ranges = cast(world(station(dock)), dock.x, dock.y, dock.yaw)
    assert ranges[180] == pytest.approx(FACE_AHEAD) == pytest.approx(0.85)
    seen = (ranges < 10.0).sum()
    assert seen == pytest.approx(math.degrees(2 * math.atan(FACE_WIDTH / 2 / FACE_AHEAD)), abs=1.01)
    for side in (-1, 1):
        corner = Rotation.from_euler("z", dock.yaw).apply((0.85, side * 0.2, 0.0))
        assert signed_distance(station(dock), dock.x + corner[0], dock.y + corner[1]) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("name", WORLDS)
def test_a_world_has_a_station_unless_its_dock_is_but_a_place(name: str) -> None:
    scene = get_world(name)
    assert has_station(scene) == (name not in ("empty", "kitchen"))
    bare = dataclasses.replace(scene, obstacles=())
    assert not has_station(bare)
    assert has_station(dataclasses.replace(bare, obstacles=(station(scene.dock),)))
    assert not has_station(dataclasses.replace(scene, dock=Pose2(50.0, 50.0)))


def test_the_approach_begins_straight_behind_the_docked_place() -> None:
    assert Pose2(-0.8, 0.0, 0.0) == BEFORE


def test_the_cup_stands_on_its_table_wherever_it_is_put() -> None:
    for scene in (kitchen(), kitchen((2.1, 0.9))):
        cup, box = scene.things
        assert (cup.name, box.name) == ("cup", "box")
        assert signed_distance(TABLE, cup.shape.x, cup.shape.y) < -cup.shape.radius
        assert cup.z == TABLE.height == 0.45
        assert box.z == BOARD
    assert kitchen().things[0].shape.x == 2.0
    assert signed_distance(OTHER_TABLE, 1.9, -1.0) < 0.0, "where the manual has the cup carried to"


def test_the_lidar_looks_over_the_tables_of_the_kitchen_and_meets_its_walls() -> None:
    scene = kitchen()
    over, under = (cast(scene, 1.0, 1.0, 0.0, height=height) for height in (0.5, 0.3))
    assert over[180] == pytest.approx(6.0)
    assert under[180] == pytest.approx(2.05 - 0.15 - 1.0)


@given(st.floats(0.01, 0.5), st.floats(0.01, 0.5), st.floats(0.005, 0.2))
def test_a_thing_is_as_thick_as_the_thinner_of_its_sides(length: float, width: float, radius: float) -> None:
    red = (200, 0, 0)
    assert Thing("brick", Box(0, 0, length, width), red).thickness == min(length, width)
    assert Thing("cup", Cylinder(0, 0, radius), red).thickness == 2 * radius


@pytest.mark.parametrize(
    ("degrees", "name"), [(0, "red"), (29, "red"), (31, "yellow"), (89, "yellow"), (91, "green"), (179, "green"), (181, "blue"), (299, "blue"), (301, "red")]
)  # fmt: skip
def test_a_hue_has_the_nearest_name_and_red_is_at_both_ends(degrees: float, name: str) -> None:
    hue, rest = divmod(degrees, 60)
    rising, falling = round(200 * rest / 60), round(200 * (1 - rest / 60))
    color = [
        (200, rising, 0),
        (falling, 200, 0),
        (0, 200, rising),
        (0, falling, 200),
        (rising, 0, 200),
        (200, 0, falling),
    ][int(hue)]
    assert color_name(color) == name


def test_looks_are_known_by_the_things_names() -> None:
    looks = looks_of(kitchen().things)
    assert {name: look.label for name, look in looks.items()} == {"cup": "red", "box": "blue"}
    assert (looks["cup"].thickness, looks["cup"].height) == (0.07, 0.10)
