"""What a journal keeps of values, and how recorded and replayed ones are compared."""

from __future__ import annotations

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

from actors.interfaces.std_msgs.msg import Float64MultiArray, Int32, MultiArrayDimension, MultiArrayLayout
from actors.replay import ReplayError, Tape
from actors.replay.comparison import first_difference
from actors.replay.encoding import array_made, class_named, frozen, scalar_made, thawed
from actors.replay.parts import pack, unpack
from actors.replay.tape import Start, Unkept


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
    tape = Tape("/a", [start(), 2.5, ("step", 3.5, 1), ("out", "publish", "/t", 1)])
    assert repr(tape) == "<journal of /a: 4 entries>"
    assert tape.counts() == {"start": 1, "clock reading": 1, "step": 1, "out": 1}
    assert tape.seconds == 1.5
    assert tape.start.node == "/a"
    with pytest.raises(ReplayError, match="the journal of /a does not begin with a start of the node"):
        _ = Tape("/a", tape.entries[1:]).start
    assert Tape("/a").seconds == 0.0


def test_a_start_names_the_versions_that_a_replay_depends_on(monkeypatch: pytest.MonkeyPatch) -> None:
    named = dict(start()[3].versions)
    assert (named["python"], named["numpy"]) == (platform.python_version(), np.__version__)

    def unknown(package: str) -> str:
        raise PackageNotFoundError(package)

    monkeypatch.setattr("actors.replay.tape.version", unknown)
    assert dict(start()[3].versions)["numpy"] == "none"  # a source tree that was never installed


class Called:
    """Is pickled as a call."""

    def __init__(self, *call: Any) -> None:
        self._call = call

    def __reduce__(self) -> Any:
        return self._call


class Hashed:
    called = False

    def __hash__(self) -> int:
        Hashed.called = True
        return 0

    def __iter__(self) -> Any:
        Hashed.called = True
        return iter(())


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
    ],
)
def test_no_objects_are_made_of_bytes_and_no_methods_called(value: Any) -> None:
    with pytest.raises(ReplayError):
        thawed(pickle.dumps(value, 4))
    assert not Hashed.called


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
