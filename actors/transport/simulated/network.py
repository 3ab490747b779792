"""A simulated network: the processes of several machines on one event loop, and what goes wrong between them."""

from __future__ import annotations

import asyncio
from collections import Counter
from functools import partial
from random import Random

from actors.transport.format.names import new_session
from actors.transport.simulated.connections import Connections
from actors.transport.simulated.link import LAN, Conditions, Link
from actors.transport.simulated.session import SimulatedTransport
from actors.transport.simulated.topology import Host, Mode, Topology


class Network:
    """Hosts by name, the links between them, and the transports of their processes. It is made while its event loop runs.

    Guarantee: everything random is drawn from `seed`, so that a run on a virtual loop that does the same things at the same times has
    the same course.

    `lease` is the time in seconds after which a process that is not heard any more is lost, `discovery` the time within which two that
    can reach each other connect, and `conditions` those of all links between hosts that are not set otherwise. If one host has a
    router, processes find each other by it. Those on hosts in mode ``client`` also exchange everything by it, and reach nobody when it
    is gone; the others keep their connections. Without a router, peers find each other, and clients reach nobody.

    A process notices the silence of a cut or dead machine only; a link that is slow or loses much passes for alive.
    """

    def __init__(
        self, seed: int = 0, *, lease: float = 2.0, discovery: float = 0.05, conditions: Conditions = LAN
    ) -> None:
        loop = asyncio.get_running_loop()
        self._seed = seed
        self._topology = Topology(seed, conditions, loop)
        self._connections = Connections(self._topology, lease, discovery, Random(f"connections/{seed}"), loop)
        self._processes: Counter[str] = Counter()
        self._transports: list[SimulatedTransport] = []

    # Hosts and their processes -------------------------------------------------------------------------------------------

    def add_host(self, name: str, mode: Mode = "peer", *, clock_offset: float = 0.0, router: bool = False) -> Host:
        """Add a machine, with the router of the network if it is said. Raises ValueError if the name or the router is there already."""
        return self._topology.add_host(name, mode, clock_offset, router)

    def host(self, name: str) -> Host:
        """Raises ValueError if there is none of that name, as all methods here do."""
        return self._topology.host(name)

    def transport(self, host: str) -> SimulatedTransport:
        """A transport for one more process on a host, not yet open."""
        self._topology.host(host)
        self._processes[host] += 1
        number = self._processes[host]
        session = new_session(Random(f"session/{self._seed}/{host}/{number}"))
        transport = SimulatedTransport(
            self._connections, session, host, number, partial(self.transport, host), self.kill
        )
        self._transports = [*(one for one in self._transports if not one.closed), transport]
        return transport

    def kill(self, transport: SimulatedTransport) -> None:
        """End a process without a farewell, as ``kill -9`` does. Its machine tells the others at once."""
        self._connections.break_off(transport=transport)
        transport.kill()
        self._connections.look_around()

    def crash(self, host: str) -> None:
        """Let a machine lose its power, and its router with it. Its transports are dead; the others notice that it is silent."""
        machine = self._topology.host(host)
        self.resume(host)
        machine.up = False
        self._connections.break_off(host=host)
        if machine is self._topology.router:
            self._topology.routes = False
            self._connections.break_routes()
        for link in self._topology.links_from(host):
            link.clear()
        for transport in self._transports:
            if transport.host == host:
                transport.kill()
        self._connections.look_around()

    def reboot(self, host: str) -> None:
        """Let a machine that has crashed come up again, and its router. Its processes need new transports."""
        machine = self._topology.host(host)
        if not machine.up:
            machine.up = True
            if machine is self._topology.router:
                self._topology.routes = True
            self._connections.look_around()

    def pause(self, host: str) -> None:
        """Let the processes of a machine stand still until `resume`, as a debugger and a suspended laptop do. Nothing comes from them, what is
        sent to them with best effort is lost, and what is reliable waits. Others lose them after the lease; they notice nothing themselves.
        """
        machine = self._topology.host(host)
        if machine.up and machine.resumed is None:
            machine.resumed = self._connections.loop.create_future()
            for link in self._topology.links_of(host):
                link.cut(host)
            self._connections.look_around()

    def resume(self, host: str) -> None:
        """Undo `pause`. Who has lost them meanwhile, and is found again, is another connection for both. A crash undoes it, too."""
        machine = self._topology.host(host)
        if machine.resumed is not None:
            machine.resumed.set_result(None)
            machine.resumed = None
            for link in self._topology.links_of(host):
                link.heal(host)
            self._connections.look_around()

    # The router ----------------------------------------------------------------------------------------------------------

    def stop_router(self) -> None:
        """End the process of the router. The processes that are connected by it learn of it at once. Without a router nothing happens."""
        self._topology.routes = False
        self._connections.break_routes()
        self._connections.look_around()

    def start_router(self) -> None:
        """Start it again, if its machine is up."""
        router = self._topology.router
        self._topology.routes = router is None or router.up
        self._connections.look_around()

    # Links ---------------------------------------------------------------------------------------------------------------

    def link(self, source: str, target: str) -> Link:
        """The link from one host to another, in this direction, or between the processes of one host."""
        return self._topology.link(source, target)

    def set_conditions(self, one: str, other: str, conditions: Conditions, *, one_way: bool = False) -> None:
        """Say what the link between two hosts is like, from `one` to `other` only if `one_way`."""
        for link in self._links(one, other, one_way):
            link.usual = link.conditions = conditions

    def impair(self, one: str, other: str, conditions: Conditions, *, one_way: bool = False) -> None:
        """Change the conditions until `repair`."""
        for link in self._links(one, other, one_way):
            link.conditions = conditions

    def repair(self, one: str, other: str, *, one_way: bool = False) -> None:
        """Undo `impair`."""
        for link in self._links(one, other, one_way):
            link.conditions = link.usual

    def cut(self, one: str, other: str, *, one_way: bool = False) -> None:
        """Let nothing pass between two hosts, or from `one` to `other` if `one_way`. What is on its way arrives."""
        for link in self._links(one, other, one_way):
            link.cut()
        self._connections.look_around()

    def heal(self, one: str, other: str, *, one_way: bool = False) -> None:
        """Undo `cut`."""
        for link in self._links(one, other, one_way):
            link.heal()
        self._connections.look_around()

    def _links(self, one: str, other: str, one_way: bool) -> list[Link]:
        there = self._topology.link(one, other)
        return [there] if one_way or one == other else [there, self._topology.link(other, one)]
