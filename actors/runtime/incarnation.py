"""`Incarnation`: one life of one node, from its making to its clean-up.

A `Node` object holds the user's code and state; its incarnation runs it. A start makes the node object, opens its endpoints, so that messages
are queued from the first moment on, restores what the last life left, and calls `on_start`. Timers and background tasks begin after that. All
of it runs in the one task that then serves the inbox. To keep a start cheap, it makes only what every node needs: log, random numbers,
parameter store, timers and ROS time are made at their first use.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from functools import partial
from threading import get_ident
from time import monotonic
from typing import TYPE_CHECKING, Any, Literal, NoReturn, TypeAlias, TypeVar
from weakref import proxy

from actors.checks import factory_name
from actors.errors import (
    CallCycle,
    DeclarationError,
    Ended,
    NodeRestarting,
    NotRunning,
    NotStarted,
    ProgramExit,
    WrongThread,
)
from actors.inbox.boundary import BOUNDARY, asked, outside
from actors.inbox.control import Failure, StopRequest, StopServing, blame, stray_cancel
from actors.logs import ERROR, WARN
from actors.parameters.declare import INTROSPECTION, LOGGER_SERVICE, OPTIONAL_PARAMETERS
from actors.parameters.hooks import attach_hooks
from actors.parameters.rates import guard_rates
from actors.places import awaited_in, error_fields
from actors.runtime.endpoints import Endpoints
from actors.runtime.members import check_assigned
from actors.runtime.node import Node
from actors.runtime.tasks import Tasks, contained
from actors.runtime.timers import NodeTimer, Timers
from actors.services.peers import caller_id
from actors.supervision.reasons import Failed, Killed, Skip, Stop, Stopped

if TYPE_CHECKING:
    from random import Random

    from actors.inbox.inbox import Item
    from actors.logs import NodeLog
    from actors.parameters import ParameterChange, ParameterStore
    from actors.runtime.node import ErrorVerdict
    from actors.runtime.runtime import NodeRecord, Runtime
    from actors.runtime.sim_time import SimTime
    from actors.services.peers import Awaited, CallId
    from actors.supervision.child import Child
    from actors.supervision.child_task import ChildTask
    from actors.supervision.reasons import ExitReason
    from actors.time.clock import Clock
    from actors.time.deadlines import Deadlines

T = TypeVar("T")

Phase: TypeAlias = Literal["new", "on_start", "begin", "running"]


class Incarnation:
    """One life of one node. For its supervisor it is a `Life`; for endpoints it is the node that they belong to.

    Its parts: `endpoints`, `tasks`, `timers` and `ros_time()`, each made at its first use.

    Invariants:

    - It is the `life` of its record from its making until `release`. `release` sets `ended`, once and for good: from then on it publishes
      nothing, receives nothing and creates no task.
    - `phase` only moves forwards: new, on_start, begin (the framework's own part of the start), running. It stays as it is in the clean-up.
    - `serving` turns true once, after the node has become ready. Concurrent handlers begin to run then.
    - The failure of one of `tasks` ends the incarnation, and an orderly clean-up ends all of them.
    - `asked` is the reason for which the supervisor asked for the end; None before it asks.
    """

    __slots__ = (
        "_child", "_ids", "_log", "_parameters", "_rng", "_tasks", "_timers", "asked", "clock", "declarations", "ended", "identity", "inbox",
        "incarnation", "node", "opened", "phase", "record", "runtime", "serving", "sim", "waits_for",
    )  # fmt: skip

    def __init__(self, runtime: Runtime, record: NodeRecord, node: Node) -> None:
        if record.life is not None:  # it refused a kill and was abandoned: it must not keep its endpoints
            record.life.release()
        record.incarnation += 1
        self.runtime = runtime
        self.record = record
        self.node = node
        self.identity = record.identity
        self.inbox = record.inbox
        self.incarnation = record.incarnation
        self.declarations = type(node).declarations
        self.clock: Clock = runtime.clock
        """The system's clock, until this incarnation uses ROS time; from then on its own `SimClock`."""
        self.phase: Phase = "new"
        self.asked: str | None = None
        self.serving = self.ended = False
        self.waits_for: Awaited | None = None
        self._child, record.task = record.task, None
        self.opened: Endpoints | None = None
        """Its `endpoints`, once it has had any."""
        self._tasks: Tasks | None = None
        self._timers: Timers | None = None
        self.sim: SimTime | None = None
        self._parameters: ParameterStore | None = None
        self._log: NodeLog | None = None
        self._rng: Random | None = None
        self._ids: Callable[[], bytes] | None = None
        node.__machinery__ = self
        record.life = self  # last: another thread may look at it from now on

    def __repr__(self) -> str:
        return f"<incarnation {self.incarnation} of {self.fqn}>"

    # -- the life, for its supervisor ---------------------------------------------------------------------------------------

    async def run(self, started: Callable[[], None]) -> None:
        """Run the whole life; call `started` when the node is ready. Returns after an orderly end that the supervisor asked for.

        Raises `Stop` when the node itself asked for its end, and the error when it fails. `SystemExit` and `KeyboardInterrupt` of the node's
        code stop the whole system; the node then ends with `ProgramExit`.
        """
        try:
            try:
                await self._start()
                self.phase = "running"
                started()
                del started  # the coroutine would keep it as long as the node lives
                self.runtime.ready(self)
                if self.asked is not None:
                    self.request_stop(self.asked)
                self.serving = True
                if self.opened is not None:
                    self.opened.serve_concurrently()
                await self.inbox.serve(self)
            except BaseException as error:
                try:
                    if not await self._end(error):
                        raise
                except (SystemExit, KeyboardInterrupt) as request:
                    # Before `release`, so that no caller is answered with `NodeRestarting`.
                    raise _exit(self.runtime, self.fqn, request) from request
            finally:
                killed = bool(self._tasks) and self.killed
                if not self.ended:  # else it was abandoned and released already, and another incarnation may run
                    self.release()
                    self.runtime.ended(self)
                if killed:
                    await self.tasks.outlast_kill(self.log)
                # These refer to this life, too: without the cycles an ended node is freed at once, and not by the garbage collector.
                self.node = proxy(self.node)
                self._tasks = self._tasks or None
                self.opened = self._timers = self._log = None
                if self._parameters is not None:
                    self._parameters.on_event = None
        except (asyncio.CancelledError, ProgramExit, SystemExit, KeyboardInterrupt) as error:
            _raise_in_words(self.runtime, self.fqn, self.phase, error)

    async def _end(self, error: BaseException) -> bool:
        """Clean up, because `error` has ended the start phase or the service. Returns whether that was the orderly end that was asked for.

        Raises another error if that is what the end counts as.
        """
        if isinstance(error, StopServing):
            try:
                await self._clean_up(Stopped(error.reason))
            except asyncio.CancelledError:
                if not self.killed:  # for example `asyncio.run` at its end; a kill is reported anyway
                    self.log.error(
                        "clean-up cut short", after=str(error), because="its task was canceled by somebody else"
                    )
                raise
            if self.asked is None:
                raise Stop(error.reason) from None
            return True
        if isinstance(error, Stop):
            await self._clean_up(Stopped(error.reason))
        elif isinstance(error, asyncio.CancelledError):
            await self._canceled(error)
        else:
            await self._failed(error)
        return False

    async def _start(self) -> None:
        """Run the start phase. Calls from it count as calls from a handler, so that a call of the node to itself is refused at once."""
        node, record = self.node, self.record
        self.inbox.task = asyncio.current_task()
        self.runtime.starts.begin(self)
        self._open_endpoints()
        if record.saved is not None:
            node.resume(record.saved)
        self.phase = "on_start"
        await node.on_start()
        if not self.declarations.clean:
            check_assigned(node)
            self.declarations.clean = True
        self.phase = "begin"
        await node.__begin__()
        if self.identity.overrides and type(node) is not Node:  # a node of a script may declare parameters later
            from actors.parameters.unknown import refuse_unknown

            refuse_unknown(self.parameters, type(node).__name__, self.identity.optional)
        if self.incarnation > 1 and (lost := record.sweep(self)):
            self.runtime.lost(self.fqn, lost)
        if not node.managed:
            self.start_timers()
        for background in self.declarations.backgrounds:
            self.own(getattr(node, background.attribute)(), name=background.attribute)

    def _open_endpoints(self) -> None:
        """Open all endpoints that the node's class declares.

        A setting that nobody has made costs a start nothing: without overrides and observers the parameters are opened at their first use.
        """
        declarations, overrides = self.declarations, self.identity.overrides
        announced = declarations.parameters and (overrides or self.runtime.observers.parameters)
        if announced and declarations.overridable:
            self.open_parameters(announce=True)
        endpoints = self.endpoints if declarations.endpoints else None
        if endpoints is not None:
            endpoints.open_published()
        if announced and not declarations.overridable:
            self.open_parameters(announce=True)
        if "use_sim_time" in overrides and self.parameters.value("use_sim_time"):
            self.ros_time().use(True)
        if endpoints is not None:
            endpoints.open_declared()

    async def _failed(self, error: BaseException) -> None:
        """Clean up after an error; raise the failure that it means if that is another error."""
        failure = blame(error, f"{self.identity.fqn} {self.phase}")
        child = self.child
        if failure is None or child is None or child.task is not asyncio.current_task():
            return  # the task is being ended and cannot await, or the incarnation was abandoned
        if isinstance(failure, Skip) and self.phase != "running":
            await self.tasks.cancel()
        else:
            if isinstance(failure, ProgramExit):  # before the clean-up, so that callers are answered with `NotRunning`
                _exit(self.runtime, self.fqn, failure)
            await self._clean_up_after(Failed(failure))
        if failure is not error:
            raise failure from error

    async def _canceled(self, error: asyncio.CancelledError) -> None:
        """Clean up after a cancellation that is no kill: a start is broken off, or code outside of the framework canceled the task."""
        if self.killed:
            return
        if self.phase != "running" and self.asked is not None:
            await self._clean_up_after(Stopped(self.asked))
        else:
            stray = stray_cancel(error, f"{self.fqn} {self.phase}")
            await self._clean_up_after(Killed(None) if stray is None else Failed(stray))

    async def _clean_up(self, reason: ExitReason) -> None:
        """Clean up: end the goals, which may still communicate, then the tasks, and then call `on_stop` if the start phase had begun."""
        node, record = self.node, self.record
        self.inbox.task = asyncio.current_task()
        if self.asked is None and (child := self.child) is not None:  # else its end has a limit already
            token = BOUNDARY.set(None)
            try:
                child.bound()
            finally:
                BOUNDARY.reset(token)
        cleaning: list[asyncio.Task[None]] = []
        for action in record.actions.values():
            cleaning += action.stop(f"{self.fqn} stops: {reason}")
        if cleaning:
            await asyncio.wait(cleaning)
        if self._tasks:
            await self._tasks.cancel()
        try:
            if self.phase in ("begin", "running"):
                await node.__finish__()
        finally:
            if self.phase != "new":
                await node.on_stop(reason)
        if self.phase == "running" and isinstance(reason, Stopped) and (state := node.handover()) is not None:
            record.saved = state

    async def _clean_up_after(self, reason: ExitReason) -> None:
        """Clean up after a failure. An error of the clean-up is logged, not raised, so that it does not hide the failure."""
        try:
            await self._clean_up(reason)
        except BaseException as error:
            if blame(error, "clean-up") is None:
                if isinstance(error, asyncio.CancelledError):  # the report will only say "killed": log the reason here
                    self.log.error("clean-up cut short", after=str(reason))
                raise
            self.log.exception("clean-up failed", after=str(reason))

    def stop(self, reason: str) -> None:
        """Ask for an orderly end. It takes effect after the present handler, before all items that wait."""
        self.asked = reason
        if not self.ended:
            self.request_stop(reason)

    # -- identity, clock, log and parameters --------------------------------------------------------------------------------

    @property
    def fqn(self) -> str:
        return self.identity.fqn

    @property
    def child(self) -> ChildTask | None:
        """The supervisor's task of this life; None if it was abandoned, since another one may run in its place."""
        return None if self._child is None or self._child.over else self._child

    @property
    def killed(self) -> bool:
        """Whether this life was killed or abandoned, and so has no time for a clean-up."""
        child = self.child
        return child is None or child.killed is not None

    @property
    def thread(self) -> int:
        """The thread of the node's event loop."""
        return self.runtime.thread

    @property
    def deadlines(self) -> Deadlines:
        return self.runtime.deadlines

    @property
    def log(self) -> NodeLog:
        if self._log is None:
            self._log = self.runtime.system_log.log(self.fqn, self.incarnation, self)
        return self._log

    @property
    def rng(self) -> Random:
        if self._rng is None:
            self._rng = self.runtime.random(f"{self.fqn}#{self.incarnation}")
        return self._rng

    @property
    def parameters(self) -> ParameterStore:
        """The node's parameters; the store is made at its first use."""
        return self._parameters or self.open_parameters(announce=False)

    def open_parameters(self, *, announce: bool) -> ParameterStore:
        """Make the parameter store and check the overrides. With `announce` the observers are told of the declared parameters.

        Raises `ParameterError` for an override that does not fit its declaration, or that a hook refuses.
        """
        from actors.parameters import ParameterStore

        declarations, overrides = self.declarations, self.identity.overrides
        store = self._parameters = ParameterStore(
            self.fqn,
            overrides,
            table=declarations.table,
            allow_undeclared=self.node.allow_undeclared_parameters,
            automatically_declare=self.node.automatically_declare_parameters_from_overrides,
            on_event=self._parameters_changed,
            announce=announce,
        )
        for name, declaration in OPTIONAL_PARAMETERS.items():
            if name in overrides and not store.has(name):
                store.declare(name, declaration.default.value, declaration.descriptor)
        # The rest comes after the assignment, because the node's hooks may read parameters.
        if declarations.rates:
            guard_rates(store, declarations.rates)
        if declarations.parameter_hooks:
            attach_hooks(store, self.node, declarations.parameter_hooks)
        store.check_overrides()
        return store

    def _parameters_changed(self, change: ParameterChange) -> None:
        for parameter in change.changed:
            if parameter.name == "use_sim_time":
                self.ros_time().use(parameter.value is True)
            elif parameter.name in self.declarations.rates:
                self.timers.retime(self.declarations, parameter.name, parameter.value)
            elif parameter.name in INTROSPECTION and self.opened is not None:
                self.opened.introspect()
        with outside():
            for observer in self.runtime.observers.parameters:
                observer(self, change)

    @property
    def serves_loggers(self) -> bool:
        """Whether the node is told to serve the levels of the loggers of its process."""
        given = LOGGER_SERVICE in self.identity.overrides or LOGGER_SERVICE in self.declarations.table.values
        return given and self.parameters.value(LOGGER_SERVICE) is True

    def ros_time(self) -> SimTime:
        """The ROS time of this incarnation, made at its first use. From then on its clock is the node's clock."""
        if self.sim is None:
            from actors.runtime.sim_time import CLOCK, ClockSubscription, SimTime

            def followed(step: Callable[[Any], None]) -> ClockSubscription:
                entry = self.runtime.graph.topic(self.identity.topic(CLOCK.name))
                subscription = ClockSubscription(self, entry, step, self.endpoints.stream_closed)
                self.endpoints.join(subscription)
                return subscription

            self.sim = SimTime(self, self.runtime.clock, self.runtime.ticker, self.timers, followed)
            self.clock = self.sim.clock
        return self.sim

    def now_ns(self) -> int:
        """The time of the node's clock, nanoseconds."""
        return self.clock.now_ns()

    def call_id(self, service: str, number: int) -> CallId:
        return caller_id(self.fqn, service), number

    def new_id(self) -> bytes:
        """A new id of 16 bytes in the form of a random UUID, from a stream of this incarnation's own."""
        if self._ids is None:
            draw: Callable[[], bytes] = partial(_uuid_of, self.runtime.ids(self.fqn))
            for each in reversed(self.runtime.interceptors):
                draw = each.drawing(self, draw)
            self._ids = draw
        return self._ids()

    def warn(self, event: str, **fields: object) -> None:
        self.log.write(WARN, event, fields)

    def check_thread(self) -> None:
        """Raise `WrongThread` in any thread but that of the node's event loop."""
        if get_ident() != self.runtime.thread:
            raise WrongThread(
                f"{self.fqn} was used from a foreign thread: use node.threadsafe(function, *arguments), and for what is awaited "
                "blocking.open_node(name, system=system)"
            )

    def check_use(self) -> None:
        """Raise `WrongThread` in a foreign thread, and `Ended` after the end of this incarnation."""
        if get_ident() != self.runtime.thread:
            self.check_thread()
        if self.ended:
            raise self._over()

    def _over(self) -> Ended:
        return Ended(f"{self.fqn}, incarnation {self.incarnation}, has ended: ask its successor, if there is one")

    # -- timers -------------------------------------------------------------------------------------------------------------

    @property
    def timers(self) -> Timers:
        """The node's timers; the part is made at its first use."""
        if self._timers is None:
            runtime = self.runtime
            self._timers = Timers(self, runtime.ticker, runtime.stalls, runtime.interceptors)
        return self._timers

    def start_timers(self) -> None:
        """Start the timers that the class declares."""
        if self.declarations.timers:
            record = self.record
            record.timers = self.timers.start(self.node, self.declarations, lambda: self.parameters, record.timers)

    # -- errors -------------------------------------------------------------------------------------------------------------

    def service_failed(self, service: str, error: Exception) -> None:
        """Handle an exception that left a service handler and was given to its caller: `on_error` decides whether the node fails, too."""
        self.goal_failed(service, error, "service handler failed")

    def service_took_long(self, service: str, seconds: float) -> None:
        """Log a warning that a request of a concurrent service took `seconds`."""
        remedy = "make it an action: its client hears how it goes, and can cancel it"
        self.log.warning(f"a request took {seconds:.1f} s", service=service, remedy=remedy)

    def cycle_refused(self, error: CallCycle) -> None:
        """Tell the observers that a call, or goal, of this node was refused because it would wait for itself."""
        for observer in self.runtime.observers.answered:
            observer(error)

    def entering(self, what: str, enter: Callable[..., T]) -> Callable[..., T]:
        """`enter`, by which other code changes this life, behind the interceptors; see `Interceptor.entering`."""
        for each in self.runtime.interceptors:
            enter = each.entering(self, what, enter)
        return enter

    def invoking(self, label: str, handler: Callable[..., Any]) -> Callable[..., Any]:
        """`handler` behind the interceptors; see `Interceptor.invoking`."""
        for each in self.runtime.interceptors:
            handler = each.invoking(self, label, handler)
        return handler

    def goal_failed(self, action: str, error: Exception, event: str = "goal failed") -> None:
        """Handle an exception that left an action's body or hook, and that its caller has been given.

        It is logged as `event`, the observers are told, and `on_error` decides whether the node fails as well. `Stop` and `ProgramExit` end
        the incarnation without being asked about.
        """
        if isinstance(error, (Stop, ProgramExit)):
            self.fail(error, action, decided=True)
            return
        self._write(error, action, event)
        for observer in self.runtime.observers.answered:
            observer(error)
        try:
            verdict = self.node.on_error(error, action)
        except BaseException as problem:  # that is the node's failure, and must not reach the caller's code
            label = f"on_error for {action}"
            self.fail(blame(problem, label) or problem, label, decided=True)
            return
        if verdict == "fail":
            self.fail(error, action, decided=True)

    def _write(self, error: BaseException, handler: str, event: str) -> None:
        fields = {"handler": handler, **error_fields(error)}
        self.log.write(ERROR, event, fields, *self.runtime.system_log.new_error(error, fields.get("at", "")))

    def fail(self, error: BaseException, label: str, *, decided: bool = False) -> None:
        """Let `error` end this incarnation, as the next item of its inbox. Unless `decided`, `on_error` is asked first."""
        if self.ended:  # the next incarnation is not to blame
            self._write(error, label, "failed after the end of its node")
        else:
            self.inbox.put_control(Failure(error, label, decided=decided))

    def on_error(self, error: Exception, handler: str) -> ErrorVerdict:
        """Whether the node goes on after an exception left a timer or topic handler. `Stop` and `ProgramExit` always end it."""
        current = self.inbox.current
        if isinstance(error, (Stop, ProgramExit)) or (isinstance(current, Failure) and current.decided):
            return "fail"
        verdict = self.node.on_error(error, handler)
        if verdict == "continue":
            self.record.work_on()
        return verdict

    def on_holding(self, item: Item, seconds: float) -> None:
        """Log a warning that a handler has kept the node's other handlers waiting for `seconds`, with the line at which it waits.

        Nothing is logged when it was the event loop's thread that waited, for a processor.
        """
        if asked(self._has_waited, seconds):
            return
        task = self.inbox.task
        lost = 0 if self._timers is None else sum(one.record.missed - one.record.blocked for one in self._timers)
        waits = (
            "run what waits by self.create_task()"
            if isinstance(item, NodeTimer)
            else "declare it concurrent=n, make it an action"
        )
        self.log.warning(
            f"handler holds the inbox for more than {seconds:g} s", handler=item.label, awaits=awaited_in(task) if task else "",
            ticks_lost=lost, remedy=f"{waits}, or self.offload() its work",
        )  # fmt: skip

    def _has_waited(self, seconds: float) -> bool:
        """Whether the event loop's thread has waited for a processor for most of the last `seconds`."""
        stalls = self.runtime.stalls
        return stalls is not None and stalls.waited(monotonic() - seconds) > 0.5 * seconds

    def absent(self) -> Exception:
        """The error for callers whose answer this incarnation owes at its end: `NotRunning` if the system stops, else `NodeRestarting`."""
        if (reason := self.runtime.stop_reason) is not None:
            return NotRunning(f"{self.fqn} has stopped: {reason}")
        return NodeRestarting(self.fqn, self.incarnation)

    # -- endpoints and tasks ------------------------------------------------------------------------------------------------

    @property
    def endpoints(self) -> Endpoints:
        """Its publishers, subscriptions, servers and clients; the part is made at its first use."""
        if self.opened is None:
            self.opened = Endpoints(self)
        return self.opened

    @property
    def tasks(self) -> Tasks:
        """The tasks that it owns; the part is made at its first use."""
        if self._tasks is None:
            self._tasks = Tasks(self)
        return self._tasks

    def owns(self, task: asyncio.Task[object]) -> bool:
        """Whether `task` is one of its `tasks`."""
        return self._tasks is not None and task in self._tasks

    def create_task(self, work: Coroutine[object, None, T], *, name: str = "") -> asyncio.Task[T]:
        """Run `work` in a task that the node owns: its failure is the node's failure, and the node's end cancels it. Raises `Ended`."""
        if self.ended:
            work.close()
            raise self._over()
        for each in self.runtime.interceptors:
            work = each.creating_task(self, work, name)
        task = self.runtime.loop.create_task(work, name=f"{self.fqn} {name or getattr(work, '__qualname__', work)}")
        self.tasks.add(task)
        return task

    def own(self, work: Coroutine[object, None, None], *, name: str = "") -> asyncio.Task[None]:
        """As `create_task`, for user code: an exception of any kind ends the node, and never the event loop."""
        if self.ended:
            work.close()
            raise self._over()
        called = getattr(work, "__qualname__", "")
        name = name or called or str(work)
        guarded: Any = contained(work, f"{self.fqn} {name}")
        guarded.__qualname__ = called or name  # so that reports name the user's code
        task = self.create_task(guarded, name=name)
        task.add_done_callback(lambda _: work.close())  # for a task that was canceled before its first step
        return task

    def threadsafe(self, function: Callable[[], object]) -> None:
        """Call `function` in the event loop, soon; may be called from any thread. What `function` raises is this node's failure."""

        def call() -> None:
            try:
                function()
            except BaseException as error:
                self.fail(blame(error, "a call from another thread") or error, "a call from another thread")

        self.runtime.threads.submit(call)

    # -- the end ------------------------------------------------------------------------------------------------------------

    def request_stop(self, reason: str) -> None:
        """End the service in order when the present handler has ended."""
        self.inbox.put_control(StopRequest(reason))

    def release(self) -> None:
        """End this incarnation at once, without waiting: close its endpoints, stop its timers, cancel its tasks. Must be called once."""
        self.ended = True
        self._child = None
        self.runtime.starts.end(self)
        record = self.record
        record.life = None
        if self._timers is not None:
            self._timers.close()
        if self._tasks is not None:
            for task in reversed(self._tasks.running):
                task.cancel()
        if self.sim is not None:
            self.sim.close()
        if self.opened is not None:
            self.opened.close()
        record.park(self.absent)


def made(runtime: Runtime, child: Child, fqn: str) -> Node:
    """Make the node object of `child`. Raises `DeclarationError` when the factory makes no node, and what the factory raises."""
    try:
        node = child.factory(*child.args)
        if not isinstance(node, Node):
            raise DeclarationError(f"{fqn}: its factory made {type(node).__name__} {node!r:.60}, which is not a Node")
        if not type(node).declarations.clean:
            check_assigned(node)
    except TypeError as error:
        if error.__traceback__ is None or error.__traceback__.tb_next is not None:
            raise
        # The call itself was wrong: no line of the factory has run.
        name = factory_name(child.factory)
        raise DeclarationError(f"{error}: a node's arguments come from its place, Child({name}, args=(...))") from None
    except (asyncio.CancelledError, ProgramExit, SystemExit, KeyboardInterrupt) as error:
        _raise_in_words(runtime, fqn, "new", error)
    return node


def _raise_in_words(
    runtime: Runtime,
    fqn: str,
    phase: str,
    error: asyncio.CancelledError | ProgramExit | SystemExit | KeyboardInterrupt,
) -> NoReturn:
    """Raise `error` as the supervisor is to see it.

    A cancellation of the node's task is raised as it is; one that only left the node's code becomes a `RuntimeError`; a request to exit
    stops the system and becomes a `ProgramExit`.
    """
    if isinstance(error, asyncio.CancelledError):
        if (stray := stray_cancel(error, f"{fqn} {phase}")) is None:
            raise error
        raise stray from error
    request = _exit(runtime, fqn, error)
    if runtime.tree.exit_request is None:  # no block of `run` is there to raise it: end the program from here
        raise request.error from None
    raise request from request.error


def _exit(runtime: Runtime, fqn: str, error: ProgramExit | SystemExit | KeyboardInterrupt) -> ProgramExit:
    """Have the system stop in order, because code of the node `fqn` asks the program to exit."""
    request = error if isinstance(error, ProgramExit) else ProgramExit(fqn, error)
    runtime.exits(request)
    return request


def incarnation_of(node: Node) -> Incarnation:
    """The incarnation that runs this node object. Raises `NotStarted` before its start."""
    life = node.__machinery__
    if life is None:
        raise NotStarted(f"{type(node).__name__} has not been started yet")
    return life


def _uuid_of(numbers: Random) -> bytes:
    """The next id of `numbers`: 16 bytes in the form of a random UUID (version 4)."""
    raw = bytearray(numbers.randbytes(16))
    raw[6] = raw[6] & 0x0F | 0x40
    raw[8] = raw[8] & 0x3F | 0x80
    return bytes(raw)
