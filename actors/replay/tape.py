"""The journal of one node as a value: what came in, what went out, and in which order the node's code ran in between.

The entries are tuples that begin with their kind. A float stands for a reading of the clock by the node's code. What came in:

* ``(kind, time, place, ...)``, where `place` is `APART`, `WITHIN` or `BACK`: between two steps of the node, within one (the messages that
  a late joiner is given), or while the node's code was out, as when it cancels a goal and is told of that at once.

What the node did:

* ``("step", time, number)``: the event loop ran the callback that was the node's `number`-th to be scheduled.
* ``("out", kind, name, value)``: it sent something, or drew an id.
"""

from __future__ import annotations

import platform
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from typing import Any, TypeAlias

from actors.replay.errors import ReplayError

__all__ = [
    "APART",
    "BACK",
    "WITHIN",
    "Entry",
    "Start",
    "Tape",
    "Unkept",
    "versions",
]

APART, WITHIN, BACK = 0, 1, 2

Entry: TypeAlias = "tuple[Any, ...] | float"


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
    versions: tuple[tuple[str, str], ...] = field(default_factory=lambda: versions())


def versions() -> tuple[tuple[str, str], ...]:
    """What a replay depends on, beside the node's own code."""
    return (("python", platform.python_version()), ("robactor", _version("robactor")), ("numpy", _version("numpy")))


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "none"


class Tape:
    """The journal of one node, from the start of a life on.

    `trusted` says whether what it has kept may call any code when it is made again; see `actors.replay.encoding`.
    Invariants: the first entry is a ``start``.
    """

    def __init__(self, node: str, entries: Iterable[Any] = (), *, trusted: bool = True) -> None:
        self.node = node
        self.trusted = trusted
        self.entries: list[Entry] = list(entries)
        """What is on it, in order; see `actors.replay.tape`."""

    def __repr__(self) -> str:
        return f"<journal of {self.node}: {len(self.entries)} entries>"

    @property
    def start(self) -> Start:
        """How the first life on the tape began. Raises `ReplayError` if there is none."""
        if not self.entries or not isinstance(first := self.entries[0], tuple) or first[0] != "start":
            raise ReplayError(f"the journal of {self.node} does not begin with a start of the node")
        start: Start = first[3]
        return start

    def outputs(self) -> Iterator[tuple[str, str, Any]]:
        """What the node sent, in order: (kind, name, value)."""
        for entry in self.entries:
            if isinstance(entry, tuple) and entry[0] == "out":
                yield entry[1], entry[2], entry[3]

    def counts(self) -> Counter[str]:
        """How many entries of each kind there are."""
        return Counter(entry[0] if isinstance(entry, tuple) else "clock reading" for entry in self.entries)

    @property
    def seconds(self) -> float:
        """For how long the journal was kept."""
        times = [entry[1] for entry in self.entries if isinstance(entry, tuple) and entry[0] not in ("out", "result")]
        return float(times[-1] - times[0]) if times else 0.0

    def missing(self) -> list[str]:
        """What came in that a journal does not carry; a replay ends there."""
        return [entry[3] for entry in self.entries if isinstance(entry, tuple) and entry[0] == "unknown"]
