"""Pickles of strangers: what a number, a key, a part at many places, and an attribute in them may cost or do."""

from __future__ import annotations

import contextlib
import enum
import pickle
import time
from collections import Counter, OrderedDict, defaultdict, deque
from datetime import timedelta
from decimal import Decimal
from typing import Any, NamedTuple

import msgspec
import pytest

from actors.pickle_bounds import BoundedUnpickler, Steps, UnreadablePickle, check_extent

ACTED: list[str] = []


class Point(NamedTuple):
    x: int
    y: int


class Cell(msgspec.Struct, frozen=True):
    place: tuple[int, int]


class Colour(enum.Enum):
    RED = 1


class Acting:
    def __hash__(self) -> int:
        ACTED.append("hash")
        return 0

    def __setstate__(self, state: Any) -> None:
        ACTED.append("setstate")

    def extend(self, values: Any) -> None:
        ACTED.append("extend")

    def append(self, value: Any) -> None:
        ACTED.append("append")

    def __setitem__(self, key: Any, value: Any) -> None:
        ACTED.append("setitem")

    def add(self, value: Any) -> None:
        ACTED.append("add")


MADE = pickle.dumps(Acting, 4)[11:-1] + b")R"
"""An object of it, without the head of a pickle."""


def read(data: bytes, steps: int = 100_000) -> Any:
    return BoundedUnpickler(data, Steps(steps)).load()


@pytest.mark.parametrize("protocol", [4, 5])
@pytest.mark.parametrize(
    "value",
    [
        None, [True, 1, 1 << 80, -1.5, "text", b"bytes", bytearray(b"array"), 1j], {"a": {1, 2.5}}, frozenset({(1, "x")}), deque([1, 2]),
        OrderedDict(a=1), defaultdict(None, {1: 2}), Counter("aab"), {Point(1, 2): Cell((3, 4))}, {Cell((1, 2)): 1}, {Colour.RED: Colour.RED},
        {1 << 70: 1}, {Decimal(1): timedelta(1), Point: 1}, list(range(3000)), dict.fromkeys(range(3000)), [[1]],
    ],
    ids=repr,
)  # fmt: skip
def test_values_come_back_as_they_were(value: Any, protocol: int) -> None:
    assert read(pickle.dumps(value, protocol)) == value
    check_extent(value, 10_000)


@pytest.mark.parametrize(
    "ending",
    [b"}b", b"K\x01a", b"(K\x01K\x02e", b"K\x01K\x02s", b"(K\x01K\x02u", b"(K\x01\x90"],
    ids=["BUILD", "APPEND", "APPENDS", "SETITEM", "SETITEMS", "ADDITEMS"],
)
def test_nothing_is_done_to_an_object(ending: bytes) -> None:
    ACTED.clear()
    with pytest.raises(UnreadablePickle):
        read(MADE + ending + b".")
    assert ACTED == []


@pytest.mark.parametrize("holder", [b"(" + MADE + b"\x91.", b"}" + MADE + b"Ns.", b"\x8f(" + MADE + b"\x90."])
def test_no_object_is_hashed_by_code_of_its_own(holder: bytes) -> None:
    ACTED.clear()
    with pytest.raises(UnreadablePickle, match="may call code of its own"):
        read(holder)
    assert ACTED == []


class Named:
    def __init__(self, *, name: str) -> None:
        self.name = name

    def __getnewargs_ex__(self) -> Any:
        return (), {"name": "x"}


def test_keywords_reach_what_may_be_called() -> None:
    data = pickle.dumps(Named(name="x"), 4)
    with pytest.raises(UnreadablePickle, match="changes an object of Named"):
        read(data)
    assert read(data[: data.rindex(b"}")] + b".").name == "x"


@pytest.mark.parametrize(
    "data",
    [
        b"\x80\x04Nr\xff\xff\xff\x3f.",  # remembered as number 2**30, as the pickler in Python writes it
        b"\x96\xff\xff\xff\xff\x00\x00\x00\x00.",  # 4 GB of zeros, but only where they are there
        b"\x80\x04P1\n.",
        b"\x80\x04\x8c\x01aQ.",
        b"\x80\x04\x8c\x08builtins\x8c\x05print\x93K\x01R.",
        b"(i",
        b"2",
        b"",
    ],
)
def test_what_needs_more_than_it_holds_is_refused_at_once(data: bytes) -> None:
    begun = time.process_time()
    with contextlib.suppress(UnreadablePickle, EOFError, KeyError, IndexError):
        assert read(data) == bytearray()
    assert time.process_time() - begun < 0.1


def test_values_are_counted_before_they_are_made() -> None:
    with pytest.raises(UnreadablePickle, match="more values"):
        read(b"\x80\x04" + b"\x8f" * 1000, steps=100)


def test_keys_whose_hashes_collide_are_few() -> None:
    prime = 2**61 - 1
    keys = b"".join(pickle.dumps(number * prime, 2)[2:-1] + b"N" for number in range(2, 10_003))
    begun = time.process_time()
    with pytest.raises(UnreadablePickle, match="10000 keys"):
        read(b"\x80\x04}(" + keys + b"u.")
    with pytest.raises(UnreadablePickle, match="no arguments"):
        read(b"\x80\x04NNR.")
    assert time.process_time() - begun < 1.0


def test_a_key_is_no_larger_than_what_it_takes() -> None:
    doubled: Any = ()
    for _ in range(60):
        doubled = (doubled, doubled)
    data = pickle.dumps(doubled, 4)[:-1]
    begun = time.process_time()
    with pytest.raises(UnreadablePickle, match="too many parts"):
        read(b"\x80\x04}" + data[2:] + b"Ns.")
    with pytest.raises(UnreadablePickle, match="at many places"):
        check_extent(read(data + b"."), 100_000)
    assert time.process_time() - begun < 1.0


class Holder:
    def __init__(self) -> None:
        self.held: Any = None


class Slots:
    __slots__ = ("held",)
    held: Any


def test_depth_and_circles() -> None:
    deep: Any = []
    for _ in range(200):
        deep = [deep]
    with pytest.raises(UnreadablePickle, match="deep"):
        check_extent(deep, 10_000)
    ring, slots, error = Holder(), Slots(), ValueError([1, 2])
    ring.held = [ring, {"x": ring}, slots, error, Colour.RED, Point, deque([1])]
    slots.held = ring
    check_extent(ring, 100)
    with pytest.raises(UnreadablePickle):
        check_extent(ring, 5)
