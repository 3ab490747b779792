"""`python -m robot picture`: what it writes, and how it refuses."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from robot.picture import main
from tests.robot.picture.kit import decoded


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["--world", "wherehouse"], "did you mean 'warehouse'"),
        (["--size", "12"], "WIDTHxHEIGHT"),
        (["--size", "0x100"], "give 64x64 to 4096x4096"),
        (["--size", "64x99999"], "give 64x64 to 4096x4096"),
        (["--at", "-1"], "--at -1"),
        (["--at", "nan"], "--at nan"),
        (["--seed", "-1"], "-1 is no seed: give a whole number of at least 0"),
        (["--renderer", "mujoco", "--arm"], "draws no arm"),
        (["--fetch", "cup"], "the world 'kitchen' has one: add --world kitchen"),
        (["--goal", "100", "0"], "outside of the world 'warehouse'"),
        (["--goal", "1", "0", "--fetch", "cup"], "one task at a time"),
    ],
)
def test_what_cannot_be_drawn_is_one_line_and_code_2(
    words: list[str], reason: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(tmp_path / "picture.png"), *words]) == 2
    said = capsys.readouterr().err
    assert reason in said
    assert said.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_file_that_cannot_be_written_is_said_before_anything_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for path, reason in ((tmp_path / "away" / "x.png", "there is no folder"), (tmp_path, "that is a folder")):
        assert main([str(path)]) == 2
        said = capsys.readouterr().err
        assert reason in said
        assert said.count("\n") == 1


def test_words_it_does_not_know_are_one_line_too(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--renderer", "crayon"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("robot picture: argument --renderer: invalid choice: 'crayon'")
    assert said.endswith("(see robactor picture --help)\n")
    assert said.count("\n") == 1


@pytest.mark.parametrize("name", ["x.jpg", "x", "x.png.gif"])
def test_another_suffix_than_that_of_what_is_written_is_refused(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(tmp_path / name)]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"robot picture: {tmp_path / name}: ")
    assert ".png" in said.removeprefix(f"robot picture: {tmp_path / name}: ")
    assert said.count("\n") == 1


def test_without_mujoco_its_renderer_says_so_in_one_line(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    assert main([str(tmp_path / "x.png"), "--renderer", "mujoco"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("robot picture: --renderer mujoco: MuJoCo cannot be imported")
    assert said.count("\n") == 1


def test_without_opengl_its_renderer_says_so_in_one_line(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mujoco = pytest.importorskip("mujoco")

    def broken(*_: object) -> None:
        raise AttributeError("no glGetError.\nand more lines")

    monkeypatch.setattr(mujoco, "Renderer", broken)
    assert main([str(tmp_path / "x.png"), "--renderer", "mujoco"]) == 2
    said = capsys.readouterr().err
    assert "OpenGL is not available here (no glGetError)" in said
    assert said.count("\n") == 1


def test_the_same_seed_draws_the_same_bytes(tmp_path: Path) -> None:
    words = ["--size", "96x64", "--at", "0.4", "--backend", "kinematic", "--world", "empty", "--seed", "7"]
    first, again = tmp_path / "first.png", tmp_path / "again.png"
    assert main([str(first), *words]) == 0
    assert main([str(again), *words]) == 0
    assert first.read_bytes() == again.read_bytes()
    height, width, _ = decoded(first.read_bytes()).shape
    assert (width, height) == (96, 64)


def test_the_robot_is_caught_in_mid_stride_with_its_plan_and_its_trail() -> None:
    from robot import Robot
    from robot.picture.watched_run import record

    seen = record(Robot("warehouse", body="kinematic", mission="patrol", seed=1), seed=1, at=4.0)
    assert 4.0 <= seen.time <= 4.5
    assert seen.times[-1] == pytest.approx(seen.time)
    assert seen.trail[-1] == pytest.approx((seen.pose.x, seen.pose.y))
    assert seen.trail[-1] != pytest.approx(seen.trail[-25], abs=0.1)  # it walks
    assert len(seen.path) >= 2
    assert len(seen.footprints) > 4


def test_a_task_is_pictured_with_the_arm_and_the_things_where_they_are() -> None:
    from robot import Robot
    from robot.nodes.carrier import Delivery
    from robot.picture.watched_run import record

    robot = Robot("kitchen", body="kinematic", mission=Delivery("cup", (2.0, 1.0, 0.45)), seed=1)
    seen = record(robot, seed=1, at=2.0)
    assert seen.arm is not None
    assert len(seen.arm) == 4
    assert [thing.name for thing in seen.things] == ["cup", "box"]
    assert record(Robot("kitchen", body="kinematic", seed=1), seed=1, at=0.1).arm is None


@pytest.mark.slow(reason="two walks and two pictures")
def test_without_a_time_a_world_with_things_is_caught_beside_them(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for world, second in (("kitchen", "5."), ("empty", "24.")):
        words = ["--world", world, "--backend", "kinematic", "--size", "64x64"]
        assert main([str(tmp_path / "x.png"), *words]) == 0
        assert f"in {world} at {second}" in capsys.readouterr().err


DOCS = Path(__file__).parents[3] / "docs"


@pytest.mark.parametrize("name", ["walking.png", "fetching.png"])
def test_the_pictures_of_the_documents_are_ours_and_small(name: str) -> None:
    data = (DOCS / name).read_bytes()
    assert len(data) < 400_000
    assert decoded(data).shape == (675, 1200, 3)
    pages = [page.read_text(encoding="utf-8") for page in (*DOCS.rglob("*.md"), DOCS.parent / "README.md")]
    assert any(f"robactor picture docs/{name}" in page for page in pages)
