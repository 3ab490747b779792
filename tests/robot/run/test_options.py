"""The words of `python -m robot run`: what each becomes, and the one line that a mistake gets."""

from __future__ import annotations

import argparse
import shlex
from dataclasses import fields
from pathlib import Path

import pytest

from cli.command import UsageError
from robot.run.arguments import parse_seed, seconds, whole, within
from robot.run.disturbances import Push
from robot.run.options import RealRobot, Web, parse
from robot.run.tasks import Crash, Fetch, parse_fetch, parse_goal
from robot.sim.ground import Ground
from tests.facts import lacks


def test_without_a_word_it_is_the_patrol_in_physics_on_the_real_clock() -> None:
    options = parse([])
    assert {field.name: getattr(options, field.name) for field in fields(options)} == {
        "duration": None, "battery": 90.0, "crashes": (), "clock": "real", "world": "warehouse", "backend": "physics", "seed": 0,
        "goal": None, "params": None, "log_format": "console", "log_level": "info", "report": None, "motor_delay": 0.004,
        "flight_record": None, "trace": False, "publish_clock": None, "only": (), "arm": False, "fetch": None,
        "listen": (), "connect": (), "processes": False, "machines": None, "hangs": (), "security": None,
        "replay": (), "journals": None, "spans": False, "ground": None, "pushes": (), "web": Web(), "real_drives": True, "map": None,
        "sensors": "real", "sight": False, "robot": "spot", "hardware": None,
    }  # fmt: skip


def test_every_word_is_taken(tmp_path: Path) -> None:
    report, record = str(tmp_path / "report.json"), str(tmp_path / "flight.mcap")
    options = parse(
        [
            "--duration", "9.5", "--battery", "12", "--crash", "gait@2", "--crash", "lidar@0", "--clock", "virtual", "--world", "pillars",
            "--backend", "kinematic", "--seed", "7", "--goal", "1", "-2", "0.5", "--log-format", "json", "--log-level", "WARN",
            "--report", report, "--motor-delay", "8", "--flight-record", record, "--trace", "--publish-clock", "100", "--arm",
            "--only", "gait,motors", "gait", "--replay", "gait", "navigation", "--params", "some.yaml",
        ]
    )  # fmt: skip
    assert (options.duration, options.battery, options.clock, options.world) == (9.5, 12.0, "virtual", "pillars")
    assert options.crashes == (Crash("gait", 2.0), Crash("lidar", 0.0))
    assert (options.backend, options.seed, options.goal) == ("kinematic", 7, (1.0, -2.0, 0.5))
    assert (options.log_format, options.log_level) == ("json", "warn")
    assert (options.report, options.flight_record, options.params) == (report, record, "some.yaml")
    assert options.motor_delay == pytest.approx(0.008)
    assert (options.trace, options.publish_clock, options.arm) == (True, 100.0, True)
    assert options.only == ("gait", "motors")
    assert options.replay == ("gait", "navigation")


def test_a_folder_for_bags_is_the_pages_and_so_asks_for_the_page() -> None:
    assert parse(["--bags", "recordings"]).web == Web(bags="recordings", wanted=True)
    with pytest.raises(UsageError, match="--no-web"):
        parse(["--bags", "recordings", "--no-web"])
    with pytest.raises(UsageError, match="browsers live in real time"):
        parse(["--bags", "recordings", "--clock", "virtual"])


def test_floor_load_and_blows_are_taken_in_the_units_of_people() -> None:
    options = parse(
        [
            "--friction",
            "0.4",
            "--payload",
            "6",
            "0.1",
            "-0.05",
            "--slope",
            "10",
            "--push",
            "0,40@5",
            "--push=-20,1.5@7.5",
            "--push",
            "-30,0@6",
        ]
    )
    assert options.ground == Ground(0.4, (pytest.approx(0.17633, abs=1e-5), 0.0), 6.0, (0.1, -0.05))  # type: ignore[arg-type]
    assert options.pushes == (Push(0.0, 40.0, 5.0), Push(-20.0, 1.5, 7.5), Push(-30.0, 0.0, 6.0))
    assert parse(["--payload", "14"]).ground == Ground(0.8, (0.0, 0.0), 14.0, (0.0, 0.0))
    assert parse(["--slope", "0", "-4.5"]).ground == Ground(slope=(0.0, pytest.approx(-0.0787, abs=1e-4)))  # type: ignore[arg-type]


