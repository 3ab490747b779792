"""`Driver`: plays a recording to its nodes, which live in a system of their own, in which there is nothing else."""

from __future__ import annotations

import asyncio
import math
from typing import TYPE_CHECKING

from actors.inbox.boundary import BOUNDARY
from actors.replay.inputs import Inputs
from actors.replay.lives import PlayedNodes
from actors.replay.recording import SENT, Entry, Recording, Start, comes_in
from actors.replay.replaying_boundary import ReplayingBoundary, run_handle
from actors.time.ticker import TickHandle

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.replay.replay_loop import ReplayDeadlines, ReplayLoop
    from actors.runtime.timers import NodeTimer
    from actors.supervision.child import Child
    from actors.system import System

RESOLUTION = 1e-6
"""Seconds; an event loop may call a timer early by the resolution of its clock."""


class Driver:
    """Plays one recording. `declared(start)` gives the declaration of the node that is played to, for each recorded life.

    Invariants: `over` is done when the recording is at its end, when the nodes have done too much otherwise, or when the recording does not say what
    came next.
    """

    def __init__(
        self,
        system: System,
        loop: ReplayLoop,
        recording: Recording,
        declared: Callable[[Start], Child],
        boundary: ReplayingBoundary,
        deadlines: ReplayDeadlines,
    ) -> None:
        self.boundary, self._deadlines = boundary, deadlines
        self.played = PlayedNodes(system, boundary, declared)
        self.inputs = Inputs(system, loop, recording, boundary, self.played)
        self.over: asyncio.Future[None] = loop.create_future()
        self._loop, self._recording = loop, recording
        self._known_timers = {one[4] for one in recording.entries if isinstance(one, tuple) and one[0] == "tick"}
        self._ticking = 0
        """How many of the timers are known to tick by the recording, or by themselves."""
        boundary.apply = self.inputs.apply
        system.runtime.intercept(self.played)
        system.runtime.intercept(boundary, first=True)
        system.graph.watchers.append(boundary)

    # -- the course of the recording ----------------------------------------------------------------------------------------------

    def drive(self) -> None:
        """Play as far as possible without a turn of the loop; then come back, until the recording is over."""
        try:
            self._drive()
        except BaseException as error:
            self.boundary.over = True
            self.over.set_exception(error)

    def _drive(self) -> None:
        boundary = self.boundary
        while not (boundary.over or self.inputs.lacking or self.over.done()):
            if boundary.diverged:
                going = self._play_diverged()
            else:
                entry = boundary.entry()
                going = None if entry is None else self._follow(entry)
            if going is None:
                break
            if not going:
                self._loop.call_soon(self.drive)
                return
        if not self.over.done():
            if not (boundary.over or self.inputs.lacking):
                boundary.end()
            boundary.over = True
            self.over.set_result(None)

    def _follow(self, entry: Entry) -> bool:
        """Play one entry as it was. Returns False if the loop has to turn first, or afterwards."""
        boundary = self.boundary
        if not isinstance(entry, tuple) or entry[0] == "result":
            boundary.diverge()  # the recording has read the clock here
            return True
        if entry[0] in SENT:
            boundary.missed(entry)
            return True
        if entry[0] == "start" and not (node := self.played.of(entry[3])).waiting:
            if not node.alive:
                node.ask(entry[3])
                return False
            boundary.diverge()  # the recorded node could not be made, and this one could
            return True
        boundary.at += 1
        self._at(entry[1])
        boundary.look_ahead()
        if entry[0] != "step":
            self.inputs.apply(entry)
            return str(entry[0]) != "start"
        handle = boundary.planned.get(entry[2])
        if handle is None or _is_early(handle, entry[1]):
            boundary.diverge()
        else:
            del boundary.planned[entry[2]]
            run_handle(handle)
        return True

    def _play_diverged(self) -> bool | None:
        """Play the next thing to a node that has left the recording: its own callbacks as they are due, and what came in as it came.

        Returns False if the loop has to turn first, or afterwards; None at the end of the recording.
        """
        boundary, entries = self.boundary, self._recording.entries
        self._own_ticks()
        soon = next(
            (number for number, handle in boundary.planned.items() if not isinstance(handle, asyncio.TimerHandle)), None
        )
        if soon is not None:
            run_handle(boundary.planned.pop(soon))
            return True
        while boundary.at < len(entries) and not comes_in(entries[boundary.at]):
            boundary.at += 1
        if boundary.at >= len(entries):
            return None
        entry = entries[boundary.at]
        assert isinstance(entry, tuple)
        due, number = self._due()
        if due <= entry[1]:
            self._at(due)
            if number is None:
                self._deadlines.expire()
            else:
                run_handle(boundary.planned.pop(number))
            return True
        starting = self.played.of(entry[3]) if entry[0] == "start" else None
        if starting is not None and not starting.waiting and not starting.alive:
            starting.ask(entry[3])
            return False
        boundary.at += 1
        self._at(entry[1])
        if starting is None or not starting.alive:  # else the changed node has not ended here
            self.inputs.apply(entry)
        return starting is None

    def _due(self) -> tuple[float, int | None]:
        """When the next callback of a node is due, and its number; None for the end of a call that was not answered in time."""
        planned = self.boundary.planned
        for number in [number for number, handle in planned.items() if handle.cancelled()]:
            del planned[number]
        timers = (
            (handle.when(), number) for number, handle in planned.items() if isinstance(handle, asyncio.TimerHandle)
        )
        due, number = min(timers, default=(math.inf, 0))
        late = self._deadlines.due
        return (late, None) if late < due else (due, number)

    def _own_ticks(self) -> None:
        """Have the timers tick that the recording does not know, each on its own grid."""
        for name, timer in self.boundary.timers[self._ticking :]:
            if name not in self._known_timers and isinstance(handle := timer.handle, TickHandle):
                self._later_tick(timer, handle)
        self._ticking = len(self.boundary.timers)

    def _later_tick(self, timer: NodeTimer, handle: TickHandle) -> None:
        due = handle.start + (handle.k + 1) / handle.hz

        def tick() -> None:
            if timer.handle is handle:  # else it has been stopped, or follows another clock
                handle.k += 1
                timer.on_tick(handle.k, due)
                self._later_tick(timer, handle)

        token = BOUNDARY.set(self.boundary)
        try:
            self._loop.call_at(due, tick)
        finally:
            BOUNDARY.reset(token)

    def _at(self, time: float) -> None:
        self.boundary.now = self._loop.now = time


def _is_early(handle: asyncio.Handle, time: float) -> bool:
    """Whether a callback is a timer that is not due yet: then it is not the one that had its number in the recording."""
    return isinstance(handle, asyncio.TimerHandle) and handle.when() > time + RESOLUTION
