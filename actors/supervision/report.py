"""The reports of a supervisor: one value for each event, and its log line."""

from __future__ import annotations

from typing import Literal, TypeAlias

import msgspec

from actors.logs.levels import Level
from actors.supervision.policy import Restart
from actors.supervision.reasons import ExitReason, Returned, Stopped, is_abnormal
from actors.supervision.refs import ChildRef

Context: TypeAlias = Literal["child_terminated", "start_error", "shutdown_error", "shutdown", "progress", "unexpected"]
"""The kind of a report.

- child_terminated: a child ended by itself and is restarted, or ended abnormally.
- start_error: a start phase failed.
- shutdown_error: a child that was to stop did not stop in order.
- shutdown: the supervisor gives up, or shuts down because of a significant child.
- progress: a child is ready.
- unexpected: a life called `started()` a second time, or after its end; the call was ignored.
"""


class Report(msgspec.Struct, frozen=True):
    """One event of a supervisor. `at` is loop time in seconds; `reason` is None for "progress" and "unexpected"."""

    context: Context
    supervisor: tuple[str, ...]
    child: ChildRef
    restart: Restart
    at: float
    reason: ExitReason | None = None
    note: str = ""

    def __str__(self) -> str:
        text = f"{'/'.join(self.supervisor)}: {self.context}: {self.child.id} (incarnation {self.child.incarnation})"
        details = "; ".join(str(detail) for detail in (self.reason, self.note) if detail)
        return f"{text}: {details}" if details else text


def log_line(report: Report, reason: str, ended_at: float | None) -> tuple[int, str, dict[str, object]]:
    """The level, the text and the fields of a report's log line. `reason` is the text of its reason, `ended_at` the loop time at which the
    child's last life ended, or None.

    The number of the child's life is not among the fields: the log line itself has it.
    """
    child, supervisor = report.child.id, report.supervisor[-1]
    fields: dict[str, object] = {"child": "/".join(report.child.path)}
    if report.context == "progress":
        if report.child.incarnation == 1:
            return Level.DEBUG, f"started {child}", fields
        return Level.INFO, f"restarted {child} (life {report.child.incarnation}){_after(report, ended_at)}", fields
    if report.context == "shutdown" and report.note.startswith("auto_shutdown="):
        return Level.INFO, f"{supervisor} stops, because {child} has ended: {_end(report)}", fields
    if reason:
        fields["reason"] = reason
    if report.context == "shutdown":
        return Level.ERROR, f"{supervisor} gives up: {report.note}", fields
    if report.note:
        fields["note"] = report.note
    harmless = report.context == "child_terminated" and report.reason is not None and not is_abnormal(report.reason)
    level = Level.WARN if harmless else Level.ERROR
    return level, report.context.replace("_", " "), fields


def _after(report: Report, ended_at: float | None) -> str:
    if ended_at is None:
        return ""
    seconds = report.at - ended_at
    return f" after {seconds:.3g} s" if seconds >= 0.0005 else " at once"


def _end(report: Report) -> str:
    """How a significant child ended, as a phrase for the log line."""
    reason = report.reason
    if isinstance(reason, Stopped):
        return reason.why
    return "its work is done" if isinstance(reason, Returned) else str(reason)
