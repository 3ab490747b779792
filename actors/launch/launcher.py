"""`Launcher`: the node that carries out a launch: it starts what is planned, and answers the events that follow."""

from __future__ import annotations

import asyncio
import shlex
import tempfile
from collections import deque
from collections.abc import Callable, Coroutine, Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actors.errors import ActorError, described
from actors.launch import events
from actors.launch.actions.nodes import LifecycleNode
from actors.launch.children import job_supervisor, named, nodes_of, program_of
from actors.launch.containers import COMPONENTS, ComponentContainer, load
from actors.launch.entity import LaunchDescriptionEntity, evaluate, listed
from actors.launch.errors import LaunchError, ProcessDied
from actors.launch.executables import Running, console_line, flattened, shows_stdout
from actors.launch.lifecycle import UP, follow, take_through, transit
from actors.launch.packages import Program
from actors.launch.plan import Handler, Item, Job, Load, Message, Scope, Signal, Timer, Transitions, Unregister
from actors.launch.program import ProgramNode
from actors.launch.requests import Requests
from actors.launch.shim import shim
from actors.logs import INFO, LogRecord
from actors.names.names import fully_qualified
from actors.runtime.declarations import background
from actors.runtime.node import Node
from actors.supervision.child import Child
from actors.supervision.declarations import Spec, Supervisor
from actors.supervision.errors import NotFound, StartFailed, SupervisorDown
from actors.supervision.reasons import ExitReason, Failed, Stopped
from actors.supervision.running import RunningSupervisor
from actors.system import system_of

if TYPE_CHECKING:
    from actors.launch.context import LaunchContext
    from actors.supervision.refs import ChildRef
    from actors.supervision.report import Report

Write = Callable[[str], None]
"""Takes a line of the output of a process."""


