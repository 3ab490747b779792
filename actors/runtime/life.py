"""From birth to end: how one incarnation of a node runs under its supervisor."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING, Literal

from actors.actions.driver import GoalHandlers
from actors.actions.server import ActionServer
from actors.errors import DeclarationError, ProgramExit
from actors.inbox.control import StopServing, blame, stray_cancel
from actors.node.members import check_assigned
from actors.node.node import Node
from actors.runtime.core import Core
from actors.supervision.reasons import Failed, Killed, Skip, Stop, Stopped

if TYPE_CHECKING:
    from actors.names.identity import Identity
    from actors.runtime.mailbox import Mailbox
    from actors.supervision.declarations import Child
    from actors.supervision.reasons import ExitReason
    from actors.system import System

__all__ = ["NodeLife"]


class NodeLife:
    """One incarnation of one node: what a supervisor starts, stops and watches."""

    __slots__ = ("asked", "child", "core", "identity", "mailbox", "phase", "system")

    def __init__(self, system: System, child: Child, identity: Identity, mailbox: Mailbox) -> None:
        self.system = system
        self.child = child
        self.identity = identity
        self.mailbox = mailbox
        self.core: Core | None = None
        self.asked: str | None = None
        self.phase: Literal["new", "on_start", "begin", "running"] = "new"

    def __repr__(self) -> str:
        return f"<life of {self.identity.fqn}>"

    async def run(self, started: Callable[[], None]) -> None:
        """The whole life. Returns after an orderly end that was asked for; raises `Stop` if the node asked itself, or its error.

        `SystemExit` and `KeyboardInterrupt` stop the whole system: the node ends with `ProgramExit`.
        """
        try:
            core = self.core = self._born()
            try:
                await self._live(core, started)
            except (SystemExit, KeyboardInterrupt) as error:
                raise self._exit(error) from error  # at once: nobody is to hear that another life follows
            finally:
                killed = bool(core.tasks) and self.system.killed(core)
                if not core.ended:  # else it had been abandoned, and another incarnation may live
                    core.release()
                    self.system.ended(core)
                if killed:
                    await core.tasks_ended()
        except asyncio.CancelledError as error:
            if (stray := stray_cancel(error, f"{self.identity.fqn} {self.phase}")) is None:
                raise
            raise stray from error
        except (ProgramExit, SystemExit, KeyboardInterrupt) as error:
            request = self._exit(error)
            if self.system.exit_request is None:  # there is no block of `run` that could raise it
                raise request.error from None
            raise request from request.error

    def _exit(self, error: ProgramExit | SystemExit | KeyboardInterrupt) -> ProgramExit:
        """Code of this node asks the program to exit: the system stops in order."""
        request = error if isinstance(error, ProgramExit) else ProgramExit(self.identity.fqn, error)
        self.system.exits(request)
        return request

    async def _live(self, core: Core, started: Callable[[], None]) -> None:
        try:
            await self._start(core)
            self.phase = "running"
            started()
            self.system.running_now(core)
            if self.asked is not None:
                core.request_stop(self.asked)
            core.serve_concurrently()
            await core.inbox.serve()
        except StopServing as request:
            try:
                await self._clean_up(core, Stopped(request.reason))
            except asyncio.CancelledError:
                if not self.system.killed(core):  # `asyncio.run` at its end, for instance; a kill is reported
                    core.log.error(
                        "clean-up cut short", after=str(request), because="its task was canceled by somebody else"
                    )
                raise
            if self.asked is None:
                raise Stop(request.reason) from None
        except Stop as request:
            await self._clean_up(core, Stopped(request.reason))
            raise
        except asyncio.CancelledError as error:
            await self._canceled(core, error)
            raise
        except BaseException as error:
            failure = blame(error, f"{self.identity.fqn} {self.phase}")
            incarnation = self.system.incarnation(core)
            if failure is None or incarnation is None or incarnation.task is not asyncio.current_task():
                raise  # nothing can be awaited any more, or it has been given up
            if isinstance(failure, Skip) and self.phase != "running":
                await core.cancel_tasks()
            else:
                if isinstance(failure, ProgramExit):  # so that who waits for an answer hears that there is no next life
                    self._exit(failure)
                await self._clean_up_after(core, Failed(failure))
            if failure is error:
                raise
            raise failure from error

    async def _canceled(self, core: Core, error: asyncio.CancelledError) -> None:
        """Clean up, unless the cancellation is a kill: a start is broken off, or somebody else ends all tasks of the loop."""
        if self.system.killed(core):
            return
        if self.phase != "running" and self.asked is not None:
            await self._clean_up_after(core, Stopped(self.asked))
        else:
            stray = stray_cancel(error, f"{self.identity.fqn} {self.phase}")
            await self._clean_up_after(core, Killed(None) if stray is None else Failed(stray))

    def stop(self, reason: str) -> None:
        """Ask for an orderly end: after the present handler, before anything else that waits."""
        self.asked = reason
        if self.core is not None and not self.core.ended:
            self.core.request_stop(reason)

    def _born(self) -> Core:
        node = self.child.factory(*self.child.args)
        if not isinstance(node, Node):
            raise DeclarationError(
                f"{self.identity.fqn}: its factory made {type(node).__name__} {node!r:.60}, which is not a Node"
            )
        if not type(node).declarations.clean:
            check_assigned(node)
        node._core = core = self._make_core(node)  # pyright: ignore[reportPrivateUsage]
        return core

    def _make_core(self, node: Node) -> Core:
        return Core(self.system, node, type(node).declarations, self.identity, self.mailbox)

    async def _start(self, core: Core) -> None:
        """The start phase. Calls out of it count as a handler's, so that a call to itself is refused and not waited for."""
        node = core.node
        core.inbox.task = asyncio.current_task()
        self.system.starts.begin(core)
        open_endpoints(core)
        if self.mailbox.saved is not None:
            node.resume(self.mailbox.saved)
        self.phase = "on_start"
        await node.on_start()
        if not core.declarations.clean:
            check_assigned(node)
            core.declarations.clean = True
        self.phase = "begin"
        await node._begin()  # pyright: ignore[reportPrivateUsage]
        if core.identity.overrides and type(node) is not Node:  # a script's node may declare its own at any time
            from actors.parameters.unknown import refuse_unknown

            refuse_unknown(core.parameters, type(node).__name__, core.identity.optional)
        self.mailbox.sweep(core)
        if not node.managed:
            core.start_timers()
        start_backgrounds(core)

    async def _clean_up(self, core: Core, reason: ExitReason) -> None:
        """Goals first, they may still talk; then the node's tasks; then its own last word, if it had its first."""
        core.inbox.task = asyncio.current_task()
        self.system.stopping(core)
        if self.asked is None and (incarnation := self.system.incarnation(core)) is not None:
            incarnation.bound()  # nobody has asked for this end, so nobody watches over it yet
        cleaning: list[asyncio.Task[None]] = []
        for action in core.mailbox.actions.values():
            cleaning += action.stop(f"{core.fqn} stops: {reason}")
        if cleaning:
            await asyncio.wait(cleaning)
        await core.cancel_tasks()
        try:
            if self.phase in ("begin", "running"):
                await core.node._finish()  # pyright: ignore[reportPrivateUsage]
        finally:
            if self.phase != "new":
                await core.node.on_stop(reason)
        if self.phase == "running" and isinstance(reason, Stopped) and (state := core.node.handover()) is not None:
            self.mailbox.saved = state

    async def _clean_up_after(self, core: Core, reason: ExitReason) -> None:
        """The same after a failure; nothing that goes wrong now may hide what went wrong first."""
        try:
            await self._clean_up(core, reason)
        except BaseException as error:
            if blame(error, "clean-up") is None:
                if isinstance(
                    error, asyncio.CancelledError
                ):  # the verdict will be that it was killed: say what came before
                    core.log.error("clean-up cut short", after=str(reason))
                raise
            core.log.exception("clean-up failed", after=str(reason))


