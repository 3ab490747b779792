"""Wrapping angles: one rule, for one and for many."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.geometry.angles import wrap
from robot.geometry.vectors import wrap_all


@given(st.floats(-1e4, 1e4))
def test_a_wrapped_angle_is_the_same_direction_within_half_a_turn(angle: float) -> None:
    wrapped = wrap(angle)
    assert -math.pi < wrapped <= math.pi
    assert math.cos(wrapped - angle) == pytest.approx(1.0)
    assert math.cos(float(wrap_all(np.array([angle]))[0]) - wrapped) == pytest.approx(1.0)


@given(st.floats(-math.pi, math.pi, exclude_min=True))
def test_an_angle_within_half_a_turn_keeps_its_last_bit(angle: float) -> None:
    assert wrap(angle) == angle
    assert wrap_all(np.array([angle]))[0] == angle


@pytest.mark.parametrize("turns", [-3, -1, 1, 3])
def test_half_a_turn_either_way_is_half_a_turn_to_the_left(turns: int) -> None:
    assert wrap(turns * math.pi) == pytest.approx(math.pi)


def test_no_number_stays_no_number_and_infinity_is_refused() -> None:
    assert math.isnan(wrap(math.nan))
    with pytest.raises(ValueError, match="math domain error"):
        wrap(math.inf)
