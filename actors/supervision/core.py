"""The supervisor's own life: events come in one at a time, and OTP's rules say what follows.

No handler ever waits. Starting a child makes a task, stopping it asks that task to end, and both answer later with an event
of their own: `ready`, `ended`, a retry that is due. So a supervisor answers at once, whatever its children do.
"""

from __future__ import annotations

import asyncio
import contextvars
from collections.abc import Callable

from actors.supervision.child_task import ChildTask
from actors.supervision.entry import Entry
from actors.supervision.errors import StartFailed
from actors.supervision.policy import permanent, temporary
from actors.supervision.reasons import ExitReason, Returned, Stopped, cause_of, is_abnormal
from actors.supervision.restarts import Restarts

__all__ = ["Core"]


class Core(Restarts):
    """Runs one `Supervisor` or `DynamicSupervisor` once. Is a `Life`, so supervisors nest."""

    async def run(self, started: Callable[[], object], /) -> None:
        """Start all children in order, call `started()`, supervise until stopped, stop all children.

        Returns after `stop`, or after the end of a significant child shut it down. Raises `StartFailed` when a child
        does not start the first time, `SupervisorGaveUp` when the restart intensity is reached; in each case after all
        children have stopped. When its task is cancelled it kills all children at once and passes the cancellation on;
        so it does with an exception of its own, or of a runtime that does not keep to its protocol. A
        cancellation of which its owner's `killed()` knows nothing comes from somebody else, such as `asyncio.run` at its end:
        then it stops all children in order before it passes it on.
        """
        if self._phase != "new":
            raise RuntimeError(f"{self!r} has been run before; make a new one for another run")
        if self._why:
            self._phase = "over"
            return
        self.loop = asyncio.get_running_loop()
        self._context = contextvars.copy_context()
        self._over = self.loop.create_future()
        self._started = started
        self._phase = "starting"
        self.post(self._begin)
        try:
            await self._over
        except BaseException as error:
            if isinstance(error, asyncio.CancelledError):
                await self._outlast_cancellation()
            await self._kill_all()
            raise
        failure, self._failure = self._failure, None
        if failure is not None:
            raise failure

    def stop(self, reason: str = "shutdown", /) -> None:
        """Ask for an orderly end: retries are dropped, then the children stop in reverse order."""
        if self._phase == "new":
            self._why = reason or "shutdown"
        elif self._phase != "over":
            self.post(self._shut_down, reason)

    def _begin(self) -> None:
        for entry in self._entries.values():
            entry.intent = "start"
        self._lane.plan(self._entries.values())
        self._advance()

    def _on_ready(self, incarnation: ChildTask) -> None:
        if incarnation.over or incarnation.ready:
            self._report("unexpected", incarnation, note="it said once more that it has started; dropped")
        elif incarnation.asked is None and incarnation.imposed is None:
            incarnation.ready = True
            entry = incarnation.entry
            entry.intent, entry.fresh, entry.ready_at = "", False, self.loop.time()
            self._report("progress", incarnation)
            if answer := entry.take_answer():
                answer.set_result(incarnation.ref)
            self._done_in_lane(entry)

    def _on_ended(self, incarnation: ChildTask, reason: ExitReason) -> None:
        entry = incarnation.entry
        entry.now = None
        if isinstance(incarnation.life, Core) and isinstance(reason, Returned):
            reason = Stopped("shutdown")  # a supervisor has no work of its own to come to the end of
        if self._phase == "stopping":
            self._ended_in_shutdown(incarnation, reason)
        elif incarnation.asked is not None or entry.marked:
            self._ended_by_request(incarnation, reason)
        elif incarnation.ready:
            self._ended_by_itself(incarnation, reason)
        elif incarnation.declined:
            self._declined(entry)
        else:
            self._failed_to_start(incarnation, reason)
        if not entry.intent:
            self._tell_gone(entry)
        self._notify(incarnation, reason)
        self._done_in_lane(entry)

    def _ended_by_request(self, incarnation: ChildTask, reason: ExitReason) -> None:
        entry = incarnation.entry
        entry.marked = False
        if self._is_unclean(incarnation, reason):
            self._report("shutdown_error", incarnation, reason)
        if not entry.intent:
            self._forget(entry)
        elif not entry.queued:
            self._start_in_turn(entry)

    def _ended_by_itself(self, incarnation: ChildTask, reason: ExitReason) -> None:
        entry = incarnation.entry
        restart = entry.spec.restart
        if is_abnormal(reason) or restart == permanent:
            self._report("child_terminated", incarnation, reason)
        if restart == permanent or (restart != temporary and is_abnormal(reason)):
            self._restart(incarnation, reason)
            return
        self._forget(entry)
        if entry.spec.significant and self._ends_with(entry):
            if self._phase == "starting":
                self._closing = self._closing or (incarnation, reason)
            else:
                self._auto_shut_down(incarnation, reason)

    def _declined(self, entry: Entry) -> None:
        entry.intent, entry.fresh = "", False
        if answer := entry.take_answer():
            answer.set_result(None)
        self._forget(entry)

    def _failed_to_start(self, incarnation: ChildTask, reason: ExitReason) -> None:
        entry = incarnation.entry
        self._report("start_error", incarnation, reason)
        if entry.intent == "restart":
            self._restart(incarnation, reason)
        elif entry.answer is None:
            self._failure = self._start_failed(incarnation, reason)
            self._shut_down("shutdown")
        else:
            if answer := entry.take_answer():
                answer.set_exception(self._start_failed(incarnation, reason))
            entry.intent, entry.parked = "", True
            if entry.fresh:
                del self._entries[entry.spec.name]
            else:
                self._forget(entry)

    def _start_failed(self, incarnation: ChildTask, reason: ExitReason) -> StartFailed:
        cause = cause_of(reason)
        if isinstance(cause, StartFailed):  # of a leaf further down: that one is at fault
            return cause
        failure = StartFailed(incarnation.ref.path, str(reason) if cause else f"{reason} before it had started")
        failure.__cause__ = cause
        return failure
