"""`Executor`: carries out the acts of `decide`, with tasks, timers and futures."""

from __future__ import annotations

import asyncio
import contextlib
import contextvars
from collections import deque
from collections.abc import Callable, Mapping
from itertools import count
from typing import Any, TypeAlias, TypeVarTuple

from actors.shield import see_through, shield
from actors.supervision import acts
from actors.supervision.acts import Act
from actors.supervision.child import Child
from actors.supervision.child_task import ChildTask, LeakedChild
from actors.supervision.children import Children
from actors.supervision.decide import decide
from actors.supervision.declarations import DynamicSupervisor, Supervisor
from actors.supervision.entry import Entry
from actors.supervision.errors import StartFailed
from actors.supervision.events import AllReady, Ended, Event, KillAsked, Ready, Request, StopAsked
from actors.supervision.peers import Life, Runtime
from actors.supervision.policy import Backoff
from actors.supervision.reasons import ExitReason
from actors.supervision.refs import ChildRef, Down
from actors.supervision.report import Context, Report

Args = TypeVarTuple("Args")

Caller: TypeAlias = asyncio.Future[ChildRef | None]
"""The future on which the caller of a request waits; its result is the live reference of a child, or None."""

Nest: TypeAlias = Callable[[Supervisor | DynamicSupervisor, tuple[str, ...], Callable[[], bool]], Life]
"""Makes the life of a supervisor below this one, of its declaration, its path, and a function that says whether it was killed."""

_serials = count(1)


