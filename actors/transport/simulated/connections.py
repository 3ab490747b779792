"""Who is connected with whom on a simulated network: how processes find each other, and how they learn that one is lost."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from random import Random

from actors.transport.protocol import WireUnavailable
from actors.transport.simulated.link import Stream
from actors.transport.simulated.session import SimulatedTransport
from actors.transport.simulated.topology import Topology

_KEEP_ALIVE = 0.25
"""The share of the lease within which every process says that it is alive: so long before a cut it may have been heard last."""


@dataclass(eq=False, slots=True)
class _Direction:
    """One half of a connection. `silence` runs while nothing can arrive from its source."""

    stream: Stream
    source: SimulatedTransport
    target: SimulatedTransport
    routed: bool
    silence: asyncio.TimerHandle | None = None


@dataclass(eq=False, slots=True)
class _Connection:
    there: _Direction
    back: _Direction

    def both(self, stream: Stream) -> tuple[_Direction, _Direction]:
        """The direction of this stream, and the other one."""
        return (self.there, self.back) if self.there.stream is stream else (self.back, self.there)


class Connections:
    """The open processes of a network, and the connections between them.

    Invariants: there is at most one connection between two processes; it ends when both have lost it, and then they look for each other
    again. A process that can hear nothing from the other for `lease` loses it, unless something is heard before; one that can still hear the
    other learns within the time of a message that the other has lost it or has died. One that stands still learns of nothing until it goes on.
    """

    def __init__(
        self, topology: Topology, lease: float, discovery: float, rng: Random, loop: asyncio.AbstractEventLoop
    ) -> None:
        self.loop = loop
        self._topology = topology
        self._lease = lease
        self._discovery = discovery
        self._rng = rng
        self._open: list[SimulatedTransport] = []
        self._connections: dict[Stream, _Connection] = {}
        self._together: set[frozenset[SimulatedTransport]] = set()
        """The pairs that are connected, or are about to be."""

    # Processes -----------------------------------------------------------------------------------------------------------

    def enter(self, transport: SimulatedTransport) -> None:
        """It is open now, and looks for others. Raises WireUnavailable."""
        if transport.closed:
            raise WireUnavailable("this transport is closed, or its process has died: make another one")
        if not self._topology.host(transport.host).up:
            raise WireUnavailable(f"the host {transport.host} is down: reboot it first")
        self._open.append(transport)
        self._seek(transport)

    def leave(self, transport: SimulatedTransport) -> None:
        """It is closed, or has died."""
        if transport in self._open:
            self._open.remove(transport)

    # Finding each other --------------------------------------------------------------------------------------------------

    def look_around(self) -> None:
        """Something has changed on the network: who is not connected may find each other now, or have lost each other."""
        for stream in tuple(self._connections):
            self._review(stream)
        for transport in tuple(self._open):
            self._seek(transport)

    def _seek(self, transport: SimulatedTransport) -> None:
        for other in self._open:
            pair = frozenset((transport, other))
            if len(pair) == 2 and pair not in self._together and self._can_meet(transport, other):
                self._together.add(pair)
                self.loop.call_later(self._discovery * (0.5 + 0.5 * self._rng.random()), self._meet, transport, other)

    def _can_meet(self, one: SimulatedTransport, other: SimulatedTransport) -> bool:
        topology = self._topology
        return not (one.closed or other.closed) and topology.can_meet(
            topology.host(one.host), topology.host(other.host)
        )

    def _meet(self, one: SimulatedTransport, other: SimulatedTransport) -> None:
        if not self._can_meet(one, other):
            self._together.discard(frozenset((one, other)))
            return
        start, end = self._topology.host(one.host), self._topology.host(other.host)
        routed = self._topology.is_routed(start, end)
        there = _Direction(Stream(self._topology.route(start, end)), one, other, routed)
        back = _Direction(Stream(self._topology.route(end, start)), other, one, routed)
        self._connections[there.stream] = self._connections[back.stream] = _Connection(there, back)
        one.connect(other, incoming=back.stream, outgoing=there.stream)
        other.connect(one, incoming=there.stream, outgoing=back.stream)
        one.greet(back.stream)
        other.greet(there.stream)

    # Losing each other ---------------------------------------------------------------------------------------------------

    def parted(self, stream: Stream) -> None:
        """Nothing is received from this stream any more."""
        connection = self._connections[stream]
        direction, opposite = connection.both(stream)
        self._hear(direction)
        if not opposite.stream.open:
            del self._connections[stream], self._connections[opposite.stream]
            self._together.discard(frozenset((direction.source, direction.target)))
            self._seek(direction.source)

    def break_off(self, *, host: str | None = None, transport: SimulatedTransport | None = None) -> None:
        """Nothing more comes from the processes of a host, or from one process; `look_around` lets the others learn of it."""
        for direction in self._directions():
            if direction.source.host == host or direction.source is transport:
                direction.stream.broken = True

    def break_routes(self) -> None:
        """Nothing passes the router any more; `look_around` lets everybody learn of it."""
        for direction in self._directions():
            if direction.routed:
                direction.stream.broken = True

    def _directions(self) -> list[_Direction]:
        return [connection.both(stream)[0] for stream, connection in self._connections.items()]

    def _review(self, stream: Stream) -> None:
        """See whether the target of this stream can hear its source, and what it hears."""
        if not stream.open:
            return
        direction, opposite = self._connections[stream].both(stream)
        if self._topology.host(direction.target.host).resumed is not None:
            self._hear(direction)  # its timers stand still, too
            return
        if self._is_silent(direction):
            if direction.silence is None:
                heard = self._lease * _KEEP_ALIVE * self._rng.random()
                direction.silence = self.loop.call_later(self._lease - heard, self._expire, direction)
            return
        self._hear(direction)
        if stream.broken or not (opposite.stream.open or direction.source.closed):
            self.loop.call_later(stream.delay, direction.target.lose, stream)

    def _is_silent(self, direction: _Direction) -> bool:
        router = self._topology.router
        return (
            direction.stream.is_cut
            or not self._topology.host(direction.source.host).up
            or (direction.routed and router is not None and not router.up)
        )

    def _hear(self, direction: _Direction) -> None:
        if direction.silence is not None:
            direction.silence.cancel()
            direction.silence = None

    def _expire(self, direction: _Direction) -> None:
        _, opposite = self._connections[direction.stream].both(direction.stream)
        direction.target.lose(direction.stream)
        self._review(opposite.stream)
