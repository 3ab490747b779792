"""The inbox: everything a node's own code must do, one thing after another.

It is what makes a node an actor. Messages, requests and ticks wait here as items; the node's task takes them out and runs them to
their end before it takes the next, so handlers of one node never overlap. Control items go before data items. However many
items arrive while the node is busy or asleep, they cost one wake-up.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING, Any, Protocol

from actors.inbox.control import blame

if TYPE_CHECKING:
    from actors.inbox.expiring import TimedMessage
    from actors.inbox.load import Load, Meter

__all__ = ["HOLDING_SECONDS", "STEP_SECONDS", "Inbox", "Item"]

HOLDING_SECONDS = 0.5
"""A plain handler that keeps the others waiting for longer than this is reported once (docs/concepts.md)."""

STEP_SECONDS = 0.01
"""An item that runs for at least so long without an await is made known: it may have delayed somebody's timer."""

LOOKS = 8
"""The number of measured runs of a handler that awaits for which the turns of the loop are watched, at the price of a callback each."""

TURN = 256
"""After so many items without a pause the loop gets a turn, so that a flood in one node cannot starve the others."""


class Item(Protocol):
    """One piece of work. `run` does it at once (None) or returns what has to be awaited."""

    def run(self) -> Awaitable[Any] | None: ...

    @property
    def label(self) -> str:
        """The handler's name, for reports."""
        ...


