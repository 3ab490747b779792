"""Buffers of any tree and any history: laws that hold for all of them, against products of numpy's matrices."""

from __future__ import annotations

from itertools import pairwise
from math import sqrt
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from actors.tf2 import Buffer, ExtrapolationException, Transform, stamped
from actors.time import stamp_of

SECOND = 1_000_000_000
lengths = st.floats(-50.0, 50.0)


@st.composite
def transforms(draw: st.DrawFn) -> Transform:
    q = draw(st.tuples(*[st.floats(-1.0, 1.0)] * 4))
    norm = sqrt(sum(part * part for part in q))
    assume(norm > 1e-2)
    w, x, y, z = (part / norm for part in q)
    return Transform(draw(st.tuples(lengths, lengths, lengths)), (w, x, y, z))


class Forest(NamedTuple):
    """Frames f0, f1, ... with the number of their parent, which is smaller, and where they are in it."""

    parents: list[int]
    places: list[Transform]

    def buffer(self) -> Buffer:
        buffer = Buffer()
        for child, (parent, place) in enumerate(zip(self.parents, self.places, strict=True), start=1):
            buffer.set_transform(stamped(f"f{parent}", f"f{child}", place, stamp_of(SECOND)))
        return buffer

    def matrix(self, frame: int) -> NDArray[np.float64]:
        """The pose of a frame in the root, 4 x 4."""
        whole = np.eye(4)
        while frame:
            whole = matrix(self.places[frame - 1]) @ whole
            frame = self.parents[frame - 1]
        return whole


@st.composite
def forests(draw: st.DrawFn) -> Forest:
    size = draw(st.integers(1, 8))
    return Forest([draw(st.integers(0, k)) for k in range(size)], [draw(transforms()) for _ in range(size)])


def matrix(transform: Transform) -> NDArray[np.float64]:
    w, x, y, z = transform.rotation
    whole = np.eye(4)
    whole[:3, :3], whole[:3, 3] = Rotation.from_quat((x, y, z, w)).as_matrix(), transform.translation
    return whole


def look(buffer: Buffer, target: str, source: str, nanoseconds: int = 0) -> Transform:
    return Transform.from_msg(buffer.lookup_transform(target, source, stamp_of(nanoseconds)))


@settings(deadline=None)
@given(forests(), st.data())
def test_a_lookup_is_the_product_of_the_matrices_on_the_way(forest: Forest, data: st.DataObject) -> None:
    a, b = (data.draw(st.integers(0, len(forest.parents))) for _ in range(2))
    expected = np.linalg.inv(forest.matrix(a)) @ forest.matrix(b)
    assert matrix(look(forest.buffer(), f"f{a}", f"f{b}")) == pytest.approx(expected, abs=1e-6)


@settings(deadline=None)
@given(forests(), st.data())
def test_there_and_back_is_the_identity(forest: Forest, data: st.DataObject) -> None:
    buffer = forest.buffer()
    a, b = (f"f{data.draw(st.integers(0, len(forest.parents)))}" for _ in range(2))
    assert matrix(look(buffer, a, b) @ look(buffer, b, a)) == pytest.approx(np.eye(4), abs=1e-7)


@settings(deadline=None)
@given(transforms(), transforms(), st.lists(st.integers(0, SECOND), min_size=2, max_size=6))
def test_between_two_transforms_the_way_goes_forward_only(first: Transform, last: Transform, times: list[int]) -> None:
    """Along the line, and about the axis between the two, later is never behind earlier."""
    buffer = Buffer()
    buffer.set_transform(stamped("map", "robot", first, stamp_of(SECOND)))
    buffer.set_transform(stamped("map", "robot", last, stamp_of(2 * SECOND)))
    way = np.subtract(last.translation, first.translation)
    poses = [look(buffer, "map", "robot", SECOND + time) for time in sorted(times)]
    along = [float(np.dot(np.subtract(pose.translation, first.translation), way)) for pose in poses]
    assert all(a <= b + 1e-6 for a, b in pairwise(along))
    turned = [angle(first, pose) for pose in poses]
    assert all(a <= b + 1e-6 for a, b in pairwise(turned))


def angle(a: Transform, b: Transform) -> float:
    """The angle between two rotations, rad."""
    return float((Rotation.from_matrix(a.matrix).inv() * Rotation.from_matrix(b.matrix)).magnitude())


@settings(deadline=None)
@given(st.lists(st.integers(1, 30 * SECOND), min_size=1, max_size=60), st.integers(1, 10 * SECOND))
def test_what_is_kept_is_the_cache_time_before_the_newest_whatever_the_order(times: list[int], cache: int) -> None:
    buffer = Buffer(cache_time=cache * 1e-9)
    newest = 0
    for time in times:
        kept = buffer.set_transform(stamped("map", "robot", Transform((time * 1e-9, 0.0, 0.0)), stamp_of(time)))
        assert kept == (time >= newest - cache)
        newest = max(newest, time)
    known = sorted({time for time in times if time >= newest - cache})
    frame = buffer.frames()["robot"]
    assert frame.length == len(known)
    assert frame.newest - frame.oldest <= cache * 1e-9 + 1e-9
    for time in known:
        assert look(buffer, "map", "robot", time).translation[0] == pytest.approx(time * 1e-9)
    for outside in (known[0] - 1, known[-1] + 1):
        if outside > 0:
            with pytest.raises(ExtrapolationException):
                look(buffer, "map", "robot", outside)
