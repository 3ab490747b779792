"""What a journal keeps of values, and how recorded and replayed ones are compared."""

from __future__ import annotations

import enum
import math
import pickle
import platform
import sys
from collections import Counter, deque
from importlib.metadata import PackageNotFoundError
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zstandard
from msgspec._utils import rebuild  # type: ignore[import-untyped]

from actors.interfaces.std_msgs.msg import Float64MultiArray, Int32, MultiArrayDimension, MultiArrayLayout
from actors.replay import Recording, ReplayError
from actors.replay.comparison import first_difference
from actors.replay.encoding import (
    array_made,
    class_named,
    frozen,
    message_named,
    object_filled,
    object_made,
    scalar_made,
    thawed,
    tuple_made,
)
from actors.replay.parts import pack, unpack, whole
from actors.replay.recording import Start, Unkept


class Numbered(Exception):
    def __init__(self, number: int, *, unit: str) -> None:
        super().__init__(f"{number} {unit}")
        self.number = number


def start(node: str = "/a") -> tuple[Any, ...]:
    return (
        "start",
        2.0,
        0,
        Start(
            node,
            node,
            1,
            ("a",),
            b"",
            b"",
            b"",
            None,
            seed=0,
            process="",
            level=20,
            virtual=True,
            origin=2.0,
            epoch=0.0,
        ),
    )


@pytest.mark.parametrize(
    ("recorded", "replayed", "difference"),
    [
        (Int32(data=1), Int32(data=1), None),
        (math.nan, math.nan, None),
        (0.0, -0.0, ("", 0.0, -0.0)),
        (1, 1.0, ("", 1, 1.0)),
        (Float64MultiArray(data=[1, 2, 3]), Float64MultiArray(data=[1, 2, 3]), None),
        (Float64MultiArray(data=[1, 2, 3]), Float64MultiArray(data=[1, 2, 4]), ("data[2]", 3.0, 4.0)),
        (Float64MultiArray(data=[1]), Float64MultiArray(data=[1, 2]), ("shape(data)", (1,), (2,))),
        (np.zeros(2, np.float32), np.zeros(2), ("dtype()", "float32", "float64")),
        (("id", [1, 2]), ("id", [1, 2, 3]), ("len([1])", 2, 3)),
        (("id", [1, 2]), ("id", [1, 3]), ("[1][1]", 2, 3)),
        (
            MultiArrayLayout(dim=[MultiArrayDimension(label="x")]),
            MultiArrayLayout(dim=[MultiArrayDimension(label="y")]),
            ("dim[0].label", "x", "y"),
        ),
    ],
)
def test_the_first_field_in_which_two_values_differ_is_named(
    recorded: Any, replayed: Any, difference: tuple[str, Any, Any] | None
) -> None:
    found = first_difference(recorded, replayed)
    assert repr(found) == repr(difference)  # -0.0 equals 0.0, but is not written like it


def test_an_error_that_its_class_cannot_make_again_is_kept_with_its_arguments_and_attributes() -> None:
    again = thawed(frozen(Numbered(3, unit="m")))
    assert isinstance(again, Numbered)
    assert (str(again), again.number) == ("3 m", 3)


def test_a_value_that_cannot_be_pickled_is_left_out_and_the_rest_is_kept() -> None:
    number, entries = unpack(pack(3, [0.25, ("out", "log", "INFO", lambda: None), ("step", 1.5, 7)]))
    assert (number, entries[0]) == (3, 0.25)
    assert entries[2] == ("step", 1.5, 7)
    out = entries[1]
    assert isinstance(out, tuple)
    assert out[:3] == ("out", "log", "INFO")
    assert isinstance(out[3], Unkept)
    assert "not kept: function: " in repr(out[3])


def test_a_tape_says_what_it_holds_and_refuses_to_begin_amid_a_life() -> None:
    recording = Recording("/a", [start(), 2.5, ("step", 3.5, 1), ("out", "publish", "/t", 1)])
    assert repr(recording) == "<journal of /a: 4 entries>"
    assert recording.counts() == {"start": 1, "clock reading": 1, "step": 1, "out": 1}
    assert recording.seconds == 1.5
    assert recording.start.node == "/a"
    with pytest.raises(ReplayError, match="the journal of /a does not begin with a start of the node"):
        _ = Recording("/a", recording.entries[1:]).start
    assert Recording("/a").seconds == 0.0


def test_a_start_names_the_versions_that_a_replay_depends_on(monkeypatch: pytest.MonkeyPatch) -> None:
    named = dict(start()[3].versions)
    assert (named["python"], named["numpy"]) == (platform.python_version(), np.__version__)

    def unknown(package: str) -> str:
        raise PackageNotFoundError(package)

    monkeypatch.setattr("actors.replay.recording.version", unknown)
    assert dict(start()[3].versions)["numpy"] == "none"  # a source tree that was never installed


class Called:
    """Is pickled as a call."""

    def __init__(self, *call: Any) -> None:
        self._call = call

    def __reduce__(self) -> Any:
        return self._call

    def __call__(self) -> None:
        """What it is pickled as may be called."""


class Hashed:
    called = False

    def __hash__(self) -> int:
        Hashed.called = True
        return 0

    def __iter__(self) -> Any:
        Hashed.called = True
        return iter(())


class Setting:
    called = False

    @property
    def speed(self) -> float:
        return 0.0

    @speed.setter
    def speed(self, value: float) -> None:
        Setting.called = True


class Mood(enum.Enum):
    CALM = 1


def doubled(times: int, depth: int = 0) -> Any:
    value: Any = ()
    for _ in range(times):
        value = (value, value)
    for _ in range(depth):
        value = [value]
    return value


