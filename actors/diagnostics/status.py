"""`Status`: what a diagnostic task fills in, and the topics on which it is published."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, TypeAlias

from actors.contracts.contracts import Topic
from actors.interfaces.diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

DIAGNOSTICS: Final = Topic(DiagnosticArray, "/diagnostics")
"""The topic on which every node publishes its own diagnostics."""
DIAGNOSTICS_AGG: Final = Topic(DiagnosticArray, "/diagnostics_agg")
"""The topic on which an aggregator publishes those of all nodes."""
LEVELS: Final = {
    DiagnosticStatus.OK: "OK",
    DiagnosticStatus.WARN: "Warning",
    DiagnosticStatus.ERROR: "Error",
    DiagnosticStatus.STALE: "Stale",
}
"""The words for the levels."""


class Status:
    """The state of one thing: a level, a message and values. A task is given one that says ERROR, "No message was set"."""

    def __init__(self, name: str, hardware_id: str = "") -> None:
        self.name = name
        self.hardware_id = hardware_id
        self.level: int = DiagnosticStatus.ERROR
        self.message = "No message was set"
        self.values: list[tuple[str, str]] = []

    def __repr__(self) -> str:
        return f"<{self.name}: {LEVELS.get(self.level, self.level)}, {self.message}>"

    def summary(self, level: int, message: str) -> None:
        """Set level and message."""
        self.level, self.message = level, message

    def ok(self, message: str = "OK") -> None:
        self.summary(DiagnosticStatus.OK, message)

    def warn(self, message: str) -> None:
        self.summary(DiagnosticStatus.WARN, message)

    def error(self, message: str) -> None:
        self.summary(DiagnosticStatus.ERROR, message)

    def merge_summary(self, level: int, message: str) -> None:
        """Add a second summary: the worse level counts, and of two that are no OK both messages are kept."""
        both = level > DiagnosticStatus.OK and self.level > DiagnosticStatus.OK
        if both:
            self.message = f"{self.message}; {message}" if self.message else message
        elif level > self.level:
            self.message = message
        self.level = max(self.level, level)

    def add(self, key: str, value: object) -> None:
        """Add a value; what is no text is shown as Python does, floats with six digits after the point."""
        self.values.append((key, f"{value:f}" if isinstance(value, float) else str(value)))

    def to_msg(self) -> DiagnosticStatus:
        values = [KeyValue(key=key, value=value) for key, value in self.values]
        return DiagnosticStatus(
            level=self.level, name=self.name, message=self.message, hardware_id=self.hardware_id, values=values
        )


Task: TypeAlias = Callable[[Status], object]
"""A diagnostic task: it is called with a `Status` and fills it in. What it returns is ignored."""
