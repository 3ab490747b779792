"""Instants, durations, the ROS clock and the grid of a timer, as a user meets them."""

from __future__ import annotations

import copy
import math
import pickle
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.time import ClockType, Duration, Time
from actors.time.ros_clock import ClockChange, JumpThreshold, RosClock, TimeJump, TimerCanceled, TimerGrid

SECOND = 1_000_000_000


def ros(nanoseconds: int) -> Time:
    return Time(nanoseconds=nanoseconds, clock_type=ClockType.ROS_TIME)


def test_the_time_between_two_readings_is_a_duration() -> None:
    start, end = ros(1 * SECOND), ros(3 * SECOND)

    assert end - start == Duration(seconds=2)
    assert start - end == Duration(seconds=-2)
    assert start + Duration(seconds=2) == end == Duration(seconds=2) + start
    assert end - Duration(seconds=2) == start
    assert start < end
    assert end >= start


def test_a_time_says_exactly_in_two_integers_what_its_seconds_say_as_near_as_a_float_comes() -> None:
    now = ros(1_760_000_000 * SECOND + 1)

    assert now.sec_nanosec() == (1_760_000_000, 1)
    assert now.seconds == 1_760_000_000.0
    assert ros(2**63 - 1).sec_nanosec() == (9_223_372_036, 854_775_807)
    assert (ros(SECOND - 1).sec_nanosec(), ros(SECOND).sec_nanosec()) == ((0, 999_999_999), (1, 0))
    assert Time(seconds=12.25).sec_nanosec() == (12, SECOND // 4)
    assert Time(seconds=12.25).seconds == 12.25


def test_durations_calculate() -> None:
    half = Duration(seconds=0.5)

    assert half + half == 2 * half == half * 2.0 == Duration(seconds=1)
    assert half - Duration(seconds=1) == Duration(nanoseconds=-SECOND // 2)
    assert (half.seconds, half.nanoseconds) == (0.5, SECOND // 2)


@pytest.mark.parametrize("factor", [math.nan, -math.inf])
def test_a_duration_times_no_number_is_refused(factor: float) -> None:
    with pytest.raises(ValueError, match="only inf has a meaning"):
        Duration(seconds=1) * factor


@pytest.mark.parametrize("nanoseconds", [0, 1, -5])
def test_a_duration_times_infinity_is_the_longest_as_in_rclpy(nanoseconds: int) -> None:
    assert (Duration(nanoseconds=nanoseconds) * math.inf).nanoseconds == 9223372036854775807


def test_a_time_before_the_epoch_or_beyond_64_bits_is_refused() -> None:
    with pytest.raises(ValueError, match="before its clock's epoch"):
        ros(1) - Duration(nanoseconds=2)
    with pytest.raises(OverflowError, match="292 years"):
        ros(2**63 - 1) + Duration(nanoseconds=1)
    with pytest.raises(TypeError, match=r"ClockType\.ROS_TIME"):
        Time(clock_type="steady")  # type: ignore[arg-type]


def test_times_of_different_clocks_have_no_relation() -> None:
    steady = Time(nanoseconds=1, clock_type=ClockType.STEADY_TIME)

    for compare in (
        lambda: ros(1) == steady,
        lambda: ros(1) != steady,
        lambda: ros(1) < steady,
        lambda: ros(1) - steady,
    ):
        with pytest.raises(TypeError, match="times of different clocks"):
            compare()


def test_times_durations_and_numbers_are_never_equal_nor_ordered() -> None:
    assert ros(1) != Duration(nanoseconds=1)
    assert ros(1) != 1
    assert Duration(nanoseconds=1) != 1
    for nonsense in (
        lambda: ros(1) < Duration(nanoseconds=2),
        lambda: Duration(nanoseconds=2) > ros(1),
        lambda: Duration() - ros(0),
        lambda: ros(1) + ros(1),
        lambda: Duration() * "2",
        lambda: Duration() + 1,
    ):
        with pytest.raises(TypeError):
            nonsense()


def test_a_message_keeps_the_instant() -> None:
    stamp = SimpleNamespace(sec=1, nanosec=2)

    assert Time.from_msg(stamp) == ros(1 * SECOND + 2)
    assert Time.from_msg(stamp, ClockType.SYSTEM_TIME).clock_type is ClockType.SYSTEM_TIME
    assert Duration.from_msg(SimpleNamespace(sec=-1, nanosec=999_999_999)) == Duration(nanoseconds=-1)
    assert (Time.from_msg(stamp).to_msg().sec, Time.from_msg(stamp).to_msg().nanosec) == (1, 2)
    assert Duration(nanoseconds=-1).to_msg().nanosec == 999_999_999


def test_values_never_change_and_survive_copying() -> None:
    for value in (ros(5), Duration(nanoseconds=-5)):
        with pytest.raises(AttributeError, match="never changes"):
            value.nanoseconds = 3
        assert pickle.loads(pickle.dumps(value)) == copy.copy(value) == value
        assert hash(copy.copy(value)) == hash(value)


def test_the_repr_is_exact() -> None:
    assert repr(ros(1_500_000_001)) == "Time(1.500000001 s, ROS_TIME)"
    assert repr(Duration(nanoseconds=-1)) == "Duration(-0.000000001 s)"
    assert repr(Duration(seconds=2)) == "Duration(2.0 s)"


@given(st.integers(-(2**63), 2**63 - 1))
def test_a_duration_goes_through_seconds_and_nanoseconds_unharmed(nanoseconds: int) -> None:
    sec, nanosec = Duration(nanoseconds=nanoseconds).sec_nanosec()

    assert 0 <= nanosec < SECOND
    assert Duration.from_msg(SimpleNamespace(sec=sec, nanosec=nanosec)).nanoseconds == nanoseconds


# The ROS clock


def test_simulated_time_is_zero_until_it_is_set() -> None:
    clock = RosClock(lambda: 77)
    assert clock.now() == ros(77)

    clock.activate()
    assert clock.now_ns() == 0
    clock.set(5)
    assert clock.now_ns() == 5
    clock.deactivate()
    assert clock.now_ns() == 77


def test_a_time_set_while_inactive_is_kept_and_told_to_nobody() -> None:
    clock = RosClock(lambda: 77)
    told: list[TimeJump] = []
    clock.on_jump(JumpThreshold(min_forward=Duration(nanoseconds=1), min_backward=None), post=told.append)

    clock.set(5)
    assert (clock.now_ns(), told) == (77, [])

    clock.activate()
    clock.activate()
    assert clock.now_ns() == 5
    assert [jump.clock_change for jump in told] == [ClockChange.ROS_TIME_ACTIVATED]


def test_pre_sees_the_old_time_and_post_the_new_one() -> None:
    clock = RosClock(lambda: 0)
    clock.activate()
    seen: list[int] = []
    handle = clock.on_jump(
        JumpThreshold(min_forward=Duration(nanoseconds=10), min_backward=None),
        pre=lambda: seen.append(clock.now_ns()),
        post=lambda jump: seen.extend((clock.now_ns(), jump.delta.nanoseconds)),
    )

    clock.set(9)
    clock.set(19)
    handle.remove()
    handle.remove()
    clock.set(1000)

    assert seen == [9, 19, 10]


def test_a_clock_does_not_accept_a_time_before_its_epoch() -> None:
    with pytest.raises(ValueError, match="epoch"):
        RosClock(lambda: 0).set(-1)


# Timers


def test_a_late_timer_skips_whole_periods_and_keeps_its_phase() -> None:
    timer = TimerGrid(100, 1000)

    assert not timer.ready(1099)
    assert timer.ready(1100)
    assert timer.call(1330) == (1100, 1330, 330)
    assert timer.time_until_next_call(1330) == 70
    assert timer.time_since_last_call(1400) == 70


def test_a_canceled_timer_is_never_due_until_it_is_reset() -> None:
    timer = TimerGrid(100, 0, autostart=False)
    assert not timer.ready(1000)
    assert timer.time_until_next_call(1000) is None
    with pytest.raises(TimerCanceled, match=r"reset\(\) it"):
        timer.call(1000)

    timer.reset(1000)
    assert timer.time_until_next_call(1000) == 100


def test_a_timer_of_period_zero_is_always_due() -> None:
    timer = TimerGrid(0, 50)

    for now in (50, 50, 60):
        assert timer.ready(now)
        timer.call(now)


def test_a_negative_period_is_refused() -> None:
    with pytest.raises(ValueError, match="negative"):
        TimerGrid(-1, 0)


def test_a_timer_waits_the_rest_of_its_period_when_simulated_time_begins() -> None:
    clock = RosClock(lambda: 1030)
    clock.set(500_000)
    timer = TimerGrid(100, 1000)
    handle = timer.attach(clock)

    clock.activate()

    assert timer.time_until_next_call(clock.now_ns()) == 70
    assert timer.time_since_last_call(clock.now_ns()) == 30
    handle.remove()


@given(st.integers(1, 50), st.integers(0, 1000), st.lists(st.integers(0, 200), max_size=30))
def test_calls_come_on_the_grid_at_most_one_a_period_and_never_early(period: int, start: int, waits: list[int]) -> None:
    timer, now = TimerGrid(period, start), start
    planned: list[int] = []
    for wait in waits:
        now += wait
        if timer.ready(now):
            planned.append(timer.call(now).expected)
            remaining = timer.time_until_next_call(now)
            assert remaining is not None
            assert 0 < remaining <= period

    assert all((due - start) % period == 0 for due in planned)
    assert planned == sorted(set(planned))


def test_the_reprs_tell_the_state() -> None:
    clock = RosClock(lambda: 0)
    clock.activate()
    timer = TimerGrid(100, 5)
    threshold = JumpThreshold(min_forward=Duration(seconds=1), min_backward=None)

    assert repr(clock) == "RosClock(Time(0.0 s, ROS_TIME), simulated time)"
    assert repr(threshold) == "JumpThreshold(forward Duration(1.0 s), backward None, source changes)"
    assert repr(timer) == "TimerGrid(every 100 ns, next at 105 ns)"
    timer.cancel()
    assert repr(timer) == "TimerGrid(every 100 ns, canceled)"


def test_an_instant_as_a_float_and_what_cannot_be_taken_from_it() -> None:
    assert ros(1_500_000_000).seconds == 1.5
    with pytest.raises(TypeError):
        ros(1) - 1  # type: ignore[operator]  # pyright: ignore


def test_switching_to_the_time_in_force_tells_nobody() -> None:
    clock = RosClock(lambda: 5)
    told: list[ClockChange] = []
    clock.on_jump(JumpThreshold(min_forward=None, min_backward=None), post=lambda jump: told.append(jump.clock_change))
    clock.deactivate()
    assert (clock.active, told) == (False, [])
    clock.activate()
    clock.activate()
    assert (clock.active, told) == (True, [ClockChange.ROS_TIME_ACTIVATED])


def test_who_wants_to_hear_only_before_a_jump_hears_only_before_it() -> None:
    clock = RosClock(lambda: 5)
    story: list[str] = []
    clock.on_jump(JumpThreshold(min_forward=None, min_backward=None), pre=lambda: story.append("pre"))
    clock.activate()
    assert story == ["pre"]


def test_a_timer_keeps_its_plan_when_the_new_time_is_not_known_yet() -> None:
    clock = RosClock(lambda: 7)
    timer = TimerGrid(10, clock.now_ns())
    timer.attach(clock)
    clock.activate()  # nobody has said yet what simulated time it is: it stands at 0
    assert clock.now_ns() == 0
    assert timer.time_until_next_call(0) == 17
