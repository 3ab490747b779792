"""`ReplayingBoundary`: the boundary of a node, or a subtree, that is replayed. What it sends is compared, what it is given comes from the recording."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable, Coroutine, Iterator
from contextvars import Context
from typing import TYPE_CHECKING, Any, TypeVar

from actors.inbox.boundary import BOUNDARY
from actors.replay.boundary import JournalBoundary
from actors.replay.comparison import ABSENT, Difference, first_difference
from actors.replay.recording import APART, BACK, NO_TIME, SENT, WITHIN, Entry, Recording, comes_in

if TYPE_CHECKING:
    from actors.graph.servers import S, ServerEntry
    from actors.replay.debugger import Break
    from actors.replay.journaled_loop import Callback
    from actors.replay.stubs import StubPublisher
    from actors.topics.peers import PublisherPeer, SubscriptionPeer, Target

T = TypeVar("T")

GRAPH = frozenset({"publisher", "subscription", "server"})
"""What was there before a step met it."""

AWAITED = frozenset({"call", "goal", "cancel", "offload"})
"""What a member sends and awaits."""


class ReplayingBoundary(JournalBoundary):
    """Gives its members what their recording holds, and compares what they send. It is driven by `actors.replay.driver.Driver`.

    Invariants:

    - `at` is the place in the recording: everything before it has been given, or was compared.
    - While `diverged` is false, the members do what they did in the recording, step by step. Once it is true, because their code schedules
      or reads otherwise than in the recording, their callbacks run as they are due, and what they send is compared by name and number only.
    - `planned` holds the callbacks of the members that have not run, by their number.
    - `differences` are those of what passes the boundary, `inner` those of what passes between members; each has the first of its name.
    """

    def __init__(self, recording: Recording, pause: Break | None, limit: int) -> None:
        super().__init__()
        self.recording = recording
        self.at = 0
        self.now = recording.start.origin
        """The time, seconds of the event loop's clock."""
        self.diverged = False
        self.over = False
        self.planned: dict[int, asyncio.Handle] = {}
        self.awaited: dict[int, asyncio.Future[Any]] = {}
        self.channels: dict[tuple[str, str, int], asyncio.Future[Any]] = {}
        """What is awaited, by kind, name and place among those of its name."""
        self.differences: list[Difference] = []
        self.inner: list[Difference] = []
        self.sent: Counter[tuple[str, str]] = Counter()
        self.apply: Callable[[tuple[object, ...]], None] = _nowhere
        """Gives the node what came in."""
        self._pause = pause
        self._limit = limit
        self._ahead: set[int] = set()
        """The places in the recording, behind `at`, of what was given in advance."""
        self._asked: Counter[tuple[str, str]] = Counter()
        self._expected = _by_name(recording)
        self._last: tuple[str, str] = ("", "")
        self._joining = -1
        """The number of the subscription whose target the graph has asked for last: a late joiner is asked for just before it catches up."""

    # -- what passes ---------------------------------------------------------------------------------------------------------

    def enter(self, kind: str, details: tuple[object, ...], function: Callable[..., T], *arguments: object) -> T:
        token = BOUNDARY.set(self)
        try:
            return function(*arguments)
        finally:
            BOUNDARY.reset(token)

    def leave(
        self, kind: str, name: str, value: object, function: Callable[..., T], *arguments: object, inner: bool = False
    ) -> T:
        self.send(kind, name, value, inner=inner)
        token = BOUNDARY.set(None)
        try:
            answer = function(*arguments)
        finally:
            BOUNDARY.reset(token)
        self._come_back()
        self._last = (kind, name)
        self.expect_if_future(answer)
        return answer

    def send(self, kind: str, name: str, value: object, *, inner: bool = False) -> None:
        number, self._last = self.sent[kind, name], (kind, name)
        self.sent[kind, name] += 1
        if self.over:
            return
        if self._pause is not None and self._pause.at(name, number):
            self._pause.stop()
        self._come_back()
        if not self.diverged:
            entry = self.entry()
            if isinstance(entry, tuple) and entry[0] in SENT and entry[1:3] == (kind, name):
                self.at += 1
            elif not self.differences:
                self._unlike(kind, name, entry, value)
        expected = self._expected.get((kind, name), [])
        if number >= len(expected):
            self._differs(kind, name, number, "", ABSENT, value, inner=inner)
            return
        within, recorded = expected[number]
        if (found := first_difference(recorded, value)) is not None:
            self._differs(kind, name, number, *found, inner=within)

    def _unlike(self, kind: str, name: str, entry: Entry | None, value: object) -> None:
        """The recording did something else here."""
        if isinstance(entry, tuple) and entry[0] in SENT:
            self._missing(entry, f"{kind} {name}: {value!r}")
        self.diverge()

    def _missing(self, entry: tuple[Any, ...], replayed: object) -> None:
        """The recording sends something at a place where `replayed` was done."""
        tag, kind, name, value = entry
        self._differs(kind, name, self.sent[kind, name], "", value, replayed, inner=tag == "inner")

    def _differs(
        self, kind: str, name: str, number: int, field: str, recorded: object, replayed: object, *, inner: bool
    ) -> None:
        found = self.inner if inner else self.differences
        if any((one.kind, one.name) == (kind, name) for one in found):
            return
        time = self.now - self.recording.start.origin
        found.append(Difference(kind, name, number, time, field, recorded, replayed))
        if len(self.differences) >= self._limit:
            self.over = True

    def diverge(self) -> None:
        """The members' code has left the recording."""
        self.diverged = True

    def end(self) -> None:
        """Compare what was sent with the whole recording, at its end."""
        for (kind, name), values in self._expected.items():
            number = self.sent[kind, name]
            if number < len(values):
                inner, recorded = values[number]
                self._differs(kind, name, number, "", recorded, ABSENT, inner=inner)

    def missed(self, entry: tuple[object, ...]) -> None:
        """The recording sends something that is not sent now."""
        self._missing(entry, ABSENT)
        self.diverge()

    def let_go(self, loop: asyncio.AbstractEventLoop) -> None:
        """Let the loop run what the node's code has still to do, so that it can be ended."""
        self.over = True
        for handle in self.planned.values():
            if not handle.cancelled() and not isinstance(handle, asyncio.TimerHandle):
                loop.call_soon(run_handle, handle)

    # -- what others do at the node's own call -------------------------------------------------------------------------------

    def entry(self) -> Entry | None:
        """The entry at the present place, behind what was given in advance; None at the end."""
        entries = self.recording.entries
        while self.at in self._ahead:
            self._ahead.discard(self.at)
            self.at += 1
        return entries[self.at] if self.at < len(entries) else None

    def _come_back(self) -> None:
        """Give the node what others did to it while its code was out."""
        while not (self.diverged or self.over):
            entry = self.entry()
            if not comes_in(entry):
                return
            done = entry[0] == "done" and entry[2] == WITHIN
            if not (entry[2] == BACK or done) or (entry[0] == "done" and entry[3] not in self.awaited):
                return
            self.at += 1
            self.apply(entry)

    def catch_up(self, publisher: StubPublisher, target: Target) -> None:
        """Give a subscription of the node the messages that were kept for it."""
        while isinstance(entry := self.entry(), tuple) and entry[0] == "deliver" and entry[2] == WITHIN:
            if entry[3:5] != (self._joining, publisher.number):
                return
            self.at += 1
            publisher.sent(entry[5])
            target(entry[5])

    def server_sought(self, entry: ServerEntry[S]) -> None:
        self._come_back()

    def look_ahead(self) -> None:
        """Put into the graph what the step that begins now will find there."""
        for place, entry, sent in self._step_entries():
            met = entry[2] == WITHIN or not sent  # what others do at something that the node sends comes back with that
            if entry[0] in GRAPH and met and place not in self._ahead:
                self._ahead.add(place)
                self.apply(entry)

    def _step_entries(self) -> Iterator[tuple[int, tuple[object, ...], bool]]:
        """What comes in during the step that begins now, with its place in the recording, and whether the node has sent something before."""
        entries, sent = self.recording.entries, False
        for place in range(self.at, len(entries)):
            entry = entries[place]
            if not isinstance(entry, tuple) or entry[0] in NO_TIME:
                sent = sent or isinstance(entry, tuple)
                continue
            if entry[0] in ("step", "start") or entry[2] == APART:
                return
            yield place, entry, sent

    def compute(self, function: Callable[..., T], arguments: tuple[object, ...]) -> T:
        entry = None if self.diverged else self.entry()
        if isinstance(entry, tuple) and entry[0] == "result":
            self.at += 1
            result: T = entry[1]
            return result
        return function(*arguments)

    def elsewhere(self, name: str, work: Callable[[], Coroutine[object, None, object]]) -> asyncio.Future[object]:
        return self.in_thread(asyncio.get_running_loop().create_future, name)

    def in_thread(self, start: Callable[[], asyncio.Future[T]], name: str) -> asyncio.Future[T]:
        self.send("offload", name, None)
        future = asyncio.get_running_loop().create_future()
        self.expect(future)
        return future

    def expected(self, future: asyncio.Future[T], number: int) -> None:
        self.awaited[number] = future
        kind, name = self._last
        self.channels[kind, name, self._asked[kind, name]] = future
        self._asked[kind, name] += 1
        self._come_back()

    def delivering(self, publisher: PublisherPeer, subscription: SubscriptionPeer, target: Target) -> Target:
        if self.owns(publisher):
            return self.to_itself(target)
        self._joining = self.number_of(subscription)
        return target

    def uses(self, entry: object) -> None:
        """Do nothing: the recording knows who serves it."""

    # -- the event loop ------------------------------------------------------------------------------------------------------

    def plan(
        self, plain: Callable[..., asyncio.Handle], when: float | None, number: int, callback: Callback, arguments: tuple[object, ...],
        context: Context | None,
    ) -> asyncio.Handle:  # fmt: skip
        if self.over:
            return plain(callback, *arguments, context=context)
        loop = asyncio.get_running_loop()
        handle = (
            asyncio.Handle(callback, arguments, loop, context)
            if when is None
            else asyncio.TimerHandle(when, callback, arguments, loop, context)
        )
        self.planned[number] = handle
        return handle

    def read(self, clock: Callable[[], float]) -> float:
        if not (self.diverged or self.over):
            self._come_back()
            entry = self.entry()
            if entry is None or isinstance(entry, tuple):
                self.diverge()
            else:
                self.at += 1
                self.now = entry
        return clock() if self.over else self.now


def _by_name(recording: Recording) -> dict[tuple[str, str], list[tuple[bool, object]]]:
    """What was sent in the recording, by kind and name: each with whether it was sent to members alone."""
    sent: dict[tuple[str, str], list[tuple[bool, object]]] = {}
    for entry in recording.entries:
        if isinstance(entry, tuple) and entry[0] in SENT:
            sent.setdefault((entry[1], entry[2]), []).append((entry[0] == "inner", entry[3]))
    return sent


def run_handle(handle: asyncio.Handle) -> None:
    """Run a callback as the event loop does: an error goes to its exception handler."""
    if not handle.cancelled():
        handle._run()  # pyright: ignore[reportPrivateUsage]


def _nowhere(entry: tuple[object, ...]) -> None:
    """Take nothing in: there is no node yet."""
