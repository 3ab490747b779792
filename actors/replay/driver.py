"""`Driver`: plays a tape to one node, which lives in a system of its own, in which there is nothing else."""

from __future__ import annotations

import asyncio
import math
from typing import TYPE_CHECKING, Any

from actors.inbox.border import INSIDE
from actors.replay.edge import name_of
from actors.replay.inputs import Inputs
from actors.replay.lives import PlayedNode
from actors.replay.replaying import Replaying, run_handle
from actors.time.ticker import TickHandle

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.inbox.border import Timed
    from actors.replay.debugger import Break
    from actors.replay.tape import Entry, Tape
    from actors.replay.tape_loop import TapeLoop
    from actors.supervision.declarations import Child
    from actors.system import System

__all__ = ["Driver"]


class Driver:
    """Plays one tape. `change(child)` gives the declaration of the node that is played to, for that of each recorded life.

    Invariants: `over` is done when the tape is at its end, when the node has done too much otherwise, or when the tape does not say what
    came next.
    """

    def __init__(
        self,
        system: System,
        loop: TapeLoop,
        tape: Tape,
        change: Callable[[Child], Child],
        pause: Break | None,
        limit: int,
    ) -> None:
        self.edge = Replaying(tape, pause, limit)
        self.played = PlayedNode(system, self.edge, change)
        self.inputs = Inputs(system, loop, tape, self.edge, self.played)
        self.over: asyncio.Future[None] = loop.create_future()
        self._loop, self._tape = loop, tape
        self._known_timers = {one[4] for one in tape.entries if isinstance(one, tuple) and one[0] == "tick"}
        self._ticking = 0
        """How many of the node's timers are known to tick by the tape, or by themselves."""
        self.edge.apply = self.inputs.apply
        system.runtime.gates.append(self.played)
        graph: Any = system.graph
        opened = graph.open_standard_service

        def open_standard_service(entry: Any) -> None:
            opened(entry)
            if INSIDE.get() is self.edge:
                self.edge.served(entry)

        graph.open_standard_service = open_standard_service
        graph.borders.append(self.edge)
        graph.watchers.append(_Numbers(self.edge))

    # -- the course of the tape ----------------------------------------------------------------------------------------------

    def drive(self) -> None:
        """Play as far as possible without a turn of the loop; then come back, until the tape is over."""
        try:
            self._drive()
        except BaseException as error:
            self.edge.over = True
            self.over.set_exception(error)

    def give_up(self, starting: asyncio.Future[None]) -> None:
        """End the replay if the node could not be started the first time: no supervisor starts it again."""
        if not (starting.cancelled() or starting.exception() is None or self.over.done()):
            self.edge.end()
            self.edge.over = True
            self.over.set_result(None)

    def _drive(self) -> None:
        edge = self.edge
        while not (edge.over or self.inputs.lacking or self.over.done()):
            if edge.astray:
                going = self._stray()
            else:
                entry = edge.entry()
                going = None if entry is None else self._follow(entry)
            if going is None:
                break
            if not going:
                self._loop.call_soon(self.drive)
                return
        if not self.over.done():
            if not (edge.over or self.inputs.lacking):
                edge.end()
            edge.over = True
            self.over.set_result(None)

    def _follow(self, entry: Entry) -> bool:
        """Play one entry as it was. Returns False if the loop has to turn first, or afterwards."""
        edge = self.edge
        if not isinstance(entry, tuple) or entry[0] == "result":
            edge.stray()  # the recording has read the clock here
            return True
        if entry[0] == "out":
            edge.missed(entry)
            return True
        if entry[0] == "start" and not self.played.waiting:
            if not self.played.alive:
                return False
            edge.stray()  # the recorded node could not be made, and this one could
            return True
        edge.at += 1
        self._at(entry[1])
        edge.look_ahead()
        if entry[0] != "step":
            self.inputs.apply(entry)
            return str(entry[0]) != "start"
        handle = edge.planned.pop(entry[2], None)
        if handle is None:
            edge.stray()
        else:
            run_handle(handle)
        return True

    def _stray(self) -> bool | None:
        """Play the next thing to a node that has left the tape: its own callbacks as they are due, and what came in as it came.

        Returns False if the loop has to turn first, or afterwards; None at the end of the tape.
        """
        edge, entries = self.edge, self._tape.entries
        self._own_ticks()
        soon = next(
            (number for number, handle in edge.planned.items() if not isinstance(handle, asyncio.TimerHandle)), None
        )
        if soon is not None:
            run_handle(edge.planned.pop(soon))
            return True
        while edge.at < len(entries) and not _comes_in(entries[edge.at]):
            edge.at += 1
        if edge.at >= len(entries):
            return None
        entry = entries[edge.at]
        assert isinstance(entry, tuple)
        due, number = self._due()
        if due <= entry[1]:
            self._at(due)
            if number is None:
                self.inputs.nobody_answers()
            else:
                run_handle(edge.planned.pop(number))
            return True
        starts = entry[0] == "start"
        if starts and not self.played.waiting and not self.played.alive:
            return False
        edge.at += 1
        self._at(entry[1])
        if not (starts and self.played.alive):  # else the changed node has not ended here
            self.inputs.apply(entry)
        return not starts

    def _due(self) -> tuple[float, int | None]:
        """When the next callback of the node is due, and its number; None for the end of a call that nobody answers."""
        planned = self.edge.planned
        for number in [number for number, handle in planned.items() if handle.cancelled()]:
            del planned[number]
        timers = (
            (handle.when(), number) for number, handle in planned.items() if isinstance(handle, asyncio.TimerHandle)
        )
        due, number = min(timers, default=(math.inf, 0))
        late = min((when for when, _ in self.inputs.late), default=math.inf)
        return (late, None) if late < due else (due, number)

    def _own_ticks(self) -> None:
        """Have the timers tick that the recording does not know, each on its own grid."""
        for timer in self.edge.timers[self._ticking :]:
            if name_of(timer) not in self._known_timers and isinstance(handle := timer.handle, TickHandle):
                self._later_tick(timer, handle)
        self._ticking = len(self.edge.timers)

    def _later_tick(self, timer: Timed, handle: TickHandle) -> None:
        due = handle.start + (handle.k + 1) / handle.hz

        def tick() -> None:
            if timer.handle is handle:  # else it has been stopped, or follows another clock
                handle.k += 1
                timer.on_tick(handle.k, due)
                self._later_tick(timer, handle)

        token = INSIDE.set(self.edge)
        try:
            self._loop.call_at(due, tick)
        finally:
            INSIDE.reset(token)

    def _at(self, time: float) -> None:
        self.edge.now = self._loop.now = time


class _Numbers:
    """Gives the replayed node's subscriptions their numbers, as a recording does."""

    def __init__(self, edge: Replaying) -> None:
        self._edge = edge

    def publisher_joined(self, publisher: Any) -> None:
        if self._edge.owns(publisher):
            publisher.attach(_nothing)

    def publisher_left(self, publisher: Any) -> None:
        """Do nothing."""

    def subscription_joined(self, subscription: Any) -> None:
        if self._edge.owns(subscription):
            self._edge.number_of(subscription)

    def subscription_left(self, subscription: Any) -> None:
        """Do nothing."""

    def server_changed(self, entry: Any) -> None:
        """Do nothing."""


def _comes_in(entry: Entry) -> bool:
    return isinstance(entry, tuple) and entry[0] not in ("step", "out", "result")


def _nothing(_: object) -> None:
    """Do nothing."""
