"""The named worlds: every place can be stood at, every passage a robot of 1.1 x 0.5 m should take is wide enough."""

from __future__ import annotations

import itertools
import math
import pickle
from dataclasses import replace

import pytest

from robot.geometry.planar import Pose2
from robot.planning.grid import Grid
from robot.planning.planner import Planner
from robot.scenes.scene import Cylinder, Pit, Walker
from robot.scenes.worlds import WORLDS, UnknownWorld, get_world
from tests.robot.navigation.navigation_sim import body_clearance
from tests.robot.stage import apart

TURNING = math.hypot(1.1, 0.5) / 2


def test_an_unknown_world_names_the_closest() -> None:
    with pytest.raises(UnknownWorld, match="did you mean 'warehouse'"):
        get_world("warehose")
    with pytest.raises(UnknownWorld, match=r"warehouse.*empty.*corridor.*pillars"):
        get_world("moon")


def test_the_warehouse_is_the_default_and_is_furnished() -> None:
    scene = get_world()
    assert scene.name == "warehouse" == WORLDS[0]
    shelves = [name for name in scene.places if name.startswith("shelf_")]
    assert len(shelves) >= 4
    assert {"start", "dock"} <= set(scene.places)


@pytest.mark.parametrize("name", WORLDS)
def test_every_pose_of_a_world_keeps_a_quarter_meter_around_the_body(name: str) -> None:
    scene = get_world(name)
    x0, y0, x1, y1 = scene.bounds
    for pose in (scene.start, scene.dock, *scene.patrol, *scene.places.values()):
        assert x0 + 0.5 < pose.x < x1 - 0.5
        assert y0 + 0.5 < pose.y < y1 - 0.5
        assert body_clearance(scene, pose) >= 0.25, pose


@pytest.mark.parametrize("name", WORLDS)
def test_a_patrol_has_four_stops_at_least_four_meters_apart_and_leads_home(name: str) -> None:
    scene = get_world(name)
    planner = Planner(Grid.from_scene(scene))
    stops = (scene.start, *scene.patrol)
    assert len(scene.patrol) >= 4
    assert all(apart(a, b) >= 3.99 for a, b in itertools.pairwise(scene.patrol))
    for a, b in [*itertools.pairwise(stops), (stops[-1], scene.dock)]:
        assert planner.plan(a, b).length >= apart(a, b) - 1e-9


def test_in_the_warehouse_a_straight_line_to_some_stop_is_blocked_and_paths_are_wide() -> None:
    scene = get_world("warehouse")
    grid = Grid.from_scene(scene)
    planner = Planner(grid)
    blocked = 0
    for a, b in itertools.pairwise((scene.start, *scene.patrol, scene.dock)):
        line = [Pose2(a.x + (b.x - a.x) * k / 100, a.y + (b.y - a.y) * k / 100) for k in range(101)]
        blocked += any(grid.occupied[cell] for p in line if (cell := grid.cell(p.x, p.y)) is not None)
        for x, y in planner.plan(a, b).spaced(0.05).points:
            cell = grid.cell(x, y)
            assert cell is not None
            assert grid.clearance[cell] >= TURNING + 0.05, "there is room to turn everywhere on the way"
    assert blocked >= 2


def test_worlds_are_values_that_compare_equal() -> None:
    assert get_world("pillars").obstacles == get_world("pillars").obstacles


@pytest.mark.parametrize("name", WORLDS)
def test_a_scene_can_be_copied_to_another_process_with_all_that_is_in_it(name: str) -> None:
    person = Walker(Cylinder(1.0, 1.0, 0.2, mapped=False), way=((1.0, 1.0), (2.0, 1.0)))
    scene = replace(get_world(name), pits=(Pit(3.0, 0.0, 0.3, 0.3, 0.2),), walkers=(person,))
    copy = pickle.loads(pickle.dumps(scene))
    assert copy == scene
    assert type(copy.places) is type(scene.places)
