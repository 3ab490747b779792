"""A doctor that stays: it looks at a running system from inside it, again and again, with the checks that `doctor` makes from outside."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from actors.interfaces.foreign import ForeignType
from actors.names.names import is_hidden
from actors.qos.policies import QoS
from actors.qos.profiles import SERVICES
from actors.transport.domain_id import domain_from_environment
from actors.transport.figures import PERIOD, ProcessFigures, process_figures
from actors.transport.format.tokens import EndpointKind
from actors.transport.local_side import type_info
from actors.transport.protocol import RemoteEndpoint, RemoteNode
from actors.transport.standard_names import standard_services
from cli.graph.view import CLIENT, PUBLISHER, SERVER, SUBSCRIPTION, Endpoint
from cli.verbs.doctor.observation import Observation, Told

if TYPE_CHECKING:
    from actors import System
    from actors.graph.servers import ServiceEntry

LOST: Final = 3.5 * PERIOD
"""A process that has not told its figures for so many seconds has ended."""
UNKNOWN: Final = ForeignType("", "")
"""The type of what is not served now."""


@dataclass
class _Reports:
    """The last two reports of a process."""

    before: ProcessFigures
    last: ProcessFigures
    lag: float | None
    """The least time from sending to arrival, seconds; None for this process."""
    heard: float
    """When the last one came, in seconds on the clock of the system."""


class Inside:
    """Observations of one system and of the others that it reaches. What those tell of themselves has to be given to `take`.

    Invariant: `_reports` holds, by session, each process that has told its figures within `LOST`; this one has the session "".
    """

    def __init__(self, system: System) -> None:
        self._system = system
        self._reports: dict[str, _Reports] = {}
        self._domain = domain_from_environment(os.environ)

    def take(self, figures: ProcessFigures, lag: float | None = None) -> None:
        """Note the figures of a process. `lag` is the time from sending to arrival, seconds."""
        now, known = self._system.clock.now(), self._reports.get(figures.session)
        if known is None:
            self._reports[figures.session] = _Reports(figures, figures, lag, now)
            return
        known.before, known.last, known.heard = known.last, figures, now
        if lag is not None:
            known.lag = lag if known.lag is None else min(lag, known.lag, key=abs)

    @property
    def others(self) -> tuple[Told, ...]:
        """The last two reports of each other process; the same one twice where it has made one only."""
        return tuple(Told(one.before, one.last) for one in self._reports.values() if one.last.session)

    def look(self) -> Observation:
        """What there is now. The figures of this process are those since the look before; the first look has none."""
        self.take(process_figures(self._system.runtime))
        now = self._system.clock.now()
        self._reports = {session: one for session, one in self._reports.items() if now - one.heard <= LOST}
        reports = self._reports.values()
        return Observation(
            domain=self._domain,
            nodes=tuple(self._nodes()),
            ends=(*self._ends_of_topics(), *self._ends_of_services()),
            told=tuple(Told(one.before, one.last) for one in reports if one.before is not one.last),
            processes=tuple(one.last for one in reports),
            lags={session: one.lag for session, one in self._reports.items() if one.lag is not None},
        )

    def _nodes(self) -> Iterator[RemoteNode]:
        for number, view in enumerate(self._system.snapshot().nodes):
            if view.state != "stopped":
                yield self._node(view.name, f"{view.host} {view.process}", number)

    def _node(self, fqn: str, session: str = "", number: int = 0) -> RemoteNode:
        return RemoteNode(fqn, session, number, self._domain)

    def _end(self, kind: EndpointKind, node: str, name: str, type: Any, qos: QoS) -> Endpoint:
        described = (type.__ros_type__, type.type_hash) if isinstance(type, ForeignType) else type_info(type)[:2]
        return Endpoint(RemoteEndpoint(self._node(node), kind, name, *described, qos, b""))

    def _ends_of_topics(self) -> Iterator[Endpoint]:
        for name, entry in self._system.graph.topics.items():
            for publisher in entry.publishers:
                yield self._end(PUBLISHER, publisher.node.fqn, name, publisher.type, publisher.qos)
            for subscription in entry.subscriptions:
                if not is_hidden(subscription.node.fqn):  # tools listen to whatever there is
                    yield self._end(SUBSCRIPTION, subscription.node.fqn, name, subscription.type, subscription.qos)

    def _ends_of_services(self) -> Iterator[Endpoint]:
        for name, entry in self._system.graph.services.items():
            served = self._servers(entry)
            for host, type in served.items():
                yield self._end(SERVER, host, name, type, SERVICES)
            asked = next(iter(served.values()), UNKNOWN)  # the graph does not know what clients ask for
            for client in entry.clients:
                if not is_hidden(client):
                    yield self._end(CLIENT, client, name, asked, SERVICES)

    def _servers(self, entry: ServiceEntry) -> dict[str, Any]:
        """The nodes that serve a name with the types; without any, the one that will when it is asked or has been restarted."""
        served = {one.host: one.type for one in (entry.local, *entry.remotes) if one is not None}
        if served:
            return served
        if entry.restarting is not None:
            return {entry.restarting[0]: UNKNOWN}
        lives = [record.life for record in self._system.nodes.values() if record.life is not None]
        owners = [life for life in lives if entry.name.startswith(f"{life.fqn}/")]
        return {life.fqn: one.type for life in owners for one in standard_services(life) if one.name == entry.name}