def open_endpoints(core: Core) -> None:
    """Make what the class declares. From here on messages queue up; they are handled once the node has started."""
    node, declarations = core.node, core.declarations
    core.inbox.on_error = core.on_error
    core.inbox.on_holding = core.on_holding
    for published in declarations.publishers:
        setattr(node, published.attribute, core.publisher(published.topic, published.qos))
    for stream in declarations.streams:
        setattr(node, stream.attribute, core.subscribe(stream.topic, stream.qos))
    if declarations.parameters:
        core.open_parameters()
    if "use_sim_time" in core.identity.overrides and core.parameters.value("use_sim_time"):
        core.ros_time().use(True)
    labels = declarations.labels
    for topic in declarations.topics:
        core.feed(topic.topic, topic.qos, getattr(node, topic.attribute), labels[topic.attribute], topic.concurrent)
    for service in declarations.services:
        core.serve(service.service, getattr(node, service.attribute), labels[service.attribute], service.concurrent)
    for action in declarations.actions:
        entry = core.system.graph.action(core.identity.service(action.action.name))
        hooks = {
            hook.verb: getattr(node, hook.attribute) for hook in declarations.hooks if hook.action is action.action
        }
        handlers = GoalHandlers(labels[action.attribute], getattr(node, action.attribute), **hooks)
        server = ActionServer(core, entry, action.action, handlers, action.arrivals, action.result_timeout)
        core.serve_action(entry, server)


def start_backgrounds(core: Core) -> None:
    """Start the node's own tasks."""
    for background in core.declarations.backgrounds:
        core.own(getattr(core.node, background.attribute)(), name=background.attribute)
