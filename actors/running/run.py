"""`run(tree)` runs a tree, `open_node(name)` a node for a script, `execute(main)` a whole program."""

from __future__ import annotations

import asyncio
import inspect
import os
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Coroutine, Mapping, Sequence
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal, Protocol, TypeVar, cast

from actors.checks import NoPublicConstructor, create, factory_name
from actors.errors import DeclarationError, NotRunning, explain
from actors.logs import INFO, LogSink, structlog_sink
from actors.places import shortened
from actors.running.hints import give_hints
from actors.running.options import ParameterSources, misplaced, options_of, overruled, with_arguments
from actors.running.signals import interrupt, listen
from actors.running.trees import Runnable, tree_of
from actors.runtime.node import Node
from actors.runtime.placement import HERE, Placement
from actors.supervision.child import Child
from actors.supervision.declarations import Spec
from actors.supervision.errors import StartFailed
from actors.supervision.policy import temporary
from actors.system import System, keep_step, system_here

if TYPE_CHECKING:
    from actors.hosts.placing import Hosts
    from actors.runtime.runtime import OtherProcesses, Runtime
    from actors.transport.protocol import Transport

T = TypeVar("T")


class Observer(Protocol):
    """An object that is attached to a system before its tree starts."""

    def attach(self, system: System) -> object: ...


def run(
    tree: Runnable,
    *more: Spec | type[Node],
    seed: int = 0,
    signals: bool = True,
    sinks: tuple[LogSink, ...] = (structlog_sink,),
    level: int = INFO,
    observers: tuple[Observer, ...] = (),
    parameters: ParameterSources | None = None,
    argv: Sequence[str] | None = None,
    transport: Transport | None = None,
    hosts: Hosts | None = None,
) -> Run:
    """Run a tree in this event loop: ``async with run(tree) as system: await system.wait()``.

    Node classes and `Child` declarations are run under a plain supervisor: ``run(Talker)``, ``run(Talker, Child(Listener, name="ear"))``.
    Anything that is no part of a tree raises `DeclarationError`.

    Entering returns when every child is ready, and raises `StartFailed` otherwise. Leaving stops the tree, last child first. If the tree
    ends by itself meanwhile, because its restarts are used up, `system.wait()` raises `SupervisorGaveUp`; a block that waits elsewhere is
    canceled, and the ``async with`` statement raises the error. Canceling the block, even repeatedly, does not cut the stop short.

    SIGINT, SIGTERM and SIGHUP (main thread, real clock, unless ``signals=False``) do the same in all systems of the loop: the tree stops in
    order and `wait()` returns. Signals within 0.5 s are one; a second one after that, within 2 s, kills the tree. SIGHUP stays ignored if it
    was, as by `nohup`. If the output is a pipe that nobody reads any more, the tree stops as by SIGPIPE. While the loop hangs, a second
    signal ends the program at once, with a line that says where. `sys.exit()` in a node stops the tree, too, and leaving raises it.
    `observers`, such as a `FlightRecorder`, are attached to the system before its tree starts.

    `parameters` are overrides for nodes of the tree: the path of a ROS 2 parameter file, ``{node: {parameter: value}}`` with the patterns
    of such files (``/**`` for all nodes), or a list of these, of which a later one counts more. `argv` are those of a ROS 2 program:
    ``["--ros-args", "-p", "gait:speed:=0.5", "-r", "scan:=points", "--params-file", "f.yaml", "--log-level", "gait:=debug"]``; arguments
    that are not for ROS are in `system.argv`. As in ROS 2, the last source that sets a parameter counts, in this order: defaults, `argv`,
    ``Child(parameters=)``, `parameters`; rules of ``Child(remap=)`` come before those of `argv`. A node, parameter or argument that does
    not exist, or a value of a wrong type or out of bounds, raises a `ValueError` of one line here, before anything starts.

    With a `transport` the nodes take part in the graph of ROS_DOMAIN_ID, together with the nodes of other processes. It is opened beside the
    start of the tree, and closed after its stop; if it cannot be opened, that is logged, and the tree runs alone. Without one, nothing is
    opened, and other processes neither see nor hear these nodes: `spin` opens the one that the environment names.

    `hosts`, such as `TlsHosts`, says where the hosts of ``Child(host=...)`` are; it needs a `transport`, by which their nodes are reached.
    Each run is counted then; entering raises `DeclarationError` if it cannot be.
    """
    return create(Run,
        tree, *more, seed=seed, signals=signals, sinks=sinks, level=level, observers=observers, parameters=parameters, argv=argv,
        transport=transport, hosts=hosts,
    )  # fmt: skip


