"""Log lines and supervisor events as messages, so that they can be recorded like topics."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.message import Message
from actors.interfaces.types import default, string, uint32
from actors.logs import printable
from actors.time.values import stamp_of

if TYPE_CHECKING:
    from actors.supervision.report import Report

SUPERVISOR_EVENTS = "/supervisor_events"
"""The topic of a recording that holds the reports of the supervisors."""


class SupervisorEvent(Message, frozen=True, kw_only=True):
    """One report of a supervisor. `context` is a value of `actors.supervision.report.Context`; `reason` is empty if there is none."""

    stamp: Time = default()
    supervisor: string = ""
    context: string = ""
    child: string = ""
    incarnation: uint32 = 0
    restart: string = ""
    reason: string = ""
    note: string = ""


def event_message(report: Report, nanoseconds: int) -> SupervisorEvent:
    """Convert a report of this wall time, in nanoseconds. The text of an error is kept, not the error with the objects it refers to."""
    return SupervisorEvent(
        stamp=stamp_of(nanoseconds),
        supervisor="/".join(report.supervisor),
        context=report.context,
        child="/".join(report.child.path),
        incarnation=report.child.incarnation,
        restart=str(report.restart),
        reason=printable("" if report.reason is None else str(report.reason)),
        note=printable(report.note),
    )
