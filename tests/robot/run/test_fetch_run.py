"""`python -m robot run --fetch` as its users meet it, and the arm's nodes by themselves (E-11)."""

from __future__ import annotations

from pathlib import Path

import pytest

from actors.testing import Rig
from robot.run.tree_nodes import nodes_of, only
from robot.sim.kinematic import KinematicBody
from tests.robot.run.test_run import KINEMATIC, robot, run
from tests.robot.stage import KITCHEN, robot_around


def test_a_run_for_something_out_of_sight_ends_with_the_reason_and_has_not_moved(tmp_path: Path) -> None:
    done, report = run(tmp_path, *KINEMATIC, "--world", "kitchen", "--fetch", "box", "--duration", "60")
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == "robot run: --fetch box: not done: aborted: confirm: box is not in sight"
    assert report["failure"] == "--fetch box: not done: aborted: confirm: box is not in sight"
    (task,) = report["goals"]
    assert (task["name"], task["outcome"], task["reason"]) == (
        "fetch box",
        "aborted",
        "confirm: box is not in sight",
    )
    assert report["distance_walked"] == 0.0
    assert report["simulated_seconds"] < 10.0


@pytest.mark.slow(reason="the whole task")
def test_the_run_fetches_a_cup_sits_down_with_it_and_ends(tmp_path: Path) -> None:
    done, report = run(tmp_path, *KINEMATIC, "--world", "kitchen", "--fetch", "cup", "--seed", "2", "--duration", "60")
    assert done.returncode == 0, done.stderr
    (task,) = report["goals"]
    assert (task["name"], task["outcome"]) == ("fetch cup", "succeeded")
    assert task["true_error"] < 0.05
    assert report["arm"]
    assert report["last"]["held"] == "cup"
    assert report["last"]["body_height"] < 0.22
    assert report["simulated_seconds"] < 40.0
    assert report["contacts"] == {}
    stages = [line.split()[3] for line in done.stderr.splitlines() if "[/carrier] thing=cup" in line]
    assert stages == ["calibrate", "confirm", "navigate", "grab"]


def test_a_robot_with_an_arm_may_patrol_as_ever(tmp_path: Path) -> None:
    done, report = run(tmp_path, *KINEMATIC, "--arm", "--duration", "4")
    assert done.returncode == 0, done.stderr
    (joints,) = [topic for topic in report["topics"] if topic["name"] == "/arm/joint_states"]
    assert joints["rate"] == pytest.approx(50.0, rel=0.02)
    assert report["distance_walked"] > 0.3


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--fetch", "cup"), "the world 'warehouse' has no cup; the world 'kitchen' has one: add --world kitchen"),
        (("--fetch", "mug"), "the world 'warehouse' has no such thing; there is nothing"),
        (
            ("--world", "kitchen", "--fetch", "cup", "100", "100"),
            "--fetch cup 100 100 0: that is outside of the world 'kitchen', where x is -3 to 7 m and y is -4 to 4 m",
        ),
        (
            ("--world", "kitchen", "--fetch", "cup", "1.9", "-1"),
            "something 0.4 m high stands there; give Z of at least 0.4 m",
        ),
        (("--world", "kitchen", "--fetch", "cup", "4", "0", "-1"), "that is below the floor; give Z of at least 0 m"),
        (
            ("--world", "kitchen", "--fetch", "cup", "1.9", "-1", "3"),
            "there is no place to stand from which the arm reaches that",
        ),
        (("--world", "kitchen", "--fetch", "mug"), "has no such thing; there is cup, box"),
        (("--world", "kitchen", "--fetch", "Cup"), "has no such thing; did you mean cup?"),
        (("--world", "kitchen", "--fetch", "cup", "1"), "--fetch takes NAME, NAME X Y or NAME X Y Z, not 1 numbers"),
        (("--world", "kitchen", "--fetch", "cup", "here", "there"), "X, Y and Z are numbers"),
        (("--world", "kitchen", "--fetch", "cup", "nan", "0"), "must be finite"),
        (("--world", "kitchen", "--fetch", "cup", "--goal", "1", "1"), "one task at a time"),
    ],
)
def test_a_task_that_cannot_be_run_is_one_line_and_exit_code_2(words: tuple[str, ...], complaint: str) -> None:
    done = robot("run", *KINEMATIC, *words)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith("robot run: ")
    assert complaint in line


@pytest.mark.parametrize("name", ["arm", "object_confirmation", "fetch"])
async def test_each_node_of_the_arm_runs_alone_and_with_those_that_come_later(rig: Rig, name: str) -> None:
    tree = robot_around(KinematicBody(KITCHEN, seed=1, arm=True))
    system = await rig.start(only(tree, [name]))
    await rig.advance(0.5)
    for child in nodes_of(tree):
        if child.name != name:
            await system.join(child)
    await rig.advance(1.0)
    assert rig.incarnation(name) == 1
    assert not [record for record in rig.logs if record.level >= 40]


OTHERS = [
    pytest.param(name, marks=pytest.mark.slow(reason="other nodes of the same task"))
    for name in ("fetch", "object_confirmation", "navigation")
]


@pytest.mark.parametrize("crashed", ["arm", *OTHERS])
def test_a_task_is_done_although_a_node_that_it_needs_crashes_on_the_way(tmp_path: Path, crashed: str) -> None:
    done, report = run(
        tmp_path, *KINEMATIC, "--world", "kitchen", "--fetch", "cup", "--duration", "60", "--crash", f"{crashed}@9"
    )
    assert done.returncode == 0, done.stderr
    assert [goal["outcome"] for goal in report["goals"]] == ["succeeded"]
    assert report["last"]["held"] == "cup"
    assert [one["incarnation"] for one in report["nodes"] if one["name"] == f"/{crashed}"] == [2]