class Run(metaclass=NoPublicConstructor):
    """The async context manager that `run` returns.

    It has no public constructor: `run` gives one.

    Invariants:

    - `_inside` is true while the body of the block runs, and only then may its task be interrupted.
    - `_interrupted` is set when the body has been canceled from here; that is done at most once, and undone when the block is left.
    """

    def __init__(
        self,
        tree: Runnable,
        *more: Spec | type[Node],
        seed: int,
        signals: bool,
        sinks: tuple[LogSink, ...],
        level: int,
        observers: tuple[Observer, ...],
        parameters: ParameterSources | None,
        argv: Sequence[str] | None,
        transport: Transport | None,
        hosts: Hosts | None,
    ) -> None:
        self._tree = tree_of("run(...)", tree, *more)
        if hosts is not None and transport is None:
            raise DeclarationError(
                "run(hosts=...): nodes on other machines are reached by a transport: add transport=..."
            )
        self._hosts = hosts
        options = options_of("run(parameters=...)", self._tree, parameters, argv, level)
        if options is not None:
            level, sinks = options.levels.default, sinks if options.stdout_logs else ()
        self._options = options
        self._argv = argv
        self._settings: dict[str, Any] = {"seed": seed, "sinks": sinks, "level": level, "options": options}
        self._wants_signals = signals
        self._observers = observers
        self._transport = transport
        self._ignore_signals: Callable[[], None] = _nothing
        self._end_hints: Callable[[], None] = _nothing
        self._entered = False
        self._inside = False
        self._interrupted = False
        self._leaving = False
        self._told = False

    def __repr__(self) -> str:
        return "<run(tree), which is entered by `async with run(tree) as system: ...`; spin(tree) is a whole program>"

    if not TYPE_CHECKING:  # type checkers report it without these methods

        def __await__(self):
            self._refuse("await run(tree)")

        def __enter__(self):
            self._refuse("with run(tree)")

        def __exit__(self, *exc):
            """Do nothing: `__enter__` has raised."""

        def _refuse(self, written):
            self._entered = True
            raise TypeError(f"{written}: a system runs within a block, write `async with run(tree) as system: ...`")

    def __del__(self) -> None:
        if not getattr(self, "_entered", True):
            warnings.warn(f"never entered: {self!r}", RuntimeWarning, stacklevel=2, source=self)

    async def __aenter__(self) -> System:
        self._entered = True
        _refuse_in_an_import()
        placement = HERE if self._hosts is None else Placement(self._hosts.count_run())
        keep_step(self._tree)
        self._system = system = create(System, **self._settings, processes=self._processes, placement=placement)
        if self._transport is not None:
            from actors.transport.bridge import connect

            connect(system.runtime, self._transport)
        for observer in self._observers:
            observer.attach(system)
        if self._options is not None:
            for node, name, value in overruled(self._tree, self._options):
                system.log.warning("argument without effect", node_name=node, parameter=name, its_child_says=value)
            for words in misplaced(self._argv or ()):
                system.log.warning("not after --ros-args, so not a parameter", argument=words)
        self._owner = asyncio.current_task()
        if self._wants_signals and not system.clock.virtual and threading.current_thread() is threading.main_thread():
            self._ignore_signals = listen(system.loop, self._signaled)
        try:
            await system.start(self._tree)
        except BaseException as error:
            self._ignore_signals()
            if isinstance(error, NotRunning) and (exit := _exit_for(system)) is not None:
                raise exit from None
            if isinstance(error, StartFailed):
                raise shortened(error)  # noqa: B904 its cause stays
            raise
        self._inside = True
        system.observe(end=self._tree_ended)
        if not system.clock.virtual and self._settings["sinks"]:
            self._end_hints = give_hints(system, alone=self._transport is None)
        return system

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        explain(error)
        system = self._system
        self._inside, self._leaving = False, system.runtime.tree.signal is None
        self._end_hints()
        try:
            await system.stop("the block was left")
        finally:
            self._ignore_signals()
            if self._interrupted and self._owner is not None:
                self._owner.uncancel()
        if error is None or (self._interrupted and isinstance(error, asyncio.CancelledError)):
            if system.failure is not None and not self._told:
                raise shortened(system.failure) from system.failure.__cause__
            exit = _exit_for(system)
            # A signal that came during the stop: the body could not react to it.
            late = self._leaving and system.runtime.tree.signal is not None
            if exit is not None and (self._interrupted or late or system.runtime.tree.exit_request is not None):
                raise exit from None

    def _processes(self, runtime: Runtime) -> OtherProcesses:
        from actors.processes.child_processes import ChildProcesses
        from actors.processes.flight_records import makers  # late: few trees have other processes

        launch = None
        if self._hosts is not None:
            from actors.hosts.placing import elsewhere

            launch = elsewhere(self._hosts, runtime)
        return ChildProcesses(runtime, self._transport, makers(self._observers), launch)

    def _signaled(self, number: signal.Signals) -> bool:
        """Stop the tree; if it has ended already, interrupt the block, once. Returns False if neither is possible any more."""
        system, owner = self._system, self._owner
        if interrupt(system, number):
            return True
        if not self._inside or self._interrupted or owner is None or owner.done():
            return False
        system.runtime.tree.signal = system.runtime.tree.signal or number  # the first one counts
        self._interrupted = True
        owner.cancel()
        return True

    def _tree_ended(self) -> None:
        """Interrupt the block when the tree has ended by itself, unless a task is in `wait()`, which raises the error."""
        system = self._system
        self._told = system.runtime.tree.waiting > 0
        ended_by_itself = system.failure is not None or _exit_for(system) is not None
        if ended_by_itself and self._inside and not self._told and self._owner is not None and not self._owner.done():
            self._interrupted = True
            self._owner.cancel()


