"""How a supervisor ends: asked to, for a child that did not start, for a significant child, or killed."""

from __future__ import annotations

import asyncio
import contextlib

from actors.shield import see_through, shield
from actors.supervision.base import Base
from actors.supervision.child_task import ChildTask
from actors.supervision.entry import Entry
from actors.supervision.errors import StartFailed
from actors.supervision.policy import all_significant, any_significant, permanent
from actors.supervision.reasons import ExitReason, Killed, Returned, is_abnormal

__all__ = ["Ending"]


class Ending(Base):
    """Stops the children, last one first and one at a time; instances of a template all at once.

    `_over` is done when no child is left; `_failure` is what `run` then raises.
    """

    _over: asyncio.Future[None]
    _why = ""
    _failure: BaseException | None = None
    _last: list[ChildTask]

    def _shut_down(self, why: str) -> None:
        if self._phase in ("starting", "running"):
            self._enter_shutdown(why)
            if self.dynamic:  # instances stop together
                for incarnation in reversed(self._last):
                    self._ask(incarnation, why)
            self._stop_next()

    def _enter_shutdown(self, why: str) -> None:
        self._phase, self._why = "stopping", why
        self._last = [entry.now for entry in self._entries.values() if entry.now is not None]
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
        while last and last[-1].over:
            last.pop()
        if last:
            self._ask(last[-1], self._why)
        else:
            self._phase = "over"
            if not self._over.done():  # it is when we have been cancelled in this very turn of the loop
                self._over.set_result(None)

    def _ended_in_shutdown(self, incarnation: ChildTask, reason: ExitReason) -> None:
        by_itself = incarnation.asked is None and incarnation.killed is None
        if by_itself and not incarnation.ready:
            if not incarnation.declined:
                self._report("start_error", incarnation, reason)
        elif self._is_unclean(incarnation, reason) or (
            by_itself and isinstance(reason, Returned) and incarnation.entry.spec.restart == permanent
        ):
            self._report("shutdown_error", incarnation, reason)
        self._stop_next()

    def _is_unclean(self, incarnation: ChildTask, reason: ExitReason) -> bool:
        brutal = incarnation.entry.spec.stop == "kill" and isinstance(reason, Killed)
        return is_abnormal(reason) and not brutal

    def _broken(self, error: Exception) -> None:
        """A handler raised: what we know may be wrong now, so we do not go on. `run` kills all and raises `error`."""
        if not self._over.done():
            self._over.set_exception(error)

    async def _kill_all(self) -> None:
        """No clean-up for anybody. Bounded in time, so further cancellations have to wait."""
        if self._phase == "over":
            return
        self._over = self.loop.create_future()
        self.post(self._on_kill)
        with contextlib.suppress(asyncio.CancelledError):
            await see_through(self._over)
        self._over.exception()  # if it broke once more, the first exception says why

    async def _outlast_cancellation(self) -> None:
        """Unless it was a kill, stop all children in order all the same. Returns early when a kill comes after all."""
        if self._killed() or self._phase == "over":
            return
        self._over = self.loop.create_future()
        self.post(self._shut_down, "its task was canceled by somebody else")
        with shield():
            while not self._killed() and not self._over.done():
                with contextlib.suppress(asyncio.CancelledError):
                    await asyncio.wait([self._over])

    def _on_kill(self) -> None:
        if self._phase != "stopping":
            self._enter_shutdown("killed")
        for incarnation in reversed(self._last):
            incarnation.kill()
        self._stop_next()

    def _ends_with(self, entry: Entry) -> bool:
        """Whether the end, for good, of the significant child `entry` is the supervisor's."""
        if self.spec.auto_shutdown == all_significant:
            return not any(
                other.spec.significant and (other.now or other.intent)
                for other in self._entries.values()
                if other is not entry
            )
        return self.spec.auto_shutdown == any_significant

    def _auto_shut_down(self, incarnation: ChildTask, reason: ExitReason) -> None:
        self._report("shutdown", incarnation, reason, f"auto_shutdown={self.spec.auto_shutdown}")
        self._shut_down("shutdown")
