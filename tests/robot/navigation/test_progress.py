"""Being stuck, and the order of recoveries."""

from __future__ import annotations

from robot.geometry.planar import Pose2
from robot.navigation.progress import RECOVERIES, ProgressChecker, Recovery


def test_half_a_meter_in_ten_seconds_is_progress() -> None:
    checker = ProgressChecker()
    for second in range(60):
        assert not checker.stuck(float(second), Pose2(0.051 * second, 0.0))


def test_less_than_that_is_stuck_even_when_it_wiggles() -> None:
    checker = ProgressChecker()
    answers = [checker.stuck(float(second), Pose2(0.2 * (second % 2), 0.0)) for second in range(15)]
    assert answers == [False] * 11 + [True] * 4


def test_a_reset_starts_the_time_anew() -> None:
    checker = ProgressChecker()
    checker.stuck(0.0, Pose2(0, 0))
    assert checker.stuck(11.0, Pose2(0, 0))
    checker.reset()
    assert not checker.stuck(12.0, Pose2(0, 0))


def test_recoveries_come_in_order_and_end() -> None:
    recovery, now, seen = Recovery(), 0.0, []
    while (name := recovery.begin(now)) is not None:
        commands = []
        while (command := recovery.command(now)) is not None:
            commands.append(command)
            now += 0.1
        seen.append((name, commands[0]))
    assert tuple(name for name, _ in seen) == RECOVERIES == ("clear", "back_up", "turn", "wait")
    assert recovery.tried == RECOVERIES
    by_name = dict(seen)
    assert by_name["back_up"] == (-0.15, 0.0)
    assert by_name["turn"][1] > 0.0
    assert by_name["clear"] == by_name["wait"] == (0.0, 0.0)


def test_a_recovery_without_room_is_given_up_and_the_next_one_follows() -> None:
    recovery = Recovery()
    assert recovery.begin(0.0) == "clear"
    recovery.give_up()
    assert recovery.command(0.1) is None
    assert recovery.begin(0.1) == "back_up"
    recovery.reset()
    assert recovery.begin(0.2) == "clear"