class Inbox:
    """The queue of one node. It outlives an incarnation: what is waiting when a node crashes waits for its next life.

    `on_step` is told of an item that has just run for so many seconds without an await; on the real clock only, where that takes time.

    Invariants:

    - At most one item runs at a time, `current`, in `task`; both are None, and so are `on_error` and `on_holding`, while nobody serves.
    - `waiter` is set only while `serve` waits and nothing is in `items` or `control`. `handled` counts the items that have run.
    - `mark` is set while the wait of one item or message is measured; if it is a `_Mark`, it stands in `items` just before that one.
    """

    __slots__ = (
        "control",
        "current",
        "handled",
        "items",
        "looks",
        "loop",
        "mark",
        "meter",
        "on_error",
        "on_holding",
        "on_step",
        "reported",
        "task",
        "waiter",
        "watch",
    )

    def __init__(
        self, loop: asyncio.AbstractEventLoop, on_step: Callable[[Inbox, str, float], None] | None = None
    ) -> None:
        self.loop = loop
        self.items: deque[Item] = deque()
        self.control: list[Item] = []  # rarely more than one, and an empty list is a tenth of a deque
        self.waiter: asyncio.Future[None] | None = None
        self.task: asyncio.Task[Any] | None = None
        self.current: Item | None = None
        self.handled = 0
        self.watch: asyncio.TimerHandle | None = None
        self.meter: Meter | None = None
        self.mark: _Mark | TimedMessage[Any] | None = None
        """The waiting item, or message, whose wait is measured."""
        self.reported: set[str] | None = None
        self.on_holding: Callable[[Item, float], None] | None = None
        self.on_error: Callable[[Exception, str], object] | None = None
        self.looks: dict[str, int] | None = None
        """Handler -> how often it was seen to whether the loop turns while it is awaited; `LOOKS` times, until it takes long."""
        self.on_step = on_step

    def put(self, item: Item) -> None:
        """Append an item. Never blocks, never runs it."""
        self.items.append(item)
        self.wake()

    def put_control(self, item: Item) -> None:
        """Append an item that goes before all data."""
        self.control.append(item)
        self.wake()

    def wake(self) -> None:
        """Let the node's task look into the inbox, or, when it is busy, begin to watch how long it stays so."""
        waiter = self.waiter
        if waiter is not None:
            self.waiter = None
            if not waiter.done():
                waiter.set_result(None)
        elif self.watch is None and self.current is not None:
            self._observe()

    def clear(self, keep: Callable[[Item], bool]) -> None:
        """Drop what waits, but for what `keep` accepts. Who still serves here finds nothing more to do."""
        items, control = self.items, self.control
        mark, self.mark = self.mark, None
        if isinstance(mark, _Mark):
            items.remove(mark)
        self.items, self.control = deque(filter(keep, items)), list(filter(keep, control))
        items.clear()
        control.clear()

    async def serve(
        self,
        on_error: Callable[[Exception, str], object] | None = None,
        on_holding: Callable[[Item, float], None] | None = None,
    ) -> None:
        """Run items until one of them raises and `on_error` does not say "continue": that ends the incarnation. Cancel to stop.

        `on_holding` is told, once for each handler, of an item that keeps the others waiting, and for how many seconds it has done so.
        """
        self.on_error, self.on_holding = on_error, on_holding
        items, control = self.items, self.control
        self.task = task = asyncio.current_task()
        budget = 1  # so many items on, one is measured, and it is seen whether the loop is due for a turn
        try:
            while True:
                paused = self.handled
                while control or items:
                    item = control.pop(0) if control else items.popleft()
                    self.current = item
                    budget -= 1
                    if not budget:
                        await self._run_measured(item)
                        if self.handled - paused >= TURN:
                            self.current = None
                            await asyncio.sleep(0)
                            paused = self.handled
                        budget = min(self._meter().interval(self.handled), paused + TURN - self.handled)
                        continue
                    try:
                        pending = item.run()
                        if pending is not None:
                            if items and self.watch is None:
                                self.wake()  # who waits behind it came before it began
                            await pending
                    except BaseException as error:
                        self._failed(item, error)
                    self.handled += 1
                if self.task is not task:  # it refused to die when it was told to, and another one serves here now
                    return
                self.current = None
                self.waiter = waiter = self.loop.create_future()
                await waiter
        finally:
            if self.task is task:
                self.leave()

    async def _run_measured(self, item: Item) -> None:
        """Run one item as `serve` does, and look at the clock before and after."""
        turned: list[None] | None = None
        awaited = False
        begun = self.loop.time()
        try:
            pending = item.run()
            if pending is not None:
                if self.items and self.watch is None:
                    self.wake()
                awaited = True
                if self.on_step is not None and self._is_looked_at(item.label):
                    turned = []
                    self.loop.call_soon(turned.append, None)  # empty for as long as the loop has not turned
                await pending
        except BaseException as error:
            self._failed(item, error)
        if not isinstance(item, _Mark):
            seconds = self.loop.time() - begun
            self._meter().took(item.label, seconds)
            if seconds >= STEP_SECONDS and self.on_step is not None:
                self._took_long(item.label, seconds, awaited, turned)
        self.handled += 1

    def _is_looked_at(self, label: str) -> bool:
        """Whether this measured run of a handler that awaits is one of those that are held against the turns of the loop."""
        if self.looks is None:
            self.looks = {}
        self.looks[label] = looks = self.looks.get(label, 0) + 1
        return looks <= LOOKS

    def _took_long(self, label: str, seconds: float, awaited: bool, turned: list[None] | None) -> None:
        """Tell of it if the loop has not turned meanwhile. Where nobody has looked, the next runs are looked at."""
        if awaited and turned is None:
            self.looks = None
        elif not turned and self.on_step is not None:
            self.on_step(self, label, seconds)

    def leave(self) -> None:
        """Nobody serves here any more."""
        self.waiter = self.current = self.task = self.on_error = self.on_holding = None
        if self.watch is not None:
            self.watch.cancel()
            self.watch = None

    def _failed(self, item: Item, error: BaseException) -> None:
        """Raise what ends the incarnation: the error of an item, unless it is an `Exception` and `on_error` says "continue"."""
        failure = blame(error, item.label)
        if not isinstance(failure, Exception) or self.on_error is None:
            raise failure or error
        if self.on_error(failure, item.label) != "continue":
            raise failure

    def _observe(self) -> None:
        """Somebody waits: see in half a second whether still for the same item, and measure how long this one waits."""
        due = self.loop.time() + HOLDING_SECONDS
        self.watch = self.loop.call_at(due, self._look, self.handled, due)
        if self.items and self.mark is None:
            stamp: Callable[[], TimedMessage[Any]] | None = getattr(self.items[-1], "stamp", None)
            if stamp is not None:  # what this item stands for may be replaced while it waits
                self.mark = stamp()
                return
            self.mark = mark = _Mark(self, self.loop.time())
            self.items.insert(len(self.items) - 1, mark)

    def _look(self, handled: int, due: float) -> None:
        """Half a second after somebody found the node busy: is it still busy with the same item? Not by its own fault if the loop was."""
        self.watch = None
        current = self.current
        if current is None:
            return
        if self.handled == handled and self.loop.time() - due < STEP_SECONDS:
            self.report_holding(current, HOLDING_SECONDS)
        if self.items or self.control:
            self._observe()

    # -- load ---------------------------------------------------------------------------------------------------------------

    @property
    def waiting(self) -> int:
        """How many items wait."""
        return len(self.items) + len(self.control) - isinstance(self.mark, _Mark)

    @property
    def load(self) -> Load:
        """The measurements so far."""
        from actors.inbox.load import Load

        age = 0.0 if self.mark is None else self.loop.time() - self.mark.since
        meter = self._meter()
        return Load(self.handled, self.waiting, age, max(age, meter.longest_wait), meter.handlers())

    def took(self, label: str, seconds: float) -> None:
        """A handler with tasks of its own took so long."""
        self._meter().took(label, seconds)

    def waited(self, mark: _Mark | TimedMessage[Any]) -> None:
        """What came with `mark` has its turn now."""
        self.lost(mark)
        self._meter().waited(self.loop.time() - mark.since)

    def lost(self, mark: _Mark | TimedMessage[Any]) -> None:
        """What came with `mark` waits no more; measure the next one that has to."""
        if self.mark is mark:
            self.mark = None

    def _meter(self) -> Meter:
        if self.meter is None:
            from actors.inbox.load import Meter

            self.meter = Meter()
        return self.meter

    # -- reports ------------------------------------------------------------------------------------------------------------

    def report_holding(self, item: Item, seconds: float) -> None:
        """Tell, once per handler, that it keeps the node's other handlers waiting."""
        if self.reported is None:
            self.reported = set()
        if item.label not in self.reported and self.on_holding is not None:
            self.reported.add(item.label)
            self.on_holding(item, seconds)


class _Mark:
    """Waits in the inbox just before the item whose waiting time is measured."""

    __slots__ = ("inbox", "since")
    label = "inbox age"

    def __init__(self, inbox: Inbox, since: float) -> None:
        self.inbox = inbox
        self.since = since

    def run(self) -> None:
        self.inbox.handled -= 1  # nobody's item
        self.inbox.waited(self)
