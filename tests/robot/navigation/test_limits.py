"""The bounds of navigation's commands: clipping, pace, and a ramp that never delays braking."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.geometry.planar import ZERO_TWIST, Twist2
from robot.navigation.limits import Limits, Tolerance

LIMITS = Limits()
speed = st.floats(-3.0, 3.0)
twists = st.builds(Twist2, speed, speed, speed)


def parts(twist: Twist2) -> tuple[float, float, float]:
    return (twist.vx, twist.vy, twist.wz)


@given(vx=speed, vy=speed, wz=speed)
def test_a_command_is_clipped_axis_by_axis(vx: float, vy: float, wz: float) -> None:
    found = LIMITS.clip(vx, vy, wz)
    assert found == Twist2(sorted((-0.3, vx, 0.8))[1], sorted((-0.3, vy, 0.3))[1], sorted((-1.0, wz, 1.0))[1])
    assert LIMITS.clip(*parts(found)) == found


@pytest.mark.parametrize(
    ("clearance", "pace"), [(-1.0, 0.3), (0.0, 0.3), (0.1, 0.5), (0.2, 0.7), (0.25, 0.8), (5.0, 0.8)]
)
def test_the_pace_grows_with_the_room_around_the_body(clearance: float, pace: float) -> None:
    assert LIMITS.pace(clearance) == pytest.approx(pace)


def test_a_creep_beyond_the_highest_speed_is_no_way_round_it() -> None:
    assert Limits(vx_max=0.2).pace(0.0) == 0.2


@given(wanted=twists, last=twists, dt=st.floats(0.01, 0.5))
def test_no_axis_grows_faster_than_its_acceleration(wanted: Twist2, last: Twist2, dt: float) -> None:
    now = LIMITS.ramp(wanted, last, dt)
    for found, before, growth in zip(parts(now), parts(last), (1.0, 1.0, 3.0), strict=True):
        assert abs(found) <= abs(before) + growth * dt + 1e-12


@given(wanted=twists, last=twists, dt=st.floats(0.01, 0.5))
def test_a_ramp_never_overshoots_nor_turns_away_from_what_is_wanted(wanted: Twist2, last: Twist2, dt: float) -> None:
    for found, asked in zip(parts(LIMITS.ramp(wanted, last, dt)), parts(wanted), strict=True):
        assert abs(found) <= abs(asked)
        assert found * asked >= 0.0


@given(last=twists, share=st.floats(0.0, 1.0), dt=st.floats(0.001, 0.5))
def test_braking_is_never_delayed(last: Twist2, share: float, dt: float) -> None:
    slower = Twist2(share * last.vx, share * last.vy, share * last.wz)
    assert LIMITS.ramp(slower, last, dt) == slower


def test_the_other_way_starts_from_zero() -> None:
    assert parts(LIMITS.ramp(Twist2(-0.3, 0.3, -1.0), Twist2(0.8, -0.3, 1.0), 0.1)) == pytest.approx((-0.1, 0.1, -0.3))


def test_from_rest_the_highest_speed_takes_its_time() -> None:
    now, seconds = ZERO_TWIST, 0.0
    while now.vx < 0.8:
        now = LIMITS.ramp(Twist2(0.8, 0.0, 0.0), now, 0.05)
        seconds += 0.05
    assert seconds == pytest.approx(0.8 / 1.0)


def test_near_means_within_six_centimetres_and_a_twenty_fifth_of_a_radian() -> None:
    assert (Tolerance().position, Tolerance().yaw) == (0.06, 0.04)
