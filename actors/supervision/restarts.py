"""Restarts: whether, when, with whom, and in which order."""

from __future__ import annotations

from collections.abc import Callable

from actors.supervision.child_task import ChildTask
from actors.supervision.ending import Ending
from actors.supervision.entry import Entry
from actors.supervision.errors import SupervisorGaveUp
from actors.supervision.policy import one_for_all, one_for_one, temporary
from actors.supervision.reasons import ExitReason, cause_of

__all__ = ["Restarts"]


class Restarts(Ending):
    """Restart intensity, backoff, strategies. Group restarts and the first start go through the lane, in order."""

    _started: Callable[[], object]
    _closing: tuple[ChildTask, ExitReason] | None = None

    def _restart(self, incarnation: ChildTask, reason: ExitReason) -> None:
        entry, now = incarnation.entry, self.loop.time()
        if not self._window.add(now, self.spec.intensity):
            self._give_up(incarnation, reason)
            return
        entry.intent = "restart"
        backoff = entry.spec.backoff
        delay = backoff.delay(entry.earlier_attempts(backoff, now), self.runtime.rng) if backoff else 0.0
        if self.spec.strategy != one_for_one:
            self._restart_group(entry, delay)
        elif delay:
            entry.timer = self.loop.call_later(delay, self.post, self._on_retry, entry)
        else:
            self._start(entry)

    def _on_retry(self, entry: Entry) -> None:
        entry.timer = None
        self._start(entry)

    def _restart_group(self, failed: Entry, delay: float) -> None:
        """Mark the others of the group for a stop and a start. Merges with a restart that is under way."""
        whole = self.spec.strategy == one_for_all
        for entry in self._entries.values():
            if entry is not failed and (whole or entry.position > failed.position):
                self._mark(entry)
        self._lane.plan(self._entries.values())
        if delay:
            self._lane.hold_for(failed, self.loop.call_later(delay, self.post, self._on_hold_end))
        self._advance()

    def _mark(self, entry: Entry) -> None:
        now = entry.now
        if now is not None and now.asked is None:
            entry.marked = True
            if now.ready and entry.spec.restart != temporary:
                entry.intent = "restart"
        elif now is None and not entry.intent and not entry.parked:
            entry.intent = "restart"  # it had ended for good by itself; its group begins anew, and so does it

    def _on_hold_end(self) -> None:
        self._lane.release()
        self._advance()

    def _done_in_lane(self, entry: Entry) -> None:
        if self._lane.current is entry:
            self._lane.current = None
            self._advance()

    def _advance(self) -> None:
        """Let the lane do its next step, if it is free to."""
        lane = self._lane
        if lane.current is not None:
            return
        if (entry := lane.next_stop()) is not None:
            lane.current = entry
            entry.marked = False
            assert entry.now is not None
            self._ask(entry.now, "shutdown")
        elif lane.hold is None and (entry := lane.next_start()) is not None:
            lane.current = entry
            self._start(entry)
        elif self._phase == "starting" and not lane.busy:
            self._all_ready()

    def _start_in_turn(self, entry: Entry) -> None:
        """Start it now, or, while ordered work is under way, in its place."""
        if self._lane.busy:
            self._lane.add(entry)
            self._advance()
        else:
            self._start(entry)

    def _all_ready(self) -> None:
        self._phase = "running"
        self._guard("started()", self._started)
        if self._closing is not None:
            self._auto_shut_down(*self._closing)

    def _give_up(self, incarnation: ChildTask, reason: ExitReason) -> None:
        intensity = self.spec.intensity
        failure = SupervisorGaveUp(self.path, incarnation.ref.id, intensity.restarts, intensity.within, reason)
        failure.__cause__ = cause_of(reason)
        self._failure = failure
        self._report("shutdown", incarnation, reason, "restart intensity reached")
        self._shut_down("shutdown")
