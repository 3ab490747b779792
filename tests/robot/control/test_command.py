"""What is asked of a walk: refused, clipped, slewed."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.control.command import CommandLimits, CommandShaper

LIMITS = CommandLimits()
finite = st.floats(-10.0, 10.0)
velocity = st.tuples(finite, finite, finite)


def close(a: tuple[float, ...], b: tuple[float, ...]) -> bool:
    return a == pytest.approx(b, abs=1e-12)


@given(asked=velocity)
def test_commands_are_clipped_and_slewed(asked: tuple[float, float, float]) -> None:
    vx, vy, wz = asked
    shaper = CommandShaper(LIMITS)
    assert shaper.ask(*asked)
    before = shaper.velocity
    for _ in range(400):
        now = shaper.advance(0.005, walking=True)
        assert all(abs(a - b) <= most + 1e-12 for a, b, most in zip(now, before, (0.0075, 0.0075, 0.02), strict=True))
        before = now
    assert before == pytest.approx((max(-0.5, min(1.6, vx)), max(-0.4, min(0.4, vy)), max(-1.5, min(1.5, wz))))


@pytest.mark.parametrize("part", range(3))
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_command_that_is_not_a_number_is_refused_and_counted(bad: float, part: int) -> None:
    shaper = CommandShaper(LIMITS)
    shaper.ask(0.5, 0.0, 0.0)
    asked = [0.1, 0.1, 0.1]
    asked[part] = bad
    assert not shaper.ask(*asked)
    assert shaper.asked == (0.5, 0.0, 0.0)
    assert shaper.refused == 1


@pytest.mark.parametrize(
    ("asked", "given_"),
    [
        ((2.0, 0.0, 0.0), (1.6, 0.0, 0.0)),
        ((-2.0, 0.0, 0.0), (-0.5, 0.0, 0.0)),
        ((0.0, 2.0, 0.0), (0.0, 0.4, 0.0)),
        ((0.0, -2.0, 0.0), (0.0, -0.4, 0.0)),
        ((0.0, 0.0, 9.0), (0.0, 0.0, 1.5)),
        ((0.0, 0.0, -9.0), (0.0, 0.0, -1.5)),
        ((0.3, -0.2, 1.0), (0.3, -0.2, 1.0)),
    ],
)
def test_each_limit_is_that_of_its_own_direction(
    asked: tuple[float, float, float], given_: tuple[float, float, float]
) -> None:
    assert LIMITS.clip(*asked) == given_
    assert LIMITS.allows(asked) is (asked == given_)


@given(asked=velocity)
def test_what_was_clipped_is_allowed(asked: tuple[float, float, float]) -> None:
    assert LIMITS.allows(LIMITS.clip(*asked))


@given(share=st.floats(0.0, 1.0))
def test_between_two_limits_every_speed_goes_linearly(share: float) -> None:
    low, high = CommandLimits(0.1, 0.2, 0.3, 0.4, 5.0, 6.0), CommandLimits(1.1, 1.2, 1.3, 1.4)
    found = low.between(high, share)
    assert (found.forward, found.backward, found.sideways, found.turn) == pytest.approx(
        (0.1 + share, 0.2 + share, 0.3 + share, 0.4 + share)
    )


def test_the_slew_is_one_and_a_half_metres_and_four_radians_a_second_squared() -> None:
    shaper = CommandShaper(LIMITS)
    shaper.ask(9.0, -9.0, 9.0)
    assert close(shaper.advance(0.1, True), (0.15, -0.15, 0.4))
    assert close(shaper.advance(0.1, True), (0.3, -0.3, 0.8))


def test_a_walk_that_must_end_is_braked_faster_and_never_slower_than_the_limits_say() -> None:
    shaper = CommandShaper(LIMITS)
    shaper.resume(1.0, -0.3, 0.5)
    assert close(shaper.advance(0.1, False, least_slew=4.0), (0.6, 0.0, 0.1))
    assert close(shaper.advance(0.1, False, least_slew=0.5), (0.45, 0.0, 0.0))


def test_who_does_not_walk_is_braked_to_rest_and_goes_on_when_walking() -> None:
    shaper = CommandShaper(LIMITS)
    shaper.ask(0.3, 0.0, 0.0)
    for _ in range(10):
        shaper.advance(0.1, True)
    assert close(shaper.advance(0.1, False), (0.15, 0.0, 0.0))
    assert close(shaper.advance(0.1, False), (0.0, 0.0, 0.0))
    assert close(shaper.advance(0.1, True), (0.15, 0.0, 0.0))


@given(asked=velocity, forward=st.floats(0.05, 1.0), sideways=st.floats(0.05, 1.0))
def test_of_several_bounds_the_narrowest_holds(
    asked: tuple[float, float, float], forward: float, sideways: float
) -> None:
    shaper = CommandShaper(LIMITS)
    shaper.ask(*asked)
    bounds = (CommandLimits(forward=forward), None, CommandLimits(sideways=sideways))
    found = shaper.advance(100.0, True, *bounds)
    assert -0.5 <= found[0] <= forward
    assert abs(found[1]) <= min(sideways, 0.4)
    assert shaper.asked == LIMITS.clip(*asked), "what was asked for is kept for when the bound is gone"


def test_halted_it_stands_at_once_and_has_forgotten_what_was_asked() -> None:
    shaper = CommandShaper(LIMITS)
    shaper.ask(0.3, 0.1, 0.2)
    shaper.advance(1.0, True)
    shaper.halt()
    assert shaper.velocity == (0.0, 0.0, 0.0)
    assert shaper.advance(1.0, True) == (0.0, 0.0, 0.0)
