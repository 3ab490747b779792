"""What all of a running node stands on: who it is, its clock, log and randomness, its tasks, and what becomes of its errors."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from threading import get_ident
from typing import TYPE_CHECKING, Any

from actors.errors import Ended, NodeRestarting, NotRunning, ProgramExit, WrongThread, described
from actors.inbox.control import Failure, StopRequest, blame, in_task
from actors.inbox.inbox import Inbox
from actors.logs import ERROR, WARN
from actors.places import awaited_in, place_of
from actors.supervision.child_task import GRACE
from actors.supervision.reasons import Stop

if TYPE_CHECKING:
    from random import Random

    from actors.logs import NodeLog
    from actors.names.identity import Identity
    from actors.node.node import ErrorVerdict, Node
    from actors.runtime.mailbox import Mailbox
    from actors.system import System
    from actors.time.clock import Clock
    from actors.time.deadlines import Deadlines

__all__ = ["Ground"]


class Ground:
    """One incarnation of one node, without its endpoints."""

    __slots__ = (
        "_log",
        "_rng",
        "clock",
        "ended",
        "identity",
        "inbox",
        "incarnation",
        "mailbox",
        "node",
        "serving",
        "system",
        "tasks",
        "waits_for",
    )

    def __init__(self, system: System, node: Node, identity: Identity, mailbox: Mailbox) -> None:
        self.system = system
        self.clock: Clock = system.clock
        """The system's, until this incarnation uses simulated time."""
        self.node = node
        self.identity = identity
        self.mailbox = mailbox
        self.inbox: Inbox = mailbox.inbox
        mailbox.incarnation += 1
        self.incarnation = mailbox.incarnation
        self.tasks: dict[asyncio.Task[Any], None] = {}
        self.serving = False
        """Whether the start phase is over: what came meanwhile has waited for that."""
        self.ended = False
        self.waits_for: Any = None
        self._log: NodeLog | None = None
        self._rng: Random | None = None

    def __repr__(self) -> str:
        return f"<core of {self.fqn}, incarnation {self.incarnation}>"

    @property
    def fqn(self) -> str:
        return self.identity.fqn

    @property
    def thread(self) -> int:
        """The thread of the node's event loop."""
        return self.system.thread

    @property
    def deadlines(self) -> Deadlines:
        return self.system.deadlines

    @property
    def log(self) -> NodeLog:
        if self._log is None:
            self._log = self.system.node_log(self.fqn, self.incarnation, self)
        return self._log

    @property
    def rng(self) -> Random:
        if self._rng is None:
            self._rng = self.system.random(f"{self.fqn}#{self.incarnation}")
        return self._rng

    def now_ns(self) -> int:
        """What the node's clock shows, nanoseconds."""
        return self.clock.now_ns()

    def new_id(self) -> bytes:
        return self.system.new_id()

    def warn(self, event: str, **fields: object) -> None:
        self.log.write(WARN, event, fields)

    # -- errors --------------------------------------------------------------------------------------------------------------

    def service_failed(self, service: str, error: Exception) -> None:
        """An exception left a service handler; its caller hears of it, the node only if it says so."""
        self._answered(error, service, "service handler failed")

    def goal_failed(self, action: str, error: Exception) -> None:
        """An exception left an action body; its client hears of it, the node only if it says so."""
        self._answered(error, action, "goal failed")

    def _answered(self, error: Exception, handler: str, event: str) -> None:
        if isinstance(error, (Stop, ProgramExit)):
            self.fail(error, handler, decided=True)
            return
        self.log.write(
            ERROR, event, {"handler": handler, "error": described(error), "at": place_of(error)}, *self.system.new_error(error)
        )  # fmt: skip
        self.system.answered(error)
        try:
            verdict = self.node.on_error(error, handler)
        except BaseException as problem:  # the verdict on a verdict: nobody may wait for ever because of it
            label = f"on_error for {handler}"
            self.fail(blame(problem, label) or problem, label, decided=True)
            return
        if verdict == "fail":
            self.fail(error, handler, decided=True)

    def fail(self, error: BaseException, label: str, *, decided: bool = False) -> None:
        """Let `error` end this incarnation at its next turn, unless it is `decided` not yet and `on_error` says otherwise."""
        if self.ended:  # the next incarnation is not to blame
            fields = {"handler": label, "error": described(error), "at": place_of(error)}
            self.log.write(ERROR, "failed after the end of its node", fields, *self.system.new_error(error))
        else:
            self.inbox.put_control(Failure(error, label, decided=decided))

    def on_error(self, error: Exception, handler: str) -> ErrorVerdict:
        """An exception left a timer or topic handler: what the node says; `Stop` is no error but the node's own word."""
        current = self.inbox.current
        if isinstance(error, (Stop, ProgramExit)) or (isinstance(current, Failure) and current.decided):
            return "fail"
        verdict = self.node.on_error(error, handler)
        if verdict == "continue":
            self.mailbox.work_on()
        return verdict

    def absent(self) -> Exception:
        """What those hear who wait for an answer of this incarnation when it ends."""
        if self.system.stop_reason is not None:
            return NotRunning(f"{self.fqn} has stopped: {self.system.stop_reason}")
        return NodeRestarting(self.fqn, self.incarnation)

    # -- tasks --------------------------------------------------------------------------------------------------------------

    def spawn(self, work: Coroutine[Any, Any, Any], *, name: str = "") -> asyncio.Task[Any]:
        """Run `work` in a task that this node owns: its failure is the node's failure, the node's stop cancels it."""
        if self.ended:
            work.close()
            raise self._over()
        task = self.system.loop.create_task(work, name=f"{self.fqn} {name or getattr(work, '__qualname__', work)}")
        self.tasks[task] = None
        task.add_done_callback(self._task_ended)
        return task

    def own(self, work: Coroutine[Any, Any, None], *, name: str = "") -> asyncio.Task[None]:
        """As `spawn`, for code of the user's: whatever leaves it ends the node, and never the event loop."""
        if self.ended:
            work.close()
            raise self._over()
        name = name or getattr(work, "__qualname__", str(work))

        async def contained() -> None:
            try:
                await work
            except BaseException as error:
                failure = blame(error, f"{self.fqn} {name}")
                if failure is None or failure is error:
                    raise
                raise failure from error

        contained.__qualname__ = getattr(work, "__qualname__", name)  # reports name the user's code
        task = self.spawn(contained(), name=name)
        task.add_done_callback(lambda _: work.close())  # it may have been canceled before its first step
        return task

    def _task_ended(self, task: asyncio.Task[Any]) -> None:
        self.tasks.pop(task, None)
        if not task.cancelled() and (error := task.exception()) is not None:
            self.fail(error, task.get_name())

    def threadsafe(self, function: Callable[[], object]) -> None:
        """From any thread: call `function` in the loop; what it raises is this node's failure."""

        def call() -> None:
            try:
                function()
            except BaseException as error:
                self.fail(blame(error, "a call from another thread") or error, "a call from another thread")

        self.system.threadsafe(call)

    async def cancel_tasks(self) -> None:
        """Cancel what this node runs, newest first, and wait until it has ended."""
        current = asyncio.current_task()
        while tasks := [task for task in reversed(self.tasks) if task is not current]:
            for task in tasks:
                task.cancel()
                await asyncio.wait([task])

    async def tasks_ended(self) -> None:
        """Wait until what was canceled has ended; the supervisor's patience is the limit of it. What does not end is named."""
        patience: float | None = GRACE / 2
        while in_task() and self.tasks:
            try:
                done, _ = await asyncio.wait(list(self.tasks), timeout=patience)
            except asyncio.CancelledError:
                continue
            if not done:
                patience = None
                refusing = [f"{task.get_name()} (waits at {awaited_in(task) or '?'})" for task in self.tasks]
                self.log.error(
                    "refuses to be canceled", tasks=", ".join(refusing),
                    remedy="let CancelledError out of what it catches, or raise it again after the clean-up",
                )  # fmt: skip

    # -- limits --------------------------------------------------------------------------------------------------------------

    def check_thread(self) -> None:
        """Refuse a foreign thread."""
        if get_ident() != self.system.thread:
            raise WrongThread(
                f"{self.fqn} was used from a foreign thread: use node.threadsafe(function, *arguments), and for what is awaited "
                "blocking.open_node(name, system=system)"
            )

    def check_use(self) -> None:
        """Refuse a foreign thread, and what comes after the end of this incarnation."""
        self.check_thread()
        if self.ended:
            raise self._over()

    def _over(self) -> Ended:
        return Ended(f"{self.fqn}, incarnation {self.incarnation}, has ended: ask its successor, if there is one")

    def request_stop(self, reason: str) -> None:
        """Have the inbox raise `StopServing` when the present handler has ended."""
        self.inbox.put_control(StopRequest(reason))
