"""From birth to end: how one incarnation of a node runs under its supervisor. Read from top to bottom, this is the order of events."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING, NoReturn

from actors.errors import DeclarationError, ProgramExit
from actors.inbox.control import StopServing, blame, stray_cancel
from actors.node.members import check_assigned
from actors.node.node import Node
from actors.runtime.endpoints import open_declared_endpoints, serve_concurrently
from actors.runtime.owned_tasks import cancel_tasks, tasks_ended
from actors.runtime.timers import start_timers
from actors.supervision.reasons import Failed, Killed, Skip, Stop, Stopped

if TYPE_CHECKING:
    from actors.runtime.incarnation import Incarnation
    from actors.runtime.runtime import Runtime
    from actors.supervision.declarations import Child
    from actors.supervision.reasons import ExitReason

__all__ = ["made", "run"]


def made(runtime: Runtime, child: Child, fqn: str) -> Node:
    """A new node object of this child. Raises `DeclarationError` when its factory makes something else, and what the factory raises."""
    try:
        node = child.factory(*child.args)
        if not isinstance(node, Node):
            raise DeclarationError(f"{fqn}: its factory made {type(node).__name__} {node!r:.60}, which is not a Node")
        if not type(node).declarations.clean:
            check_assigned(node)
    except (asyncio.CancelledError, ProgramExit, SystemExit, KeyboardInterrupt) as error:
        _raise_in_words(runtime, fqn, "new", error)
    return node


async def run(life: Incarnation, started: Callable[[], None]) -> None:
    """The whole life. Returns after an orderly end that was asked for; raises `Stop` if the node asked itself, or its error.

    `SystemExit` and `KeyboardInterrupt` stop the whole system: the node ends with `ProgramExit`.
    """
    try:
        try:
            await _live(life, started)
        except (SystemExit, KeyboardInterrupt) as error:
            raise _exit(
                life.runtime, life.fqn, error
            ) from error  # at once: nobody is to hear that another life follows
        finally:
            killed = bool(life.tasks) and life.runtime.killed(life)
            if not life.ended:  # else it had been abandoned, and another incarnation may live
                life.release()
                life.runtime.ended(life)
            if killed:
                await tasks_ended(life)
    except (asyncio.CancelledError, ProgramExit, SystemExit, KeyboardInterrupt) as error:
        _raise_in_words(life.runtime, life.fqn, life.phase, error)


def _raise_in_words(
    runtime: Runtime,
    fqn: str,
    phase: str,
    error: asyncio.CancelledError | ProgramExit | SystemExit | KeyboardInterrupt,
) -> NoReturn:
    """Raise what a supervisor understands: a cancellation of its task stays one, a stray one is an error, and an exit stops the system."""
    if isinstance(error, asyncio.CancelledError):
        if (stray := stray_cancel(error, f"{fqn} {phase}")) is None:
            raise error
        raise stray from error
    request = _exit(runtime, fqn, error)
    if runtime.tree.exit_request is None:  # there is no block of `run` that could raise it
        raise request.error from None
    raise request from request.error


def _exit(runtime: Runtime, fqn: str, error: ProgramExit | SystemExit | KeyboardInterrupt) -> ProgramExit:
    """Code of this node asks the program to exit: the system stops in order."""
    request = error if isinstance(error, ProgramExit) else ProgramExit(fqn, error)
    runtime.tree.exits(request)
    return request


async def _live(life: Incarnation, started: Callable[[], None]) -> None:
    try:
        await _start(life)
        life.phase = "running"
        started()
        life.runtime.ready(life)
        if life.asked is not None:
            life.request_stop(life.asked)
        serve_concurrently(life)
        await life.inbox.serve(life.on_error, life.on_holding)
    except StopServing as request:
        try:
            await _clean_up(life, Stopped(request.reason))
        except asyncio.CancelledError:
            if not life.runtime.killed(life):  # `asyncio.run` at its end, for instance; a kill is reported
                life.log.error(
                    "clean-up cut short", after=str(request), because="its task was canceled by somebody else"
                )
            raise
        if life.asked is None:
            raise Stop(request.reason) from None
    except Stop as request:
        await _clean_up(life, Stopped(request.reason))
        raise
    except asyncio.CancelledError as error:
        await _canceled(life, error)
        raise
    except BaseException as error:
        await _failed(life, error)
        raise


async def _start(life: Incarnation) -> None:
    """The start phase. Calls out of it count as a handler's, so that a call to itself is refused and not waited for."""
    node, record = life.node, life.record
    life.inbox.task = asyncio.current_task()
    life.runtime.starts.begin(life)
    open_declared_endpoints(life)
    if record.saved is not None:
        node.resume(record.saved)
    life.phase = "on_start"
    await node.on_start()
    if not life.declarations.clean:
        check_assigned(node)
        life.declarations.clean = True
    life.phase = "begin"
    await node.__begin__()
    if life.identity.overrides and type(node) is not Node:  # a script's node may declare its own at any time
        from actors.parameters.unknown import refuse_unknown

        refuse_unknown(life.parameters, type(node).__name__, life.identity.optional)
    life.runtime.lost(life.fqn, record.sweep(life))
    if not node.managed:
        start_timers(life)
    for background in life.declarations.backgrounds:
        life.own(getattr(node, background.attribute)(), name=background.attribute)


