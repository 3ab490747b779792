"""The tutorial's arm, row by row (A-50 to A-57)."""

from __future__ import annotations

from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.sim.stepping_arm import Ending, InvalidTarget, Progress, TutorialArm

TARGET = [1.57, 0.78, -0.78, 0.0]
angles = st.lists(st.floats(-3.14, 3.14), min_size=4, max_size=4)


def run(arm: TutorialArm, target: list[float]) -> tuple[list[Progress], Ending]:
    arm.begin(target)
    seen: list[Progress] = []
    while not arm.arrived:
        seen.append(arm.step())
    return seen, arm.finish()


def test_a_50_fifty_feedbacks_from_0_to_100_percent_and_the_exact_target() -> None:
    arm = TutorialArm()
    seen, ending = run(arm, TARGET)
    assert len(seen) == 50
    assert len(seen) * TutorialArm.STEP_TIME == pytest.approx(5.0)
    assert seen[0].progress_percentage == 0.0
    assert seen[-1].progress_percentage == 100.0
    assert ending == Ending(True, tuple(TARGET), "Movement completed successfully")


def test_a_51_interpolation_is_linear_over_49_intervals() -> None:
    seen, _ = run(TutorialArm(), TARGET)
    for i, feedback in enumerate(seen):
        assert feedback.current_angles == pytest.approx([angle * i / 49 for angle in TARGET])
    assert seen[24].progress_percentage == pytest.approx(48.98, abs=5e-3)


def test_a_51_a_single_step_goes_straight_to_the_target() -> None:
    seen, ending = run(TutorialArm(steps=1), TARGET)
    assert [feedback.progress_percentage for feedback in seen] == [100.0]
    assert ending.final_angles == tuple(TARGET)
    with pytest.raises(ValueError, match="at least one step"):
        TutorialArm(steps=0)


def test_a_52_status_has_one_decimal() -> None:
    seen, _ = run(TutorialArm(), TARGET)
    assert seen[24].status == "Moving... 49.0% complete"
    assert seen[-1].status == "Moving... 100.0% complete"


def test_a_53_cancel_keeps_the_real_angles_and_the_next_goal_runs_normally() -> None:
    arm = TutorialArm()
    arm.begin(TARGET)
    for _ in range(20):
        last = arm.step()
    ending = arm.cancel()
    assert ending == Ending(False, last.current_angles, "Movement canceled")
    assert last.current_angles == pytest.approx([angle * 19 / 49 for angle in TARGET])
    assert arm.joint_angles == last.current_angles
    assert arm.status == "IDLE"
    seen, ending = run(arm, [0.0] * 4)
    assert len(seen) == 50
    assert ending.success


@pytest.mark.parametrize(
    ("target", "words"),
    [
        ([0.0] * 3, "4 joints, but 3"),
        ([0.0] * 5, "4 joints, but 5"),
        ([0.0, nan, 0.0, 0.0], "Joint 1 cannot go to nan"),
        ([0.0, 0.0, inf, 0.0], "Joint 2"),
        ([0.0, 0.0, 0.0, -3.15], "Joint 3 cannot go to -3.15 rad: give an angle from -3.14 to 3.14"),
    ],
)
def test_a_54_wrong_targets_are_refused_and_nothing_moves(target: list[float], words: str) -> None:
    arm = TutorialArm()
    with pytest.raises(InvalidTarget, match=words):
        arm.begin(target)
    assert arm.status == "IDLE"
    assert arm.joint_angles == (0.0,) * 4


def test_a_55_position_and_motion_share_one_state() -> None:
    arm = TutorialArm()
    assert arm.status == "IDLE"
    arm.begin(TARGET)
    for _ in range(25):
        arm.step()
    assert arm.status == "MOVING"
    assert arm.joint_angles == pytest.approx([angle * 0.5 for angle in TARGET], abs=0.02)
    while not arm.arrived:
        arm.step()
    arm.finish()
    assert arm.joint_angles == tuple(TARGET)
    assert arm.status == "IDLE"
    assert repr(arm) == "<TutorialArm IDLE at (1.57, 0.78, -0.78, 0.00) rad>"


def test_a_56_earlier_feedback_keeps_its_numbers() -> None:
    arm = TutorialArm()
    arm.begin(TARGET)
    early = arm.step()
    kept = early.current_angles
    arm.step()
    assert early.current_angles is kept
    assert early.current_angles == (0.0,) * 4


@given(angles, angles, st.integers(1, 49))
def test_a_57_a_second_goal_starts_where_the_first_ended(first: list[float], second: list[float], steps: int) -> None:
    arm = TutorialArm()
    arm.begin(first)
    for _ in range(steps):
        arm.step()
    ending = arm.cancel()
    seen, _ = run(arm, second)
    assert seen[0].current_angles == ending.final_angles
    assert seen[-1].current_angles == tuple(second)


def test_a_motion_is_begun_stepped_and_finished_in_that_order() -> None:
    arm = TutorialArm(steps=2)
    with pytest.raises(RuntimeError, match="begin a motion first"):
        arm.step()
    with pytest.raises(RuntimeError, match="has not arrived"):
        arm.finish()
    arm.begin(TARGET)
    with pytest.raises(RuntimeError, match="moving already"):
        arm.begin(TARGET)
    arm.step()
    arm.step()
    with pytest.raises(RuntimeError, match="finish it"):
        arm.step()
