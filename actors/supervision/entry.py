"""`Entry`: the state that a supervisor keeps for one child, over all its incarnations."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import Literal, TypeAlias

from actors.supervision.child_task import ChildTask
from actors.supervision.declarations import Spec
from actors.supervision.policy import Backoff
from actors.supervision.refs import ChildInfo, ChildRef, ChildState

Intent: TypeAlias = Literal["", "start", "restart"]
"""What is due for a child that is not ready: nothing, its first or requested start, or an automatic restart. It stays set until
the child is ready, so that a start that is interrupted or fails is not forgotten."""


class Entry:
    """One child: its declaration, its present life, and what is due for it. The state of a child is stored here and nowhere else.

    - `id`: what the supervisor knows it by, which is its name unless a request gave another one.
    - `parked`: it was stopped by a request, so restarts of its group leave it alone.
    - `marked`: it is to be stopped in its turn, for a restart of its group.
    - `queued`: it is among the starts that wait for their turn.
    - `fresh`: it was added by a request, and is forgotten if that start fails.
    - `answer`: the future on which the caller of an unfinished start waits.
    - `given`: the arguments and parameters of an instance of a template.
    - `number`: how many lives it has had; `attempts`: how many of the last ones in a row did not hold; `ready_at`: when the last
      one became ready, loop time in seconds.

    Invariants:

    - `now` is the life that has begun and not ended, or None; a child has at most one.
    - `intent` stays set until the child is ready or the start is dropped; `answer` is set only while `intent` is.
    - `timer`, which starts the next life, runs only while there is no life.
    """

    __slots__ = (
        "answer",
        "attempts",
        "fresh",
        "given",
        "id",
        "intent",
        "marked",
        "now",
        "number",
        "parked",
        "position",
        "queued",
        "ready_at",
        "spec",
        "timer",
    )

    def __init__(self, spec: Spec, position: int, id: str = "") -> None:
        self.spec = spec
        self.id = id or spec.name
        self.position = position
        self.number = 0
        self.now: ChildTask | None = None
        self.intent: Intent = ""
        self.marked = False
        self.queued = False
        self.parked = False
        self.fresh = False
        self.given: tuple[tuple[object, ...], Mapping[str, object] | None] = ((), None)
        self.answer: asyncio.Future[ChildRef | None] | None = None
        self.attempts = 0
        self.ready_at: float | None = None
        self.timer: asyncio.TimerHandle | None = None

    def __repr__(self) -> str:
        return f"<entry {self.id} {self.state}#{self.number}>"

    @property
    def state(self) -> ChildState:
        now = self.now
        if self.intent:
            return "restarting" if self.intent == "restart" else "starting"
        if now is None:
            return "stopped"
        return "running" if now.ready and now.asked is None and now.imposed is None else "stopping"

    @property
    def task(self) -> asyncio.Task[None] | None:
        """The task of the present life; None between lives."""
        return None if self.now is None else self.now.task

    @property
    def info(self) -> ChildInfo:
        state = self.state
        ref = self.now.ref if self.now is not None and state == "running" else None
        return ChildInfo(self.id, self.spec.kind, state, ref, self.number)

    def take_answer(self) -> asyncio.Future[ChildRef | None] | None:
        """Take the future of the caller that waits for the start; None if there is none, or it has been canceled."""
        answer, self.answer = self.answer, None
        return None if answer is None or answer.done() else answer

    def earlier_attempts(self, backoff: Backoff, now: float) -> int:
        """How many attempts before the last one did not hold, in a row; 0 after a life of `backoff.reset_after` seconds."""
        held = self.ready_at is not None and now - self.ready_at >= backoff.reset_after
        return 0 if held else self.attempts
