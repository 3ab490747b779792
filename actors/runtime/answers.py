"""Errors that leave a node's handlers: what is logged, and what the node's `on_error` makes of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.errors import ProgramExit, described
from actors.inbox.control import blame
from actors.logs import ERROR
from actors.places import awaited_in, place_of
from actors.supervision.reasons import Stop

if TYPE_CHECKING:
    from actors.inbox.inbox import Item
    from actors.runtime.incarnation import Incarnation

__all__ = ["answered_with", "tell_holding", "tell_late"]


def answered_with(life: Incarnation, error: Exception, handler: str, event: str) -> None:
    """`error` is the answer to a caller: log it, tell the observers, and let the node decide whether it fails as well."""
    if isinstance(error, (Stop, ProgramExit)):
        life.fail(error, handler, decided=True)
        return
    _write(life, error, handler, event)
    for observer in life.runtime.observers.answered:
        observer(error)
    try:
        verdict = life.node.on_error(error, handler)
    except BaseException as problem:  # `on_error` itself failed: nobody may wait for ever because of it
        label = f"on_error for {handler}"
        life.fail(blame(problem, label) or problem, label, decided=True)
        return
    if verdict == "fail":
        life.fail(error, handler, decided=True)


def tell_late(life: Incarnation, error: BaseException, handler: str) -> None:
    """Log an error that came when the incarnation had ended."""
    _write(life, error, handler, "failed after the end of its node")


def tell_holding(life: Incarnation, item: Item, seconds: float) -> None:
    """Warn that a handler keeps the node's other handlers waiting, with the line at which it waits and the remedy."""
    task = life.inbox.task
    lost = sum(timer.record.missed - timer.record.blocked for timer in life.timers)
    life.log.warning(
        f"handler holds the inbox for more than {seconds:g} s", handler=item.label, awaits=awaited_in(task) if task else "",
        ticks_lost=lost, remedy="declare it concurrent=n, make it an action, or self.offload() its work",
    )  # fmt: skip


def _write(life: Incarnation, error: BaseException, handler: str, event: str) -> None:
    fields = {"handler": handler, "error": described(error), "at": place_of(error)}
    life.log.write(ERROR, event, fields, *life.runtime.journal.new_error(error))
