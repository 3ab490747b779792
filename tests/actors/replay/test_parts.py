"""A journal is written out as it grows, in parts; reading it calls no code that it names, unless it is trusted."""

from __future__ import annotations

import enum
import gc
import pickle
from collections import OrderedDict, deque
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np
import pytest
import zstandard

from actors import CallTimeout, Child, Node, execute, publishes, run
from actors.bag import BagReader, Recorder, RecordOptions, Selection
from actors.interfaces.cdr import decode
from actors.interfaces.std_msgs.msg import Float64MultiArray, Int32, String
from actors.interfaces.std_srvs.srv import Trigger
from actors.logs import LogRecord
from actors.qos import LATCHED
from actors.replay import Journal, Recording, ReplayError, load, recording_in, recordings_in, replay
from actors.replay.encoding import frozen, thawed
from actors.replay.parts import FORMAT, MAGIC, PART, Spool, pack, parts_of, unpack, whole
from tests.actors.replay.story import HERO, NUMBERS, OTHERS, TOLD, story

CALLS: list[str] = []


class Mood(enum.Enum):
    CALM = "calm"


@dataclass
class Plain:
    name: str
    tags: list[str] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Sealed:
    x: float
    y: float

    def __post_init__(self) -> None:
        CALLS.append("Sealed")


class Pair(NamedTuple):
    one: int
    two: str


class Shape(msgspec.Struct, frozen=True):
    sides: int


class Ordinary:
    def __init__(self, value: object) -> None:
        CALLS.append("Ordinary")
        self.value = value
        self.me = self

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Ordinary) and other.value == self.value

    __hash__ = None  # type: ignore[assignment]


class Slotted:
    __slots__ = ("inner",)

    def __init__(self, inner: int) -> None:
        self.inner = inner


class Own(Ordinary):
    """Pickles itself in its own way."""

    def __reduce__(self) -> Any:
        return Own, (self.value,)


class Restoring(Ordinary):
    def __setstate__(self, state: Any) -> None:
        CALLS.append("Restoring")
        self.__dict__.update(state)


class Leaving(Ordinary):
    def __del__(self) -> None:
        CALLS.append("Leaving")


class Loud(Exception):
    def __init__(self, text: str, *, volume: int) -> None:
        CALLS.append("Loud")
        super().__init__(text)
        self.volume = volume

    def __new__(cls, *arguments: Any, **options: Any) -> Loud:
        CALLS.append("Loud.__new__")
        return super().__new__(cls, *arguments)


class Sums(Node):
    told = publishes(TOLD)

    def __init__(self, shared: Any = None) -> None:
        self.shared = shared

    @NUMBERS.on()
    def add(self, message: Int32) -> None:
        self.told(String(data=f"{message.data} {self.shared}"))


VALUES = [
    None, True, 1 << 80, -0.0, "text", b"bytes", (1, (2, [3])), {"a": {1, 2}}, frozenset({1}), 1j, deque([1, 2], maxlen=3),
    OrderedDict(a=1), Mood.CALM, Pair(1, "two"), Plain("p", ["a"]), Sealed(1.5, float("inf")), Shape(3), Ordinary([1]), LATCHED, Path("/a/b"),
    Int32(data=4), Float64MultiArray(data=[1.5, 2.5]), Trigger.Response(success=True, message="m"), Int32, Trigger,
]  # fmt: skip


@pytest.mark.parametrize("value", VALUES, ids=lambda value: type(value).__name__)
def test_values_of_all_kinds_come_back_as_they_were_without_trust(value: object) -> None:
    data = frozen(value)
    CALLS.clear()
    again = thawed(data)
    assert type(again) is type(value)
    assert again == value
    assert repr(again) == repr(value) or isinstance(value, Ordinary)
    assert CALLS == [], "no code of a class was called"


def test_arrays_slots_and_circles_come_back_and_errors_without_a_call_of_their_class() -> None:
    numbers = np.array([[1.5, -0.0]], np.float32)
    again = thawed(frozen({"array": numbers, "scalar": np.float64(2.5), "slots": Slotted(3)}))
    assert again["array"].dtype == np.float32
    assert again["array"].tobytes() == numbers.tobytes()
    assert repr(again["scalar"]) == repr(np.float64(2.5))
    assert again["slots"].inner == 3
    ring = thawed(frozen(Ordinary("ring")))
    assert ring.me is ring
    data = frozen([Loud("ouch", volume=11), OSError(2, "not there"), CallTimeout("late"), KeyError("k")])
    CALLS.clear()
    loud, missing, late, key = thawed(data)
    assert (loud.args, loud.volume, missing.errno, str(late), key.args) == (("ouch",), 11, 2, "late", ("k",))
    assert CALLS == []


@pytest.mark.parametrize("kind", [Own, Restoring, Leaving])
def test_what_pickles_itself_is_read_with_trust_only(kind: type[Ordinary]) -> None:
    data = frozen([kind(1)])
    with pytest.raises(ReplayError, match=r"wants .* to be called: replay it with --trust \(trust=True\)"):
        thawed(data)
    assert thawed(data, trust=True)[0].value == 1


