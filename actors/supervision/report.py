"""The supervisor's reports: one structured value per event."""

from __future__ import annotations

from typing import Literal, TypeAlias

import msgspec

from actors.supervision.policy import Restart
from actors.supervision.reasons import ExitReason
from actors.supervision.refs import ChildRef

__all__ = ["Context", "Report"]

Context: TypeAlias = Literal["child_terminated", "start_error", "shutdown_error", "shutdown", "progress", "unexpected"]
"""child_terminated: a child ended by itself and is restarted, or ended abnormally. start_error: a start phase failed.
shutdown_error: a child that had to stop did not do so cleanly. shutdown: the supervisor itself gives up, or shuts down
for a significant child. progress: a child is ready. unexpected: a signal that makes no sense was dropped."""


class Report(msgspec.Struct, frozen=True):
    """One event. `at` is the time of the event loop, in seconds; `reason` is None for progress and the unexpected."""

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
