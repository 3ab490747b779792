"""The inbox of a node: a queue of work items that one task runs one after another.

Messages, requests and ticks wait here as items. The node's task runs each item to its end before it takes the next, so the handlers
of one node never overlap. Control items are taken before data items. Any number of items that arrive while the node is busy or idle
cost one wake-up.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable
from time import monotonic
from typing import TYPE_CHECKING, Any, Final, Protocol

from actors.inbox.boundary import outside
from actors.inbox.control import blame

if TYPE_CHECKING:
    from actors.inbox.expiring import TimedMessage
    from actors.inbox.load import Load, Meter

HOLDING_SECONDS = 0.5
"""A handler that keeps other items waiting for longer than this, in seconds, is reported once (docs/howto/inspect.md)."""

STEP_SECONDS = 0.01
"""An item that runs for at least this long without an await, in seconds, is reported to `on_step`: it may have delayed a timer."""

LOOKS = 8
"""For how many measured runs of a handler that awaits it is checked whether the event loop turns; each check costs one callback."""

TURN = 256
"""After this many items without a pause the inbox yields to the event loop, so that a flood in one node cannot starve the others."""


class _Nothing(deque[Any]):
    """An empty queue that stays empty."""

    __slots__ = ()

    def append(self, item: Any, /) -> None:
        raise RuntimeError(f"{item!r:.60} was put into a queue that has not been made")


NOTHING: Final[deque[Any]] = _Nothing()
"""The queue of every inbox, and of every subscription with a handler, before its first item: an empty deque of its own takes 760 bytes."""


class Item(Protocol):
    """One piece of work. `run` either does it at once and returns None, or returns an awaitable that completes it."""

    def run(self) -> Awaitable[object] | None: ...

    @property
    def label(self) -> str:
        """The handler's name, for reports."""
        ...


class Served(Protocol):
    """The incarnation whose items an inbox runs."""

    def on_error(self, error: Exception, handler: str, /) -> object:
        """Asked about each `Exception` that leaves an item; unless it returns "continue", the error is raised."""
        ...

    def on_holding(self, item: Item, seconds: float, /) -> None:
        """Called, at most once per handler, for an item that keeps others waiting."""
        ...