class Attack:
    def __init__(self, function: Any, *arguments: Any) -> None:
        self.call = function, arguments

    def __reduce__(self) -> Any:
        return self.call


def named(function: str, *arguments: object) -> bytes:
    """Bytes that call a function of the encoding with these arguments, as no journal does."""
    from actors.replay import encoding

    return pickle.dumps(Attack(getattr(encoding, function), *arguments))


@pytest.mark.parametrize(
    "data",
    [
        pickle.dumps(Attack(CALLS.append, "attacked")),
        pickle.dumps(Attack(exec, "import tests")),
        named("class_named", "subprocess", "Popen"),
        named("class_named", "os", "system"),
        named("error_made", "subprocess", "Popen", ("true",), {}),
        named("object_made", "tempfile", "_TemporaryFileCloser"),
        named("object_made", "os", "system"),
        named("object_filled", Mood, {"CALM": 1}),
        named("object_filled", {1, 2}, {"CALM": 1}),
        named("tuple_made", "builtins", "tuple", (1,)),
        named("child_made", "subprocess", "Popen", {"args": ("true",)}),
        named("child_made", "os", "system", {"args": ("true",)}),
        named("class_named", "no_such_module", "Name"),
        b"no pickle",
    ],
)
def test_a_file_that_was_made_to_do_harm_calls_nothing(data: bytes) -> None:
    gc.collect()  # what other tests have left
    CALLS.clear()
    with pytest.raises(ReplayError):
        thawed(data)
    assert CALLS == []


def test_a_journal_is_loaded_without_trust_and_the_node_is_made_only_if_it_needs_none(tmp_path: Path) -> None:
    async def main(shared: object) -> Journal:
        journal = Journal("sums")
        async with run(OTHERS, Child(Sums, args=(shared,)), observers=(journal,), sinks=()) as system:
            await system.clock.sleep(0.05)
        return journal

    plain = execute(lambda: main(Plain("p")), clock="virtual").save(tmp_path / "plain", "sums")
    own = execute(lambda: main(Own(3)), clock="virtual").save(tmp_path / "own", "sums")
    assert replay(load(plain)).equal
    assert load(own).start.node == "/sums"
    with pytest.raises(ReplayError, match=r"test_parts.Own to be called: replay it with --trust"):
        replay(load(own))
    assert not replay(load(own, trust=True)).lacking


def test_a_function_that_makes_the_node_is_called_with_trust_only(tmp_path: Path) -> None:
    async def main() -> Journal:
        journal = Journal("sums")
        async with run(OTHERS, Child(make_sums, name="sums"), observers=(journal,), sinks=()) as system:
            await system.clock.sleep(0.05)
        return journal

    path = execute(main, clock="virtual").save(tmp_path / "made", "sums")
    with pytest.raises(ReplayError, match=r"make_sums to be called|_rebuild to be called"):
        replay(load(path))
    assert replay(load(path, trust=True)).equal


def make_sums() -> Node:
    return Sums()


def test_a_long_journal_is_in_the_file_and_not_in_memory_and_is_replayed_whole(tmp_path: Path) -> None:
    held: list[int] = []

    async def main() -> Journal:
        journal = Journal("sums", folder=tmp_path / "journals")
        async with run(OTHERS, Sums, observers=(journal,), sinks=()) as system:
            recording: Any = system.runtime.interceptors[0]
            for _ in range(20):
                await system.clock.sleep(1.0)
                held.append(len(recording.spool.entries))
        return journal

    journal = execute(main, clock="virtual")
    written = load(tmp_path / "journals" / "sums.journal")
    assert len(written.entries) > 3 * PART
    assert max(held) < PART
    assert any(later < sooner for sooner, later in pairwise(held)), "it was written out"
    assert written.node == "/sums"
    assert len(journal.recording("sums").entries) == len(written.entries)
    verdict = replay(written)
    assert verdict.equal
    assert verdict.compared > 1900


def test_a_file_that_was_cut_off_is_read_up_to_its_last_whole_part(tmp_path: Path) -> None:
    spool = Spool("/a", tmp_path / "a.journal")
    for number in range(3):
        spool.entries.extend([("step", float(number), number)] * 10)
        assert spool.flush() == 10
    data = (tmp_path / "a.journal").read_bytes()
    assert [unpack(part)[0] for part in parts_of(data)] == [0, 1, 2]
    for cut in (len(data) - 1, len(data) - len(pack(2, spool.recording().entries[20:])) - 3):
        assert [unpack(part)[0] for part in parts_of(data[:cut])] == [0, 1]
    assert list(parts_of(MAGIC)) == []


def test_a_part_that_is_missing_is_named_with_what_to_do() -> None:
    parts = [pack(number, [float(number)]) for number in range(4)]
    assert whole("/a", reversed(parts), trust=False).entries == [0.0, 1.0, 2.0, 3.0]
    with pytest.raises(
        ReplayError, match=r"part 0 of the journal of /a is missing, of 4: .* into a folder: Journal\(folder=\.\.\.\)"
    ):
        whole("/a", parts[2:], trust=False)
    with pytest.raises(ReplayError, match="part 2 of the journal of /a is missing"):
        whole("/a", [*parts[:2], parts[3]], trust=False)


