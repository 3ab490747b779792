"""`SimulatedHosts`: agents on the machines of a simulated network."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, Final

from msgspec import structs

from actors.checks import NoPublicConstructor, create
from actors.hosts.agent import Agent, Running, Session
from actors.hosts.lease import LEASE_SECONDS
from actors.hosts.messages import Launch, Wire, for_agent, from_agent, written
from actors.processes.child_processes import simulate
from actors.processes.messages import Event, Opaque
from actors.processes.pickling import unpack
from actors.supervision.declarations import DynamicSupervisor, Spec, Supervisor
from actors.transport.protocol import Transport
from actors.transport.simulated.link import Call, Stream
from actors.transport.simulated.network import Network
from actors.waiting import wake

HERE: Final = "(here)"
"""The machine of a tree for which nobody has made a network."""

_PRIORITY = 1
"""Before what nodes tell each other."""


def hosts_of(spec: Spec) -> Iterator[str]:
    """The hosts that a declaration names, in order, some more than once."""
    if isinstance(spec, DynamicSupervisor):
        spec = spec.template
    yield from spec.hosts
    if isinstance(spec, Supervisor):
        for child in spec.children:
            yield from hosts_of(child)


def simulate_hosts(tree: Spec, seed: int) -> SimulatedHosts | None:
    """A network with all hosts that a tree names, and one for the tree; None if it names none."""
    if not (names := tuple(dict.fromkeys(hosts_of(tree)))):
        return None
    network = Network(seed)
    for name in (HERE, *names):
        network.add_host(name)
    return create(SimulatedHosts, network, HERE, names)


class SimulatedHosts(metaclass=NoPublicConstructor):
    """The machines that a tree on host `here` of a simulated network may give its parts to, with an agent on each of them.

    It has no public constructor: a `Rig` has one. What an agent and the tree tell each other goes over the same links as all else, reliably:
    over one that is cut it arrives after it was healed.
    """

    def __init__(self, network: Network, here: str, names: tuple[str, ...], *, lease: float = LEASE_SECONDS) -> None:
        self._network = network
        self._here = here
        self.names = names
        self.lease = lease
        self._agents = {name: Agent(partial(self._launch, name)) for name in names}
        self._streams: dict[str, list[Stream]] = {name: [] for name in names}
        self._runs = 0

    def cut(self, host: str) -> None:
        """Let nothing pass between a machine and the others, in either direction."""
        for other in self._others(host):
            self._network.cut(host, other)

    def heal(self, host: str) -> None:
        """Undo `cut`."""
        for other in self._others(host):
            self._network.heal(host, other)

    def count_run(self) -> int:
        """The number of a run of the tree that begins: 1, 2, ..."""
        self._runs += 1
        return self._runs

    def transport(self) -> Transport:
        """A transport for the tree itself."""
        return self._network.transport(self._here)

    def _others(self, host: str) -> Iterator[str]:
        return (name for name in (self._here, *self.names) if name != host)

    def crash(self, host: str) -> None:
        """Let a machine lose its power: what runs there ends without a word."""
        for stream in self._streams[host]:
            stream.open = False
        self._streams[host] = []
        self._agents.pop(host).kill()
        self._network.crash(host)

    def reboot(self, host: str) -> None:
        """Let a machine that has crashed come up again, with its agent."""
        self._network.reboot(host)
        self._agents[host] = Agent(partial(self._launch, host))

    async def dial(self, host: str, take: Callable[[Any], None], lost: Callable[[], None]) -> Wire:
        """Open a connection with the agent of a host. Never returns while its machine is down or cannot be reached."""
        there, back = (
            Stream((self._network.link(self._here, host),)),
            Stream((self._network.link(host, self._here),)),
        )
        answered: asyncio.Future[Session] = asyncio.get_running_loop().create_future()

        def arrive() -> None:
            if host in self._agents:
                session = self._agents[host].session(_SimulatedWire(back, from_agent, take, lost), self._here)
                self._streams[host] += (there, back)
                back.send(Call(back, 0, _PRIORITY, partial(wake, answered, session)))

        there.send(Call(there, 0, _PRIORITY, arrive))
        try:
            session = await answered
        except asyncio.CancelledError:
            there.open = back.open = False
            raise
        return _SimulatedWire(there, for_agent, session.take, session.lost)

    async def _launch(self, host: str, message: Launch, take: Callable[[Event | Opaque], None]) -> Running:
        order = structs.replace(unpack(message.order), transport=partial(self._network.transport, host))
        return await simulate(order, take)


class _SimulatedWire:
    """One end of a connection (`messages.Wire`): what it sends arrives at `take` of the other end, and at last `lost` is called there."""

    unsent = 0

    def __init__(
        self,
        stream: Stream,
        read: Callable[[bytes], object],
        take: Callable[[Any], None],
        lost: Callable[[], None],
    ) -> None:
        """`read` is how the other end reads what is sent."""
        self._stream = stream
        self._read = read
        self._take = take
        self._lost = lost
        self._closed = False

    def send(self, value: Any) -> None:
        if not self._closed:
            data = written(value)
            self._stream.send(Call(self._stream, len(data), _PRIORITY, lambda: self._take(self._read(data))))

    def close(self) -> None:
        if not self._closed:
            self._closed = True
            self._stream.send(Call(self._stream, 0, _PRIORITY, self._lost))
