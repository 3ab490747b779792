"""The supervisor's own life: events come in one at a time, and OTP's rules say what follows.

No handler here ever waits. Starting a child makes a task, stopping it asks that task to end, and both answer later with
an event of their own: `ready`, `ended`, a retry that is due. So a supervisor answers at once, whatever its children do.
"""

from __future__ import annotations

import asyncio
import contextlib
import contextvars
from collections import deque
from collections.abc import Callable
from itertools import count
from typing import Any, TypeVarTuple

from actors.supervision.entry import Entry
from actors.supervision.errors import StartFailed, SupervisorGaveUp
from actors.supervision.incarnation import GRACE, Incarnation
from actors.supervision.lane import Lane
from actors.supervision.policy import (
    all_significant,
    any_significant,
    one_for_all,
    one_for_one,
    permanent,
    temporary,
)
from actors.supervision.reasons import ExitReason, Killed, Returned, Stopped, cause_of, is_abnormal
from actors.supervision.refs import ChildRef, Down
from actors.supervision.report import Context, Report
from actors.supervision.seam import Life, Runtime
from actors.supervision.window import Window
from actors.supervisor import Child, DynamicSupervisor, Spec, Supervisor

__all__ = ["Core", "LeakedChild"]

Args = TypeVarTuple("Args")

_serials = count(1)


class LeakedChild:
    """A child that refused to die: `ref`, and its `task`, which is kept here until it ends after all."""

    __slots__ = ("ref", "task")

    def __init__(self, ref: ChildRef, task: asyncio.Task[None]) -> None:
        self.ref = ref
        self.task = task

    def __repr__(self) -> str:
        return f"<leaked {self.ref}: {self.task!r}>"