def test_a_run_on_the_virtual_clock_ends_after_two_minutes_unless_told_otherwise() -> None:
    assert parse(["--clock", "virtual"]).duration == 120.0
    assert parse(["--clock", "virtual", "--duration", "3"]).duration == 3.0


def test_who_fetches_has_an_arm() -> None:
    options = parse(["--fetch", "cup"])
    assert (options.arm, options.fetch) == (True, Fetch("cup", None))


@pytest.mark.parametrize(
    ("words", "facts"),
    [
        ("--friction 0", "--friction 0 0.01 2"),
        ("--payload 6 0.1", "--payload KG X Y 2"),
        ("--payload 31", "--payload 31 0 30 kg"),
        ("--payload 6 0.5 0", "--payload X 0.5 -0.4 0.4 m"),
        ("--slope 41", "--slope 41 -40 40 degrees"),
        ("--slope 1 2 3", "--slope DEG_X DEG_Y 3"),
        ("--push 40@5", "--push 40@5 FORWARD,LEFT@SECONDS 0,40@10 1000"),
        ("--push 0,4000@5", "--push 0,4000@5 FORWARD,LEFT@SECONDS 0,40@10 1000"),
        ("--push 0,nan@5", "--push 0,nan@5 FORWARD,LEFT@SECONDS 0,40@10 1000"),
        ("--push 0,40", "--push 0,40 FORWARD,LEFT@SECONDS 0,40@10"),
        ("--push 0,40@9 --duration 8", "--push 0,40@9 8 --duration"),
        ("--push 0,40@9 --processes", "--push --processes"),
        ("--friction 0.3 --backend kinematic", "--friction --backend kinematic"),
        ("--duration 0", "--duration 0 seconds --help"),
        ("--duration inf", "--duration inf seconds --help"),
        ("--duration soon", "--duration soon seconds --help"),
        ("--battery 101", "--battery 101 0 100"),
        ("--battery nan", "--battery nan 0 100"),
        ("--motor-delay 21", "--motor-delay 21 0 20 milliseconds"),
        ("--publish-clock 0", "--publish-clock 0 0.1 1000 Hz"),
        ("--seed 1.5", "--seed 1.5 whole 0 --help"),
        ("--seed -1", "--seed -1 whole 0 --help"),
        ("--trace", "--trace --clock virtual"),
        ("--spans --processes", "--spans --processes"),
        ("--crash gait", "--crash gait NODE@SECONDS navigation@10"),
        ("--crash @3", "--crash @3 NODE@SECONDS navigation@10"),
        ("--crash gait@-1", "--crash gait@-1 NODE@SECONDS navigation@10"),
        ("--crash gait@now", "--crash gait@now NODE@SECONDS navigation@10"),
        ("--duration 5 --crash gait@5", "--crash gait@5 5 --duration"),
        ("--only ,", "--only gait"),
        ("--goal 1", "--goal X Y THETA 1"),
        ("--goal 1 2 3 4", "--goal X Y THETA 4"),
        ("--goal 1 nan", "--goal Y nan finite"),
        ("--goal 1 2 90", "--goal THETA 90 radians"),
        ("--fetch cup 1", "--fetch NAME X Y Z 1"),
        ("--fetch cup 1 two", "--fetch cup 1 two X Y Z meters"),
        ("--fetch cup 1 inf", "--fetch cup 1 inf X Y Z finite"),
        ("--fetch cup --goal 1 2", "--fetch --goal"),
        ("--duratoin 5", "--duratoin --duration --help"),
        ("--report ''", "--report file"),
        ("--report /nowhere/r.json", "--report /nowhere/r.json /nowhere folder"),
        ("--report /tmp", "--report /tmp folder"),
        ("--flight-record /dev/null", "--flight-record /dev/null file"),
    ],
)
def test_a_mistake_is_told_in_one_line_with_what_to_do(words: str, facts: str) -> None:
    """It names the option, the value, and what is possible instead."""
    with pytest.raises(UsageError) as refused:
        parse(shlex.split(words))
    assert lacks(str(refused.value), facts) == []


