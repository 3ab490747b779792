"""The body as a rectangle on the floor."""

from __future__ import annotations

import math

import numpy as np
import pytest

from robot.model.footprint import Footprint


def test_the_outline_covers_the_rectangle() -> None:
    footprint = Footprint()
    assert footprint.circumscribed == pytest.approx(0.604, abs=1e-3)
    assert np.abs(footprint.outline).max(axis=0).tolist() == [0.55, 0.25]
    inside = footprint.distances(np.array([0.5, 0.0, 0.85]), np.array([0.2, 0.55, 0.65]))
    assert inside.tolist() == pytest.approx([0.0, 0.3, 0.5])


def test_a_footprint_that_reaches_farther_back_is_a_rectangle_about_another_middle() -> None:
    footprint = Footprint(length=1.1, width=0.46, ahead=-0.08)
    x, y = footprint.outline.T
    assert (x.min(), x.max()) == pytest.approx((-0.63, 0.47))
    assert (y.min(), y.max()) == pytest.approx((-0.23, 0.23))
    assert footprint.circumscribed == pytest.approx(math.hypot(0.63, 0.23))
    near = footprint.distances(np.array([0.5, -0.7, 0.0]), np.array([0.0, 0.0, 0.33]))
    assert near == pytest.approx([0.03, 0.07, 0.10])
