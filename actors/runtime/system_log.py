"""The log of a system: keeps its log lines and its supervisors' reports, and passes them on."""

from __future__ import annotations

import asyncio
import re
from collections import deque
from typing import TYPE_CHECKING, Final

from actors.checks import create
from actors.inbox.boundary import BOUNDARY, outside
from actors.logs import DEBUG, LEVEL_NAMES, LogRecord, NodeLog
from actors.places import place_of
from actors.supervision.reasons import cause_of
from actors.supervision.report import log_line

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from actors.logs import LogSink
    from actors.logs.levels import LevelTree, NanosecondClock
    from actors.supervision.report import Report
    from actors.time.clock import Clock

_ADDRESS: Final = re.compile(r" at 0x[0-9a-f]+")
"""Where an object lies in memory, in its representation: it differs from run to run."""


class SystemLog:
    """The log lines and reports of one system. It gives them to `sinks` and `observers`, to which others may be added at any time.

    Invariants:

    - `records` holds the newest 1000 log lines and `reports` the newest 10,000 reports, in the order in which they came.
    - A line is in `records` before the first sink gets it.
    - Of the lines about one error only the first shows its traceback, unless there is a line about another error in between.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        clock: Clock,
        levels: LevelTree,
        sinks: Iterable[LogSink],
        observers: Iterable[Callable[[Report], None]],
    ) -> None:
        self.levels = levels
        self.records: deque[LogRecord] = deque(maxlen=1000)
        self.reports: deque[Report] = deque(maxlen=10_000)
        self._loop = loop
        self._clock = clock
        self._sinks, self._observers = sinks, observers
        self._errors: dict[tuple[type[BaseException], str], int] = {}
        self._last_error: BaseException | None = None

    def log(self, node: str, incarnation: int, throttle_clock: NanosecondClock | None = None) -> NodeLog:
        """A log for one life of a node, with the level that was last set for that node."""
        return create(NodeLog, node, incarnation, self._clock, self.write, self.levels, throttle_clock)

    @property
    def level(self) -> int:
        """The least level that is written, unless a logger has a level of its own."""
        return self.levels.default

    def write(self, record: LogRecord) -> None:
        """Keep a line and give it to all sinks. If a sink raises, the event loop's exception handler is called, and the others get it."""
        self.records.append(record)
        if (boundary := BOUNDARY.get()) is None:
            self._pass_on(record)
        else:
            boundary.send(
                "log", LEVEL_NAMES.get(record.level, ""), (record.event, _ADDRESS.sub("", repr(record.fields)))
            )
            with outside():
                self._pass_on(record)
        record.let_go()

    def _pass_on(self, record: LogRecord) -> None:
        for sink in self._sinks:
            try:
                sink(record)
            except Exception as error:  # a broken pipe or a full disk must not stop a robot
                message = f"the log sink {getattr(sink, '__qualname__', sink)} failed; the line is lost: {record!r}"
                self._loop.call_exception_handler({"message": message, "exception": error})

    def new_error(self, error: BaseException, place: str) -> tuple[BaseException | None, int]:
        """The error to show in a log line, None if the last line with an error showed this one, and its number among those of its kind.

        Errors of one type that were raised at one place, that of `place_of`, are of one kind; they are counted from 1.
        """
        if error is self._last_error:
            return None, 1
        self._last_error = error
        kind = (type(error), place)
        self._errors[kind] = times = self._errors.get(kind, 0) + 1
        return error, times

    def keep(self, report: Report) -> None:
        """Keep a supervisor's report and tell the observers."""
        self.reports.append(report)
        for observer in self._observers:
            observer(report)

    def write_report(self, report: Report, reason: str, ended_at: float | None) -> None:
        """Log a supervisor's report. `reason` is the text of its reason, `ended_at` the loop time at which the last life of the node in
        question ended, or None."""
        if report.context == "progress" and report.child.incarnation == 1 and self.levels.default > DEBUG:
            return  # this is reported for every node; do not even make the fields of a line that is not written
        level, event, fields = log_line(report, reason, ended_at)
        if level < self.levels.default:
            return
        error, times = None, 1
        cause = None if report.reason is None else cause_of(report.reason)
        if cause is not None and report.context != "shutdown":  # there, the line before has shown the error
            if place := place_of(cause):
                fields["at"] = place
            error, times = self.new_error(cause, place)
        supervisor = "/".join(report.supervisor)
        self.write(
            LogRecord(self._clock.now(), level, supervisor, report.child.incarnation, event, fields, error, times)
        )
