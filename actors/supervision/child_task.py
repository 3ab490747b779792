"""One incarnation of a child: its task, from the start of the life to the verdict on its end."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from typing import Any, Literal, Protocol

from actors.supervision.errors import SupervisorGaveUp
from actors.supervision.policy import StopTimeout
from actors.supervision.reasons import ExitReason, Failed, Killed, Leaked, Returned, Skip, Stop, Stopped
from actors.supervision.refs import ChildRef, Down
from actors.supervision.seam import Declared, Life

__all__ = ["GRACE", "ChildTask", "LeakedChild", "Owner"]

GRACE = 1.0
"""Seconds between the kill and the verdict `Leaked`."""


class LeakedChild:
    """A child that refused to die: `ref`, and its `task`, which is kept here until it ends after all."""

    __slots__ = ("ref", "task")

    def __init__(self, ref: ChildRef, task: asyncio.Task[None]) -> None:
        self.ref = ref
        self.task = task

    def __repr__(self) -> str:
        return f"<leaked {self.ref}: {self.task!r}>"


class Owner(Protocol):
    """The supervisor, as its incarnations see it."""

    loop: asyncio.AbstractEventLoop

    def make_life(self, incarnation: ChildTask, /) -> Life: ...
    def grace_of(self, life: Life | None, /) -> float: ...
    def ready(self, incarnation: ChildTask, /) -> None: ...
    def ended(self, incarnation: ChildTask, reason: ExitReason, /) -> None: ...
    def abandoned(self, incarnation: ChildTask, /) -> None: ...


class ChildTask:
    """Owns one raw task.

    Raw, because a task group cancels its tasks in no order, cannot give up on one that refuses to end, and fails as a
    whole. There is no cancel scope around the task either: cancelling one repeats the cancellation in every turn of the
    loop for as long as the body refuses, which stops a virtual clock for ever; and it costs as much as all the rest.

    `ready` turns true with the life's `started()`. `asked` is the reason given with `stop`, None while nobody asked.
    """

    __slots__ = (
        "asked",
        "cleans_up",
        "declined",
        "entry",
        "imposed",
        "killed",
        "life",
        "made",
        "over",
        "owner",
        "ready",
        "ref",
        "task",
        "timer",
        "watchers",
    )

    def __init__(self, owner: Owner, entry: Declared, ref: ChildRef) -> None:
        self.owner = owner
        self.entry = entry
        self.ref = ref
        self.life: Life | None = None
        self.made = False
        """Whether all know of this incarnation: with tasks that start eagerly it would run before that."""
        self.ready = False
        self.over = False
        self.declined = False
        self.cleans_up = False
        """Whether it ends by itself and is in its clean-up, also when its start has failed: that is not broken off."""
        self.asked: str | None = None
        self.killed: float | None = None
        self.imposed: BaseException | None = None
        self.timer: asyncio.TimerHandle | None = None
        self.watchers: dict[Callable[[Down], object], None] | None = None
        self.task: asyncio.Task[None] = owner.loop.create_task(self._live(), name=str(ref))
        self.task.add_done_callback(self._done)
        self.made = True

    def __repr__(self) -> str:
        return f"<incarnation {self.ref}>"

    @property
    def ending(self) -> bool:
        """Whether its end has begun: it was asked for, or came by itself and is in its clean-up."""
        by_others = self.asked is not None or self.imposed is not None or self.killed is not None
        return by_others or self.cleans_up or self.over

    @property
    def state(self) -> Literal["starting", "running", "stopping", "stopped"]:
        """The state of this one life."""
        if self.over:
            return "stopped"
        if self.ending:
            return "stopping"
        return "running" if self.ready else "starting"

    @staticmethod
    def runs_in(task: asyncio.Task[Any]) -> bool:
        """Whether this task runs the life of a child."""
        return getattr(task.get_coro(), "cr_code", None) is ChildTask._live.__code__

    async def _live(self) -> None:
        if not self.made:
            await asyncio.sleep(0)
        self.life = life = self.owner.make_life(self)
        await life.run(self._started)

    def _started(self) -> None:
        self.owner.ready(self)

    def stop(self, why: str, timeout: StopTimeout) -> None:
        """Ask for an orderly end, once, and see to it that it comes: kill after `timeout` seconds."""
        ending = self.asked is not None or self.imposed is not None or self.killed is not None
        self.asked = why if self.asked is None else self.asked
        if not ending:
            self._end(why, timeout)

    def fail(self, error: BaseException, timeout: StopTimeout) -> None:
        """End it in order, as `stop` does, but let it count as its own failure with `error`."""
        if self.asked is None and self.imposed is None and self.killed is None and not self.over:
            self.imposed = error
            self._end(str(error), timeout)

    def bound(self) -> None:
        """It ends by itself, and cleans up: kill it if that takes longer than an end that was asked for may take."""
        self.cleans_up = True
        timeout = self.entry.spec.stop
        if self.asked is None and self.imposed is None and self.killed is None:
            seconds = GRACE if timeout == "kill" else timeout
            self._after(seconds, self.kill, seconds)

    def kill(self, after: float = 0.0) -> None:
        """Cancel the task, through shields, and abandon it if it still lives a second later."""
        if self.killed is None and not self.over:
            self.killed = after
            self._watch_task()
            grace = self.owner.grace_of(self.life)
            self._after(grace, self._abandon, grace)
            self.task.cancel()

    def watch(self, watcher: Callable[[Down], object]) -> None:
        """Call `watcher` when this incarnation has ended, in the order of the calls."""
        if self.watchers is None:
            self.watchers = {}
        self.watchers[watcher] = None

    def unwatch(self, watcher: Callable[[Down], object]) -> None:
        """Take a `watch` back; nothing happens if it has been called or taken back already."""
        assert self.watchers is not None
        self.watchers.pop(watcher, None)

    def _end(self, why: str, timeout: StopTimeout) -> None:
        if timeout == "kill":
            self.kill()
            return
        self._watch_task()
        self._after(timeout, self.kill, timeout)
        if self.life is None:  # its task has not come to its first step
            self.task.cancel()
            return
        try:
            self.life.stop(why)
        except Exception as error:
            self.imposed = error
            self.kill()
            return
        # A supervisor knows how to take its start back, and whose start has failed is in its clean-up.
        if not self.ready and not self.cleans_up and self.entry.spec.kind != "supervisor":
            self.task.cancel()

    def _watch_task(self) -> None:
        """A child that removed our callback from its task (OTP: unlinked itself) must not hang its supervisor."""
        self.task.remove_done_callback(self._done)
        self.task.add_done_callback(self._done)

    def _after(self, delay: float, callback: Callable[..., None], *args: float) -> None:
        if self.timer is not None:
            self.timer.cancel()
        self.timer = None if delay == math.inf else self.owner.loop.call_later(delay, callback, *args)

    def _abandon(self, after: float) -> None:
        self.owner.abandoned(self)
        self._close(Leaked(after))

    def _done(self, task: asyncio.Task[None]) -> None:
        if not self.over:
            self._close(self._verdict(task))
        elif not task.cancelled():
            task.exception()  # abandoned, and ended late: its exception was nobody's any more

    def _close(self, reason: ExitReason) -> None:
        self.over = True
        if self.timer is not None:
            self.timer.cancel()
        self.owner.ended(self, reason)

    def _verdict(self, task: asyncio.Task[None]) -> ExitReason:
        error = None if task.cancelled() else task.exception()
        if self.imposed is not None:
            return Failed(self.imposed)
        if self.killed is not None:
            return Killed(self.killed)
        if isinstance(error, SupervisorGaveUp):
            return Stopped("shutdown", error)
        if isinstance(error, Stop):
            return Stopped(error.reason)
        if isinstance(error, Skip) and not self.ready:
            self.declined = True
            return Stopped(f"declined to start: {error.reason}")
        if error is not None:
            return Failed(error)
        if self.asked is not None:
            return Stopped(self.asked)
        if task.cancelled():
            return Killed(None)
        # A supervisor has no work of its own to come to the end of.
        return Stopped("shutdown") if self.entry.spec.kind == "supervisor" else Returned()
