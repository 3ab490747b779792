"""Starting and ending: `run(tree)` for a tree, `open_node(name)` for a script, `execute(main)` for a whole program."""

from __future__ import annotations

import asyncio
import signal
import threading
from collections.abc import Callable, Coroutine, Mapping, Sequence
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal, Protocol, TypeVar

from actors.errors import NotRunning
from actors.logs import INFO, LogSink, structlog_sink
from actors.node.node import Node
from actors.running.options import ParameterSources, options_of, overruled, with_arguments
from actors.running.signals import listen
from actors.running.trees import Runnable, tree_of
from actors.supervision.declarations import Child, Spec, temporary
from actors.system import System, system_here

__all__ = ["Observer", "OpenNode", "Run", "execute", "open_node", "run"]

T = TypeVar("T")


class Observer(Protocol):
    """What looks on from a system's beginning."""

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
) -> Run:
    """Run a tree in this event loop: ``async with run(tree) as system: await system.wait()``.

    A node class, a `Child`, or several of them, are run under a plain supervisor: ``run(Talker)``, ``run(Talker, Child(Listener, name="ear"))``.
    Anything else raises `DeclarationError`.

    Entering returns when every child is ready and raises `StartFailed` otherwise; leaving stops the tree, last child first. When the tree
    ends by itself meanwhile (its restarts are used up), `system.wait()` raises `SupervisorGaveUp`; a block that is doing something else is
    canceled and the block as a whole raises it. Canceling the block does not cut the stop short, however often that happens.

    SIGINT and SIGTERM (main thread, real clock, unless ``signals=False``) are one path, for all systems of the loop: the tree stops in
    order and `wait()` returns; a second one within 2 s kills it. `sys.exit()` in a node stops the tree, too, and leaving raises it.
    `observers`, such as a `FlightRecorder`, are attached to the system before its tree starts.

    `parameters` are overrides for nodes of the tree: the path of a ROS 2 parameter file, ``{node: {parameter: value}}`` with the patterns of
    such files (``/**`` is all nodes), or a list of these, the later before the earlier. `argv` are arguments as a ROS 2 program has them:
    ``["--ros-args", "-p", "gait:speed:=0.5", "-r", "scan:=points", "--params-file", "f.yaml", "--log-level", "gait:=debug"]``; what is not
    for ROS is left in `system.argv`. As in ROS 2, parameters count in this order, the last one most: defaults, `argv`,
    ``Child(parameters=)``, `parameters`; a rule of ``Child(remap=)`` comes before one of `argv`. A node, a parameter or an argument that there
    is not, and a value of a wrong type or out of bounds, is a `ValueError` of one line, raised here, before anything starts.
    """
    return Run(
        tree, *more, seed=seed, signals=signals, sinks=sinks, level=level, observers=observers, parameters=parameters, argv=argv
    )  # fmt: skip


