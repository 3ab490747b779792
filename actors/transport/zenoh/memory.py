"""The memory of large payloads: kept for the next ones, shared with other processes of the host if that is wanted, and not left behind.

Zenoh's shared memory is made of segments, files of /dev/shm: one for the payloads of each process, some small ones beside it. They stay there
if a process is killed, and Zenoh leaves some of them when a process ends. Each user of a segment has a lock on it, so one without a lock is
used by nobody.
"""

from __future__ import annotations

import atexit
import os
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from actors.transport.zenoh.library import import_zenoh

LARGE: Final = 64 * 1024
"""Bytes from which on a payload is large: Zenoh then sends it in fragments, or by shared memory."""

_LARGEST_KEPT: Final = 16 * 1024 * 1024
_SEGMENTS: Final = Path("/dev/shm")


class SharedMemory:
    """Memory of a session from which other processes of this host read large payloads. From any thread.

    Left to itself, Zenoh copies a payload into its own memory first, and from there into what it shares.
    """

    def __init__(self, size: int) -> None:
        """Of `size` bytes. Where the system has not so much, payloads stay as they are."""
        library = import_zenoh()
        self._no_room: type[Exception] = library.ZError
        self._provider: Any = None
        with suppress(library.ZError):
            self._provider = library.shm.ShmProvider.default_backend(size)

    def shared(self, payload: bytes) -> Any:
        """The payload in shared memory; itself if there is no room, because others have still to read what is there."""
        provider = self._provider
        if provider is None:
            return payload
        provider.garbage_collect()  # what was used last is used again: it is in the processor's cache
        try:
            buffer = provider.alloc(len(payload))
        except self._no_room:
            return payload
        buffer[0 : len(payload)] = payload
        return buffer

    def close(self) -> None:
        """Give it back, when others have read what is there."""
        self._provider = None


def keep_freed_memory() -> None:
    """Have the C library keep the memory of large payloads for the next ones.

    It returns large blocks to the kernel when they are freed, and the page faults of the next one take longer than to copy an image. Large is
    what is larger than any block that has been freed before: therefore one is made here, which costs nothing as nobody writes to it.
    """
    bytes(_LARGEST_KEPT)


def leave_no_segments() -> None:
    """Remove the segments of processes that have ended, and at the end of this process its own. To be called before shared memory is used."""
    atexit.unregister(_remove_own)
    atexit.register(_remove_own)
    for segment in _SEGMENTS.glob("*.zenoh"):
        with suppress(OSError):  # it is another user's, or has just gone
            descriptor = os.open(segment, os.O_RDWR)
            try:
                _remove_unless_used(descriptor, segment)
            finally:
                os.close(descriptor)


def _remove_own() -> None:
    """Remove the segments that this process alone uses."""
    for link in Path("/proc/self/fd").glob("*"):
        with suppress(OSError):  # it has been closed, as that of this very folder
            segment = link.readlink()
            if segment.parent == _SEGMENTS and segment.suffix == ".zenoh":
                _remove_unless_used(int(link.name), segment)


def _remove_unless_used(descriptor: int, segment: Path) -> None:
    """Remove a segment unless somebody has a lock on it by another descriptor."""
    import fcntl  # which not every system has

    with suppress(BlockingIOError):
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        segment.unlink()


def give_back() -> None:
    """Give free memory back to the system where the C library is glibc, which keeps all that lies below a piece in use."""
    import ctypes  # late: it is rarely needed

    trim: Any = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
