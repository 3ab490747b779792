"""`python -m robot run` as its users meet it: one process, its words, its report, its exit code."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from robot.nodes.map_files import Occupancy, write_map
from robot.planning.grid import Grid
from robot.scenes.worlds import get_world
from tests import warm

ROOT = warm.ROOT
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT), **warm.ONE_THREAD}


def robot(*words: str, timeout: float = 300.0) -> subprocess.CompletedProcess[str]:
    return warm.run(*words, env=ENVIRONMENT, timeout=timeout)


def run(tmp_path: Path, *words: str, timeout: float = 300.0) -> tuple[subprocess.CompletedProcess[str], dict[str, Any]]:
    file = tmp_path / f"report{len(list(tmp_path.iterdir()))}.json"
    done = robot("run", "--report", str(file), *words, timeout=timeout)
    return done, json.loads(file.read_text(encoding="utf-8"))


def node(report: dict[str, Any], name: str) -> dict[str, Any]:
    return next(row for row in report["nodes"] if row["name"] == name)


VIRTUAL = ("--clock", "virtual")
KINEMATIC = (*VIRTUAL, "--backend", "kinematic")


# -- the robot walks ------------------------------------------------------------------------------------------------------------


def test_the_robot_walks_its_patrol_in_physics(tmp_path: Path) -> None:
    done, report = run(tmp_path, *VIRTUAL, "--duration", "33", "--seed", "1")
    assert done.returncode == 0, done.stderr
    assert report["backend"] == "physics"
    reached = [goal for goal in report["goals"] if goal["outcome"] == "succeeded"]
    assert len(reached) >= 2
    assert all(goal["true_error"] < 0.25 for goal in reached)
    assert any(goal["behind_obstacle"] for goal in reached)
    assert report["falls"] == 0
    assert report["contacts"] == {}
    assert report["distance_walked"] > 10.0
    assert report["battery"]["end_percent"] < report["battery"]["start_percent"]
    assert all(abs(timer["rate"] / timer["hz"] - 1.0) < 0.01 for timer in report["timers"])
    assert report["last"]["body_height"] < 0.22


@pytest.mark.slow(reason="two minutes of patrol")
@pytest.mark.parametrize("seed", range(1, 6))
def test_two_minutes_of_patrol_with_every_seed(tmp_path: Path, seed: int) -> None:
    done, report = run(tmp_path, *VIRTUAL, "--duration", "120", "--seed", str(seed), timeout=600.0)
    assert done.returncode == 0, done.stderr
    reached = [goal for goal in report["goals"] if goal["outcome"] == "succeeded" and goal["true_error"] < 0.25]
    assert len(reached) >= 3
    assert (report["falls"], report["contacts"]) == (0, {})
    assert report["distance_walked"] > 15.0


@pytest.mark.slow(reason="a minute of patrol")
def test_a_low_battery_takes_the_robot_to_its_dock(tmp_path: Path) -> None:
    done, report = run(tmp_path, *VIRTUAL, "--duration", "60", "--battery", "12", "--seed", "1")
    assert done.returncode == 0, done.stderr
    assert report["battery"]["charging"]
    assert report["falls"] == 0


def test_the_same_run_gives_the_same_report(tmp_path: Path) -> None:
    reports = [run(tmp_path, *VIRTUAL, "--duration", "4", "--seed", "3")[1] for _ in range(2)]
    for report in reports:
        del report["wall_seconds"]
    assert reports[0] == reports[1]


def test_the_kinematic_body_says_what_it_is(tmp_path: Path) -> None:
    done, report = run(tmp_path, *KINEMATIC, "--duration", "3")
    assert report["backend"] == "kinematic"
    assert "cannot fall" in done.stderr
    assert done.stderr.rstrip().splitlines()[-1].startswith("kinematic body:")


def test_one_goal_is_walked_to_and_ends_the_run(tmp_path: Path) -> None:
    done, report = run(tmp_path, *KINEMATIC, "--goal", "1", "0.5", "1.57", "--duration", "60")
    assert done.returncode == 0, done.stderr
    (goal,) = report["goals"]
    assert (goal["name"], goal["outcome"]) == ("goal", "succeeded")
    assert report["failure"] is None
    assert report["simulated_seconds"] < 40.0
    assert report["last"]["body_height"] < 0.22


@pytest.mark.skipif(not Path("/dev/full").is_char_device(), reason="there is no device that is always full")
def test_a_go2_walks_to_a_goal_with_the_same_nodes_and_a_robot_that_nobody_knows_is_one_line(tmp_path: Path) -> None:
    done, report = run(
        tmp_path, *VIRTUAL, "--robot", "go2", "--world", "empty", "--goal", "1", "0.5", "0", "--seed", "1"
    )
    assert done.returncode == 0, done.stderr
    assert (report["falls"], [goal["outcome"] for goal in report["goals"]]) == (0, ["succeeded"])
    done, report = run(
        tmp_path,
        *VIRTUAL,
        "--robot",
        "anymal_c",
        "--world",
        "empty",
        "--goal",
        "1",
        "0.5",
        "0",
        "--backend",
        "kinematic",
    )
    assert done.returncode == 0, done.stderr
    assert report["goals"][0]["outcome"] == "succeeded"
    wrong = robot("run", *VIRTUAL, "--robot", "go3")
    assert (wrong.returncode, wrong.stdout) == (2, "")
    assert wrong.stderr.startswith("robot run: --robot: no robot is called 'go3'")
    assert wrong.stderr.count("\n") == 1


def test_a_push_that_no_robot_survives_is_a_fall_and_exit_code_1(tmp_path: Path) -> None:
    done, report = run(
        tmp_path,
        *VIRTUAL,
        "--duration",
        "6",
        "--world",
        "empty",
        "--push",
        "0,200@4",
        "--friction",
        "0.7",
        "--sensors",
        "ideal",
        "--actuators",
        "ideal",  # how it tumbles is chaotic: with these it does so once
    )
    assert done.returncode == 1
    assert "robot run: the robot fell at 4." in done.stderr.splitlines()[-1]
    assert (report["falls"], report["last"]["fallen"]) == (1, True)
    assert report["failure"].startswith("the robot fell at 4.")
    assert report["ground"] == {
        "friction": 0.7,
        "payload": 0.0,
        "payload_at": [0.0, 0.0],
        "slope": [0.0, 0.0],
        "ice": None,
    }


def test_a_load_on_the_back_is_carried_to_the_goal(tmp_path: Path) -> None:
    done, report = run(
        tmp_path, *VIRTUAL, "--duration", "30", "--world", "empty", "--goal", "2", "0", "--payload", "8", "0.1", "0"
    )
    assert done.returncode == 0, done.stderr
    assert report["ground"]["payload"] == 8.0
    assert (report["falls"], report["goals"][-1]["outcome"]) == (0, "succeeded")


def test_a_report_that_cannot_be_written_is_one_line_and_exit_code_1() -> None:
    done = robot("run", *KINEMATIC, "--duration", "0.5", "--report", "/dev/full")
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    assert done.stderr.splitlines()[-1] == "robot run: --report /dev/full: not written: No space left on device"


def test_a_goal_that_is_not_reached_by_the_end_of_the_duration_is_exit_code_1_and_one_line(tmp_path: Path) -> None:
    done, report = run(tmp_path, *KINEMATIC, "--goal", "8.8", "6", "--duration", "5")
    assert done.returncode == 1
    failure = "--goal 8.8 6: not reached: the robot was 9.2 m away from it when the run ended"
    assert done.stderr.splitlines()[-1] == f"robot run: {failure}"
    assert report["failure"] == failure


def test_a_robot_that_is_given_its_worlds_map_as_a_file_walks_to_its_goal_by_it(tmp_path: Path) -> None:
    grid = Grid.from_scene(get_world("corridor"))
    data = grid.to_occupancy().reshape(grid.height, grid.width)
    file = write_map(Occupancy(data, grid.resolution, grid.origin_x, grid.origin_y), tmp_path / "corridor")
    words = ("--duration", "40", "--world", "corridor", "--map", str(file), "--goal", "2", "0")
    done, report = run(tmp_path, *KINEMATIC, *words)
    assert done.returncode == 0, done.stderr
    assert report["goals"][0]["true_error"] < 0.25
    blocked = data.copy()
    blocked[:, 60:70] = 100  # a wall across the corridor, of which the world knows nothing
    file = write_map(Occupancy(blocked, grid.resolution, grid.origin_x, grid.origin_y), tmp_path / "blocked")
    refused = robot("run", *KINEMATIC, "--world", "corridor", "--map", str(file), "--goal", "4", "0")
    assert refused.returncode == 2
    assert "--goal 4 0: " in refused.stderr


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("resolution: 0", "m.yaml:1: resolution: 0 m a cell"),
        (
            "image: m.pgm\nresolution: 1\norigin: [900, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2",
            "the start (0, 0)",
        ),
        (
            "image: n.pgm\nresolution: 1\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2",
            "n.pgm: No such file",
        ),
    ],
)
def test_a_map_that_is_none_or_none_of_this_world_is_one_line(tmp_path: Path, text: str, hint: str) -> None:
    (tmp_path / "m.yaml").write_text(text)
    (tmp_path / "m.pgm").write_bytes(b"P5 1 1 255\n\xff")
    done = robot("run", *KINEMATIC, "--map", str(tmp_path / "m.yaml"))
    assert (done.returncode, hint in done.stderr) == (2, True), done.stderr


def test_the_help_names_every_world() -> None:
    done = robot("run", "--help")
    assert "warehouse, empty, corridor, pillars, kitchen, ramps (default warehouse)" in " ".join(done.stdout.split())


def test_the_run_publishes_its_time_for_those_who_follow_it(tmp_path: Path) -> None:
    file = tmp_path / "follow.yaml"
    file.write_text("/battery:\n  ros__parameters:\n    use_sim_time: true\n", encoding="utf-8")
    done, report = run(tmp_path, *KINEMATIC, "--duration", "5", "--publish-clock", "50", "--params", str(file))
    assert done.returncode == 0, done.stderr
    (clock,) = [topic for topic in report["topics"] if topic["name"] == "/clock"]
    assert clock["rate"] == pytest.approx(50.0, rel=0.02)
    ticking = [timer for timer in report["timers"] if timer["node"] == "/battery"]
    assert ticking
    assert all(timer["missed"] == 0 and timer["rate"] == pytest.approx(timer["hz"], rel=0.02) for timer in ticking)


def test_two_parameter_files_are_two_speeds(tmp_path: Path) -> None:
    walked: dict[str, float] = {}
    for name, speed in (("slow", 0.2), ("fast", 0.6)):
        file = tmp_path / f"{name}.yaml"
        file.write_text(f"navigation:\n  ros__parameters:\n    max_speed: {speed}\n", encoding="utf-8")
        done, report = run(tmp_path, *KINEMATIC, "--duration", "6", "--params", str(file))
        assert done.returncode == 0, done.stderr
        walked[name] = report["distance_walked"]
    assert walked["slow"] < 0.2 * 6.0 < walked["fast"] < 0.6 * 6.0


def test_only_some_nodes_run_and_the_report_names_them(tmp_path: Path) -> None:
    done, report = run(tmp_path, *KINEMATIC, "--duration", "2", "--only", "navigation,localizer", "map_server")
    assert done.returncode == 0, done.stderr
    names = [row["name"] for row in report["nodes"] if row["path"].startswith("robot/")]
    assert names == ["/map_server", "/localizer", "/navigation"]
    assert report["only"] == ["navigation", "localizer", "map_server"]
    assert all(row["incarnation"] == 1 for row in report["nodes"])


def test_the_report_says_who_drove_and_that_nothing_stopped_the_robot(tmp_path: Path) -> None:
    _, report = run(tmp_path, *KINEMATIC, "--duration", "5")
    assert report["drove"].keys() == {"autonomy"}
    assert report["drove"]["autonomy"] > 2.0
    assert report["safety_stops"] == []


# -- failures -------------------------------------------------------------------------------------------------------------------


def test_a_crash_of_navigation_is_survived_and_the_patrol_goes_on(tmp_path: Path) -> None:
    done, report = run(tmp_path, *KINEMATIC, "--world", "empty", "--duration", "13", "--crash", "navigation@4")
    assert done.returncode == 0, done.stderr
    assert node(report, "/navigation")["incarnation"] == 2
    assert "crashed on request" in node(report, "/navigation")["restarts"][0]["reason"]
    assert node(report, "/gait")["incarnation"] == 1
    targets = next(topic for topic in report["topics"] if topic["name"] == "/joint_states")
    assert abs(targets["rate"] - 200.0) < 2.0
    assert [goal["outcome"] for goal in report["goals"]][-1] == "succeeded"


def test_more_crashes_than_allowed_end_in_a_safe_stop(tmp_path: Path) -> None:
    crashes = [word for at in (4.0, 4.5, 5.0, 5.5) for word in ("--crash", f"navigation@{at}")]
    done, report = run(tmp_path, *VIRTUAL, "--duration", "20", *crashes)
    assert done.returncode == 3
    assert "Traceback" not in done.stderr
    reason = [line for line in done.stderr.splitlines() if line.startswith("robot run:")]
    assert len(reason) == 1
    assert "navigation" in reason[0]
    assert report["last"]["body_height"] < 0.22
    assert not report["last"]["fallen"]


def test_the_motors_sit_the_robot_down_when_the_gait_is_gone(tmp_path: Path) -> None:
    done, report = run(tmp_path, *VIRTUAL, "--duration", "9", "--crash", "gait@6")
    assert done.returncode == 0, done.stderr
    assert report["falls"] == 0
    assert node(report, "/motors")["incarnation"] == 1


# -- mistakes -------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        (("--world", "warehose"), "warehouse"),
        (("--goal", "2.5", "2.1"), "(2.50, 2.10)"),
        (("--params", "no/such/file.yaml"), "No such file"),
        (("--crash", "nose@1"), "navigation"),
        (("--xyzzy",), "robot run: unrecognized arguments: --xyzzy (see robactor run --help)"),
        (("--world", "nowhere"), "there are: warehouse, empty, corridor, pillars"),
        (("--goal", "100", "100"), "outside of the world 'warehouse', where x is -2 to 10 m and y is -3.2 to 7.2 m"),
        (("--crash", "gait@130", "--clock", "virtual"), "the run ends at 120 s"),
        (("--backend", "kinematic", "--only", "navigatoin"), "no node 'navigatoin'; did you mean navigation"),
        (("--backend", "kinematic", "--only", "gait,xyzzy"), "no node 'xyzzy'; there are: motors, "),
        (
            ("--backend", "kinematic", "--replay", "gait", "navigatoin"),
            "--replay: there is no node 'navigatoin'; did you mean navigation",
        ),
        (("--backend", "kinematic", "--goal", "1", "0", "--only", "gait"), "it is the patrol who walks there"),
        (("--backend", "kinematic", "--only", "arm"), "those of the arm come with --arm"),
        (("--backend", "kinematic", "--crash", "navigaton@1"), "no node 'navigaton'; did you mean navigation"),
        (("--durtion", "3"), "unrecognized arguments: --durtion 3; did you mean --duration?"),
        (("--log-level", "verbose"), "invalid choice: 'verbose'"),
    ],
)
def test_a_mistake_is_one_clear_line_and_exit_code_2(words: tuple[str, ...], hint: str) -> None:
    done = robot("run", *words)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith("robot run: ")
    assert hint in line


@pytest.mark.slow(reason="a whole mission")
def test_a_crash_that_the_end_of_the_mission_forestalls_does_not_hit_the_sitting_robot(tmp_path: Path) -> None:
    words = ("--goal", "1", "0", "--duration", "60", "--crash", "battery@9.0")
    done, report = run(tmp_path, *KINEMATIC, *words)
    assert done.returncode == 0, done.stderr
    assert report["simulated_seconds"] < 9.0
    (line,) = [line for line in done.stderr.splitlines() if "crash not made: the run had ended" in line]
    assert "battery@9" in line
    assert "crashed on request" not in done.stderr


@pytest.mark.slow(reason="a long walk")
def test_the_status_lines_say_that_the_heading_is_in_degrees(tmp_path: Path) -> None:
    done, _ = run(tmp_path, *KINEMATIC, "--duration", "6")
    assert "heading_deg=" in done.stderr


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("gait:\n  ros__parameters:\n    x: [1, 2\n", "bad.yaml:4: not valid YAML: "),
        ("gait:\n\tros__parameters: 1\n", "bad.yaml:2: not valid YAML: "),
        ("gait:\n  ros__parameters:\n    x: 1\n   y: 2\n", "bad.yaml:4: not valid YAML: "),
        ("gait:\n  x: \x01\n", "bad.yaml:2: not valid YAML: the character U+0001 is not allowed"),
    ],
)
def test_a_parameter_file_that_is_no_yaml_names_file_and_line(text: str, place: str, tmp_path: Path) -> None:
    file = tmp_path / "bad.yaml"
    file.write_text(text, encoding="utf-8")
    done = robot("run", "--params", str(file))
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith("robot run: --params: ")
    assert place in line


def test_a_pattern_for_all_nodes_sets_what_they_have_and_leaves_the_others_alone(tmp_path: Path) -> None:
    file = tmp_path / "all.yaml"
    file.write_text("/**:\n  ros__parameters:\n    max_speed: 0.6\n", encoding="utf-8")
    done, _ = run(tmp_path, *KINEMATIC, "--params", str(file), "--duration", "1")
    assert done.returncode == 0, done.stderr


def test_a_malformed_parameter_file_names_file_line_and_key(tmp_path: Path) -> None:
    file = tmp_path / "bad.yaml"
    file.write_text("/navigation:\n  ros__parameters:\n    max_speed: [1, two]\n", encoding="utf-8")
    done = robot("run", "--params", str(file))
    assert done.returncode == 2
    (line,) = done.stderr.strip().splitlines()
    assert "bad.yaml" in line
    assert "3" in line
    assert "max_speed" in line


def test_a_parameter_out_of_its_bounds_names_the_node_and_the_bounds(tmp_path: Path) -> None:
    file = tmp_path / "fast.yaml"
    file.write_text("/navigation:\n  ros__parameters:\n    max_speed: 99.0\n", encoding="utf-8")
    done = robot("run", *KINEMATIC, "--params", str(file), "--duration", "1")
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert "max_speed" in done.stderr.splitlines()[-1]


def test_without_mujoco_the_remedy_is_named() -> None:
    code = "import sys; sys.modules['mujoco'] = None\nfrom cli.entry import main\nsys.exit(main(['run', '--duration', '1']))"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, env=ENVIRONMENT, capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 2
    (line,) = done.stderr.strip().splitlines()
    assert "mujoco-core" in line
    assert "kinematic" in line


# -- the real clock -------------------------------------------------------------------------------------------------------------


@pytest.mark.realtime
def test_thirty_seconds_of_real_time_at_every_rate(tmp_path: Path) -> None:
    done, report = run(tmp_path, "--clock", "real", "--duration", "30")
    assert done.returncode == 0, done.stderr
    assert all(abs(timer["rate"] / timer["hz"] - 1.0) < 0.02 for timer in report["timers"]), report["timers"]


@pytest.mark.realtime
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_brakes_sits_and_leaves_nothing(tmp_path: Path, number: signal.Signals, code: int) -> None:
    file = tmp_path / "report.json"
    process = subprocess.Popen(
        [sys.executable, "-m", "robot", "run", "--report", str(file)],
        cwd=ROOT, env=ENVIRONMENT, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    assert process.stderr is not None
    for line in process.stderr:
        if "gait=walk" in line:
            break
    begun = time.monotonic()
    process.send_signal(number)
    rest = process.stderr.read()
    process.stderr.close()
    assert process.wait(timeout=10.0) == code
    assert time.monotonic() - begun < 3.0
    assert "Traceback" not in rest
    assert json.loads(file.read_text(encoding="utf-8"))["last"]["body_height"] < 0.22
    with pytest.raises(ProcessLookupError):
        os.killpg(process.pid, 0)
