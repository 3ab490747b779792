"""Which beam looks where, and which have met something."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.hardware.beams import BEAMS, MAX_RANGE, NEAREST, beam_angles, returns


@given(st.integers(1, 1000))
def test_beams_begin_behind_and_go_round_to_the_left_in_equal_steps(beams: int) -> None:
    angles = beam_angles(beams)
    assert angles.shape == (beams,)
    assert angles[0] == -math.pi
    assert np.diff(angles) == pytest.approx(np.full(beams - 1, 2 * math.pi / beams))
    assert angles[-1] == pytest.approx(math.pi - 2 * math.pi / beams), "the last comes just before the first again"


def test_of_360_beams_that_in_the_middle_looks_ahead() -> None:
    assert len(beam_angles()) == BEAMS == 360
    assert beam_angles()[[90, 180, 270]] == pytest.approx([-math.pi / 2, 0.0, math.pi / 2])


def test_the_angles_are_made_once_and_cannot_be_written() -> None:
    assert beam_angles(36) is beam_angles(36)
    with pytest.raises(ValueError, match="read-only"):
        beam_angles(36)[0] = 1.0


@pytest.mark.parametrize(
    ("shown", "met"),
    [
        (0.0, False),
        (NEAREST, False),
        (NEAREST + 1e-6, True),
        (9.99, True),
        (MAX_RANGE, False),
        (float(np.float32(MAX_RANGE)) - 1e-7, False),
        (12.0, False),
        (math.inf, False),
        (-math.inf, False),
        (math.nan, False),
    ],
)
def test_a_return_is_a_finite_range_between_the_housing_and_the_maximum(shown: float, met: bool) -> None:
    assert returns(np.array([shown])).tolist() == [met]


@given(st.lists(st.floats(0.125, 30.0, width=32), min_size=1, max_size=30), st.floats(1.0, 29.0, width=32))
def test_a_scan_says_the_same_after_its_way_through_32_bits(ranges: list[float], most: float) -> None:
    """What is clipped to the maximum before it is sent must not come back as something just before it."""
    clipped = np.minimum(np.array(ranges), most)
    sent = clipped.astype(np.float32).astype(np.float64)
    assert returns(sent, most).tolist() == [r < most - 1e-6 for r in sent]
    assert returns(clipped, most).sum() >= returns(sent, most).sum()


def test_the_least_range_can_be_given() -> None:
    assert returns(np.array([0.0, 0.01, 0.6]), nearest=0.0).tolist() == [False, True, True]
    assert returns(np.array([0.01, 0.6]), nearest=0.5).tolist() == [False, True]
