"""`Observers`: all who are told of what happens in one system, in one place."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from actors.logs import LogSink
    from actors.parameters import ParameterChange
    from actors.runtime.incarnation import Incarnation
    from actors.supervision.report import Report

__all__ = ["Observers"]


class Observers:
    """Callbacks by what they are told of; each list is called in order.

    Invariants: a callback that was added stays until the system is gone. Those of `sinks` may raise, and lose their line then; the others must
    not. None of them may block.
    """

    __slots__ = ("answered", "closed", "ended", "parameters", "ready", "reports", "sinks", "tree_ended")

    def __init__(self, sinks: tuple[LogSink, ...]) -> None:
        self.sinks: list[LogSink] = list(sinks)
        """Every log line, supervisors' reports among them."""
        self.reports: list[Callable[[Report], None]] = []
        """Every report of a supervisor, before it is logged."""
        self.parameters: list[Callable[[Incarnation, ParameterChange], None]] = []
        """Parameters that were declared, set or undeclared. Those declared before the first of these was added are not told of."""
        self.ready: list[Callable[[Incarnation], None]] = []
        """An incarnation has become ready; nothing that waits for it has been handled yet."""
        self.answered: list[Callable[[Exception], None]] = []
        """An error left a service handler or an action body, and is the answer to the caller."""
        self.ended: list[Callable[[Incarnation], None]] = []
        """An incarnation has ended and given up its endpoints; its tasks may be ending still."""
        self.tree_ended: list[Callable[[], None]] = []
        """The tree has ended, however."""
        self.closed: list[Callable[[], None]] = []
        """The system has ended: the tree, and the nodes beside it."""

    def add(
        self,
        *,
        reports: Callable[[Report], None] | None = None,
        lines: LogSink | None = None,
        end: Callable[[], None] | None = None,
    ) -> None:
        """See `System.observe`."""
        if reports is not None:
            self.reports.append(reports)
        if lines is not None:
            self.sinks.append(lines)
        if end is not None:
            self.tree_ended.append(end)
