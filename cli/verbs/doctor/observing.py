"""Looks at the graph and at this process, and returns an `Observation`."""

from __future__ import annotations

import argparse
import asyncio
import os
import sys
import time
from collections.abc import Generator, Iterable
from contextlib import contextmanager
from importlib import import_module
from typing import Final

from actors.interfaces.cdr import decode
from actors.interfaces.errors import InterfaceError
from actors.transport.domain_id import domain_from_environment
from actors.transport.environment import security_from_environment
from actors.transport.figures import FIGURES, PERIOD, ProcessFigures
from actors.transport.local_side import type_info
from actors.transport.protocol import Participant, RemoteEndpoint, RemoteNode, WireUnavailable
from cli.command import CommandFailed
from cli.graph.view import CLIENT, PUBLISHER, SERVER, SUBSCRIPTION, GraphView, transport_of
from cli.quality import add_qos_options
from cli.verbs.doctor.observation import Listened, Observation, Told, Word
from cli.verbs.topic.raw import Ear

PATIENCE: Final = 1.5 * PERIOD
"""Seconds for which a process that has told its figures once is waited for to tell them again."""


class AllDomains(GraphView):
    """The graph of one domain, and the nodes of all others that the transport shows."""

    def __init__(self, domain: int) -> None:
        super().__init__()
        self.domain: Final = domain
        self._everywhere: dict[RemoteNode, None] = {}

    def node(self, node: RemoteNode, there: bool) -> None:
        if there:
            self._everywhere[node] = None
        else:
            self._everywhere.pop(node, None)
        if node.domain_id == self.domain:
            super().node(node, there)

    def appeared(self, endpoint: RemoteEndpoint) -> None:
        if endpoint.node.domain_id == self.domain:
            super().appeared(endpoint)

    def everywhere(self) -> tuple[RemoteNode, ...]:
        """The nodes of all domains."""
        return tuple(self._everywhere)


class Reports:
    """The first and the last report of each process."""

    def __init__(self) -> None:
        self.news = asyncio.Event()
        """Set when a process has told its figures."""
        self.first: dict[str, ProcessFigures] = {}
        self.last: dict[str, ProcessFigures] = {}
        self.lags: dict[str, float] = {}
        """By the session of a process: the least time from sending to arrival, seconds; negative if its clock is ahead."""

    def take(
        self, takers: object, gid: bytes, number: int, source_time: int, payload: bytes, since: float | None
    ) -> None:
        """A process has told its figures. What cannot be read is no report."""
        try:
            figures = decode(ProcessFigures, payload)
        except InterfaceError:
            return
        self.first.setdefault(figures.session, figures)
        self.last[figures.session] = figures
        lag = _lag(source_time)
        self.lags[figures.session] = min(lag, self.lags.get(figures.session, lag), key=abs)
        self.news.set()

    def twice(self) -> tuple[Told, ...]:
        """Those that have told twice."""
        return tuple(
            Told(one, self.last[session]) for session, one in self.first.items() if self.last[session] is not one
        )


async def observe(options: argparse.Namespace, asked: tuple[Word, str] | None, wanted: str) -> Observation:
    """Look at the graph for `options.seconds` at least. Raises `CommandFailed` if the network cannot be reached."""
    security = _security_shown(options)
    transport = transport_of(options)
    view, reports = AllDomains(domain_from_environment(os.environ)), Reports()
    try:
        participant = await transport.join(view.domain, view, beyond=True)
        view.complete = lambda: participant.complete
    except (WireUnavailable, ValueError) as error:
        raise CommandFailed(str(error)) from error
    try:
        with _watched(participant, reports):
            await view.settle(options.spin_time)
            ends = tuple(view.endpoints(PUBLISHER, SUBSCRIPTION, SERVER, CLIENT))
            topic = asked[1] if asked is not None and asked[0] == "topic" else None
            listened = await _listen(view, participant, topic, options.seconds)
            await _told_twice(reports)
        return Observation(
            domain=view.domain,
            nodes=view.everywhere(),
            ends=ends,
            told=reports.twice(),
            processes=tuple(reports.last.values()),
            lags=reports.lags,
            listened=listened,
            implementation=os.environ.get("RMW_IMPLEMENTATION", ""),
            security=security,
            robots=packages_named("robot", [os.getcwd(), *sys.path]),
            asked=asked,
            wanted=wanted,
        )
    finally:
        await transport.close()


@contextmanager
def _watched(participant: Participant, reports: Reports) -> Generator[None]:
    """Let the processes of a domain tell their figures, for as long as the block lasts."""
    told = participant.subscription(None, FIGURES.name, type_info(ProcessFigures), FIGURES.qos, reports.take, reports)
    try:
        yield
    finally:
        told.close()


async def _listen(view: GraphView, participant: Participant, name: str | None, seconds: float) -> dict[str, Listened]:
    """Wait, and meanwhile listen to a topic if it has ends."""
    ends = [] if name is None else view.endpoints(PUBLISHER, SUBSCRIPTION, name=name)
    if name is None or not ends:
        await asyncio.sleep(seconds)
        return {}
    lags: list[float] = []
    ear = Ear(view, participant, f"_robactor_cli_{os.getpid()}")
    begun = asyncio.get_running_loop().time()
    with ear.node(), ear.subscribe(name, ends, _any_quality(), lambda arrival: lags.append(_lag(arrival.source_time))):
        await asyncio.sleep(seconds)
        lag = min(lags, key=abs, default=None)
        return {name: Listened(len(lags), asyncio.get_running_loop().time() - begun, lag)}


def _lag(source_time: int) -> float:
    """Seconds since this time of sending, in nanoseconds since 1970, by the clock of this machine."""
    return (time.time_ns() - source_time) / 1e9


def _any_quality() -> argparse.Namespace:
    """Options that let a subscription fit itself to the publishers."""
    parser = argparse.ArgumentParser()
    add_qos_options(parser, "subscription", "sensor_data")
    return parser.parse_args([])


async def _told_twice(reports: Reports) -> None:
    """Wait until each process that has told its figures has told them twice, or until `PATIENCE` is over."""
    end = asyncio.get_running_loop().time() + PATIENCE
    while len(reports.twice()) < len(reports.first) and asyncio.get_running_loop().time() < end:
        reports.news.clear()
        try:
            async with asyncio.timeout_at(end):
                await reports.news.wait()
        except TimeoutError:
            return


def _security_shown(options: argparse.Namespace) -> tuple[str, ...]:
    """What the security file says that is used; empty without one."""
    from cli.verbs.security import shown

    try:
        security = security_from_environment(os.environ, options.security)
    except WireUnavailable as error:
        raise CommandFailed(str(error)) from error
    return () if security is None else tuple(shown(security))


def packages_named(name: str, path: Iterable[str]) -> tuple[str, ...]:
    """Where the package or module of this name is that is imported, and then where on the path others of the name are."""
    used = import_module(name).__file__ or ""
    found = {os.path.realpath(used): used}
    for folder in path:
        for file in (os.path.join(folder, name, "__init__.py"), os.path.join(folder, f"{name}.py")):
            if os.path.isfile(file):
                found.setdefault(os.path.realpath(file), file)
    return tuple(found.values())
