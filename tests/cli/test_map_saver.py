"""`map_saver_cli`: the map that a robot publishes, as a file that a robot is given."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from robot.nodes.map_files import read_map
from robot.planning.grid import Grid
from robot.scenes.worlds import get_world
from tests.cli.conftest import Command, Start


@pytest.fixture
async def map_server(start: Start) -> None:
    """The robot's map server alone, in another process."""
    words = ("run", "--backend", "kinematic", "--world", "corridor", "--only", "map_server", "--no-web")
    process = await start(*words)
    while b"robot running" not in (line := await process.stderr.readline()):
        assert line


async def test_the_map_of_a_running_robot_is_saved_and_read_back(
    map_server: None, robot: Command, tmp_path: Path
) -> None:
    words = ("-f", str(tmp_path / "hall"), "--timeout", "20")
    saved = await robot("run", "nav2_map_server", "map_saver_cli", *words)
    assert (saved.code, saved.out) == (0, f"Map of 248 X 208 @ 0.05 m/cell saved to {tmp_path / 'hall.yaml'}\n")
    found = read_map(tmp_path / "hall.yaml")
    expected = Grid.from_scene(get_world("corridor"))
    assert np.array_equal(found.grid().occupied, expected.occupied)
    assert found.grid().bounds == pytest.approx(expected.bounds, abs=1e-5)
    scale = await robot("map_saver_cli", *words, "--mode", "scale")
    assert (scale.code, (tmp_path / "hall.png").exists()) == (0, True)
    raw = await robot("map_saver_cli", *words, "--mode", "raw", "--fmt", "png")
    assert raw.code == 0
    assert np.array_equal(read_map(tmp_path / "hall.yaml").data, found.data)


async def test_what_cannot_be_saved_is_one_line(robot: Command, tmp_path: Path) -> None:
    nobody = await robot("map_saver_cli", "-t", "nowhere", "--timeout", "0.5")
    assert (nobody.code, "no map on /nowhere for 0.5 s" in nobody.err) == (1, True)
    misnamed = await robot("map_saver_cli", "-t", "bad name")
    assert misnamed.code == 1
    (line,) = misnamed.err.splitlines()
    assert "/bad name" in line and "ROBACTOR_TRACEBACK" not in line


async def test_thresholds_and_folders_that_cannot_be_are_one_line(
    map_server: None, robot: Command, tmp_path: Path
) -> None:
    crossed = await robot("map_saver_cli", "-f", str(tmp_path / "m"), "--occ", "0.1", "--timeout", "20")
    assert (crossed.code, "the map is not saved: thresholds of 0.196 and 0.1" in crossed.err) == (1, True)
    nowhere = await robot("map_saver_cli", "-f", str(tmp_path / "no" / "m"), "--timeout", "20")
    assert (nowhere.code, "No such file or directory" in nowhere.err) == (1, True)