class Run:
    """What `run` returns: an async context manager.

    It has no public constructor: `run` gives one.
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
    ) -> None:
        self._tree = tree_of("run(...)", tree, *more)
        options = options_of("run(parameters=...)", self._tree, parameters, argv, level)
        if options is not None:
            level, sinks = options.levels.default, sinks if options.stdout_logs else ()
        self._options = options
        self._settings: dict[str, Any] = {"seed": seed, "sinks": sinks, "level": level, "options": options}
        self._wants_signals = signals
        self._observers = observers
        self._ignore_signals: Callable[[], None] = _nothing
        self._inside = False
        self._interrupted = False
        self._leaving = False
        self._told = False

    if not TYPE_CHECKING:  # there, type checkers say it themselves

        def __await__(self):
            raise TypeError(
                "await run(tree): a system runs within a block, write `async with run(tree) as system: ...`"
            )

    async def __aenter__(self) -> System:
        self._system = system = System(**self._settings)
        for observer in self._observers:
            observer.attach(system)
        if self._options is not None:
            for node, name, value in overruled(self._tree, self._options):
                system.log.warning("argument without effect", node_name=node, parameter=name, its_child_says=value)
        self._owner = asyncio.current_task()
        if self._wants_signals and not system.clock.virtual and threading.current_thread() is threading.main_thread():
            self._ignore_signals = listen(system.loop, self._signaled)
        try:
            await system.start(self._tree)
        except BaseException as error:
            self._ignore_signals()
            if isinstance(error, NotRunning) and (exit := _exit_for(system)) is not None:
                raise exit from None
            raise
        self._inside = True
        system.observe(end=self._tree_ended)
        return system

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        system = self._system
        self._inside, self._leaving = False, system.runtime.tree.signal is None
        try:
            await system.stop("the block was left")
        finally:
            self._ignore_signals()
            if self._interrupted and self._owner is not None:
                self._owner.uncancel()
        if error is None or (self._interrupted and isinstance(error, asyncio.CancelledError)):
            if system.failure is not None and not self._told:
                raise system.failure from system.failure.__cause__
            exit = _exit_for(system)
            late = (
                self._leaving and system.runtime.tree.signal is not None
            )  # during the stop: nobody in the block could see it
            if exit is not None and (self._interrupted or late or system.runtime.tree.exit_request is not None):
                raise exit from None

    def _signaled(self, number: signal.Signals) -> bool:
        """The tree stops, or, when it is over already, the block is interrupted, once. False when neither is left to do."""
        system, owner = self._system, self._owner
        if system.runtime.tree.interrupt(number):
            return True
        if not self._inside or self._interrupted or owner is None or owner.done():
            return False
        system.runtime.tree.note_signal(number)
        self._interrupted = True
        owner.cancel()
        return True

    def _tree_ended(self) -> None:
        """The tree is over. Whoever is in `wait()` sees it there; a block that does something else is interrupted."""
        system = self._system
        self._told = system.runtime.tree.waiting > 0
        ended_by_itself = system.failure is not None or _exit_for(system) is not None
        if ended_by_itself and self._inside and not self._told and self._owner is not None and not self._owner.done():
            self._interrupted = True
            self._owner.cancel()


def _nothing() -> None:
    """Where no signals are listened to."""


def _exit_for(system: System) -> BaseException | None:
    """What ends a program whose system was stopped by a signal, or by a node that asked the program to exit."""
    if system.runtime.tree.exit_request is not None:
        return system.runtime.tree.exit_request.error
    if system.runtime.tree.signal is None:
        return None
    return KeyboardInterrupt() if system.runtime.tree.signal == signal.SIGINT else SystemExit(system.exit_code)


def open_node(
    name: str,
    *,
    namespace: str = "",
    parameters: Mapping[str, Any] | None = None,
    remap: Mapping[str, str] | None = None,
    system: System | None = None,
    seed: int = 0,
    sinks: tuple[LogSink, ...] = (structlog_sink,),
    argv: Sequence[str] | None = None,
) -> OpenNode:
    """A node for a script: no class, no tree. ``async with open_node("listener") as node: ...``

    It joins `system`, else the newest system running in this event loop, else it makes one of its own, which further `open_node`s join.
    When a handler or task of the node fails, the node ends, its streams end, and leaving the block raises the error.
    `argv` are arguments for this node, as `run` takes them for all: `parameters` and `remap` come before them, and what they say of nodes
    of other names is left. Raises `ValueError` for what is wrong with them.
    """
    child = Child(Node, name=name, namespace=namespace, parameters=parameters, remap=remap, restart=temporary)
    child, level = with_arguments(child, argv)
    return OpenNode(child, system, seed, sinks, level)


class OpenNode:
    """What `open_node` returns: an async context manager.

    It has no public constructor: `open_node` gives one.
    """

    def __init__(self, child: Child, system: System | None, seed: int, sinks: tuple[LogSink, ...], level: int) -> None:
        self._child = child
        self._given = system
        self._seed = seed
        self._sinks = sinks
        self._level = level

    if not TYPE_CHECKING:  # as above

        def __await__(self):
            raise TypeError(
                "await open_node(...): a node lives within a block, write `async with open_node(...) as node: ...`"
            )

    async def __aenter__(self) -> Node:
        system = self._given or system_here()
        if system is None:
            system = System(seed=self._seed, sinks=self._sinks)
            system.open()
        self._system = system
        self._joined = await system.join(self._child)
        node = self._joined.node
        if self._level:
            node.log.level = self._level
        return node

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            await self._system.leave(self._joined)
        except (Exception, SystemExit, KeyboardInterrupt):
            if error is None:  # else what ended the block says more; the node's error has been logged
                raise


def execute(main: Callable[[], Coroutine[Any, Any, T]], *, clock: Literal["real", "virtual"] = "real") -> T:
    """Run an async program to its end on the real clock, or on the virtual one, where waiting takes no time.

    Ctrl-C ends it with exit code 130 and without a traceback.
    """
    factory: Callable[[], asyncio.AbstractEventLoop]
    if clock == "virtual":
        from actors.time.virtual_loop import VirtualLoop

        factory = VirtualLoop
    elif clock == "real":
        from actors.runtime.preload import preload
        from actors.time.real_loop import new_event_loop

        preload()
        factory = new_event_loop
    else:
        raise ValueError(f"clock={clock!r}: use 'real' or 'virtual'")
    try:
        with asyncio.Runner(loop_factory=factory) as runner:
            return runner.run(main())
    except KeyboardInterrupt:  # out of the program, or out of what the runner canceled when it was left
        raise SystemExit(128 + signal.SIGINT) from None
