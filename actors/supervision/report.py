"""The reports of a supervisor: one value for each event."""

from __future__ import annotations

from typing import Literal, TypeAlias

import msgspec

from actors.supervision.policy import Restart
from actors.supervision.reasons import ExitReason
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
