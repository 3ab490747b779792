"""The PNG file, read back by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.png import encode
from tests.robot.picture.kit import decoded


@given(st.integers(1, 9), st.integers(1, 9), st.integers(0, 999))
def test_a_png_file_reads_back_as_what_was_written(height: int, wide: int, seed: int) -> None:
    image = np.random.default_rng(seed).integers(0, 256, (height, wide, 3), dtype=np.uint8)
    assert np.array_equal(decoded(encode(image)), image)


def test_what_is_no_image_of_bytes_is_refused() -> None:
    with pytest.raises(ValueError, match="three channels of bytes"):
        encode(np.zeros((2, 2, 4), dtype=np.uint8))
