"""`Observers`: the callbacks of one system, by the events that they are called for."""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from actors.actions.server import ActionServer
    from actors.logs import LogSink
    from actors.parameters import ParameterChange
    from actors.runtime.incarnation import Incarnation
    from actors.runtime.record import NodeRecord
    from actors.services.introspection import CallEvents
    from actors.supervision.report import Report

__all__ = ["HostLease", "Observers"]


class HostLease(NamedTuple):
    """What a machine holds to which parts of the tree are given: for how many seconds it may run them, 0 if it cannot be reached, and how many."""

    host: str
    left: float
    parts: int


class Observers:
    """The callbacks of one system, one list for each kind of event. The callbacks of a list are called in its order.

    A callback must not block. Those in `sinks` may raise, and then do not get that line; the others must not raise.

    Invariants: a callback is never removed while the system exists.
    """

    __slots__ = (
        "answered", "calls", "closed", "closing", "dismissed", "ended", "goals", "leases", "opening", "parameters", "ready", "reports", "sinks",
        "tree_ended",
    )  # fmt: skip

    def __init__(self, sinks: tuple[LogSink, ...]) -> None:
        self.sinks: list[LogSink] = list(sinks)
        """Called with every log line, those of supervisors' reports included."""
        self.reports: list[Callable[[Report], None]] = []
        """Called with every report of a supervisor, before it is logged."""
        self.parameters: list[Callable[[Incarnation, ParameterChange], None]] = []
        """Called when parameters were declared, set or undeclared, but not for those declared before the first of these was added."""
        self.ready: list[Callable[[Incarnation], None]] = []
        """Called when an incarnation has become ready, before it handles any item of its inbox."""
        self.answered: list[Callable[[Exception], None]] = []
        """Called with the error that left a service handler or an action body, which is the answer to the caller."""
        self.calls: list[Callable[[str, str], CallEvents]] = []
        """Called with a node and a service when the node opens a server or a client of it; what they return is told of its calls."""
        self.goals: list[Callable[[ActionServer], None]] = []
        """Called with every action server when it is opened."""
        self.ended: list[Callable[[Incarnation], None]] = []
        """Called when an incarnation has ended and closed its endpoints; its tasks may still be ending."""
        self.dismissed: list[Callable[[NodeRecord], None]] = []
        """Called when a node has ended for good and its endpoints are closed; may be called again for the same node."""
        self.leases: list[Callable[[], Iterable[HostLease]]] = []
        """Called for the leases of the machines to which parts of the tree are given, when they are to be shown."""
        self.opening: list[Callable[[], Coroutine[Any, Any, None]]] = []
        """Run beside the start of the tree, which is over when they have returned. They must not raise."""
        self.closing: list[Callable[[], Coroutine[Any, Any, None]]] = []
        """Run after the tree and the nodes beside it have ended, before the stop of the system returns. They must not raise."""
        self.tree_ended: list[Callable[[], None]] = []
        """Called when the tree has ended, for any reason."""
        self.closed: list[Callable[[], None]] = []
        """Called when the system has ended: the tree, and the nodes beside it."""

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
