"""The thread that waits for everything that Cyclone DDS has for us: samples, statuses and discovery."""

from __future__ import annotations

import ctypes as c
import logging
import threading
from collections.abc import Callable
from typing import Final

from actors.transport.dds.library import DURATION_INFINITE, Library

_AT_ONCE: Final = 64
"""The most entities that one wake-up names; the others are named by the next one."""


class Report:
    """Counts what is dropped because it is malformed or too large, and logs the first of it. From any thread."""

    def __init__(self) -> None:
        self.count = 0

    def unreadable(self, what: str) -> None:
        """Count a piece, and log it if it is the first."""
        self.count += 1
        if self.count == 1:
            logging.getLogger(__name__).warning(
                "dropped what another DDS participant has sent: %s; more is only counted", what
            )


class Reading:
    """One thread and one wait set for all entities of a participant.

    An entity is attached with the function that takes what it has, on the thread, and returns whether there is more. What such a function
    raises is reported, and the thread goes on.

    What another process sends one after the other may be for several entities, and is ready in that order. What services send comes after
    topics here: a reply does not overtake feedback, nor a request a message. For that it is taken first, and handed over last: what
    was ready before it is ready by then.

    Invariants: the thread runs between construction and `close`; a function is called only while its entity is attached, or during `detach`.
    """

    def __init__(self, library: Library, participant: int, report: Report) -> None:
        self._library = library
        self._report = report
        self._set: int = library.dds_create_waitset(participant)
        library.dds_waitset_attach(self._set, self._set, self._set)
        self._takes: dict[int, Callable[[], bool]] = {}
        self._last: set[int] = set()
        """The entities that are taken first and handed over last."""
        self.held: list[Callable[[], None]] = []
        """What hands over what has been taken of them. The thread alone uses it."""
        self._names = (c.c_ssize_t * _AT_ONCE)()
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="dds reading", daemon=True)
        self._thread.start()

    def attach(self, entity: int, take: Callable[[], bool], *, last: bool = False) -> None:
        """Call `take` whenever a status of `entity` is raised that its mask enables. With `last` it puts into `held` what hands over."""
        self._takes[entity] = take
        if last:
            self._last.add(entity)
        self._library.dds_waitset_attach(self._set, entity, entity)

    def detach(self, entity: int) -> None:
        """Undo `attach`."""
        self._takes.pop(entity, None)
        self._last.discard(entity)
        self._library.dds_waitset_detach(self._set, entity)

    def close(self) -> None:
        """End the thread, and wait for its end."""
        self._closed = True
        self._library.dds_waitset_set_trigger(self._set, True)
        self._thread.join()

    def _run(self) -> None:
        more: set[int] = set()
        while not self._closed:
            ready = self._named(0 if more else DURATION_INFINITE) | more
            more = self._taken(ready & self._last)
            rest = ready - self._last
            if self.held:
                rest |= self._named(0) - self._last
            more |= self._taken(rest)
            for hand_over in self.held:
                hand_over()
            self.held.clear()

    def _named(self, patience: int) -> set[int]:
        """The entities that have something."""
        count: int = self._library.dds_waitset_wait(self._set, self._names, _AT_ONCE, patience)
        return set(self._names[: min(max(count, 0), _AT_ONCE)])

    def _taken(self, entities: set[int]) -> set[int]:
        """Take what they have. Returns those that may have more."""
        more = set[int]()
        for entity in entities:
            if (take := self._takes.get(entity)) is None:
                continue
            try:
                if take():
                    more.add(entity)
            except Exception as error:  # nothing that comes from outside ends the thread
                self._report.unreadable(f"{type(error).__name__}: {error}")
        return more