def test_a_journal_of_another_format_is_refused_by_both_numbers() -> None:
    other = zstandard.compress(frozen((FORMAT + 1, 0, [])))
    with pytest.raises(ReplayError, match=f"has format {FORMAT + 1}, and this version reads format {FORMAT}"):
        unpack(other)
    with pytest.raises(ReplayError, match="this is no part of a journal of this version"):
        unpack(b"something else")
    for odd in ((FORMAT, "0", []), (FORMAT, 0, ["text"]), (FORMAT, 0, [frozen(5)]), (FORMAT, 0)):
        with pytest.raises(ReplayError, match="this is no part of a journal"):
            unpack(zstandard.compress(frozen(odd)))


def test_a_file_that_cannot_be_written_ends_the_journal_and_not_the_node(tmp_path: Path) -> None:
    lines: list[LogRecord] = []

    async def main() -> None:
        journal = Journal("sums", folder=tmp_path)
        async with run(OTHERS, Sums, observers=(journal,), sinks=(lines.append,)) as system:
            recording: Any = system.runtime.interceptors[0]
            (tmp_path / "sums.journal").unlink()
            (tmp_path / "sums.journal").mkdir()  # nothing can be written there any more
            await system.clock.sleep(10.0)
            assert "its journal cannot be written any more: [Errno 21] Is a directory" in recording.spool.failure
            assert system.nodes["system", "sums"].incarnation == 1
            assert len(recording.spool.entries) < PART
            with pytest.raises(ReplayError, match="/sums: its journal cannot be written any more"):
                journal.recording("sums")

    execute(main, clock="virtual")
    assert [line.fields["because"] for line in lines if line.event == "a journal is not whole"] != []


def test_the_parts_on_the_topic_are_those_of_the_file(tmp_path: Path) -> None:
    async def main() -> Journal:
        journal = Journal("hero", publish=True)
        recorder = Child(
            Recorder, args=(tmp_path / "bag", RecordOptions(selection=Selection(topics=["/hero/_journal"])))
        )
        async with run(recorder, OTHERS, HERO, observers=(journal,), sinks=()) as system:
            await system.clock.sleep(3.0)
        return journal

    journal = execute(main, clock="virtual")
    with BagReader(tmp_path / "bag") as bag:
        parts: list[Any] = [decode(bag_type(one), one.data) for one in bag.messages()]
    assert [unpack(part.data.tobytes(), trust=True)[0] for part in parts] == list(range(len(parts)))
    assert len(parts) > 3
    recorded = recording_in(tmp_path / "bag", "hero").entries
    kept = journal.recording("hero").entries
    assert len(recorded) > 100
    assert repr(recorded) == repr(kept[: len(recorded)])


def test_a_bag_gives_the_journals_of_all_nodes_in_it(tmp_path: Path) -> None:
    async def main() -> Journal:
        journal = Journal("others", "hero", publish=True)
        told = Selection(topics=["/hero/_journal", "/told", "/others/_journal"])
        recorder = Child(Recorder, args=(tmp_path / "bag", RecordOptions(selection=told)))
        async with run(recorder, OTHERS, HERO, observers=(journal,), sinks=()) as system:
            await system.clock.sleep(1.0)
        return journal

    journal = execute(main, clock="virtual")
    recordings = recordings_in(tmp_path / "bag")
    assert [*recordings] == ["/hero", "/others"]
    for node, recording in recordings.items():
        kept = journal.recording(node)
        assert (recording.node, recording.start.node) == (kept.node, kept.start.node) == (node, node)
        assert repr(recording.entries) == repr(kept.entries[: len(recording.entries)])


def bag_type(message: Any) -> Any:
    from actors.bag.schemas import type_of

    return type_of(message.topic)


def test_a_story_survives_the_way_through_a_file(tmp_path: Path) -> None:
    journal, _ = execute(story, clock="virtual")
    recording = load(journal.save(tmp_path / "hero", "hero"))
    assert not recording.trusted
    assert repr(recording.entries) == repr(journal.recording("hero").entries)
    verdict = replay(recording)
    assert verdict.equal, verdict


def test_a_node_that_acts_on_the_machine_is_neither_journaled_nor_replayed(tmp_path: Path) -> None:
    async def main() -> str:
        journal = Journal("rosbag2_recorder")
        async with run(Child(Recorder, args=(tmp_path / "bag",)), observers=(journal,), sinks=()):
            return journal.refused["/rosbag2_recorder"]

    assert execute(main, clock="virtual") == "writes files, which no journal carries"
    start = execute(story, clock="virtual")[0].recording("hero").entries[0]
    assert isinstance(start, tuple)
    forged = start[3]
    object.__setattr__(forged, "child", frozen(Child(Recorder, name="hero", args=(tmp_path / "written",))))
    with pytest.raises(ReplayError, match="writes files"):
        replay(Recording("/hero", [start], trusted=False))
    assert not (tmp_path / "written").exists()
