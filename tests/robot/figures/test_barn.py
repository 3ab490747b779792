"""Fields never seen before: the command that measures them, and a robot that gets through without a map or its true pose."""

from __future__ import annotations

import json
from itertools import takewhile
from pathlib import Path
from typing import Any

import pytest

from cli.command import UsageError
from robot.geometry.planar import Pose2
from robot.navigation.motion import State
from tests.figures.__main__ import main
from tests.figures.barn_run import Walk, run, score
from tests.figures.barn_worlds import find_worlds, read_world
from tests.figures.unmapped import unmapped_grid


def write(folder: Path, index: int = 7, **changes: Any) -> Path:
    """A small world: two rows of posts across the way, with gaps of 1.2 m on different sides."""
    posts = [
        (x / 10, y) for y, free in ((2.0, 4), (4.0, -4)) for x in range(-16, 17, 2) if not free - 6 <= x <= free + 6
    ]
    world = {
        "idx": index, "radius": 0.075, "start": [0.0, 0.0, 1.5708], "goal": [0.0, 6.0], "goal_radius": 1.0,
        "cylinders": posts, "ref_path": [[0.0, 0.0], [0.0, 6.0]], "ref_length": 6.5,
    }  # fmt: skip
    file = folder / f"world_{index:03}.json"
    file.write_text(json.dumps(world | changes), encoding="utf-8")
    return file


def test_a_world_file_becomes_a_scene(tmp_path: Path) -> None:
    world = read_world(write(tmp_path))
    assert world.index == 7
    assert world.scene.start == Pose2(0.0, 0.0, 1.5708)
    assert (world.goal, world.goal_radius) == (Pose2(0.0, 6.0), 1.0)
    assert world.optimal_time == pytest.approx(3.25)
    assert all(post.radius == 0.075 for post in world.scene.obstacles)  # type: ignore[union-attr]


@pytest.mark.parametrize(("seconds", "points"), [(1.0, 0.5), (6.5, 0.5), (13.0, 0.25), (26.0, 0.125), (90.0, 0.125)])
def test_the_score_is_half_at_best_and_an_eighth_at_least(tmp_path: Path, seconds: float, points: float) -> None:
    assert score(read_world(write(tmp_path)), seconds) == pytest.approx(points)


@pytest.mark.parametrize(
    ("changes", "hint"),
    [
        ({"cylinders": "none"}, "Expected `array`"),
        ({"ref_length": 0.0}, "must be positive"),
        ({"start": [0.0, 0.0]}, "start"),
    ],
)
def test_a_file_that_is_no_world_is_refused_by_name(tmp_path: Path, changes: dict[str, Any], hint: str) -> None:
    file = write(tmp_path, **changes)
    with pytest.raises(UsageError, match=hint) as refused:
        read_world(file)
    assert str(file) in str(refused.value)


def test_a_folder_without_worlds_and_a_world_that_it_lacks_are_usage_errors(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"holds no \.json file"):
        find_worlds(tmp_path)
    with pytest.raises(UsageError, match="there is no"):
        find_worlds(tmp_path / "nowhere")
    write(tmp_path)
    with pytest.raises(UsageError, match="has no world 8; it has: 7"):
        find_worlds(tmp_path, [8])


def test_the_map_begins_empty_and_reaches_beyond_start_and_goal() -> None:
    grid = unmapped_grid(Pose2(0.0, 0.0), Pose2(0.0, 10.0))
    assert not grid.occupied.any()
    assert grid.bounds == pytest.approx((-5.0, -5.0, 5.0, 15.0))


def test_the_robot_is_told_nothing_but_what_it_senses(tmp_path: Path) -> None:
    """Elsewhere in the world, turned: the robot's own frame begins where it stands, so it does the same."""
    here = read_world(write(tmp_path))
    moved = [[y + 3.0, -x - 2.0] for x, y in json.loads((tmp_path / "world_007.json").read_text())["cylinders"]]
    there = read_world(write(tmp_path, 8, start=[3.0, -2.0, 0.0], goal=[9.0, -2.0], cylinders=moved))
    paths = []
    for world in (here, there):
        walk = Walk(world, "kinematic", 1)
        steps = walk.steps()
        for _ in range(40):
            next(steps)
        paths.append(walk.pose())
    assert (paths[0].x, paths[0].y) == pytest.approx((paths[1].x, paths[1].y), abs=0.05)
    assert abs(paths[0].x) > 0.5


def test_the_robot_winds_through_a_field_in_physics(tmp_path: Path) -> None:
    outcome = run(read_world(write(tmp_path)), "physics", 1)
    assert outcome.ended == "success"
    assert outcome.score > 0.25


@pytest.mark.slow(reason="a long walk")
def test_a_wall_that_nothing_leads_through_ends_in_giving_up_not_in_contact(tmp_path: Path) -> None:
    ring = [(x / 10, y) for y in (-1.5, 1.8) for x in range(-18, 19, 2)]
    ring += [(x, y / 10) for x in (-1.8, 1.8) for y in range(-15, 19, 2)]
    walk = Walk(read_world(write(tmp_path, cylinders=ring)), "kinematic", 1)
    *_, last = takewhile(lambda motion: walk.seconds < 60.0, walk.steps())
    assert walk.touched == ""
    assert last.state is State.FAILED
    assert last.failure is not None
    assert last.failure.name == "PathBlocked"
    assert walk.ended == "gave up"


def test_the_command_prints_every_run_and_the_summary(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path, 7)
    write(tmp_path, 9, cylinders=[])
    assert main(["barn", str(tmp_path), "--backend", "kinematic", "--worlds", "9", "--seeds", "1", "2"]) == 0
    said = capsys.readouterr()
    assert (
        "back end kinematic, sensors real, actuators ideal, hull sheet; pose: legs and IMU alone; map: LiDAR alone"
        in said.out
    )
    assert "seeds 1, 2; " in said.out
    assert "2 runs: 2 successes (100.0 %), 0 collisions, 0 falls, 0 time-outs, 0 given up" in said.out
    assert "score 0.5000 of 0.5 (acceptable 0.25, good 0.48, excellent 0.495): excellent" in said.out
    assert said.err.count("success") == 2


def test_the_command_prints_json_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path, 9, cylinders=[])
    main(["barn", str(tmp_path), "--backend", "kinematic", "--json"])
    result = json.loads(capsys.readouterr().out)
    assert (result["backend"], result["runs"], result["ends"]["success"]) == ("kinematic", 1, 1)
    assert result["machine"]["cores"] > 0
    assert result["outcomes"][0]["score"] == 0.5
