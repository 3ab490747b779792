"""Who drives."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.control.twist_mux import Source, TwistMux, VelocityLimits, Verdict
from robot.geometry.planar import ZERO_TWIST, Twist2

AHEAD = Twist2(0.3, 0.0, 0.0)
TURN = Twist2(0.0, 0.0, 0.5)
finite = st.floats(-1e9, 1e9)
anything = st.floats(allow_nan=True, allow_infinity=True)
sources = st.sampled_from(Source)


# --- priority and time ----------------------------------------------------------------------------------------------


def test_nobody_drives_until_someone_does() -> None:
    mux = TwistMux()
    assert mux.decide(0.0).velocity == ZERO_TWIST
    assert mux.decide(0.0).source is None
    assert mux.decide(0.0).reason == "no command"


@pytest.mark.parametrize("higher", Source)
@pytest.mark.parametrize("lower", Source)
def test_teleop_beats_joystick_beats_voice_beats_autonomy(higher: Source, lower: Source) -> None:
    if higher >= lower:
        return
    for first, second in ((higher, lower), (lower, higher)):
        mux = TwistMux()
        mux.offer(first, AHEAD if first is higher else TURN, 1.0)
        mux.offer(second, AHEAD if second is higher else TURN, 1.1)
        decision = mux.decide(1.2)
        assert decision.velocity == AHEAD
        assert decision.source is higher


@pytest.mark.parametrize("source", Source)
def test_every_source_times_out_after_half_a_second(source: Source) -> None:
    mux = TwistMux()
    assert mux.offer(source, AHEAD, 10.0) is Verdict.ACCEPTED
    assert mux.decide(10.49).velocity == AHEAD
    assert mux.decide(10.5).velocity == ZERO_TWIST
    assert mux.decide(10.5).reason == "all commands timed out"


@pytest.mark.parametrize("source", list(Source))
def test_who_drives_may_change_the_command_at_any_time(source: Source) -> None:
    mux = TwistMux()
    for now, wanted in ((0.0, AHEAD), (0.05, TURN), (0.1, AHEAD)):
        assert mux.offer(source, wanted, now) is Verdict.ACCEPTED
        assert mux.decide(now).velocity == wanted
    assert mux.decide(0.55).velocity == AHEAD, "the timeout is that of the latest command"


def test_the_next_source_takes_over_when_a_higher_one_falls_silent() -> None:
    mux = TwistMux()
    mux.offer(Source.TELEOP, AHEAD, 0.0)
    assert mux.offer(Source.AUTONOMY, TURN, 0.4) is Verdict.OUTRANKED
    assert mux.decide(0.6).velocity == ZERO_TWIST
    assert mux.offer(Source.AUTONOMY, TURN, 0.6) is Verdict.ACCEPTED
    assert mux.decide(0.6).source is Source.AUTONOMY


def test_x_07b_joystick_input_in_the_last_half_second_makes_voice_ignored() -> None:
    mux = TwistMux()
    mux.offer(Source.JOYSTICK, TURN, 0.0)
    assert mux.offer(Source.VOICE, AHEAD, 0.3) is Verdict.OUTRANKED
    # ignored for good: it does not come alive when the joystick's command has timed out
    assert mux.decide(0.55).velocity == ZERO_TWIST
    assert mux.offer(Source.VOICE, AHEAD, 0.55) is Verdict.ACCEPTED


def test_a_clock_that_jumps_back_does_not_keep_old_commands_alive() -> None:
    mux = TwistMux()
    mux.offer(Source.TELEOP, AHEAD, 100.0)
    assert mux.decide(1.0).velocity == ZERO_TWIST
    assert mux.offer(Source.AUTONOMY, TURN, 1.0) is Verdict.ACCEPTED


# --- clipping and refusing ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("asked", "given"),
    [
        (Twist2(5.0, 5.0, 5.0), Twist2(1.6, 0.4, 1.5)),
        (Twist2(-5.0, -5.0, -5.0), Twist2(-0.5, -0.4, -1.5)),
        (Twist2(0.5, 0.1, -0.2), Twist2(0.5, 0.1, -0.2)),
    ],
)
def test_commands_are_clipped_to_the_limits_of_the_robot(asked: Twist2, given: Twist2) -> None:
    mux = TwistMux()
    mux.offer(Source.TELEOP, asked, 0.0)
    assert mux.decide(0.0).velocity == given


def test_x_07_joystick_2_and_minus_3_becomes_1_and_minus_1() -> None:
    mux = TwistMux(VelocityLimits(forward=1.0, backward=1.0, sideways=1.0, turn=1.0))
    mux.offer(Source.JOYSTICK, Twist2(2.0, 0.0, -3.0), 0.0)
    assert mux.decide(0.0).velocity == Twist2(1.0, 0.0, -1.0)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("part", ["vx", "vy", "wz"])
def test_x_07b_what_is_not_a_number_is_dropped_and_counted(bad: float, part: str) -> None:
    mux = TwistMux()
    mux.offer(Source.JOYSTICK, AHEAD, 0.0)
    broken = Twist2(**{"vx": 0.0, "vy": 0.0, "wz": 0.0, part: bad})
    assert mux.offer(Source.JOYSTICK, broken, 0.4) is Verdict.NOT_A_NUMBER
    assert mux.dropped[Source.JOYSTICK] == 1
    assert mux.decide(0.4).velocity == AHEAD
    assert mux.decide(0.6).velocity == ZERO_TWIST  # it did not prolong the last good command


@given(st.lists(st.tuples(sources, anything, anything, anything, st.floats(0, 2)), max_size=40), st.floats(0, 3))
def test_whatever_is_offered_the_decision_is_finite_and_within_limits(
    offers: list[tuple[Source, float, float, float, float]], now: float
) -> None:
    mux = TwistMux()
    for source, vx, vy, wz, at in sorted(offers, key=lambda offer: offer[4]):
        mux.offer(source, Twist2(vx, vy, wz), at)
    velocity = mux.decide(now).velocity
    assert -0.5 <= velocity.vx <= 1.6
    assert abs(velocity.vy) <= 0.4
    assert abs(velocity.wz) <= 1.5


@given(finite, finite, finite)
def test_clipping_is_idempotent(vx: float, vy: float, wz: float) -> None:
    limits = VelocityLimits()
    once = limits.clip(Twist2(vx, vy, wz))
    assert limits.clip(once) == once


# --- disabled and stopped -------------------------------------------------------------------------------------------


def test_x_07_disabled_means_zero_and_refuses() -> None:
    mux = TwistMux(enabled=False)
    assert mux.offer(Source.VOICE, AHEAD, 0.0) is Verdict.DISABLED
    assert mux.decide(0.0).velocity == ZERO_TWIST
    assert mux.decide(0.0).reason == "disabled"


def test_x_07_disabling_stops_at_once_and_enabling_revives_nothing() -> None:
    mux = TwistMux()
    mux.offer(Source.TELEOP, AHEAD, 0.0)
    mux.disable()
    assert mux.decide(0.1).velocity == ZERO_TWIST
    mux.enable()
    assert mux.decide(0.1).velocity == ZERO_TWIST
    mux.offer(Source.TELEOP, AHEAD, 0.2)
    assert mux.decide(0.2).velocity == AHEAD


def test_f_08_an_emergency_stop_overrides_every_source_until_cleared() -> None:
    mux = TwistMux()
    mux.offer(Source.TELEOP, AHEAD, 0.0)
    mux.stop("bumper")
    for source in Source:
        assert mux.offer(source, AHEAD, 0.1) is Verdict.STOPPED
    assert mux.decide(0.1).velocity == ZERO_TWIST
    assert mux.decide(0.1).reason == "emergency stop: bumper"
    mux.enable()
    assert mux.stopped == "bumper"
    mux.clear()
    assert mux.decide(0.1).velocity == ZERO_TWIST
    mux.offer(Source.TELEOP, AHEAD, 0.2)
    assert mux.decide(0.2).velocity == AHEAD


def test_f_08_clearing_a_stop_does_not_enable_and_the_first_reason_is_kept() -> None:
    mux = TwistMux(enabled=False)
    mux.stop("bumper")
    mux.stop("lidar lost")
    assert mux.stopped == "bumper"
    assert repr(mux) == "<TwistMux stopped: bumper, dropped 0>"
    mux.clear()
    assert not mux.enabled
    assert mux.offer(Source.TELEOP, AHEAD, 0.0) is Verdict.DISABLED


# --- a spoken stop --------------------------------------------------------------------------------------------------


def test_after_a_spoken_stop_autonomy_is_held_back() -> None:
    mux = TwistMux()
    mux.offer(Source.AUTONOMY, AHEAD, 0.0)
    assert mux.offer(Source.VOICE, ZERO_TWIST, 0.1) is Verdict.ACCEPTED
    assert mux.offer(Source.AUTONOMY, AHEAD, 10.0) is Verdict.HELD_BACK
    assert mux.decide(10.0).velocity == ZERO_TWIST
    assert mux.decide(10.0).reason == "held back by a spoken stop"


@pytest.mark.parametrize("person", [Source.TELEOP, Source.JOYSTICK, Source.VOICE])
def test_a_person_who_drives_again_ends_that(person: Source) -> None:
    mux = TwistMux()
    mux.offer(Source.VOICE, ZERO_TWIST, 0.0)
    mux.offer(person, ZERO_TWIST, 1.0)  # a stick at rest is no wish to drive
    assert mux.offer(Source.AUTONOMY, AHEAD, 2.0) is Verdict.HELD_BACK
    mux.offer(person, TURN, 3.0)
    assert mux.offer(Source.AUTONOMY, AHEAD, 4.0) is Verdict.ACCEPTED


def test_enabling_ends_that_too_and_clearing_a_stop_does_not() -> None:
    mux = TwistMux()
    mux.offer(Source.VOICE, ZERO_TWIST, 0.0)
    mux.stop("bumper")
    mux.clear()
    assert mux.offer(Source.AUTONOMY, AHEAD, 1.0) is Verdict.HELD_BACK
    mux.enable()
    assert mux.offer(Source.AUTONOMY, AHEAD, 2.0) is Verdict.ACCEPTED