@pytest.mark.parametrize(
    "value",
    [
        Called(np.ndarray, ((1,), np.dtype("O"), b"A" * 8)),
        Called(np.dtype, ("O",)),
        Called(array_made, ("O", (1,), b"A" * 8, False)),
        Called(array_made, ("O8", (1,), b"A" * 8, False)),
        Called(array_made, ("i4,O", (1,), b"A" * 12, False)),
        Called(array_made, ("V8", (1,), b"A" * 8, False)),
        Called(scalar_made, ("O", b"A" * 8)),
        Called(set, (["x"],)),
        Called(deque, (Hashed(),)),
        Called(Counter, (Hashed(),)),
        Called(range, (Hashed(),)),
        Called(Counter, ([Hashed()],)),
        Called(array_made, ("i4", (1,), 10**12, False)),
        Called(array_made, ("i4", range(10**12), b"A" * 4, False)),
        Called(array_made, ("i4", (True,), b"A" * 4, False)),
        Called(class_named, ("actors." + "a" * 1000, "A")),
        Called(class_named, (__name__, "Hashed.__hash__.x")),
        Called(message_named, (range(10**12),)),
        Called(Called(class_named, (__name__, "Mood")), (Hashed(),)),
        Called(Called(class_named, (Int32.__module__, "Int32")), (Hashed(),)),
        Called(
            rebuild,
            (Called(class_named, (Float64MultiArray.__module__, "Float64MultiArray")), {"data": (range(10**12),)}),
        ),
        Called(rebuild, (Called(class_named, (Int32.__module__, "Int32")), ())),
        Called(tuple_made, (Start.__module__, "Start", range(10**12))),
        Called(object_filled, (Hashed(), (1, 2))),
        Called(object_filled, (Setting(), (None, {"speed": 1}))),
        Called(object_filled, (Setting(), (None, {"none": 1}))),
        doubled(60),
        doubled(1, depth=300),
    ],
)
def test_no_objects_are_made_of_bytes_and_no_methods_called(value: Any) -> None:
    data = frozen(value)
    with pytest.raises(ReplayError):
        thawed(data)
    assert not Hashed.called
    assert not Setting.called


def test_nothing_is_called_with_keywords() -> None:
    data = frozen(Called(class_named, (Int32.__module__, "Int32")))
    with pytest.raises(ReplayError, match="keywords"):
        thawed(data[:-1] + b")}\x8c\x04dataK\x01s\x92.")


def test_a_message_of_nested_parts_comes_back() -> None:
    value = MultiArrayLayout(dim=[MultiArrayDimension(label="x")])
    assert thawed(frozen(value)) == value


@pytest.mark.parametrize(
    "value",
    [
        np.arange(6, dtype=">i4").reshape(2, 3),
        np.zeros((0, 3)),
        np.array(["a", "bc"]),
        np.array([True]),
        np.array(["2026-01-01"], dtype="M8[s]"),
        np.float32(1.5),
        np.array(1 + 2j),
    ],
    ids=repr,
)
def test_arrays_and_numbers_of_numpy_are_kept_as_they_were(value: Any) -> None:
    kept = thawed(frozen(value))
    assert (type(kept), kept.dtype, kept.shape) == (type(value), value.dtype, value.shape)
    assert np.array_equal(kept, value)
    if isinstance(value, np.ndarray):
        value.flags.writeable = False
        assert value.size == 0 or not thawed(frozen(value)).flags.writeable


def test_arrays_of_objects_need_trust() -> None:
    data = frozen(np.array([1, "x"], dtype=object))
    with pytest.raises(ReplayError, match="--trust"):
        thawed(data)
    assert thawed(data, trust=True).tolist() == [1, "x"]


def test_a_module_is_imported_with_trust_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "planted_module.py").write_text("import msgspec\nclass A(msgspec.Struct): pass\n")
    monkeypatch.syspath_prepend(tmp_path)
    data = pickle.dumps(Called(class_named, ("planted_module", "A")), 4)
    with pytest.raises(ReplayError, match="planted_module, which is not imported"):
        thawed(data)
    assert "planted_module" not in sys.modules
    assert thawed(data, trust=True).__name__ == "A"
    assert thawed(data).__name__ == "A"


def test_a_part_that_grows_without_measure_is_not_read() -> None:
    bomb = zstandard.ZstdCompressor().compress(b"\0" * 100_000_000)
    with pytest.raises(ReplayError, match="claims 100000000 bytes"):
        unpack(bomb)
    endless = zstandard.ZstdCompressor().compressobj().compress(b"x") + b""
    with pytest.raises(ReplayError):
        unpack(endless or b"(\xb5/\xfd\0")


@pytest.mark.parametrize(
    "inside", [(4, 0), (4, "0", []), (4, 0, ["x"]), (4, 0, [frozen("x")]), [], (3, 0, [])], ids=str
)
def test_a_part_that_holds_something_else_is_refused(inside: Any) -> None:
    with pytest.raises(ReplayError):
        unpack(zstandard.ZstdCompressor().compress(frozen(inside)))


def test_the_parts_of_a_journal_share_what_they_may_become() -> None:
    with pytest.raises(ReplayError, match="all may take"):
        whole("", [pack(0, [0.5]), pack(1, [b"\0" * 40_000_000]), pack(2, [b"\0" * 40_000_000])], trust=False)


def test_a_journal_whose_start_is_none_is_refused() -> None:
    with pytest.raises(ReplayError, match="does not begin with a start"):
        _ = Recording("/a", [("start", 1.0, 0, "x")]).start


def test_a_journal_with_an_unfinished_start_is_refused() -> None:
    begun = thawed(frozen(Called(object_made, (Start.__module__, "Start"))))
    with pytest.raises(ReplayError, match="does not begin with a start"):
        _ = Recording("/a", [("start", 1.0, 0, begun)]).start