def _refuse_in_an_import() -> None:
    """Raise RuntimeError if a process of a program runs the program's main module to find what is defined there: a second system would start.

    `multiprocessing`, anyio and `Child(process=True)` all run it under the name ``__mp_main__``.
    """
    frame = sys._current_frames().get(threading.main_thread().ident or 0)  # pyright: ignore[reportPrivateUsage]
    while frame is not None:
        if frame.f_code.co_name == "<module>" and frame.f_globals.get("__name__") == "__mp_main__":
            raise RuntimeError(
                f"{frame.f_code.co_filename}, line {frame.f_lineno}: a process of this program reads the main module for its functions and "
                "classes, and that starts the program again: start it under `if __name__ == '__main__':`"
            )
        frame = frame.f_back


def _nothing() -> None:
    """Do nothing: the function for a run without signals or hints."""


def _exit_for(system: System) -> BaseException | None:
    """The exception that ends the program after a signal, or after a node has asked it to exit; else None."""
    if system.runtime.tree.exit_request is not None:
        return system.runtime.tree.exit_request.error
    if system.runtime.tree.signal is None:
        return None
    return KeyboardInterrupt() if system.runtime.tree.signal == signal.SIGINT else SystemExit(system.exit_code)


def open_node(
    name: str,
    *,
    namespace: str = "",
    parameters: Mapping[str, object] | None = None,
    remap: Mapping[str, str] | None = None,
    system: System | None = None,
    seed: int = 0,
    sinks: tuple[LogSink, ...] = (structlog_sink,),
    argv: Sequence[str] | None = None,
    transport: Transport | Literal["environment"] | None = "environment",
) -> OpenNode:
    """Run a node for a script, without a class and a tree: ``async with open_node("listener") as node: ...``

    It joins `system`, or else the newest system that is open in this event loop, or else a new system, which further `open_node`s join.
    When a handler or a task of the node fails, the node and its streams end, and leaving the block raises the error.
    `argv` are ROS arguments for this node, as for `run`; `parameters` and `remap` count more, and arguments for nodes of other names are
    ignored. Raises `ValueError` if an argument is wrong.

    A new system takes part in the graph of other processes by `transport`, as `run` does: by default by the one that the environment
    variable RMW_IMPLEMENTATION names (see `transport_from_environment`), but on the virtual clock by none. In a test run that is
    ``in_process``, whatever the shell has. A system that is there already stays as it is.
    """
    child = Child(Node, name=name, namespace=namespace, parameters=parameters, remap=remap, restart=temporary)
    child, level = with_arguments(child, argv)
    return create(OpenNode, child, system, seed, sinks, level, transport)


