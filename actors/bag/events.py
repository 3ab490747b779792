"""Log lines and supervisor events as messages, so that one kind of file holds them beside the topics."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.message import Message
from actors.interfaces.types import default, string, uint32
from actors.logs import printable
from actors.time.values import stamp_of

if TYPE_CHECKING:
    from actors.supervision.report import Report

__all__ = ["SUPERVISOR_EVENTS", "SupervisorEvent", "event_message"]

SUPERVISOR_EVENTS = "/supervisor_events"
"""The topic of a recording that holds what the supervisors reported."""


class SupervisorEvent(Message, frozen=True, kw_only=True):
    """One event of a supervisor. `context` is a word of `actors.supervision.report.Context`; `reason` is empty where there is none."""

    stamp: Time = default()
    supervisor: string = ""
    context: string = ""
    child: string = ""
    incarnation: uint32 = 0
    restart: string = ""
    reason: string = ""
    note: string = ""


def event_message(report: Report, nanoseconds: int) -> SupervisorEvent:
    """The message for a report of this wall time. It keeps the words of an error, not the error and all that hangs on it."""
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