class Launcher(Node):
    """Carries out a plan below its own siblings, the supervisors of the launch files and groups, and ends when nothing is left to do.

    Invariants:

    - `_running` holds every executable from its first start until its supervisor has ended for good.
    - `_pending` counts the tasks that may still start something: timers, starts, loads. With both empty the launch is over, unless
      `requests` holds it open.
    - A handler is asked about events from its registration on, the newest handler first, until every executable has ended.
    """

    node_name = "launch"

    def __init__(self, plan: Scope, write: Write, on_ready: Callable[[], None], requests: Requests) -> None:
        self._plan = plan
        self._requests = requests
        self._write = write
        self._on_ready = on_ready
        self._running: dict[str, Running] = {}
        self._handlers: list[tuple[Handler, tuple[str, ...]]] = []
        self._events: deque[object] = deque()
        """The event that is being shown to the handlers, and behind it those that they have emitted meanwhile."""
        self._pending = 0
        self._ending = False

    async def on_start(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="robactor_launch_")
        system_of(self).observe(reports=self._report, lines=self._logged)

    @background
    async def begin(self) -> None:
        """Start everything, in order; from then on tasks go on by themselves."""
        self._pending += 1
        self._start_items(self._plan.items, (self._plan.name,))
        self._requests.begin(self._requested)
        self._pending -= 1
        self._end_if_done()

    async def on_stop(self, reason: ExitReason) -> None:
        """End every executable, the last first, so that handlers are told of each end."""
        self._requests.end()
        why = reason.why if isinstance(reason, Stopped) else str(reason)
        self._ending = True
        self.emit(events.Shutdown(reason=why, due_to_sigint=why == "SIGINT"))
        for running in reversed(list(self._running.values())):
            await self._terminate(running)
            self._ended(running, running.path[:-1], running.code)
        self._folder.cleanup()

    def _requested(self, entities: Sequence[LaunchDescriptionEntity], context: LaunchContext) -> None:
        self._do(entities, context, (self._plan.name,))
        self._end_if_done()

    # -- items --------------------------------------------------------------------------------------------------------------

    def _start_items(self, items: Iterable[Item], place: tuple[str, ...]) -> None:
        """Start items in order, those that take time in tasks of their own."""
        for item in items:
            match item:
                case Scope():
                    self._start_items(item.items, (*place, item.name))
                case Job():
                    self._start(item, place)
                case Timer():
                    self._later(self._fire(item, place), f"timer {item.period:g} s")
                case Handler():
                    self._handlers.insert(0, (item, place))
                case Unregister():
                    self._handlers = [one for one in self._handlers if one[0].handler is not item.handler]
                case Message():
                    getattr(self.log, item.level)(item.text)
                case Signal():
                    self._signal(item)
                case Load():
                    self._later(load(self, item), f"load into {item.container}")
                case Transitions():
                    for name in item.nodes:
                        self._later(take_through(self, name, item.ids), f"transitions of {name}")
                case _:
                    self.log.error(f"{item.what}: {item.why}")

    def _later(self, work: Coroutine[object, None, None], name: str) -> None:
        """Do something that takes time; an error is logged, and the launch goes on."""

        async def done() -> None:
            try:
                await work
            except (ActorError, LaunchError, TimeoutError, LookupError) as error:
                self.log.error(f"{name}: {described(error)}")
            finally:
                self._pending -= 1
            self._end_if_done()

        self._pending += 1
        self.create_task(done(), name=name)

    async def _fire(self, timer: Timer, place: tuple[str, ...]) -> None:
        await self.clock.sleep(timer.period)
        self._do(timer.then.entities, timer.then.context, place)
        self.emit(events.TimerEvent(timer_action=timer.action))
        self.emit(events.ExecutionComplete(action=timer.action))

    def _do(self, entities: Iterable[LaunchDescriptionEntity], context: LaunchContext, place: tuple[str, ...]) -> None:
        """Evaluate entities, and start what they come to below the supervisor at `place`."""
        scope = Scope(place[-1], "")
        try:
            with shim(context):
                evaluate(entities, context, scope)
        except LaunchError as error:
            self.log.error(str(error))
            return
        flat: list[Item] = []
        for item in scope.items:
            flat += flattened(item)
        if self._ending:
            if any(not isinstance(item, (Message, Signal, Handler, Unregister)) for item in flat):
                self.log.warning("the launch is ending: nothing is started any more")
            flat = [item for item in flat if isinstance(item, Message)]
        self._start_items(flat, place)

    # -- executables --------------------------------------------------------------------------------------------------------

    def _start(self, job: Job, place: tuple[str, ...]) -> None:
        running = Running(job, (*place, job.label))
        job.action.process_details = running.details()
        self._running[job.label] = running
        if isinstance(job.action, LifecycleNode) and job.action.node_name:
            self.create_task(follow(self, job.action, self.emit), name=f"transitions of {job.label}")
        self._later(self._run(running, place), job.label)

    async def _run(self, running: Running, place: tuple[str, ...]) -> None:
        """Start an executable; one that does not start is tried again as often as it is to be respawned."""
        job = running.job
        tries = 0
        while True:
            try:
                ref = await self._supervisor(place).start_child(job_supervisor(job, await self._children(running)))
                break
            except (StartFailed, SupervisorDown, NotFound, LaunchError) as error:
                self._died(running, error.__cause__ or error)
                tries += 1
                if not job.respawn or (0 <= job.respawn_max_retries < tries):
                    del self._running[job.label]
                    self._ended(running, place, 1)
                    if job.required:  # it was never in the tree, whose business this is else
                        self.shut_down(f"{job.label} did not start")
                    return
                await self.clock.sleep(max(job.respawn_delay, RETRY_SECONDS))
        assert ref is not None  # a supervisor never declines to start
        self.create_task(self._watch(running, place, ref), name=f"watch {job.label}")
        life = self._supervisor(running.path)
        if not any(child.ref for child in life.children()):  # all of its nodes have declined to start
            await self._terminate(running)
        if job.node is not None and job.node.autostart and job.node.name is not None:
            await take_through(self, fully_qualified(job.node.namespace or "/", job.node.name), UP)

    async def _children(self, running: Running) -> list[Spec]:
        job = running.job
        node = job.node
        if node is None or isinstance(node.found, Program):
            assert job.process is not None

            def output(line: bytes, stdout: bool) -> None:
                self._output(running, line, stdout)

            return [program_of(running, job.process, output, Path(self._folder.name))]
        if node.container and node.found is None:
            context = job.context
            container = Child(ComponentContainer, args=(context.packages, context.stand_ins))
            return [named(container, node, self.log.warning), Supervisor(COMPONENTS)]
        return await nodes_of(job, node, self.log.warning)

    async def _watch(self, running: Running, place: tuple[str, ...], ref: ChildRef) -> None:
        root = self._root
        down = await root.watch(ref)
        del self._running[running.job.label]
        self._ended(running, place, running.code or int(isinstance(down.reason, Failed)))
        self._end_if_done()

    def _report(self, report: Report) -> None:
        """See what becomes of the nodes of executables: that they have started, and that they have ended."""
        running = next((one for one in self._running.values() if one.path == report.supervisor[1:]), None)
        if running is None:
            return
        first = self._first(running)
        if report.context == "progress" and report.child.id == first:
            running.failures.clear()
            running.exit_told = False
            pid = f" with pid [{running.pid}]" if running.pid else ""
            self.log.info(f"[{running.job.label}] process started{pid}")
            if running.job.process is not None and running.job.process.log_cmd and running.pid:
                self.log.info(f"[{running.job.label}] command: {shlex.join(running.job.process.cmd)}")
            self.emit(events.ProcessStarted(**running.about()))
        elif report.context == "child_terminated":
            error = report.reason.error if isinstance(report.reason, Failed) else None
            if error is not None:
                running.failures.append(error)
                self._died(running, error)
            if running.job.respawn:
                self._tell_exit(running, events.ProcessExited(returncode=running.code, **running.about()))

    def _died(self, running: Running, error: BaseException) -> None:
        pid = f"pid {running.pid}, " if running.pid else ""
        if isinstance(error, ProcessDied):
            cmd = " ".join(running.job.process.cmd) if running.job.process is not None else ""
            self.log.error(f"[{running.job.label}] process has died [{pid}exit code {error.returncode}, cmd '{cmd}']")
        else:
            self.log.error(f"[{running.job.label}] process has died: {described(error)}")

    def _ended(self, running: Running, place: tuple[str, ...], code: int) -> None:
        """An executable has ended for good: tell the handlers, and do what its `on_exit` says."""
        job = running.job
        if code == 0:
            self.log.info(f"[{job.label}] process has finished cleanly{f' [pid {running.pid}]' if running.pid else ''}")
        elif not running.failures:  # it was told to end, and did so with this code
            self.log.info(f"[{job.label}] process has finished [pid {running.pid}, exit code {code}]")
        event = events.ProcessExited(returncode=code, **running.about())
        self._tell_exit(running, event)
        self.emit(events.ExecutionComplete(action=job.action))
        if job.on_exit is not None and not job.required:
            context = job.context.fork()
            context.is_shutdown = self._ending
            context.extend_globals({"event": event})
            self._do(listed(job.on_exit(event, context) if callable(job.on_exit) else job.on_exit), context, place)

    def _tell_exit(self, running: Running, event: events.ProcessExited) -> None:
        """Tell handlers of the end of a life, once: the end of the last life is that of the executable, too."""
        if not running.exit_told:
            running.exit_told = True
            self.emit(event)

    def _output(self, running: Running, line: bytes, stdout: bool) -> None:
        """A line of a process: shown as its `output` says, and told to the handlers."""
        job = running.job
        assert job.process is not None
        if not stdout or shows_stdout(job.process):
            self._write(f"[{job.label}] {line.decode(errors='replace').rstrip()}")
        kind = events.ProcessStdout if stdout else events.ProcessStderr
        self.emit(kind(text=line, **running.about()))

    def _logged(self, record: LogRecord) -> None:
        """Tell handlers what a node of an executable logs: for them it is a line on stderr, as the console of ROS 2 has it."""
        if not self._handlers or record.level < INFO:
            return
        node = next((one for one in system_of(self).nodes.values() if one.identity.fqn == record.node), None)
        if node is None:
            return
        for running in self._running.values():
            if node.path[1 : len(running.path) + 1] == running.path:
                event = events.ProcessStderr(text=console_line(record), **running.about())
                asyncio.get_running_loop().call_soon(self.emit, event)
                return

    # -- events -------------------------------------------------------------------------------------------------------------

    def emit(self, event: object) -> None:
        """Ask every handler about an event, the newest first, and do what they answer. What they emit comes after it, as in ROS 2."""
        self._events.append(event)
        if len(self._events) > 1:
            return
        try:
            while self._events:
                self._handle(self._events[0])
                self._events.popleft()
        finally:
            self._events.clear()

    def _handle(self, event: object) -> None:
        for handler, place in list(self._handlers):
            if not handler.handler.matches(event):
                continue
            if handler.handler.handle_once:
                self._handlers.remove((handler, place))
            context = handler.context.fork()
            context.is_shutdown = self._ending
            context.extend_globals({"event": event})
            try:
                entities = handler.handler.handle(event, context)
            except Exception as error:
                self.log.error(f"{handler.line or 'event handler'}: {described(error)}")
                continue
            self._do(entities, context, place)

    def _signal(self, item: Signal) -> None:
        event = item.event
        if isinstance(event, events.Shutdown):
            self.shut_down(event.reason)  # handlers are asked about it in `on_stop`, whatever ends the launch
            return
        if isinstance(event, events.SignalProcess):
            self._send(event.process_matcher, int(event.signal_number))
        elif isinstance(event, events.ShutdownProcess):
            self._send(event.process_matcher, None)
        elif isinstance(event, events.ChangeState):
            meant = [getattr(one, "node_name", "") for one in self._actions() if event.lifecycle_node_matcher(one)]
            self._later(transit(self, [name for name in meant if name], event.transition_id), "lifecycle transition")
        elif isinstance(event, events.IncludeLaunchDescription):
            self._do([event.launch_description], item.context, (self._plan.name,))
        elif isinstance(event, events.ReadyToTest):
            self._on_ready()
        self.emit(event)

    def _send(self, matcher: Callable[[Any], bool], number: int | None) -> None:
        """Send a signal to the processes that are meant, or end the executables."""
        for running in [one for one in self._running.values() if matcher(one.job.action)]:
            life = self._root.life(running.path)
            node = life.life(self._first(running)) if isinstance(life, RunningSupervisor) else None
            program = getattr(node, "node", None)
            if number is not None and isinstance(program, ProgramNode):
                program.send(number)
            else:
                self._later(self._terminate(running), f"end {running.job.label}")

    async def _terminate(self, running: Running) -> None:
        with suppress(SupervisorDown, NotFound):
            await self._supervisor(running.path[:-1]).terminate_child(running.job.label)

    def shut_down(self, reason: str) -> None:
        """End the launch: this node ends, and with it everything else in reverse order."""
        self.stop(reason)

    def _end_if_done(self) -> None:
        if not self._running and not self._pending and not self._ending and not self._requests.stay:
            self.stop("nothing is left to run")

    # -- the tree -----------------------------------------------------------------------------------------------------------

    def _actions(self) -> list[object]:
        """The actions of the executables that run."""
        return [one.job.action for one in self._running.values()]

    @property
    def _root(self) -> RunningSupervisor:
        root = system_of(self).supervisor
        assert root is not None
        return root

    def _supervisor(self, place: tuple[str, ...]) -> RunningSupervisor:
        life = self._root.life(place)
        assert isinstance(
            life, RunningSupervisor
        )  # the supervisors of scopes are temporary: they run, or are forgotten
        return life

    def _first(self, running: Running) -> str:
        """The id of the first node of an executable, whose start counts as that of the executable."""
        life = self._root.life(running.path)
        children = life.children() if isinstance(life, RunningSupervisor) else []
        return children[0].id if children else ""


RETRY_SECONDS = 0.1
"""The least time between two attempts to start an executable that is to be respawned."""
