"""What `tests.figures mission` makes of the legs of a mission, and a short one."""

from __future__ import annotations

from dataclasses import asdict
from math import inf

import pytest

from tests.figures.fidelity import Fidelity
from tests.figures.mission import LEARNING, show, summary
from tests.figures.mission_run import Leg, Outcome, mission


def leg(name: str, used: float, outcome: str = "succeeded") -> Leg:
    return Leg(name, 100.0, outcome, 8.0, 2.0, 2.0, used, 40.0)


def outcome(legs: list[Leg]) -> Outcome:
    return Outcome(1, "warehouse", "kinematic", 3600.0, [asdict(one) for one in legs], 1, 0, 100.0, 0.1)


def test_the_error_of_a_leg_is_in_per_cent_of_what_it_took() -> None:
    assert leg("patrol_1", 1.6).error == pytest.approx(25.0)
    assert leg("patrol_1", 2.5).error == pytest.approx(-20.0)
    assert leg("patrol_1", 0.0, "aborted").error == inf


def test_the_legs_from_which_it_learns_the_dock_and_failures_do_not_count_as_predictions() -> None:
    first = [leg("patrol_1", 9.0)] * LEARNING
    rest = [
        leg("patrol_1", 2.0),
        leg("dock", 9.0),
        leg("patrol_2", 9.0, "aborted"),
        leg("patrol_2", 2.05),
        leg("patrol_3", 2.2),
    ]
    told = summary([outcome([*first, *rest])])
    assert (told["goals"], told["reached"], told["docked"], told["docking_failed"]) == (
        LEARNING + 4,
        LEARNING + 3,
        1,
        0,
    )
    assert (told["predicted"], told["within"]) == (3, 2)
    assert told["worst_error"] == pytest.approx(100.0 * 0.2 / 2.2)
    circumstances = {
        "seed": 1, "date": "today", "wall_seconds": 1.0, "world": "warehouse", "sensors": "real", "actuators": "ideal",
        "backend": "kinematic", "machine": {"processor": "one", "cores": 2, "python": "3", "mujoco": "3"},
    }  # fmt: skip
    assert "within 3 %  2 of 3 legs" in show(told | circumstances)


@pytest.mark.slow(reason="minutes of walking")
def test_a_mission_is_walked_leg_by_leg_and_each_is_predicted_before_it_is_walked() -> None:
    """The kinematic body takes what is typical of the robot, so that the first prediction is near already."""
    held = mission(2, 60.0, "kinematic", Fidelity("ideal", "ideal"), "warehouse")
    legs = [Leg(**one) for one in held.legs]
    assert len(legs) >= 2
    assert held.falls == 0
    assert held.walked > 15.0
    for one in legs:
        assert one.outcome == "succeeded"
        assert one.length > 3.0
        assert abs(one.error) < 40.0
