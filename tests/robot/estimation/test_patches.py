"""Patches of a mask are those that scipy finds."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy import ndimage

from robot.estimation.patches import patches

masks = hnp.arrays(np.bool_, st.tuples(st.integers(1, 12), st.integers(1, 12)))


@given(masks)
def test_patches_are_those_of_scipy(mask: np.ndarray) -> None:
    labels, count = ndimage.label(mask, structure=np.ones((3, 3)))
    found = patches(mask)
    assert len(found) == count
    for patch in found:
        rows, columns = patch.pixels()
        assert patch.size == len(rows) == len(columns)
        label = labels[rows[0], columns[0]]
        drawn = np.zeros_like(mask)
        drawn[rows, columns] = True
        np.testing.assert_array_equal(drawn, labels == label)
        left, top, width, height = patch.box
        assert (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1) == (left, top, left + width, top + height)