class Executor:
    """Runs the children of one supervisor, once: it owns their tasks and the queue of events. `decide` says what follows from an event.

    It waits for no event. Starting a child makes a task, stopping a child asks that task to end, and each leads to a later event. So a
    supervisor handles requests at once, whatever its children are doing.

    Invariants:

    - Events are handled one at a time, in the order in which they come, in the context of the task that calls `run`.
    - An event is recorded in `Children` before `decide` is asked, and the acts are carried out in their order.
    - `_over` is done when no child is left, or with an error when an event could not be handled: `Children` may be wrong then.
    """

    def __init__(
        self,
        children: Children,
        runtime: Runtime,
        started: Callable[[], object],
        *,
        leaked: list[LeakedChild],
        killed: Callable[[], bool],
        nest: Nest,
        grace_of: Callable[[Life | None], float],
    ) -> None:
        self.loop = asyncio.get_running_loop()
        self.grace_of = grace_of
        self._children = children
        self._runtime = runtime
        self._started = started
        self._leaked = leaked
        self._killed = killed
        self._nest = nest
        self._context = contextvars.copy_context()
        self.of_ends = contextvars.copy_context()
        """The context in which the ends of tasks are noted: one for all, since each callback would copy the present one."""
        self._inbox: deque[tuple[Callable[..., None], tuple[object, ...]]] = deque()
        self._busy = False
        self._over: asyncio.Future[None] = self.loop.create_future()
        self._failure: Exception | None = None
        self._carry_out = self._carriers()
        self._for_caller = self._repliers()

    # ------------------------------------------------------------------ from the start to the end

    async def run(self) -> None:
        """See `RunningSupervisor.run`."""
        self.post(self._begin)
        try:
            await self._over
        except BaseException as error:
            if isinstance(error, asyncio.CancelledError):
                await self._outlast_cancellation()
            await self._kill_all()
            raise
        failure, self._failure = self._failure, None
        if failure is not None:
            raise failure

    async def _outlast_cancellation(self) -> None:
        """Stop all children in order after a cancellation that was no kill. Returns early if a kill comes meanwhile."""
        if self._killed() or self._children.phase == "over":
            return
        self._over = self.loop.create_future()
        self.stop("its task was canceled by somebody else")
        with shield():
            while not self._killed() and not self._over.done():
                with contextlib.suppress(asyncio.CancelledError):
                    await asyncio.wait([self._over])

    async def _kill_all(self) -> None:
        """Kill all children, and wait for their end even if canceled again: a child is abandoned after its grace time."""
        if self._children.phase == "over":
            return
        self._over = self.loop.create_future()
        self.post(self._handle, KillAsked())
        with contextlib.suppress(asyncio.CancelledError):
            await see_through(self._over)
        self._over.exception()  # mark a further error as retrieved; the first one is raised

    # ------------------------------------------------------------------ events

    def post(self, handler: Callable[[*Args], None], *args: *Args) -> None:
        """Queue an event, or a step that was delayed, and handle the queue unless that is under way already."""
        self._inbox.append((handler, args))
        if not self._busy:
            self._busy = True
            try:
                self._context.run(self._handle_all)
            finally:
                self._busy = False

    def stop(self, why: str) -> None:
        """Ask for the orderly end of the supervisor."""
        self.post(self._handle, StopAsked(why))

    def serve(self, request: Request) -> Caller:
        """Handle a request in its turn. The future is completed then, or by a later event."""
        caller: Caller = self.loop.create_future()
        self.post(self._serve, request, caller)
        return caller

    def _handle_all(self) -> None:
        while self._inbox:
            handler, args = self._inbox.popleft()
            try:
                handler(*args)
            except Exception as error:  # `Children` may be wrong now: end the run
                if not self._over.done():
                    self._over.set_exception(error)

    def _handle(self, event: Event) -> None:
        for act in decide(event, self._children):
            self._carry_out[type(act)](act)

    def _serve(self, request: Request, caller: Caller) -> None:
        try:
            answer = decide(request, self._children)
        except Exception as refusal:
            if not caller.done():
                caller.set_exception(refusal)
            return
        for act in answer:
            if (carry_out := self._for_caller.get(type(act))) is not None:
                carry_out(act, caller)
            else:
                self._carry_out[type(act)](act)

    def _handle_end(self, event: Ended) -> None:
        entry = self._children.entries[event.life.ref.path[-1]]
        life, entry.now = entry.now, None
        assert life is not None
        at_work = self._children.steps.current is entry  # its next start may be under way when the acts have been done
        answer = decide(event, self._children)
        entry.marked = False
        for act in answer:
            self._carry_out[type(act)](act)
        if life.watchers:
            down = Down(life.ref, event.reason)
            for watcher in list(life.watchers):
                watcher(down)
        if at_work:
            self._step_done(entry)

    # ------------------------------------------------------------------ acts

    def _confirm(self, act: acts.Confirm) -> None:
        entry = self._children.entries[act.child]
        life = entry.now
        assert life is not None
        life.ready = True
        entry.intent, entry.fresh, entry.ready_at = "", False, self.loop.time()
        self._report("progress", life, entry.ready_at)
        if answer := entry.take_answer():
            answer.set_result(life.ref)
        self._step_done(entry)

    def _drop(self, act: acts.Drop) -> None:
        entry = self._children.entries[act.child]
        entry.parked |= act.park
        self._let_go(entry, act.error)

    def _let_go(self, entry: Entry, error: Exception | None) -> None:
        entry.intent, entry.marked, entry.fresh = "", False, False
        if entry.timer is not None:
            entry.timer.cancel()
            entry.timer = None
        if answer := entry.take_answer():
            if error is None:
                answer.set_result(None)
            else:
                answer.set_exception(error)

    def _add(self, act: acts.Add, caller: Caller) -> None:
        children = self._children
        entry = children.add(act.spec, act.given, act.id)
        entry.fresh, entry.intent, entry.answer = True, "start", caller
        children.numbered = max(children.numbered, act.numbered)
        self._start_in_turn(entry)

    def _due(self, act: acts.Due, caller: Caller) -> None:
        entry = self._children.entries[act.child]
        entry.intent, entry.parked, entry.answer = "start", False, caller

    def _terminate(self, act: acts.Terminate, caller: Caller) -> None:
        entry = self._children.entries[act.child]
        entry.parked = True
        self._let_go(entry, act.error)
        assert entry.now is not None
        entry.now.watch(lambda _: _reply(caller))
        self._ask(entry, act.why)

    def _start(self, entry: Entry) -> None:
        entry.number += 1
        ref = ChildRef((*self._children.path, entry.id), entry.number, next(_serials))
        entry.now = ChildTask(self, entry, ref)

    def _start_in_turn(self, entry: Entry) -> None:
        if self._children.steps.busy:
            self._children.steps.add(entry)
            self._advance()
        else:
            self._start(entry)

    def _restart(self, act: acts.Restart) -> None:
        entry = self._children.entries[act.child]
        self._children.restart(entry, act.at, act.earlier)
        if delay := self._delay(entry.spec.backoff, act.earlier):
            entry.timer = self.loop.call_later(delay, self.post, self._retry, entry)
        else:
            self._start(entry)

    def _retry(self, entry: Entry) -> None:
        entry.timer = None
        self._start(entry)

    def _restart_group(self, act: acts.RestartGroup) -> None:
        children, entry = self._children, self._children.entries[act.child]
        children.restart(entry, act.at, act.earlier)
        delay = self._delay(entry.spec.backoff, act.earlier)
        children.plan(act.stops, act.due)
        if delay:
            children.steps.hold_for(entry, self.loop.call_later(delay, self.post, self._end_hold))
        self._advance()

    def _delay(self, backoff: Backoff | None, earlier: int | None) -> float:
        return 0.0 if backoff is None or earlier is None else backoff.delay(earlier, self._runtime.rng)

    def _ask(self, entry: Entry, why: str) -> None:
        entry.marked = False
        assert entry.now is not None
        entry.now.stop(why, entry.spec.stop)

    # ------------------------------------------------------------------ ordered work

    def _begin(self) -> None:
        self._children.begin()
        self._advance()

    def _advance(self) -> None:
        """Take the next step of the ordered work, unless one is under way."""
        children, steps = self._children, self._children.steps
        if steps.current is not None:
            return
        if (entry := steps.next_stop()) is not None:
            self._ask(entry, "shutdown")
        elif (entry := steps.next_start()) is not None:
            self._start(entry)
        elif children.phase == "starting" and not steps.busy:
            children.phase = "running"
            self._guard("started()", self._started)
            self._handle(AllReady())

    def _step_done(self, entry: Entry) -> None:
        if self._children.steps.current is entry:
            self._children.steps.current = None
            self._advance()

    def _end_hold(self) -> None:
        self._children.steps.release()
        self._advance()

    def _shut_down(self, act: acts.ShutDown) -> None:
        children = self._children
        self._failure = act.failure
        children.shut_down(act.why)
        for entry in children:
            error = None
            if entry.answer is not None:
                error = StartFailed((*children.path, entry.id), f"{children.name} is shutting down")
            self._let_go(entry, error)

    def _stop_next(self) -> None:
        if (entry := self._children.last_alive()) is not None:
            self._ask(entry, self._children.why)
        else:
            self._children.phase = "over"
            if not self._over.done():  # it is done if the task of `run` was canceled in the same turn
                self._over.set_result(None)

    # ------------------------------------------------------------------ called by the child tasks

    def make_life(self, task: ChildTask, /) -> Life:
        spec = task.entry.spec
        if isinstance(spec, Child) or (isinstance(spec, Supervisor) and spec.process):
            return self._runtime.life(task)
        return self._nest(spec, task.ref.path, lambda: task.killed is not None)

    def ready(self, task: ChildTask, /) -> None:
        self.post(self._handle, Ready(task))

    def ended(self, task: ChildTask, reason: ExitReason, /) -> None:
        at = self.loop.time() if task.asked is None else 0.0
        self.post(self._handle_end, Ended(task, reason, at))

    def abandoned(self, task: ChildTask, /) -> None:
        leaked = LeakedChild(task.ref, task.task)
        self._leaked.append(leaked)
        task.task.add_done_callback(lambda _: self._leaked.remove(leaked))

    # ------------------------------------------------------------------ telling the system

    def _report(
        self, context: Context, life: ChildTask, at: float, reason: ExitReason | None = None, note: str = ""
    ) -> None:
        report = Report(context, self._children.path, life.ref, life.entry.spec.restart, at, reason, note)
        self._guard("report()", self._runtime.report, report)

    def _tell_gone(self, act: acts.Gone) -> None:
        self._guard("gone()", self._runtime.gone, (*self._children.path, act.child), act.kept)

    def _guard(self, hook: str, call: Callable[[*Args], object], *args: *Args) -> None:
        """Call a function of the system. An exception goes to the loop's exception handler, so that the supervisor goes on."""
        try:
            call(*args)
        except Exception as error:
            message = f"supervisor {self._children.name}: {hook} raised; the supervisor goes on"
            self.loop.call_exception_handler({"message": message, "exception": error})

    # ------------------------------------------------------------------ kind of act -> the function that carries it out
    # Each is a table, made once per run, because a chain of `isinstance` tests would cost more than the rest of a start. The second
    # one has the acts that a caller waits for: only a request leads to them, so only `_serve` looks there, with the caller's future.

    def _carriers(self) -> Mapping[type[Act], Callable[[Any], object]]:
        children = self._children
        return {
            acts.Confirm: self._confirm,
            acts.Stop: lambda act: self._ask(children.entries[act.child], act.why),
            acts.StopNext: lambda act: self._stop_next(),
            acts.Start: lambda act: self._start_in_turn(children.entries[act.child]),
            acts.Drop: self._drop,
            acts.Forget: lambda act: children.entries.pop(act.child),
            acts.Gone: self._tell_gone,
            acts.Tell: lambda act: self._report(act.context, act.life, self.loop.time(), act.reason, act.note),
            acts.Restart: self._restart,
            acts.RestartGroup: self._restart_group,
            acts.EndHold: lambda act: self._end_hold(),
            acts.CloseWhenReady: lambda act: children.close_when_ready(act.end),
            acts.ShutDown: self._shut_down,
            acts.Kill: lambda act: alive(children.entries[act.child]).kill(),
            acts.Update: lambda act: setattr(children.entries[act.child], "spec", act.spec),
            acts.Adopt: lambda act: children.adopt(act.spec),
        }

    def _repliers(self) -> Mapping[type[Act], Callable[[Any, Caller], object]]:
        return {
            acts.Add: self._add,
            acts.Due: self._due,
            acts.Answer: lambda act, caller: _reply(caller),
            acts.Terminate: self._terminate,
        }


def alive(entry: Entry) -> ChildTask:
    """The present life of a child, which must have one."""
    assert entry.now is not None
    return entry.now


def _reply(caller: Caller) -> None:
    if not caller.done():
        caller.set_result(None)
