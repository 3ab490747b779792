"""The life of one incarnation under its supervisor: its making, start phase, service and clean-up, in the order in which they happen.

A start makes the node object, opens its endpoints, so that messages are queued from the first moment on, restores what the last life left,
and calls `on_start`. Timers and background tasks begin after that. All of it runs in the one task that then serves the inbox. To keep a
start cheap, it makes only what every node needs: log, random numbers, parameter store and ROS time are made at their first use.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING, NoReturn

from actors.errors import DeclarationError, ProgramExit
from actors.inbox.control import StopServing, blame, stray_cancel
from actors.runtime.endpoints import open_declared_endpoints, serve_concurrently
from actors.runtime.members import check_assigned
from actors.runtime.node import Node
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
    """Make the node object of `child`. Raises `DeclarationError` when the factory makes no node, and what the factory raises."""
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
    """Run the whole life; call `started` when the node is ready. Returns after an orderly end that the supervisor asked for.

    Raises `Stop` when the node itself asked for its end, and the error when it fails. `SystemExit` and `KeyboardInterrupt` of the node's
    code stop the whole system; the node then ends with `ProgramExit`.
    """
    try:
        try:
            await _live(life, started)
        except (SystemExit, KeyboardInterrupt) as error:
            # Before `release`, so that no caller is answered with `NodeRestarting`.
            raise _exit(life.runtime, life.fqn, error) from error
        finally:
            killed = bool(life.tasks) and life.runtime.killed(life)
            if not life.ended:  # else it was abandoned and released already, and another incarnation may run
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
            if not life.runtime.killed(life):  # for example `asyncio.run` at its end; a kill is reported anyway
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
    """Run the start phase. Calls from it count as calls from a handler, so that a call of the node to itself is refused at once."""
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
    if life.identity.overrides and type(node) is not Node:  # a node of a script may declare parameters later
        from actors.parameters.unknown import refuse_unknown

        refuse_unknown(life.parameters, type(node).__name__, life.identity.optional)
    if life.incarnation > 1:
        life.runtime.lost(life.fqn, record.sweep(life))
    if not node.managed:
        start_timers(life)
    for background in life.declarations.backgrounds:
        life.own(getattr(node, background.attribute)(), name=background.attribute)


async def _failed(life: Incarnation, error: BaseException) -> None:
    """Clean up after an error; raise the failure that it means if that is another error."""
    failure = blame(error, f"{life.fqn} {life.phase}")
    child = life.runtime.child_of(life)
    if failure is None or child is None or child.task is not asyncio.current_task():
        return  # the task is being ended and cannot await, or the incarnation was abandoned
    if isinstance(failure, Skip) and life.phase != "running":
        await cancel_tasks(life)
    else:
        if isinstance(failure, ProgramExit):  # before the clean-up, so that callers are answered with `NotRunning`
            _exit(life.runtime, life.fqn, failure)
        await _clean_up_after(life, Failed(failure))
    if failure is not error:
        raise failure from error


async def _canceled(life: Incarnation, error: asyncio.CancelledError) -> None:
    """Clean up after a cancellation that is no kill: a start is broken off, or code outside of the framework canceled the task."""
    if life.runtime.killed(life):
        return
    if life.phase != "running" and life.asked is not None:
        await _clean_up_after(life, Stopped(life.asked))
    else:
        stray = stray_cancel(error, f"{life.fqn} {life.phase}")
        await _clean_up_after(life, Killed(None) if stray is None else Failed(stray))


async def _clean_up(life: Incarnation, reason: ExitReason) -> None:
    """Clean up: end the goals, which may still communicate, then the tasks, and then call `on_stop` if the start phase had begun."""
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
    """Clean up after a failure. An error of the clean-up is logged, not raised, so that it does not hide the failure."""
    try:
        await _clean_up(life, reason)
    except BaseException as error:
        if blame(error, "clean-up") is None:
            if isinstance(error, asyncio.CancelledError):  # the report will only say "killed": log the reason here
                life.log.error("clean-up cut short", after=str(reason))
            raise
        life.log.exception("clean-up failed", after=str(reason))
