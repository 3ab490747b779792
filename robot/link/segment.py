"""The shared memory between a body's process and its controllers: its creation, its lookup by name, and its removal."""

from __future__ import annotations

import os
import struct
from collections.abc import Generator
from contextlib import contextmanager, suppress
from itertools import count
from multiprocessing import resource_tracker, shared_memory
from pathlib import Path
from typing import Any, Final

from robot.link.ring import Ring

PREFIX: Final = "robactor-body-"
"""Of the names of all segments; the maker's process id follows."""
_SHM: Final = Path("/dev/shm")
"""Where Linux shows them."""
COMMAND_SLOTS, SAMPLE_SLOTS, STATE_SLOTS, CALL_SLOTS = 512, 64, 4, 8
COMMAND, SAMPLE, STATE, CALL, REPLY = 63, 47, 89, 5, 3
"""Numbers in a record of each ring; `robot.link.records` says which."""
ARM, THING = 15, 3
"""Numbers for the arm, and for each of the scene's things."""

_SECONDS: Final = struct.Struct("<d")
HEAD: Final = 24
"""Bytes before the rings: the newest epoch, the process that commands, and the seconds that the body's time has slipped."""

_numbers = count()
_here: dict[str, Segment] = {}
"""The segments that this process has attached: one mapping each, however many children hold a link."""


class SharedMemoryMissing(RuntimeError):
    """There is no shared memory for a body's process; the text says what to do."""

    def __init__(self, size: int, cause: OSError) -> None:
        super().__init__(
            f"no shared memory for a body in a process of its own: {cause.strerror}: it needs {size // 1024 + 1} kB in {_SHM} (see df {_SHM}; in "
            "a container --shm-size=64m); or run the robot in one process"
        )


class Segment:
    """The rings of one body. `things` is how many things its scene has.

    - commands: controllers to body; targets, and from when on to take samples.
    - samples: body to controllers; IMU, encoders and contacts, each of its instant.
    - state: body to all; joints, pose and what else changes, of its present instant. scenery: its arm and the scene's things.
    - calls and replies: the arm's driver to the body and back.
    """

    def __init__(self, memory: shared_memory.SharedMemory, things: int) -> None:
        assert memory.buf is not None
        self._memory, self._bytes = memory, memory.buf
        rings: list[Ring] = []
        offset = HEAD
        for slots, width in _layout(things):
            rings.append(Ring(self._bytes, offset, slots, width))
            offset += Ring.size(slots, width)
        self.commands, self.samples, self.state, self.scenery, self.calls, self.replies = rings

    @property
    def name(self) -> str:
        return self._memory.name

    def next_epoch(self) -> int:
        """A number larger than all before, for a process that may command the body; the body obeys the newest. Processes are given theirs by
        the one that launches them, so that it does not matter when they get to use it."""
        epoch = int.from_bytes(self._bytes[:8], "little") + 1
        self._bytes[:8] = epoch.to_bytes(8, "little")
        return epoch

    @property
    def commander(self) -> int:
        """The process that commanded last; 0 before."""
        return int.from_bytes(self._bytes[8:16], "little")

    @commander.setter
    def commander(self, process: int) -> None:
        self._bytes[8:16] = process.to_bytes(8, "little")

    @property
    def slipped(self) -> float:
        """By how much the body's time is behind the machine's for good, seconds."""
        found: float = _SECONDS.unpack(self._bytes[16:HEAD])[0]
        return found

    @slipped.setter
    def slipped(self, seconds: float) -> None:
        self._bytes[16:HEAD] = _SECONDS.pack(seconds)

    def close(self) -> None:
        """Let go of the memory. The process that made it calls `remove`, too."""
        _here.pop(self.name, None)
        with suppress(BufferError):  # a ring is being read in another frame; the process's end closes it
            self._memory.close()

    def remove(self) -> None:
        """Take the name away: the memory goes with the last process that has it."""
        _unlink(self._memory)


def create(things: int) -> Segment:
    """A new segment, all zero. Raises `SharedMemoryMissing`.

    This process removes it, or the body's process when this one is gone, or, where both were killed, the next that makes one.
    """
    _sweep()
    size = HEAD + sum(Ring.size(slots, width) for slots, width in _layout(things))
    name = f"{PREFIX}{os.getpid()}-{next(_numbers)}"
    try:
        memory = _memory(name, create=True, size=size)
    except OSError as error:
        raise SharedMemoryMissing(size, error) from error
    try:
        _take(memory, size)
    except OSError as error:
        memory.close()
        _unlink(memory)
        raise SharedMemoryMissing(size, error) from error
    segment = Segment(memory, things)
    _here[name] = segment
    return segment


def attached(name: str, things: int) -> Segment:
    """The segment of that name, which another process has made. Raises `FileNotFoundError` when it is gone."""
    if name not in _here:
        _here[name] = Segment(_memory(name), things)
    return _here[name]


def _take(memory: shared_memory.SharedMemory, size: int) -> None:
    """Have the system give all of it now: a page that it cannot give later ends the process by SIGBUS. Raises `OSError`."""
    descriptor: int = getattr(memory, "_fd", -1)  # it has no public name
    if descriptor >= 0 and hasattr(os, "posix_fallocate"):
        os.posix_fallocate(descriptor, 0, size)


def _layout(things: int) -> list[tuple[int, int]]:
    return [
        (COMMAND_SLOTS, COMMAND),
        (SAMPLE_SLOTS, SAMPLE),
        (STATE_SLOTS, STATE),
        (STATE_SLOTS, ARM + THING * things),
        (CALL_SLOTS, CALL),
        (CALL_SLOTS, REPLY),
    ]


def _memory(name: str, **made: Any) -> shared_memory.SharedMemory:
    with _untracked():
        return shared_memory.SharedMemory(name, **made)


def _unlink(memory: shared_memory.SharedMemory) -> None:
    with suppress(FileNotFoundError), _untracked():
        memory.unlink()


@contextmanager
def _untracked() -> Generator[None, None, None]:
    """Python's resource tracker is told nothing within this block. It removes shared memory as soon as a process that has attached it ends, while
    others need it, and complains of what a killed process has left to others. Python 3.13 has ``track=False`` for this, 3.11 has nothing."""
    tracker: Any = resource_tracker
    before = tracker.register, tracker.unregister
    tracker.register = tracker.unregister = _nothing
    try:
        yield
    finally:
        tracker.register, tracker.unregister = before


def _nothing(name: str, kind: str) -> None:
    """What the tracker does within `_untracked`."""


def _sweep() -> None:
    """Remove what makers have left that were killed together with all that clean up after them."""
    if not _SHM.is_dir():
        return
    for path in _SHM.glob(f"{PREFIX}*"):
        maker = path.name.removeprefix(PREFIX).partition("-")[0]
        if maker.isdigit() and not Path(f"/proc/{maker}").exists():
            path.unlink(missing_ok=True)
