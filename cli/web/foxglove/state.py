"""What the page shows of a system beside topics: nodes, supervisors, rates, mismatches. An extension of the Foxglove protocol."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import msgspec

if TYPE_CHECKING:
    from actors.graph.snapshot import Snapshot
    from cli.web.graph.overview import Overview

ROUNDED: Final = 3


class StateReports:
    """The reports to one client. Rates are those since its last report."""

    def __init__(self, overview: Overview, *, virtual: bool) -> None:
        self._overview = overview
        self._clock = "virtual" if virtual else "real"
        self._messages: dict[str, int] = {}
        self._at: float | None = None

    def report(self, snapshot: Snapshot) -> dict[str, Any]:
        """The present state."""
        seconds = snapshot.at - self._at if self._at is not None else 0.0
        plain: dict[str, Any] = msgspec.to_builtins(snapshot)
        taken = self._overview.figures.rates()
        for topic in plain["topics"]:
            before = self._messages.get(topic["name"])
            if topic["name"] in taken:
                topic["rate"] = round(taken[topic["name"]], ROUNDED)
            elif before is not None and seconds > 0:
                topic["rate"] = round(max(0, topic["messages"] - before) / seconds, ROUNDED)
        self._messages = {topic.name: topic.messages for topic in snapshot.topics}
        self._at = snapshot.at
        return {
            "op": "robactor.system",
            **plain,
            "clock": self._clock,
            "restarts": self._overview.restarts(),
            "canKill": self._overview.can_kill,
        }
