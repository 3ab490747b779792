"""The journal of a system: its log lines and its supervisors' reports, kept and passed on."""

from __future__ import annotations

import asyncio
from collections import deque
from typing import TYPE_CHECKING

from actors.logs import DEBUG, LogRecord, NodeLog
from actors.places import place_of
from actors.supervision.log_lines import log_line
from actors.supervision.reasons import cause_of

if TYPE_CHECKING:
    from actors.logs.levels import NanosecondClock
    from actors.runtime.observers import Observers
    from actors.runtime.options import RunOptions
    from actors.supervision.report import Report
    from actors.time.clock import Clock

__all__ = ["Journal"]


class Journal:
    """Log lines and reports of one system.

    Invariants: `records` and `reports` hold the newest of each in the order in which they came. A line is in `records` before a sink sees it,
    and every sink sees it before the next line. An error is shown with its traceback in one line only: the first that tells of it.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        clock: Clock,
        level: int,
        observers: Observers,
        options: RunOptions | None,
    ) -> None:
        self.level = level
        """Lines below this level are not written, unless a node's log was given another one."""
        self.records: deque[LogRecord] = deque(maxlen=1000)
        self.reports: deque[Report] = deque(maxlen=10_000)
        self._loop = loop
        self._clock = clock
        self._observers = observers
        self._options = options
        self._levels: dict[str, int] = {}
        self._errors: dict[tuple[type[BaseException], str], int] = {}
        self._last_error: BaseException | None = None

    def log(self, node: str, incarnation: int, throttle_clock: NanosecondClock | None = None) -> NodeLog:
        """The log of one life of a node, with the level that was last set for it."""
        return NodeLog(
            node,
            incarnation,
            self._clock,
            self.write,
            self.level if self._options is None else self._options.level(node),
            levels=self._levels,
            throttle_clock=throttle_clock,
        )

    def write(self, record: LogRecord) -> None:
        """Keep a line and hand it to all sinks. A sink that raises loses it, and the event loop's exception handler is told."""
        self.records.append(record)
        for sink in self._observers.sinks:
            try:
                sink(record)
            except Exception as error:  # a pipe that broke, a disk that is full: no reason for a robot to fall over
                message = f"the log sink {getattr(sink, '__qualname__', sink)} failed; the line is lost: {record!r}"
                self._loop.call_exception_handler({"message": message, "exception": error})
        record.let_go()

    def new_error(self, error: BaseException) -> tuple[BaseException | None, int]:
        """What a log line says of `error`: the error itself, None if the line before told of it, and its number among those of its kind.

        Errors of one type, raised at one place, are of one kind.
        """
        if error is self._last_error:
            return None, 1
        self._last_error = error
        kind = (type(error), place_of(error))
        self._errors[kind] = times = self._errors.get(kind, 0) + 1
        return error, times

    def keep(self, report: Report) -> None:
        """Keep a supervisor's report and tell the observers."""
        self.reports.append(report)
        for observer in self._observers.reports:
            observer(report)

    def write_report(self, report: Report, ended_at: float | None) -> None:
        """Log a supervisor's report in words. `ended_at`: when the last life of the node that it is about ended, loop time."""
        if report.context == "progress" and report.child.incarnation == 1 and self.level > DEBUG:
            return  # every node reports this once
        level, event, fields = log_line(report, ended_at)
        if level < self.level:
            return
        error, times = None, 1
        cause = None if report.reason is None else cause_of(report.reason)
        if cause is not None and report.context != "shutdown":  # the line before has told of that one
            if place := place_of(cause):
                fields["at"] = place
            error, times = self.new_error(cause)
        supervisor = "/".join(report.supervisor)
        self.write(
            LogRecord(self._clock.now(), level, supervisor, report.child.incarnation, event, fields, error, times)
        )