def test_a_goal_needs_no_heading_and_a_thing_no_place_and_no_height() -> None:
    assert parse_goal(None) is None
    assert parse_goal([1.0, 2.0]) == (1.0, 2.0, 0.0)
    assert parse_fetch(None, None) is None
    assert parse_fetch(["cup", "1.5", "-2"], None) == Fetch("cup", (1.5, -2.0, 0.0))
    assert parse_fetch(["cup", "1.5", "-2", "0.4"], None) == Fetch("cup", (1.5, -2.0, 0.4))


def test_numbers_within_bounds_include_the_bounds() -> None:
    share, count = within(0.0, 1.0, "metres"), whole(1, 8)
    assert [share("0"), share("0.5"), share("1")] == [0.0, 0.5, 1.0]
    assert [count("1"), count("8")] == [1, 8]
    for text in ("-0.1", "1.1", "nan", "x"):
        with pytest.raises(argparse.ArgumentTypeError, match=f"^{text}: give 0 to 1 metres$"):
            share(text)
    for text in ("0", "9", "2.5", "x"):
        with pytest.raises(argparse.ArgumentTypeError, match=f"^{text}: give a whole number from 1 to 8$"):
            count(text)


def test_a_seed_is_a_whole_number_and_seconds_are_positive() -> None:
    assert (parse_seed("0"), parse_seed("12"), seconds("0.5")) == (0, 12, 0.5)


def test_the_drives_are_real_in_physics_unless_ideal_ones_are_asked_for() -> None:
    assert parse([]).real_drives
    assert not parse(["--actuators", "ideal"]).real_drives
    assert not parse(["--backend", "kinematic"]).real_drives
    with pytest.raises(UsageError, match="--actuators real: the kinematic body has no torques to limit"):
        parse(["--backend", "kinematic", "--actuators", "real"])


def test_spans_ask_for_what_makes_them(monkeypatch: pytest.MonkeyPatch) -> None:
    assert parse(["--spans"]).spans
    monkeypatch.setattr("robot.run.options.find_spec", lambda name: None)
    with pytest.raises(UsageError, match=r"pip install \"robactor\[otel\]\""):
        parse(["--spans"])


@pytest.mark.parametrize("also", [["--arm"], ["--fetch", "cup"], ["--sight"]])
def test_another_robot_has_none_of_what_only_the_reference_body_has(also: list[str]) -> None:
    assert parse(["--robot", "go2"]).robot == "go2"
    with pytest.raises(UsageError, match="--robot: the arm and the depth cameras are those of spot"):
        parse(["--robot", "go2", *also])


def test_a_robot_that_exists_has_its_own_words() -> None:
    options = parse(["--hardware", "unitree", "--interface", "lo", "--domain", "1", "--duration", "3", "--no-web"])
    assert options.hardware == RealRobot("unitree", "lo", 1, enable=False)
    assert parse(["--hardware", "unitree", "--enable"]).hardware == RealRobot("unitree", None, 0, enable=True)
    with pytest.raises(UsageError, match="--goal, --world: --hardware is a robot that exists"):
        parse(["--hardware", "unitree", "--goal", "1", "1", "--world", "empty"])
    with pytest.raises(UsageError, match="--enable: which robot"):
        parse(["--enable"])
