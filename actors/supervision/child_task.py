"""`ChildTask`: the task of one life of a child, from its start to the reason of its end."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from contextvars import Context
from typing import Literal, Protocol

from actors.supervision.errors import SupervisorGaveUp
from actors.supervision.peers import Declared, Life
from actors.supervision.policy import StopTimeout
from actors.supervision.reasons import ExitReason, Failed, Killed, Leaked, Returned, Skip, Stop, Stopped
from actors.supervision.refs import ChildRef, Down

GRACE = 1.0
"""Seconds from the kill of a task to its abandonment, which is reported as `Leaked`."""


class LeakedChild:
    """A child that did not end when it was killed: `ref`, and its `task`, which is kept until it ends after all."""

    __slots__ = ("ref", "task")

    def __init__(self, ref: ChildRef, task: asyncio.Task[None]) -> None:
        self.ref = ref
        self.task = task

    def __repr__(self) -> str:
        return f"<leaked {self.ref}: {self.task!r}>"


class Owner(Protocol):
    """What a `ChildTask` needs of the supervisor that made it."""

    loop: asyncio.AbstractEventLoop
    of_ends: Context

    def make_life(self, incarnation: ChildTask, /) -> Life: ...
    def grace_of(self, life: Life | None, /) -> float: ...
    def ready(self, incarnation: ChildTask, /) -> None: ...
    def ended(self, incarnation: ChildTask, reason: ExitReason, /) -> None: ...
    def abandoned(self, incarnation: ChildTask, /) -> None: ...


class ChildTask:
    """Runs one life of a child in an asyncio task of its own, and tells the owner exactly once how it ended.

    It is a plain task, because a task group cancels its tasks in no order, cannot abandon one that refuses to end, and
    fails as a whole. There is no cancel scope around the task either: a cancel scope repeats a cancellation in every turn
    of the loop for as long as the task refuses it, which stops a virtual clock for ever; and it costs as much as the rest
    of a start.

    Invariants:

    - `over` turns true once, when the task has ended or was abandoned; `owner.ended` is called then, and only then.
    - `asked` is the first reason given to `stop`, `imposed` the error that the end counts as, `killed` the seconds of
      clean-up before the kill. Each stays None until that happens, and never becomes None again.
    - `ready` is set by the owner when it accepts the life's `started()`.
    - `timer` runs from the beginning of the end on: first the stop timeout, after a kill the time until abandonment.
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
        """Whether the constructor is done. With an eager task factory the task takes its first step before that."""
        self.ready = False
        self.over = False
        self.declined = False
        self.cleans_up = False
        """Whether the life ends by itself and cleans up, also after a failed start. A clean-up is not broken off."""
        self.asked: str | None = None
        self.killed: float | None = None
        self.imposed: BaseException | None = None
        self.timer: asyncio.TimerHandle | None = None
        self.watchers: dict[Callable[[Down], object], None] | None = None
        self.task: asyncio.Task[None] = owner.loop.create_task(self._live(), name=str(ref))
        self.task.add_done_callback(self._done, context=self.owner.of_ends)
        self.made = True

    def __repr__(self) -> str:
        return f"<incarnation {self.ref}>"

    @property
    def ending(self) -> bool:
        """Whether the end of the life has begun: it was asked for, or the life ends by itself and cleans up."""
        by_others = self.asked is not None or self.imposed is not None or self.killed is not None
        return by_others or self.cleans_up or self.over

    @property
    def state(self) -> Literal["starting", "running", "stopping", "stopped"]:
        """The state of this life."""
        if self.over:
            return "stopped"
        if self.ending:
            return "stopping"
        return "running" if self.ready else "starting"

    @staticmethod
    def runs_in(task: asyncio.Task[object]) -> bool:
        """Whether `task` runs the life of a child."""
        return getattr(task.get_coro(), "cr_code", None) is ChildTask._live.__code__

    async def _live(self) -> None:
        if not self.made:
            await asyncio.sleep(0)
        self.life = life = self.owner.make_life(self)
        await life.run(self._started)

    def _started(self) -> None:
        self.owner.ready(self)

    def stop(self, why: str, timeout: StopTimeout) -> None:
        """Ask for an orderly end, and kill after `timeout` seconds. Only the first call has an effect."""
        ending = self.asked is not None or self.imposed is not None or self.killed is not None
        self.asked = why if self.asked is None else self.asked
        if not ending:
            self._end(why, timeout)

    def fail(self, error: BaseException, timeout: StopTimeout) -> None:
        """End the life in order, as `stop` does, but report the end as its failure with `error`."""
        if self.asked is None and self.imposed is None and self.killed is None and not self.over:
            self.imposed = error
            self._end(str(error), timeout)

    def bound(self) -> None:
        """Limit the clean-up of a life that ends by itself to the stop timeout; with `stop="kill"`, to `GRACE` seconds."""
        self.cleans_up = True
        timeout = self.entry.spec.stop
        if self.asked is None and self.imposed is None and self.killed is None:
            seconds = GRACE if timeout == "kill" else timeout
            self._after(seconds, self.kill, seconds)

    def kill(self, after: float = 0.0) -> None:
        """Cancel the task, and abandon it if it has not ended after the grace time of its owner. `after`: seconds of clean-up before."""
        if self.killed is None and not self.over:
            self.killed = after
            self._watch_task()
            grace = self.owner.grace_of(self.life)
            self._after(grace, self._abandon, grace)
            self.task.cancel()

    def watch(self, watcher: Callable[[Down], object]) -> None:
        """Have `watcher` called when this life has ended. Watchers are called in the order in which they were added."""
        if self.watchers is None:
            self.watchers = {}
        self.watchers[watcher] = None

    def unwatch(self, watcher: Callable[[Down], object]) -> None:
        """Remove a watcher. Nothing happens if it has been called or removed already."""
        assert self.watchers is not None
        self.watchers.pop(watcher, None)

    def _end(self, why: str, timeout: StopTimeout) -> None:
        if timeout == "kill":
            self.kill()
            return
        self._watch_task()
        self._after(timeout, self.kill, timeout)
        if self.life is None:  # the task has not taken its first step
            self.task.cancel()
            return
        try:
            self.life.stop(why)
        except Exception as error:
            self.imposed = error
            self.kill()
            return
        # Break off the start phase, but neither that of a supervisor, which undoes it by itself, nor a clean-up after a failed start.
        if not self.ready and not self.cleans_up and self.entry.spec.kind != "supervisor":
            self.task.cancel()

    def _watch_task(self) -> None:
        """Attach the done callback again: a child that removed it from its task (OTP: unlinked itself) must not hang its supervisor."""
        self.task.remove_done_callback(self._done)
        self.task.add_done_callback(self._done, context=self.owner.of_ends)

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
            task.exception()  # it was abandoned and has ended late: mark its exception as retrieved

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
        # A supervisor that returns was shut down; it has no work of its own that could be done.
        return Stopped("shutdown") if self.entry.spec.kind == "supervisor" else Returned()