class Inbox:
    """The work queue of one node. It outlives an incarnation: items that wait when a node crashes can be kept for its next life.

    `on_step(inbox, label, seconds)` is called after an item has run for at least `STEP_SECONDS` without an await. It is given on the
    real clock only; on the virtual clock handlers take no time.

    Invariants:

    - At most one item runs at a time: `current`, in `task`. `task` is the task of the node's start phase, service or clean-up; `current`
      and `life` are None unless it serves.
    - `items` is `NOTHING` until the first data item comes, and never again. Nothing is ever put into that.
    - `waiter` is set only while `serve` waits for work, and then `items` and `control` are empty.
    - `handled` counts the items that have run; one that ends the incarnation does not count.
    - `mark` is set while the waiting time of one item or message is measured. A `_Mark` stands in `items` directly before the item that
      it measures.
    """

    __slots__ = (
        "clock",
        "control",
        "current",
        "handled",
        "items",
        "life",
        "looks",
        "loop",
        "mark",
        "meter",
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
        self.clock = loop.time if getattr(loop, "virtual", False) else monotonic
        """What the time is measured with that an item takes. Not the loop's clock on the real one: that of a loop that keeps step with a world
        stands still meanwhile, and the journal of a node holds each reading of it."""
        self.items: deque[Item] = NOTHING
        self.control: list[Item] = []  # rarely more than one, and an empty list is a tenth of a deque
        self.waiter: asyncio.Future[None] | None = None
        self.task: asyncio.Task[object] | None = None
        self.current: Item | None = None
        self.handled = 0
        self.watch: asyncio.TimerHandle | None = None
        self.meter: Meter | None = None
        self.mark: _Mark | TimedMessage[Any] | None = None
        """The item or message whose waiting time is being measured, or None."""
        self.reported: set[str] | None = None
        self.life: Served | None = None
        self.looks: dict[str, int] | None = None
        """Handler -> the number of its runs that were checked for turns of the event loop; see `LOOKS`."""
        self.on_step = on_step

    def put(self, item: Item) -> None:
        """Append a data item. Never blocks and never runs the item."""
        (self.queue() if self.items is NOTHING else self.items).append(item)
        self.wake()

    def queue(self) -> deque[Item]:
        """The queue of data items, made if there is none yet. For those who append to `items` by themselves."""
        if self.items is NOTHING:
            self.items = deque()
        return self.items

    def put_control(self, item: Item) -> None:
        """Append a control item, which is taken before all data items. Never blocks and never runs the item."""
        self.control.append(item)
        self.wake()

    def wake(self) -> None:
        """Wake the task that serves; if it is busy, begin to measure how long the new item has to wait."""
        waiter = self.waiter
        if waiter is not None:
            self.waiter = None
            if not waiter.done():
                waiter.set_result(None)
        elif self.watch is None and self.current is not None:
            self._observe()

    def clear(self, keep: Callable[[Item], bool]) -> None:
        """Drop the waiting items that `keep` does not accept.

        The queues are replaced, and the old ones emptied: a task that still serves the old ones finds no more work.
        """
        items, control = self.items, self.control
        mark, self.mark = self.mark, None
        if isinstance(mark, _Mark):
            items.remove(mark)
        if items is not NOTHING:
            self.items = deque(filter(keep, items))
            items.clear()
        self.control = list(filter(keep, control))
        control.clear()

    def discard(self, unwanted: Callable[[Item], bool]) -> None:
        """Drop the waiting items that `unwanted` accepts, while the others go on to be served."""
        kept = [item for item in self.items if not unwanted(item)]
        self.items.clear()
        self.queue().extend(kept)

    async def serve(self, life: Served | None = None) -> None:
        """Run items for `life` until an error ends it or the task is canceled; the error is raised. Without `life`, every error is."""
        # This loop is the hottest code of the framework, so it is tuned. The common item costs one decrement and one test: the clock is
        # read, and the yield to the event loop is considered, only for the item at which `budget` reaches 0. `paused` is the value of
        # `handled` at the last pause, that is at the last yield or at the last wait for work; the next budget never passes
        # `paused + TURN`, so at most TURN items run in between. An item that is done at once is not awaited and makes no coroutine.
        # `items` and `control` are locals; `clear` therefore replaces the queues and empties the old ones. The first item makes the queue.
        self.life = life
        items, control = self.items, self.control
        self.task = task = asyncio.current_task()
        budget = 1  # the first item is measured
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
                        continue  # the measured item has run: `_run_measured` does all that follows here
                    try:
                        pending = item.run()
                        if pending is not None:
                            if items and self.watch is None:
                                self.wake()  # the items behind it came before it began, so no `put` begins to measure their wait
                            await pending
                    except BaseException as error:
                        self._failed(item, error)
                    self.handled += 1
                if self.task is not task:  # this task was abandoned after it refused a kill; another one serves now
                    return
                if items is NOTHING and self.items is not NOTHING:  # the first item has made the queue
                    items = self.items
                    continue
                self.current = None
                self.waiter = waiter = self.loop.create_future()
                await waiter
        finally:
            if self.task is task:
                self.leave()

    async def _run_measured(self, item: Item) -> None:
        """Run one item as `serve` does, and measure the time it takes."""
        turned: list[None] | None = None
        awaited = False
        begun = self.clock()
        try:
            pending = item.run()
            if pending is not None:
                if self.items and self.watch is None:
                    self.wake()
                awaited = True
                if self.on_step is not None and self._is_looked_at(item.label):
                    turned = []
                    with outside():  # real time decides whether it is asked: no step of a journal
                        self.loop.call_soon(turned.append, None)  # empty for as long as the loop has not turned
                await pending
        except BaseException as error:
            self._failed(item, error)
        if not isinstance(item, _Mark):
            seconds = self.clock() - begun
            self._meter().took(item.label, seconds)
            if seconds >= STEP_SECONDS and self.on_step is not None:
                self._took_long(item.label, seconds, awaited, turned)
        self.handled += 1

    def _is_looked_at(self, label: str) -> bool:
        """Whether to check, in this measured run of a handler that awaits, that the event loop turns; counts the run."""
        if self.looks is None:
            self.looks = {}
        self.looks[label] = looks = self.looks.get(label, 0) + 1
        return looks <= LOOKS

    def _took_long(self, label: str, seconds: float, awaited: bool, turned: list[None] | None) -> None:
        """Call `on_step` if the event loop did not turn during the item. If that was not checked, check the next runs."""
        if awaited and turned is None:
            self.looks = None
        elif not turned and self.on_step is not None:
            self.on_step(self, label, seconds)

    def leave(self) -> None:
        """End the service: no task serves this inbox any more. Calling it twice has no further effect."""
        self.waiter = self.current = self.task = self.life = None
        if self.watch is not None:
            self.watch.cancel()
            self.watch = None

    def _failed(self, item: Item, error: BaseException) -> None:
        """Raise the error of an item, which ends the incarnation; return if it is an `Exception` and `on_error` says "continue"."""
        failure = blame(error, item.label)
        try:
            if not isinstance(failure, Exception) or self.life is None:
                raise failure or error
            if self.life.on_error(failure, item.label) != "continue":
                raise failure
        finally:  # else the error refers to this frame and the frame to the error: a cycle that holds the whole ended node
            del failure, error

    def _observe(self) -> None:
        """Check in `HOLDING_SECONDS` whether the same item still runs, and begin to measure the waiting time of the newest item."""
        due = self.loop.time() + HOLDING_SECONDS
        self.watch = self.loop.call_at(due, self._look, self.handled, due)
        if self.items and self.mark is None:
            stamp: Callable[[], TimedMessage[Any]] | None = getattr(self.items[-1], "stamp", None)
            # The item of a subscription stands for a message that may be replaced while it waits: then the message is marked, not the item.
            if stamp is not None:
                self.mark = stamp()
                return
            self.mark = mark = _Mark(self, self.loop.time())
            self.items.insert(len(self.items) - 1, mark)

    def _look(self, handled: int, due: float) -> None:
        """Report the current item if it still runs since the watch began. `due` is when this call was due, loop time.

        A call that comes late means that the event loop itself was blocked: then the item is not reported.
        """
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
        """The number of items that wait."""
        return len(self.items) + len(self.control) - isinstance(self.mark, _Mark)

    @property
    def load(self) -> Load:
        """The measurements so far, over all incarnations of the node."""
        from actors.inbox.load import Load

        age = 0.0 if self.mark is None else self.loop.time() - self.mark.since
        meter = self._meter()
        return Load(self.handled, self.waiting, age, max(age, meter.longest_wait), meter.handlers())

    def took(self, label: str, seconds: float) -> None:
        """Record one run of a concurrent handler, which runs outside of this inbox."""
        self._meter().took(label, seconds)

    def waited(self, mark: _Mark | TimedMessage[Any]) -> None:
        """End a measurement: the item or message of `mark` has its turn now."""
        self.lost(mark)
        self._meter().waited(self.loop.time() - mark.since)

    def lost(self, mark: _Mark | TimedMessage[Any]) -> None:
        """Drop a measurement: the item or message of `mark` does not wait any more. The next one that has to wait is measured."""
        if self.mark is mark:
            self.mark = None

    def _meter(self) -> Meter:
        if self.meter is None:
            from actors.inbox.load import Meter

            self.meter = Meter()
        return self.meter

    # -- reports ------------------------------------------------------------------------------------------------------------

    def report_holding(self, item: Item, seconds: float) -> None:
        """Report, once per handler, that it keeps the node's other handlers waiting."""
        if self.reported is None:
            self.reported = set()
        if item.label not in self.reported and self.life is not None:
            self.reported.add(item.label)
            self.life.on_holding(item, seconds)


class _Mark:
    """An item that stands directly before the one whose waiting time is measured. Running it ends the measurement."""

    __slots__ = ("inbox", "since")
    label = "inbox age"

    def __init__(self, inbox: Inbox, since: float) -> None:
        self.inbox = inbox
        self.since = since

    def run(self) -> None:
        self.inbox.handled -= 1  # it does not count as an item
        self.inbox.waited(self)
