"""The log line of a supervisor's report: its level, its text and its fields."""

from __future__ import annotations

from typing import Any

from actors.logs.levels import Level
from actors.supervision.reasons import Returned, Stopped, is_abnormal
from actors.supervision.report import Report


def log_line(report: Report, ended_at: float | None) -> tuple[int, str, dict[str, Any]]:
    """The level, the text and the fields of a report's log line. `ended_at` is the loop time at which the child's last life ended, or None.

    The number of the child's life is not among the fields: the log line itself has it.
    """
    child, supervisor = report.child.id, report.supervisor[-1]
    fields: dict[str, Any] = {"child": "/".join(report.child.path)}
    if report.context == "progress":
        if report.child.incarnation == 1:
            return Level.DEBUG, f"started {child}", fields
        return Level.INFO, f"restarted {child} (life {report.child.incarnation}){_after(report, ended_at)}", fields
    if report.context == "shutdown" and report.note.startswith("auto_shutdown="):
        return Level.INFO, f"{supervisor} stops, because {child} has ended: {_end(report)}", fields
    if report.reason is not None:
        fields["reason"] = str(report.reason)
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