class OpenNode(metaclass=NoPublicConstructor):
    """The async context manager that `open_node` returns.

    It has no public constructor: `open_node` gives one.
    """

    def __init__(
        self,
        child: Child,
        system: System | None,
        seed: int,
        sinks: tuple[LogSink, ...],
        level: int,
        transport: Transport | Literal["environment"] | None,
    ) -> None:
        self._child = child
        self._given = system
        self._seed = seed
        self._sinks = sinks
        self._level = level
        self._transport = transport
        self._end_hints: Callable[[], None] = _nothing

    if not TYPE_CHECKING:  # as in `Run`

        def __await__(self):
            raise TypeError(
                "await open_node(...): a node lives within a block, write `async with open_node(...) as node: ...`"
            )

    async def __aenter__(self) -> Node:
        self._system = system = self._given or system_here() or self._new_system()
        if system.supervisor is None and not system.nodes and not system.clock.virtual and self._sinks:
            self._end_hints = give_hints(system, alone=False)
        self._joined = await system.join(self._child)
        await system.runtime.opened()
        node = self._joined.node
        if self._level:
            node.log.level = self._level
        return node

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        explain(error)
        system = self._system
        self._end_hints()
        try:
            await system.leave(self._joined)
        except (Exception, SystemExit, KeyboardInterrupt):
            if error is None:  # else the error of the block is raised; that of the node has been logged
                raise
        finally:
            if system.supervisor is None and system.stop_reason is not None:
                await system.stop()  # it ends with its last node; wait until its transport is closed, too

    def _new_system(self) -> System:
        """A system that ends with its last node."""
        system = create(System, seed=self._seed, sinks=self._sinks)
        transport = self._transport
        if isinstance(transport, str):
            from actors.transport.environment import transport_from_environment

            transport = None if system.clock.virtual else transport_from_environment(os.environ)
        if transport is not None:
            from actors.transport.bridge import connect

            connect(system.runtime, transport)
        system.open()
        return system


def refuse_a_running_loop(what: str, instead: str) -> None:
    """Raise `RuntimeError`, with what to do `instead`, in a thread whose event loop runs already."""
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return
    raise RuntimeError(
        f"{what}(...) runs an event loop, and one runs in this thread already, as in a notebook: {instead}"
    )


def execute(main: Callable[[], Coroutine[object, None, T]], *, clock: Literal["real", "virtual"] = "real") -> T:
    """Run an async program to its end, and return its result. On the virtual clock, waiting takes no time.

    Ctrl-C ends the program with exit code 130 and without a traceback. Raises `TypeError` for anything but an async function, and
    `RuntimeError` in a thread whose event loop runs already, as in a notebook.
    """
    if not callable(main):
        name = getattr(main, "__qualname__", "main")
        if inspect.iscoroutine(main):
            main.close()
        raise TypeError(f"execute({main!r:.60}): give the async function itself, as in execute({name})")
    if clock not in ("real", "virtual"):
        raise ValueError(f"clock={clock!r}: use 'real' or 'virtual'")
    refuse_a_running_loop("execute", "await the program itself, or await asyncio.to_thread(execute, main, clock=...)")
    factory: Callable[[], asyncio.AbstractEventLoop]
    try:
        if clock == "virtual":
            from actors.time.virtual_loop import VirtualLoop

            factory = VirtualLoop
        else:
            from actors.runtime.preload import preload
            from actors.time.real_loop import new_event_loop

            preload(structlog=False)  # which a run imports that logs by it
            factory = new_event_loop
        with asyncio.Runner(loop_factory=factory) as runner:
            program: object = main()
            if not inspect.iscoroutine(program):
                raise TypeError(f"execute({factory_name(main)}): it returned {program!r:.60}: give an async function")
            return cast("T", runner.run(program))
    except KeyboardInterrupt:  # raised by the program, or by a task that the runner canceled at its end
        raise SystemExit(128 + signal.SIGINT) from None
