"""`robactor check`: what it finds of maps and machines, and its exit code."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from cli.entry import main
from robot.commands import checks
from robot.nodes.map_files import Occupancy, write_map


def hall(*, door: float, cell: float = 0.05) -> Occupancy:
    """Two rooms of 6 m by 6 m beside each other, with a door of this width (m) between them."""
    cells = np.full((round(6 / cell), round(12 / cell)), 100, dtype=np.int8)
    cells[1:-1, 1:-1] = 0
    middle, half = cells.shape[0] // 2, round(door / cell / 2)
    cells[:, cells.shape[1] // 2] = 100
    cells[middle - half : middle + half, cells.shape[1] // 2] = 0
    return Occupancy(cells, cell)


def saved(path: Path, occupancy: Occupancy) -> Path:
    return Path(write_map(occupancy, str(path / "hall")))


def causes(path: Path) -> list[str]:
    return [finding.cause for finding in checks.map_file(path)()]


def test_a_map_whose_rooms_are_connected_is_good(tmp_path: Path) -> None:
    assert causes(saved(tmp_path, hall(door=1.2))) == []


def test_a_door_that_is_too_narrow_is_found(tmp_path: Path) -> None:
    assert causes(saved(tmp_path, hall(door=0.4))) == ["parts of the floor cannot be reached from each other"]


def test_a_map_of_large_cells_and_one_without_room_are_found(tmp_path: Path) -> None:
    assert causes(saved(tmp_path, hall(door=2.0, cell=0.2))) == ["gaps are hidden"]
    assert causes(saved(tmp_path, Occupancy(hall(door=1.2).data, 0.004))) == ["the robot fits nowhere"]


def test_a_map_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    assert causes(tmp_path / "none.yaml") == ["it cannot be read"]


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checks, "WALK", 0.3)
    monkeypatch.setattr(checks, "TICKS", 5)
    monkeypatch.setattr(checks, "TOO_LATE", 100.0)


def test_a_machine_is_measured_and_a_slow_one_is_a_problem(
    quick: None, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(checks, "ENOUGH", 0.0)
    monkeypatch.setattr(checks, "SCARCE", 100.0)
    assert main(["check"]) == 0
    out = capsys.readouterr().out
    assert "ok       physics\nnote     speed: there is little reserve\n" in out
    monkeypatch.setattr(checks, "SCARCE", 0.0)
    assert main(["check"]) == 1
    assert "problem  speed: this machine is too slow for the robot on the real clock" in capsys.readouterr().out


def test_what_it_finds_is_json_and_a_wrong_environment_is_a_problem(
    quick: None, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_conext")
    assert main(["check", "--json"]) == 1
    results = {one["check"]: one["findings"] for one in json.loads(capsys.readouterr().out)}
    assert results["network"][0]["measured"].startswith("RMW_IMPLEMENTATION is rmw_conext")


def test_memory_that_holds_copies_of_files_is_free(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def notes(available: str) -> list[str]:
        (tmp_path / "meminfo").write_text(f"MemTotal: 24731708 kB\nMemFree: 4096 kB\n{available}")
        monkeypatch.setattr(checks, "MEMINFO", tmp_path / "meminfo")
        return [finding.measured for finding in checks.room() if finding.subject == "memory"]

    assert notes("MemAvailable: 21404000 kB\n") == []
    assert notes("MemAvailable: 100000 kB\n") == ["0.1 GB"]
    assert notes("") == []