async def _failed(life: Incarnation, error: BaseException) -> None:
    """An error ends the life: clean up, and raise what it is called by if that is another error."""
    failure = blame(error, f"{life.fqn} {life.phase}")
    child = life.runtime.child_of(life)
    if failure is None or child is None or child.task is not asyncio.current_task():
        return  # nothing can be awaited any more, or it has been given up
    if isinstance(failure, Skip) and life.phase != "running":
        await cancel_tasks(life)
    else:
        if isinstance(failure, ProgramExit):  # so that those who wait for an answer hear that there is no next life
            _exit(life.runtime, life.fqn, failure)
        await _clean_up_after(life, Failed(failure))
    if failure is not error:
        raise failure from error


async def _canceled(life: Incarnation, error: asyncio.CancelledError) -> None:
    """Clean up, unless the cancellation is a kill: a start is broken off, or somebody else ends all tasks of the loop."""
    if life.runtime.killed(life):
        return
    if life.phase != "running" and life.asked is not None:
        await _clean_up_after(life, Stopped(life.asked))
    else:
        stray = stray_cancel(error, f"{life.fqn} {life.phase}")
        await _clean_up_after(life, Killed(None) if stray is None else Failed(stray))


async def _clean_up(life: Incarnation, reason: ExitReason) -> None:
    """Goals first, they may still talk; then the node's tasks; then its own last word, if it had its first."""
    node, record = life.node, life.record
    life.inbox.task = asyncio.current_task()
    life.runtime.cleans_up(life)
    cleaning: list[asyncio.Task[None]] = []
    for action in record.actions.values():
        cleaning += action.stop(f"{life.fqn} stops: {reason}")
    if cleaning:
        await asyncio.wait(cleaning)
    await cancel_tasks(life)
    try:
        if life.phase in ("begin", "running"):
            await node.__finish__()
    finally:
        if life.phase != "new":
            await node.on_stop(reason)
    if life.phase == "running" and isinstance(reason, Stopped) and (state := node.handover()) is not None:
        record.saved = state


async def _clean_up_after(life: Incarnation, reason: ExitReason) -> None:
    """The same after a failure; nothing that goes wrong now may hide what went wrong first."""
    try:
        await _clean_up(life, reason)
    except BaseException as error:
        if blame(error, "clean-up") is None:
            if isinstance(error, asyncio.CancelledError):  # it will be reported as killed: say what came before
                life.log.error("clean-up cut short", after=str(reason))
            raise
        life.log.exception("clean-up failed", after=str(reason))
