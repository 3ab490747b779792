"""The machines of a simulated network, the links between them, and the ways that messages take."""

from __future__ import annotations

import asyncio
from random import Random
from typing import Literal, TypeAlias

from actors.suggest import did_you_mean
from actors.transport.simulated.link import LOOPBACK, Arrivals, Conditions, Link

Mode: TypeAlias = Literal["peer", "client"]


class Host:
    """One machine. All its processes reach others directly (``peer``), or by the router only (``client``)."""

    def __init__(self, name: str, mode: Mode, clock_offset: float) -> None:
        self.name = name
        self.mode: Mode = mode
        self.clock_offset = clock_offset
        """Seconds by which its time of day is ahead of the true one. The network does not use it."""
        self.up = True
        self.resumed: asyncio.Future[None] | None = None
        """Done when its processes, which stand still, go on; None while they run."""

    def __repr__(self) -> str:
        return f"<Host {self.name} {self.mode}{'' if self.up else ' down'}>"


class Topology:
    """Hosts, links and the router. Invariant: a link draws from a generator of its own, so that the traffic of others changes nothing for it."""

    def __init__(self, seed: int, conditions: Conditions, loop: asyncio.AbstractEventLoop) -> None:
        self._seed = seed
        self._conditions = conditions
        self._loop = loop
        self._arrivals = Arrivals(loop)
        self._hosts: dict[str, Host] = {}
        self._links: dict[tuple[str, str], Link] = {}
        self.router: Host | None = None
        """The machine on which the router of this network runs, or ran; None if processes find each other without one."""
        self.routes = True
        """Whether the router runs, if there is one; never while its machine is down."""

    def add_host(self, name: str, mode: Mode, clock_offset: float, router: bool) -> Host:
        if name in self._hosts:
            raise ValueError(f"there is a host {name!r} already")
        if router and self.router is not None:
            raise ValueError(f"a network has one router, and it is on {self.router.name!r}")
        self._hosts[name] = host = Host(name, mode, clock_offset)
        if router:
            self.router = host
        return host

    def host(self, name: str) -> Host:
        if name not in self._hosts:
            raise ValueError(f"there is no host {name!r}{did_you_mean(name, self._hosts)}")
        return self._hosts[name]

    def link(self, source: str, target: str) -> Link:
        """The link from one host to another, or between the processes of one."""
        if (link := self._links.get((source, target))) is None:
            name = f"{self.host(source).name}>{self.host(target).name}"
            conditions = LOOPBACK if source == target else self._conditions
            link = Link(conditions, Random(f"link/{self._seed}/{name}"), self._arrivals, self._loop)
            self._links[source, target] = link
            for end in (source, target):
                if self._hosts[end].resumed is not None:
                    link.cut(end)
        return link

    def links_from(self, source: str) -> list[Link]:
        return [link for (start, _), link in self._links.items() if start == source]

    def links_of(self, host: str) -> list[Link]:
        """The links from a host, to it, and between its processes."""
        return [link for ends, link in self._links.items() if host in ends]

    def is_routed(self, one: Host, other: Host) -> bool:
        """Whether messages between the two pass the router."""
        return "client" in (one.mode, other.mode)

    def route(self, source: Host, target: Host) -> tuple[Link, ...]:
        """The links from one host to another."""
        if self.router is not None and self.is_routed(source, target):
            return self.link(source.name, self.router.name), self.link(self.router.name, target.name)
        return (self.link(source.name, target.name),)

    def can_meet(self, one: Host, other: Host) -> bool:
        """Whether processes of the two, which are up, can find each other and connect now."""
        needed = [*self.route(one, other), *self.route(other, one)]
        if self.router is not None:
            if not self.routes:
                return False
            for host in (one, other):
                needed += self.link(host.name, self.router.name), self.link(self.router.name, host.name)
        elif self.is_routed(one, other):
            return False
        return not any(link.is_cut for link in needed)
