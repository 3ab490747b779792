"""The journal of one node, or of a subtree, as a value: what came in, what went out, and in which order code ran in between.

The entries are tuples that begin with their kind. A float stands for a reading of the clock by the code of a node. What came in:

* ``(kind, time, place, ...)``, where `place` is `APART`, `WITHIN` or `BACK`: between two steps of the nodes, within one (the messages that
  a late joiner is given), or while their code was out, as when one cancels a goal and is told of that at once.

What the nodes did:

* ``("step", time, number)``: the event loop ran the callback that was the `number`-th of theirs to be scheduled.
* ``("out", kind, name, value)``: one sent something, or drew an id.
* ``("inner", kind, name, value)``: one sent something to others of the subtree, and to nobody else.
"""

from __future__ import annotations

import platform
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, fields
from importlib.metadata import PackageNotFoundError, version
from typing import Any, Final, TypeAlias, TypeGuard

from actors.replay.errors import ReplayError

APART, WITHIN, BACK = 0, 1, 2

SENT: Final = frozenset({"out", "inner"})
"""The kinds of entries of what was sent."""
NO_TIME: Final = SENT | {"result"}
"""The kinds of entries that do not say when they were made."""

Entry: TypeAlias = "tuple[Any, ...] | float"


def comes_in(entry: Entry | None) -> TypeGuard[tuple[object, ...]]:
    """Whether an entry is of what came in."""
    return isinstance(entry, tuple) and entry[0] != "step" and entry[0] not in NO_TIME


class Unkept:
    """Stands in a journal for a value that could not be kept."""

    __slots__ = ("why",)

    def __init__(self, why: str) -> None:
        self.why = why

    def __repr__(self) -> str:
        return f"<not kept: {self.why}>"


@dataclass(frozen=True, slots=True)
class Start:
    """How one life of a node began: all that its code could see that is no message.

    `origin` and `epoch` are those of the system's clock: the loop's time at its start, and the time of day then, seconds.
    `child`, `options` and `saved` are `frozen`: the declaration with the arguments, as they were at that moment; parameter files, remaps and
    log levels of the program; and the last checkpoint.
    """

    journal: str
    """The name of the journal: that of the node, or the path of its subtree."""
    node: str
    incarnation: int
    path: tuple[str, ...]
    child: bytes
    options: bytes
    saved: bytes
    state: str | None
    """The primary state that was last requested of a lifecycle node."""
    seed: int
    process: str
    """What makes the ids of this process differ from those of others."""
    level: int
    virtual: bool
    origin: float
    epoch: float
    id_streams: int = 0
    """How many lives of the node had drawn ids before."""
    versions: tuple[tuple[str, str], ...] = field(default_factory=lambda: _versions())


def _versions() -> tuple[tuple[str, str], ...]:
    """What a replay depends on, beside the node's own code."""
    return (("python", platform.python_version()), ("robactor", _version("robactor")), ("numpy", _version("numpy")))


def unlike_versions(start: Start) -> tuple[str, ...]:
    """What a replay depends on and is of another version here than it was in the recording, each in a few words."""
    here = dict(_versions())
    return tuple(
        f"{what} {here[what]} (recorded with {recorded})" for what, recorded in start.versions if here[what] != recorded
    )


def starts_of(recording: Recording) -> list[Start]:
    """How each life in the recording began, in order."""
    return [entry[3] for entry in recording.entries if isinstance(entry, tuple) and entry[0] == "start"]


def is_subtree(journal: str) -> bool:
    """Whether a journal of this name is that of a subtree, which is called by its path: ``robot/navigation``."""
    return "/" in journal and not journal.startswith("/")


def named(journals: Iterable[str], asked: str) -> str | None:
    """The first of the journals that is called so: by the path of its subtree, or the name or full name of its node. None without one."""
    return next(
        (one for one in journals if asked == one or (not is_subtree(one) and asked == one.rpartition("/")[2])), None
    )


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "none"


class Recording:
    """The journal of one node, from the start of a life on; or of a subtree, from the start of its first node on. `node` is its name: the
    full name of the node, or the path of the subtree.

    `trusted` says whether what it has kept may call any code when it is made again; see `actors.replay.encoding`.
    Invariants: the first entry is a ``start``.
    """

    def __init__(self, node: str, entries: Iterable[Any] = (), *, trusted: bool = True) -> None:
        self.node = node
        self.trusted = trusted
        self.entries: list[Entry] = list(entries)
        """What it holds, in order; see `actors.replay.recording`."""

    def __repr__(self) -> str:
        return f"<journal of {self.node}: {len(self.entries)} entries>"

    @property
    def start(self) -> Start:
        """How the first life in the recording began. Raises `ReplayError` if there is none."""
        match self.entries[:1]:
            case [("start", _, _, Start() as start, *_)] if all(hasattr(start, one.name) for one in fields(Start)):
                return start
            case _:
                raise ReplayError(f"the journal of {self.node} does not begin with a start of the node")

    @property
    def root(self) -> tuple[str, ...]:
        """The path of the supervisor below which all nodes are that are in the recording."""
        return tuple(self.node.split("/")) if is_subtree(self.node) else self.start.path[:-1]

    def outputs(self, *, inner: bool = False) -> Iterator[tuple[str, str, object]]:
        """What was sent, in order: (kind, name, value). With `inner`, also what the nodes of a subtree sent to each other alone."""
        for entry in self.entries:
            if isinstance(entry, tuple) and entry[0] in SENT and (inner or entry[0] == "out"):
                yield entry[1], entry[2], entry[3]

    def counts(self) -> Counter[str]:
        """How many entries of each kind there are."""
        return Counter(entry[0] if isinstance(entry, tuple) else "clock reading" for entry in self.entries)

    @property
    def seconds(self) -> float:
        """For how long the journal was kept."""
        times = [entry[1] for entry in self.entries if isinstance(entry, tuple) and entry[0] not in NO_TIME]
        return float(times[-1] - times[0]) if times else 0.0
