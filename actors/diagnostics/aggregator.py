"""`Aggregator`: the diagnostics of all nodes, sorted by analyzers and published together."""

from __future__ import annotations

from typing import Final

from actors.contracts.contracts import Topic
from actors.diagnostics.analyzers import GENERIC, Analyzer, analyzers_of
from actors.diagnostics.status import DIAGNOSTICS, DIAGNOSTICS_AGG, LEVELS
from actors.interfaces.diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from actors.interfaces.std_msgs.msg import Header
from actors.parameters.declare import parameter
from actors.runtime.declarations import every, publishes
from actors.runtime.node import Node

TOPLEVEL: Final = Topic(DiagnosticStatus, "/diagnostics_toplevel_state")


class Aggregator(Node):
    """Sorts what comes on ``/diagnostics`` and publishes it on ``/diagnostics_agg``, and the worst level on ``/diagnostics_toplevel_state``.

    Its parameters are those of diagnostic_aggregator: ``path``, ``pub_rate``, ``other_as_errors`` and
    ``analyzers.<name>.<option>`` for analyzers of the type ``diagnostic_aggregator/GenericAnalyzer``. What no analyzer takes is reported
    under ``Other``.
    """

    node_name = "diagnostic_aggregator"
    automatically_declare_parameters_from_overrides = True

    path = parameter("")
    pub_rate = parameter(1.0, unit="Hz")
    other_as_errors = parameter(False)
    aggregated = publishes(DIAGNOSTICS_AGG)
    toplevel = publishes(TOPLEVEL)

    async def on_start(self) -> None:
        base = f"/{self.path.strip('/')}".rstrip("/")
        given = self.get_parameters_by_prefix("analyzers")
        self.analyzers = analyzers_of(base, {name: one.value for name, one in given.items()})
        self.other = Analyzer(base, "Other", {"type": GENERIC, "discard_stale": True})

    @DIAGNOSTICS.on(qos=1000)
    def take(self, message: DiagnosticArray) -> None:
        """Give each status to the analyzers that match it."""
        now = self.clock.now()
        for status in message.status:
            takers = [one for one in self.analyzers if one.matches(status.name)]
            for one in takers or [self.other]:
                if one is self.other and self.other_as_errors:
                    status = status.replace(level=DiagnosticStatus.ERROR)
                one.take(status, now)

    @every(hz="pub_rate")
    def report(self) -> None:
        now, stamp = self.clock.now(), self.clock.stamp()
        headers: list[DiagnosticStatus] = []
        statuses: list[DiagnosticStatus] = []
        for one in (*self.analyzers, self.other):
            header, *items = one.report(now)
            if items or one is not self.other:
                headers.append(header)
                statuses += [header, *items]
        self.aggregated(DiagnosticArray(header=Header(stamp=stamp), status=statuses))
        worst = _worst(headers)
        self.toplevel(DiagnosticStatus(level=worst, name="toplevel_state", message=LEVELS.get(worst, str(worst))))


def _worst(headers: list[DiagnosticStatus]) -> int:
    """The worst level of several headers; stale is an error unless all are stale."""
    levels = {header.level for header in headers} or {DiagnosticStatus.OK}
    worst = max(levels)
    return DiagnosticStatus.ERROR if worst == DiagnosticStatus.STALE and len(levels) > 1 else worst
