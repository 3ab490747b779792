"""Finding handlers that block the event loop: which handler, for how long, on which line, and which timer was late because of it.

A handler that computes, sleeps or reads without an `await` delays every node of its process. There are two ways to find it:

- A thread checks the loop five times a second. If the loop does not turn for half a second while a task runs, the thread notes the node,
  the handler and the line. When the loop turns again, one warning is logged.
- A shorter block is reported if it has delayed a timer of any node by a period or more. The handler to report is one that ran without an
  await for at least that period (and 10 ms). Either its time has just been measured, which is done for the first items of every node and
  for some of the later ones, or the thread has seen it. If a delay has no known cause, the thread checks every 5 ms for five seconds.

Each handler is reported once. A handler that awaits does not block, however long it takes. On the virtual clock handlers take no time, so
nothing is watched there.

Time for which the loop's thread waited for a processor, and for which the process was stopped, is nobody's (on Linux, which tells it). A timer
that was late by that is reported as what it is: one line says how much of a core the process got.
"""

from __future__ import annotations

import asyncio
import math
from collections import deque
from threading import Event, Thread, get_native_id
from time import monotonic, process_time
from typing import TYPE_CHECKING, Any, NamedTuple

from actors.inbox.inbox import HOLDING_SECONDS, STEP_SECONDS
from actors.places import line_of
from actors.time.lockstep import lockstep_of
from actors.time.processor import Processor

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.inbox.inbox import Inbox
    from actors.runtime.system_log import SystemLog

POLL_SECONDS = 0.2
"""Time between two checks of the thread, seconds."""
CLOSE_POLL = 0.005
"""Time between two checks while the thread checks closely, seconds. Each check wakes the event loop once."""
CLOSE_FOR, CLOSE_REST = 5.0, 25.0
"""How long the thread checks closely, and how long it does not do so again afterwards, seconds."""

SAMPLES = 10
"""How many of the newest checks are remembered with the time that the loop's thread had waited by then."""
STOPPED = 0.5
"""A check that is later than this, in seconds, may come after a stop of the process."""
STARVED_FOR = 2.0
"""For how long it is measured how much of a core a process gets whose timers are late, seconds."""
STARVED = 0.25
"""It is told if the loop's thread waited for at least this share of that time."""


class Runner(NamedTuple):
    """The node that a task runs, or that has an inbox: its full name, the number of its life, and its inbox."""

    node: str
    incarnation: int
    inbox: Inbox


class _Block(NamedTuple):
    """A step of a task during which the event loop did not turn; times are seconds on the monotonic clock."""

    node: str
    incarnation: int
    handler: str
    line: str
    begun: float
    ended: float


