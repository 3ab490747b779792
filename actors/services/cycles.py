"""Detection of call cycles that could not be refused in advance. It runs only when a call has timed out.

When a handler awaits a call itself, its node records that (`Caller.waits_for`), and a cycle of such handlers is refused at once. When a
handler waits through another task (`gather`, a task group, `create_task`, `shield`), or is concurrent, nothing is recorded:
whether a task will be awaited cannot be known in advance. Once a call is late, the callbacks of the awaited futures show who waits for
them.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import partial
from itertools import chain
from typing import Any, Protocol, TypeAlias

from actors.inbox.inbox import Inbox, Item
from actors.services.peers import Caller, Registration

AnyFuture: TypeAlias = "asyncio.Future[Any]"

SEEN = 1000
"""The maximum number of futures and tasks examined in one search."""


class Responder(Protocol):
    """The server of a call, as seen by the search."""

    @property
    def node(self) -> Caller: ...

    @property
    def entry(self) -> Registration: ...

    @property
    def inbox(self) -> Inbox: ...

    @property
    def concurrent(self) -> int: ...


class ServedCall(Item, Protocol):
    """An inbox item: an unanswered call to a server of this process. Its `run` method executes the handler."""

    @property
    def server(self) -> Responder: ...

    @property
    def future(self) -> AnyFuture: ...


def cycle_of(late: ServedCall, others: Iterable[ServedCall]) -> str | None:
    """Describe the cycle that keeps `late` from being answered; None if there is none. `others` are further unanswered calls.

    A call waits for itself if it, or a call that its answer depends on, is in the inbox of a node whose current handler waits for it.
    """
    for stuck in chain((late,), others):
        inbox = stuck.server.inbox
        holder = inbox.task
        if stuck.server.concurrent or holder is None or inbox.waiter is not None or inbox.current is stuck:
            continue  # no handler holds it up
        if (way := _way(stuck, holder)) is not None and late in way:
            handler = inbox.current.label if inbox.current is not None else "its start or end"
            calls = [f"{one.server.entry.name} of {one.server.node.fqn}" for one in reversed(way)]
            links = ", which waits for ".join([*calls, "that handler to end"])
            return f"a cycle of calls: {stuck.server.node.fqn} ({handler}) waits for {links}"
    return None


def _way(stuck: ServedCall, holder: asyncio.Task[object]) -> list[ServedCall] | None:
    """The chain of calls through which `holder` waits for `stuck`, beginning with `stuck`; None if it does not wait for it."""
    begun: list[tuple[AnyFuture, list[ServedCall]]] = [(stuck.future, [stuck])]
    seen: set[AnyFuture] = {stuck.future}
    while begun and len(seen) < SEEN:
        awaited, way = begun.pop()
        for waiting in waiting_for(awaited):
            if waiting is holder:
                return way
            if waiting in seen:
                continue
            seen.add(waiting)
            begun.append((waiting, way))
            served = _served_by(waiting, type(stuck)) if isinstance(waiting, asyncio.Task) else None
            if served is not None and served.future not in seen:
                seen.add(served.future)
                begun.append((served.future, [*way, served]))
    return None


def waiting_for(awaited: AnyFuture) -> Iterator[AnyFuture]:
    """Yield the tasks that await a future or task, and the futures that wait for it in turn (gather, wait, shield, task groups)."""
    for entry in getattr(awaited, "_callbacks", None) or ():
        callback: object = entry[0]
        known: list[object] = [getattr(callback, "__self__", None)]
        for cell in getattr(callback, "__closure__", None) or ():
            with suppress(ValueError):  # the cell has no value yet
                known.append(cell.cell_contents)
        if isinstance(callback, partial):
            known.extend(callback.args)
        for one in known:
            if type(one).__name__ == "TaskGroup":  # of asyncio or anyio, waiting at the end of its block
                one = getattr(one, "_on_completed_fut", None)
            if isinstance(one, asyncio.Future):
                yield one


def _served_by(task: asyncio.Task[object], kind: type[Any]) -> ServedCall | None:
    """The call whose handler runs in a task; None if there is none."""
    waiting: object = task.get_coro()
    while waiting is not None:
        frame = getattr(waiting, "cr_frame", None)
        if frame is not None and frame.f_code is kind.handle.__code__:
            request: ServedCall = frame.f_locals["self"]
            return request
        waiting = getattr(waiting, "cr_await", None)
    return None
