"""`python -m tests.figures stops`: which robots it walks, what it counts, and that what is kept is not run again."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from robot.hardware.sensors import Sensors
from robot.model.actuators import ActuatorDesign
from robot.testing import Conditions, Trial
from tests.figures import stops
from tests.figures.__main__ import main
from tests.figures.fidelity import Fidelity
from tests.figures.stops_run import CAUSES, FAULTY, Case, Outcome, run

MORE = pytest.mark.slow(reason="more phases of a step")


def acted(case: Case) -> Outcome:
    """Falls at 1.6 m/s in the second half of the stride; is known as late as the phase says, and never at phase 0."""
    return Outcome(case.speed == 1.6 and case.phase >= 0.5, case.phase or None, "made up")


def told(capsys: pytest.CaptureFixture[str], *argv: str) -> tuple[int, dict[str, object]]:
    code = main(["stops", *argv, "--json"])
    return code, json.loads(capsys.readouterr().out)


def test_every_cause_meets_32_phases_at_5_speeds_up_to_the_limit_and_sensors_fail_200_times() -> None:
    every = stops.rows(1, 0.008)
    assert list(CAUSES) == [
        "gait silent",
        "gait restarted",
        "encoder lost",
        "IMU lost",
        "gyro wrong",
        "hang",
        "motors restarted",
    ]
    for cause in CAUSES:
        mine = [row for row in every if row.name.startswith(cause)]
        assert [{case.speed for case in row.cases} for row in mine] == [{0.3}, {0.6}, {1.0}, {1.3}, {1.6}]
        assert all([case.phase for case in row.cases] == [number / 32 for number in range(32)] for row in mine)
    drawn = [case for row in every for case in row.cases if case.cause in FAULTY]
    assert len(drawn) == 200
    assert {case.cause for case in drawn} == set(FAULTY)
    assert {case.speed for case in drawn} == {1.0, 1.6}
    assert len({case.phase for case in drawn}) == 200


def test_fewer_draws_are_the_first_of_the_many() -> None:
    few, many = stops.rows(3, 0.008, draws=10)[-1], stops.rows(3, 0.008)[-1]
    assert few.cases == many.cases[:5]


def test_falls_and_times_are_counted_row_by_row(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(stops, "run", acted)
    code, result = told(capsys, "--quick", "--only", "gait silent")
    assert code == 1
    falls = {row["name"]: (row["falls"], row["trials"]) for row in result["rows"]}  # type: ignore[attr-defined,index]
    assert falls["gait silent, 1.3 m/s"] == (0, 4)
    assert falls["gait silent, 1.6 m/s"] == (2, 4)
    last = result["rows"][-1]  # type: ignore[index]
    assert (last["known_median"], last["known_worst"], last["never_known"]) == (0.5, 0.75, 1)
    assert [case["phase"] for case in last["fallen"]] == [0.5, 0.75]
    assert main(["stops", "--quick", "--only", "gait silent, 0.3"]) == 0
    assert "falls: 0 of 4" in capsys.readouterr().out


def test_a_sensor_that_is_found_late_fails_the_row_even_without_a_fall(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(stops, "run", lambda case: Outcome(False, 0.51 if case.phase > 0.5 else 0.5, ""))
    code, result = told(capsys, "--quick", "--only", "sensor faults, 1 m/s")
    (row,) = result["rows"]  # type: ignore[misc]
    assert code == 1
    assert row["known_late"] == sum(case.phase > 0.5 for case in stops.rows(1, 0.008, draws=40)[-2].cases)


def test_what_was_kept_is_not_run_again(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    ran: list[Case] = []

    def counted(case: Case) -> Outcome:
        ran.append(case)
        return acted(case)

    monkeypatch.setattr(stops, "run", counted)
    file = tmp_path / "outcomes"
    _, whole = told(capsys, "--quick", "--only", "hang", "--resume", str(file))
    assert len(ran) == 20
    kept = file.read_text().splitlines()
    file.write_text("\n".join(kept[:13]) + "\n")
    _, resumed = told(capsys, "--quick", "--only", "hang", "--resume", str(file))
    assert len(ran) == 27
    assert resumed["rows"] == whole["rows"]
    assert file.read_text().splitlines() == kept


def test_a_file_that_holds_something_else_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "notes"
    file.write_text("to do\n")
    assert main(["stops", "--quick", "--resume", str(file)]) == 2
    assert "no outcomes of an earlier run" in capsys.readouterr().err


@pytest.mark.parametrize(("argv", "met"), [([], "real"), (["--sensors", "ideal", "--actuators", "ideal"], "ideal")])
def test_robots_have_real_sensors_and_drives_unless_others_are_asked_for(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], argv: list[str], met: str
) -> None:
    ran: list[Case] = []

    def noted(case: Case) -> Outcome:
        ran.append(case)
        return acted(case)

    monkeypatch.setattr(stops, "run", noted)
    _, result = told(capsys, "--quick", "--only", "0.3 m/s", *argv)
    assert {(case.fidelity.sensors, case.fidelity.actuators) for case in ran} == {(met, met)}
    assert (result["sensors"], result["actuators"]) == (met, met)


def test_a_row_that_does_not_exist_is_named_with_those_that_do(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["stops", "--only", "earthquake"]) == 2
    assert "no row's name contains that; there are: gait silent, 0.3 m/s" in capsys.readouterr().err


@pytest.mark.parametrize("cause", ["gait silent", "IMU lost"])
def test_a_case_is_the_same_robot_again_and_tells_when_its_cause_was_known(cause: str) -> None:
    case = Case(cause, 0.6, 0.25, 5, 0.008)
    once = run(case)
    assert once == run(case)
    assert not once.fallen
    assert once.found is not None
    assert 0.0 < once.found < 0.2


def test_a_case_gives_its_trial_the_sensors_and_drives_that_it_names(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[Conditions] = []

    class Noted(Trial):
        def __init__(self, seed: int, *, conditions: Conditions) -> None:
            seen.append(conditions)
            raise KeyError("seen")

    monkeypatch.setattr("tests.figures.stops_run.Trial", Noted)
    for case in (
        Case("hang", 0.6, 0.25, 5, 0.008),
        Case("hang", 0.6, 0.25, 5, 0.008, fidelity=Fidelity("real", "ideal")),
        Case("hang", 0.6, 0.25, 5, 0.008, fidelity=Fidelity("ideal", "real")),
    ):
        with pytest.raises(KeyError, match="seen"):
            run(case)
    ideal, felt, driven = seen
    assert (ideal.sensors, ideal.actuators) == (Sensors.ideal(), None)
    assert (felt.sensors, felt.actuators) == (Sensors.real(), None)
    assert (driven.sensors, driven.actuators) == (Sensors.ideal(), ActuatorDesign())


def test_a_robot_that_is_lost_is_counted_as_fallen(monkeypatch: pytest.MonkeyPatch) -> None:
    """All encoders show their joints on the other side: plausible, never found, and no robot can walk with it."""
    mirrored = {"mirrored": lambda: lambda imu, joints: (imu, replace(joints, position=-joints.position))}
    monkeypatch.setattr("robot.testing.trial.FAULTS", mirrored)
    assert run(Case("mirrored", 1.0, 0.25, 5, 0.008)).fallen


@pytest.mark.parametrize("phase", [10 / 32, *(pytest.param(phase, marks=MORE) for phase in (4 / 32, 25 / 32))])
def test_a_fast_robot_that_was_held_up_for_a_third_of_a_second_walks_on(phase: float) -> None:
    met = run(Case("hang", 1.6, phase, 1, 0.008, fidelity=Fidelity()))
    assert met.found is not None  # the drives acted
    assert not met.fallen