class Core:
    """Runs one `Supervisor` or `DynamicSupervisor` once. Is a `Life`, so supervisors nest."""

    loop: asyncio.AbstractEventLoop

    def __init__(
        self,
        spec: Supervisor | DynamicSupervisor,
        runtime: Runtime,
        path: tuple[str, ...] | None = None,
        *,
        leaked: list[LeakedChild] | None = None,
    ) -> None:
        self.spec = spec
        self.runtime = runtime
        self.path = (spec.name,) if path is None else path
        self.leaked: list[LeakedChild] = [] if leaked is None else leaked
        self._entries: dict[str, Entry] = {}
        self._positions = count(1)
        self._names = count(1)
        self._lane = Lane()
        self._window = Window()
        self._phase = "new"
        self._why: str | None = None
        self._failure: BaseException | None = None
        self._closing: tuple[Incarnation, ExitReason] | None = None
        self._last: list[Entry] = []
        self._inbox: deque[tuple[Callable[..., None], tuple[Any, ...]]] = deque()
        self._busy = False
        children = spec.children if isinstance(spec, Supervisor) else ()
        for child in children:
            self._add(child)

    def __repr__(self) -> str:
        return f"<supervisor {'/'.join(self.path)}: {self._phase}, {len(self._entries)} children>"

    @property
    def name(self) -> str:
        """The path from the root, as one text."""
        return "/".join(self.path)

    @property
    def dynamic(self) -> bool:
        return isinstance(self.spec, DynamicSupervisor)

    # ------------------------------------------------------------------ its life

    async def run(self, started: Callable[[], object], /) -> None:
        """Start all children in order, call `started()`, supervise until stopped, stop all children.

        Returns after `stop`, or after the end of a significant child shut it down. Raises `StartFailed` when a child
        does not start the first time, `SupervisorGaveUp` when the restart intensity is reached; in each case after all
        children have stopped. When its task is cancelled it kills all children at once and passes the cancellation on.
        """
        if self._phase != "new":
            raise RuntimeError(f"{self!r} has been run before; make a new one for another run")
        if self._why is not None:
            self._phase = "over"
            return
        self.loop = asyncio.get_running_loop()
        self._context = contextvars.copy_context()
        self._over: asyncio.Future[None] = self.loop.create_future()
        self._started = started
        self._phase = "starting"
        self.post(self._begin)
        try:
            await self._over
        except asyncio.CancelledError:
            await self._kill_all()
            raise
        failure, self._failure = self._failure, None
        if failure is not None:
            raise failure

    def stop(self, reason: str = "shutdown", /) -> None:
        """Ask for an orderly end: retries are dropped, then the children stop in reverse order."""
        if self._phase == "new":
            self._why = self._why or reason
        else:
            self.post(self._shut_down, reason)

    def post(self, handler: Callable[[*Args], None], *args: *Args) -> None:
        """Put an event into the inbox, and handle what is in it unless that is already under way."""
        self._inbox.append((handler, args))
        if not self._busy:
            self._busy = True
            try:
                self._context.run(self._handle_all)
            finally:
                self._busy = False

    def _handle_all(self) -> None:
        while self._inbox:
            handler, args = self._inbox.popleft()
            handler(*args)

    def _begin(self) -> None:
        for entry in self._entries.values():
            entry.intent = "start"
        self._lane.plan(self._entries.values())
        self._advance()

    def _all_ready(self) -> None:
        self._phase = "running"
        self._guard("started()", self._started)
        if self._closing is not None:
            self._auto_shut_down(*self._closing)

    # ------------------------------------------------------------------ one child

    def _add(self, spec: Spec) -> Entry:
        entry = self._entries[spec.name] = Entry(spec, next(self._positions))
        return entry

    def _start(self, entry: Entry) -> None:
        entry.number += 1
        ref = ChildRef((*self.path, entry.spec.name), entry.number, next(_serials))
        entry.now = Incarnation(self, entry, ref)

    def _start_in_turn(self, entry: Entry) -> None:
        """Start it now, or, while ordered work is under way, in its place."""
        if self._lane.busy:
            self._lane.add(entry)
            self._advance()
        else:
            self._start(entry)

    def make_life(self, incarnation: Incarnation, /) -> Life:
        spec, ref = incarnation.entry.spec, incarnation.ref
        if isinstance(spec, Child):
            return self.runtime.life(spec, ref.path, ref.incarnation)
        return type(self)(spec, self.runtime, ref.path, leaked=self.leaked)

    def _ask(self, incarnation: Incarnation, why: str) -> None:
        incarnation.stop(why, incarnation.entry.spec.stop)

    def _forget(self, entry: Entry) -> None:
        """What ends for good leaves no trace if it is temporary, or an instance of a template."""
        if entry.spec.restart == temporary or self.dynamic:
            self._entries.pop(entry.spec.name, None)

    # ------------------------------------------------------------------ events

    def ready(self, incarnation: Incarnation, /) -> None:
        self.post(self._on_ready, incarnation)

    def ended(self, incarnation: Incarnation, reason: ExitReason, /) -> None:
        self.post(self._on_ended, incarnation, reason)

    def abandoned(self, incarnation: Incarnation, /) -> None:
        leaked = LeakedChild(incarnation.ref, incarnation.task)
        self.leaked.append(leaked)
        incarnation.task.add_done_callback(lambda _: self.leaked.remove(leaked))

    def _on_ready(self, incarnation: Incarnation) -> None:
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

    def _on_ended(self, incarnation: Incarnation, reason: ExitReason) -> None:
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
        self._notify(incarnation, reason)
        self._done_in_lane(entry)

    def _ended_by_request(self, incarnation: Incarnation, reason: ExitReason) -> None:
        entry = incarnation.entry
        entry.marked = False
        if self._is_unclean(incarnation, reason):
            self._report("shutdown_error", incarnation, reason)
        if not entry.intent:
            self._forget(entry)
        elif not entry.queued:
            self._start_in_turn(entry)

    def _ended_by_itself(self, incarnation: Incarnation, reason: ExitReason) -> None:
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

    def _failed_to_start(self, incarnation: Incarnation, reason: ExitReason) -> None:
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

    def _start_failed(self, incarnation: Incarnation, reason: ExitReason) -> StartFailed:
        cause = cause_of(reason)
        if isinstance(cause, StartFailed):  # of a leaf further down: that one is at fault
            return cause
        failure = StartFailed(incarnation.ref.path, str(reason) if cause else f"{reason} before it had started")
        failure.__cause__ = cause
        return failure

    # ------------------------------------------------------------------ restarts

    def _restart(self, incarnation: Incarnation, reason: ExitReason) -> None:
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
        if entry.intent and entry.now is None:
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

    # ------------------------------------------------------------------ its end

    def _give_up(self, incarnation: Incarnation, reason: ExitReason) -> None:
        intensity = self.spec.intensity
        failure = SupervisorGaveUp(self.path, incarnation.ref.id, intensity.restarts, intensity.within, reason)
        failure.__cause__ = cause_of(reason)
        self._failure = failure
        self._report("shutdown", incarnation, reason, "restart intensity reached")
        self._shut_down("shutdown")

    def _ends_with(self, entry: Entry) -> bool:
        """Whether the end, for good, of the significant child `entry` is the supervisor's."""
        if self.spec.auto_shutdown == all_significant:
            return not any(
                other.spec.significant and (other.now or other.intent)
                for other in self._entries.values()
                if other is not entry
            )
        return self.spec.auto_shutdown == any_significant

    def _auto_shut_down(self, incarnation: Incarnation, reason: ExitReason) -> None:
        self._report("shutdown", incarnation, reason, f"auto_shutdown={self.spec.auto_shutdown}")
        self._shut_down("shutdown")

    def _shut_down(self, why: str) -> None:
        if self._phase not in ("starting", "running"):
            return
        alive = [entry for entry in self._entries.values() if entry.now is not None]
        self._enter_shutdown(why, alive)
        if self.dynamic:  # instances stop together
            for entry in reversed(alive):
                if entry.now is not None:
                    self._ask(entry.now, why)
        self._stop_next()

    def _enter_shutdown(self, why: str, alive: list[Entry]) -> None:
        self._phase, self._why, self._last = "stopping", why, alive
        self._lane.clear()
        for entry in self._entries.values():
            self._drop_plans(entry, f"{self.name} is shutting down")

    def _drop_plans(self, entry: Entry, why: str) -> None:
        """Nothing is due for the child any more; who waits for its start hears `why`."""
        entry.intent, entry.marked = "", False
        if entry.timer is not None:
            entry.timer.cancel()
            entry.timer = None
        if answer := entry.take_answer():
            answer.set_exception(StartFailed((*self.path, entry.spec.name), why))

    def _stop_next(self) -> None:
        last = self._last
        while last:
            now = last[-1].now
            if now is not None:
                self._ask(now, self._why or "shutdown")
                return
            last.pop()
        self._phase = "over"
        if not self._over.done():
            self._over.set_result(None)

    def _ended_in_shutdown(self, incarnation: Incarnation, reason: ExitReason) -> None:
        by_itself = incarnation.asked is None and incarnation.killed is None
        if by_itself and not incarnation.ready:
            if not incarnation.declined:
                self._report("start_error", incarnation, reason)
        elif self._is_unclean(incarnation, reason) or (
            by_itself and isinstance(reason, Returned) and incarnation.entry.spec.restart == permanent
        ):
            self._report("shutdown_error", incarnation, reason)
        self._stop_next()

    def _is_unclean(self, incarnation: Incarnation, reason: ExitReason) -> bool:
        brutal = incarnation.entry.spec.stop == "kill" and isinstance(reason, Killed)
        return is_abnormal(reason) and not brutal

    async def _kill_all(self) -> None:
        """The owner cancelled us: no clean-up for anybody. Bounded in time, so further cancellations have to wait."""
        from anyio import CancelScope  # here, because nothing else in a supervisor needs anyio

        if self._phase == "over":
            return
        self._over = self.loop.create_future()
        self.post(self._on_kill)
        with CancelScope(shield=True):  # a cancelled scope outside would cancel us again in every turn of the loop
            while not self._over.done():
                with contextlib.suppress(asyncio.CancelledError):
                    await asyncio.wait([self._over])

    def _on_kill(self) -> None:
        alive = [entry for entry in self._entries.values() if entry.now is not None]
        if self._phase != "stopping":
            self._enter_shutdown("killed", alive)
        for entry in reversed(alive):
            if entry.now is not None:
                entry.now.kill()
        self._stop_next()

    def is_supervisor(self, life: Life, /) -> bool:
        return isinstance(life, Core)

    def grace_of(self, life: Life | None, /) -> float:
        """Seconds from the kill of a child to its abandonment: a supervisor needs one more than its slowest child."""
        if not isinstance(life, Core):
            return GRACE
        below = (self.grace_of(entry.now.life) for entry in life._entries.values() if entry.now is not None)
        return GRACE + max(below, default=0.0)

    # ------------------------------------------------------------------ telling others

    def _notify(self, incarnation: Incarnation, reason: ExitReason) -> None:
        if incarnation.watchers:
            down = Down(incarnation.ref, reason)
            for watcher in list(incarnation.watchers):
                watcher(down)

    def _report(
        self, context: Context, incarnation: Incarnation, reason: ExitReason | None = None, note: str = ""
    ) -> None:
        restart = incarnation.entry.spec.restart
        report = Report(context, self.path, incarnation.ref, restart, self.loop.time(), reason, note)
        self._guard("report()", self.runtime.report, report)

    def _guard(self, hook: str, call: Callable[[*Args], object], *args: *Args) -> None:
        """Call somebody else's code. What it raises must not keep the supervisor from its work."""
        try:
            call(*args)
        except Exception as error:
            message = f"supervisor {self.name}: {hook} raised; the supervisor goes on"
            self.loop.call_exception_handler({"message": message, "exception": error})
