"""Errors that leave a node's service handlers and action bodies: how they are logged, and how `on_error` decides about the node."""

from __future__ import annotations

from time import monotonic
from typing import TYPE_CHECKING

from actors.errors import ProgramExit
from actors.inbox.control import blame
from actors.logs import ERROR
from actors.places import awaited_in, error_fields
from actors.supervision.reasons import Stop

if TYPE_CHECKING:
    from actors.inbox.inbox import Item
    from actors.runtime.incarnation import Incarnation

__all__ = ["answered_with", "tell_holding", "tell_late", "tell_took_long"]


def answered_with(life: Incarnation, error: Exception, handler: str, event: str) -> None:
    """Handle an error that its caller has been given: log it, tell the observers, and ask `on_error` whether the node fails as well.

    `Stop` and `ProgramExit` end the incarnation without being asked about.
    """
    if isinstance(error, (Stop, ProgramExit)):
        life.fail(error, handler, decided=True)
        return
    _write(life, error, handler, event)
    for observer in life.runtime.observers.answered:
        observer(error)
    try:
        verdict = life.node.on_error(error, handler)
    except (
        BaseException
    ) as problem:  # `on_error` itself failed: that is the node's failure, and must not reach the caller's code
        label = f"on_error for {handler}"
        life.fail(blame(problem, label) or problem, label, decided=True)
        return
    if verdict == "fail":
        life.fail(error, handler, decided=True)


def tell_late(life: Incarnation, error: BaseException, handler: str) -> None:
    """Log an error that occurred after the end of the incarnation, and so has no other effect."""
    _write(life, error, handler, "failed after the end of its node")


def tell_holding(life: Incarnation, item: Item, seconds: float) -> None:
    """Log a warning that a handler has kept the node's other handlers waiting for `seconds`, with the line at which it waits.

    Nothing is logged when it was the event loop's thread that waited, for a processor.
    """
    stalls = life.runtime.stalls
    if stalls is not None and stalls.waited(monotonic() - seconds) > 0.5 * seconds:
        return
    task = life.inbox.task
    lost = sum(timer.record.missed - timer.record.blocked for timer in (*life.timers, *life.made_timers))
    life.log.warning(
        f"handler holds the inbox for more than {seconds:g} s", handler=item.label, awaits=awaited_in(task) if task else "",
        ticks_lost=lost, remedy="declare it concurrent=n, make it an action, or self.offload() its work",
    )  # fmt: skip


def tell_took_long(life: Incarnation, service: str, seconds: float) -> None:
    """Log a warning that a request of a concurrent service took `seconds`."""
    remedy = "make it an action: its client hears how it goes, and can cancel it"
    life.log.warning(f"a request took {seconds:.1f} s", service=service, remedy=remedy)


def _write(life: Incarnation, error: BaseException, handler: str, event: str) -> None:
    fields = {"handler": handler, **error_fields(error)}
    life.log.write(ERROR, event, fields, *life.runtime.journal.new_error(error, fields.get("at", "")))
