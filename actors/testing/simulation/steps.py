"""The steps of a node's work: each is counted, and a fault may occur at each."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable, Coroutine, Generator, Sequence
from typing import Any, TypeAlias, cast

from actors.inbox.control import NodeExit
from actors.testing.faults import Fault
from actors.waiting import wake

Delay: TypeAlias = "float | asyncio.Future[None]"
"""How long a step waits: so many seconds, or until a future is done."""

_AWKWARD = re.compile(r"[^\w./:-]+")


class Death(NodeExit):
    """Thrown into a node that ends without clean-up. Code that catches errors must not catch it."""


class Watched(Coroutine[object, None, object]):
    """A coroutine that behaves as the one it wraps, and calls `step` before each step, from one await to the next.

    `step` returns the delay of the step. `interrupted` is called with every error thrown into the coroutine. A `Death` raised by
    either ends the coroutine where it waits.
    """

    __slots__ = ("_interrupted", "_kept", "_step", "_work")

    def __init__(
        self,
        work: Coroutine[object, None, object],
        step: Callable[[], Delay],
        interrupted: Callable[[object], object] = lambda error: None,
    ) -> None:
        self._work = work
        self._step = step
        self._interrupted = interrupted
        self._kept: tuple[object] | None = None  # the value sent into a delayed step, kept until it runs

    def __getattr__(self, name: str) -> Any:
        """Give debuggers and reports access to the wrapped coroutine."""
        return getattr(self._work, name)

    def __await__(self) -> Generator[object, object, object]:
        return cast("Generator[Any, Any, Any]", self)

    def __next__(self) -> Any:
        return self.send(None)

    def send(self, value: Any) -> Any:
        if self._kept is not None:
            (value,), self._kept = self._kept, None
            return self._work.send(value)
        try:
            late = self._step()
        except Death as death:
            return self._work.throw(death)
        if not late:
            return self._work.send(value)
        self._kept = (value,)
        return next(_waiting(late))

    def throw(self, *error: Any) -> Any:
        self._kept = None
        try:
            self._interrupted(error[0])
        except Death as death:
            return self._work.throw(death)
        return self._work.throw(*error)

    def close(self) -> None:
        self._work.close()


def _waiting(delay: Delay) -> Generator[object, None, None]:
    """Yield a future that resumes the coroutine after `delay`."""
    loop = asyncio.get_running_loop()
    future: asyncio.Future[None] = loop.create_future()
    if isinstance(delay, asyncio.Future):
        delay.add_done_callback(lambda _: wake(future, None))
    else:
        loop.call_later(delay, wake, future, None)
    return future.__await__()


def target_of(node: str, work: str) -> str:
    """The name, in faults, of a handler, an action body or a task of a node: ``NODE>WORK``, without blanks."""
    return f"{node}>{_AWKWARD.sub('-', work).strip('-')}"


class Steps:
    """Counts the steps of each piece of a node's work, and finds the fault that occurs at a step."""

    def __init__(self, node: str, faults: Sequence[Fault], counts: dict[str, int]) -> None:
        self._node = node
        self._counts = counts
        self._targets: dict[str, str] = {}
        self._faults = {(fault.target, fault.nth): fault for fault in faults if fault.kind in ("slow-step", "crash")}

    def count(self, work: str) -> Fault | None:
        """Count a step of this work. Returns the fault that occurs at it, if any."""
        target = self._targets.get(work)
        if target is None:
            target = self._targets[work] = target_of(self._node, work)
        nth = self._counts[target] = self._counts.get(target, 0) + 1
        return self._faults.get((target, nth))