class StallWatch:
    """Watches the event loop of one system on the real clock. A check costs the loop one empty callback, and only while a task runs.

    Invariants:

    - While `_asked` is true, one call of `turned` is on its way to the loop.
    - The thread sets `caught`, and only while it is None; the loop takes it in `turned`.
    - `_harm` and `_telling` are set and cleared together, in the loop.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        thread: int,
        system_log: SystemLog,
        runner_of: Callable[[asyncio.Task[object] | Inbox], Runner | None],
    ) -> None:
        self._loop = loop
        self._loop_thread = thread
        self._system_log = system_log
        self._runner_of = runner_of
        self._end = Event()
        self._asked = False
        """Whether `turned` has been submitted to the loop and has not run yet."""
        self._suspect: tuple[object, int] = (None, 0)
        """What ran at the last check: the task, and the number of items that its inbox had run."""
        self._since = 0.0
        """When `_suspect` was first seen, seconds on the monotonic clock."""
        self._close_until = self._rested = -math.inf
        self._limit = HOLDING_SECONDS
        """The least duration of a block that is noted while the thread checks closely, seconds."""
        self._reported: set[tuple[str, str]] = set()
        self._block: _Block | None = None
        """The newest step that is known to have blocked the loop."""
        self._harm: tuple[_Block, int, str] | None = None
        """The next report: the block, and of the timer that was delayed worst the number of ticks lost and the node."""
        self._telling: asyncio.TimerHandle | None = None
        self.processor = Processor(f"self/task/{get_native_id()}")
        """Of the thread of the loop, in which this is made."""
        self._stood = 0.0
        """For how long the process was stopped, or the machine slept, so far, seconds."""
        self._samples = deque([(monotonic(), self.processor.share().waited)], maxlen=SAMPLES)
        """When it was checked for how long the thread had waited; the checks are `POLL_SECONDS` apart at least."""
        self._starving: tuple[float, float, float] | None = None
        """When a measurement of the share of a core began, with the processor time of the process and the waiting time by then."""
        self._starved: asyncio.TimerHandle | None = None
        self._told_starved = False
        self.caught: tuple[Runner | None, str, str, float] | None = None
        """What blocks the loop now: node, handler, line, and the time of the check that found it, on the monotonic clock."""
        self._thread = Thread(target=self._run, name="robactor stall watch", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread, and log a report that is still to come."""
        self._end.set()
        self._thread.join()
        self.tell_harm()
        if self._starved is not None:
            self._starved.cancel()
        self.processor.close()

    # -- in the thread ------------------------------------------------------------------------------------------------------

    def _run(self) -> None:
        before, share = monotonic(), self.processor.share()
        while not self._end.wait(poll := CLOSE_POLL if monotonic() < self._close_until else POLL_SECONDS):
            now, last = monotonic(), share
            share = self.processor.share()
            if now - before - poll > STOPPED:
                self._stood += max(0.0, now - before - poll - (share.ran - last.ran) - (share.waited - last.waited))
            if now - self._samples[-1][0] >= POLL_SECONDS:
                self._samples.append((now, share.waited + self._stood))
            self.look(now)
            before = now

    def look(self, now: float) -> None:
        """Check the loop once, from the thread, at `now` seconds on the monotonic clock."""
        task = asyncio.current_task(self._loop)
        if task is None or self.caught is not None:
            return
        runner = self._runner_of(task)
        suspect = (task, runner.inbox.handled if runner is not None else 0)
        if not self._asked or suspect != self._suspect:
            self._suspect, self._since = suspect, now
            self._ask()
        elif now - self._since >= (
            self._limit if now < self._close_until else HOLDING_SECONDS
        ) and not self._waited_most(now - self._since, now):
            self.caught = (
                runner,
                work_of(None if runner is None else runner.inbox, task),
                line_of(self._loop_thread),
                now,
            )

    def waited(self, since: float) -> float:
        """For how long the loop's thread has waited for a processor, or was stopped, since `since` or some tenths of a second before."""
        samples = list(self._samples)
        by_then = next((waited for at, waited in reversed(samples) if at <= since), samples[0][1])
        return self.processor.share().waited + self._stood - by_then

    def _waited_most(self, seconds: float, now: float) -> bool:
        return self.waited(now - seconds) >= 0.5 * seconds

    def _ask(self) -> None:
        if self._asked:
            return
        self._asked = True
        try:
            self._loop.call_soon_threadsafe(self.turned)
        except RuntimeError:  # the loop has been closed although the system was not stopped
            self._end.set()

    # -- in the loop --------------------------------------------------------------------------------------------------------

    def turned(self) -> None:
        """Called by the loop when it turns: if a block was found meanwhile, note it, and report it if it was long."""
        self._asked = False
        caught, self.caught = self.caught, None
        if caught is None:
            return
        runner, handler, line, seen = caught
        node, life = ("", 0) if runner is None else (runner.node, runner.incarnation)
        self._block = block = _Block(node, life, handler, line, self._since, max(seen, monotonic()))
        if block.ended - block.begun >= HOLDING_SECONDS:
            self._tell(block, {})

    def ran(self, inbox: Inbox, handler: str, seconds: float) -> None:
        """Note that an item of this inbox has just run for `seconds` without an await."""
        now = monotonic()
        if self._waited_most(seconds, now):
            return
        if (runner := self._runner_of(inbox)) is not None:
            self._block = _Block(runner.node, runner.incarnation, handler, "", now - seconds, now)

    def delayed(self, node: str, period: float, seconds: float, lost: int) -> None:
        """Find the cause of a tick that is `seconds` late, a period or more, and cost `lost` ticks; it is not the timer's own node."""
        now, block = monotonic(), self._block
        if block is None or block.ended < now - seconds or block.ended - block.begun < max(period, STEP_SECONDS):
            if self._waited_most(seconds, now):
                self._measure(now)
            else:
                self._look_closely(now, period)
        elif self._harm is None:
            self._harm = (block, lost, node)
            self._telling = self._loop.call_later(STEP_SECONDS, self.tell_harm)
        elif lost > self._harm[1]:
            self._harm = (block, lost, node)

    def _measure(self, now: float) -> None:
        """Measure how much of a core the process gets, unless that has been told. A simulated world that is slow is told by who runs it."""
        if self._starving is None and not self._told_starved and lockstep_of(self._loop) is None:
            self._starving = (now, process_time(), self.waited(now))
            self._starved = self._loop.call_later(STARVED_FOR, self.tell_starved)

    def tell_starved(self) -> None:
        """Log how much of a core the process got, if that was too little, once."""
        assert self._starving is not None
        (begun, ran, waited), self._starving = self._starving, None
        seconds = monotonic() - begun
        waited = self.waited(begun) - waited
        if waited >= STARVED * seconds:
            self._told_starved = True
            self._system_log.log("system", 1).warning(
                f"this process got {(process_time() - ran) / seconds:.0%} of a core: its timers are late",
                waited_for_a_processor=f"{waited / seconds:.0%} of the time",
                remedy="end other programs, give it more of the machine, or ask less of it",
            )

    def _look_closely(self, now: float, period: float) -> None:
        if now >= self._rested:
            self._close_until = now + CLOSE_FOR
            self._rested = self._close_until + CLOSE_REST
            self._limit = HOLDING_SECONDS
        self._limit = min(self._limit, max(period, STEP_SECONDS))

    def tell_harm(self) -> None:
        """Log the report that is due, if there is one."""
        if self._harm is None or self._telling is None:
            return
        block, lost, node = self._harm
        self._telling.cancel()
        self._harm = self._telling = None
        self._tell(block, {"delayed": node, "ticks_lost": lost})

    def _tell(self, block: _Block, harm: dict[str, Any]) -> None:
        if (block.node, block.handler) in self._reported:
            return
        self._reported.add((block.node, block.handler))
        log = self._system_log.log(block.node, block.incarnation) if block.node else self._system_log.log("system", 1)
        fields: dict[str, Any] = {"at": block.line, **harm} if block.line else harm
        log.warning(
            f"handler blocked the event loop for {block.ended - block.begun:.2f} s", handler=block.handler, **fields,
            remedy="await self.offload(function, ...) what computes or waits; await self.clock.sleep(s) instead of time.sleep(s)",
        )  # fmt: skip


def work_of(inbox: Inbox | None, task: asyncio.Task[object]) -> str:
    """The label of the handler that runs in `task`, or the task's name if it runs no item of an inbox. May be called from any thread."""
    item = inbox.current if inbox is not None and inbox.task is task else None
    return task.get_name() if item is None else item.label
