"""`Placing`: gives the children of one tree that belong on other machines to them."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from itertools import count
from typing import Any, Final, Protocol

from msgspec import structs

from actors.errors import DeclarationError
from actors.hosts.host import Host
from actors.hosts.launcher import transport_here
from actors.hosts.messages import Wire
from actors.hosts.remote import RemoteProcess
from actors.logs import NodeLog
from actors.processes.life import Launch
from actors.processes.messages import Event, Order, Over
from actors.runtime.placement import Placement
from actors.runtime.runtime import HostLease, Runtime
from actors.suggest import did_you_mean
from actors.supervision.reasons import Failed

LOOKING_SECONDS: Final = 0.05
"""Seconds between two looks for a host that takes a child."""


class Hosts(Protocol):
    """The machines that a tree may give its parts to: their names, the lease of their agents in seconds, and the way to them."""

    @property
    def names(self) -> tuple[str, ...]: ...

    @property
    def lease(self) -> float: ...

    async def dial(self, host: str, take: Callable[[Any], None], lost: Callable[[], None], /) -> Wire:
        """Open a connection with the agent of a host; `take` gets what it sends. Raises OSError."""
        ...

    def count_run(self) -> int:
        """The number of a run of the tree that begins: larger than those of all before, whatever has become of them. Raises DeclarationError."""
        ...


def elsewhere(hosts: Hosts, runtime: Runtime) -> Launch:
    """What launches the processes of a system on other machines; it lets go of them when the system ends."""
    placing = Placing(hosts, runtime.log, runtime.placement.run)
    runtime.observers.closing.append(placing.close)
    runtime.observers.leases.append(placing.leases)
    return placing.launch


class Placing:
    """The hosts of one tree, each connected from the first child on that may be given to it.

    Invariants:

    - There is one process at a time for each path: the next one is placed when the one before has ended for certain.
    - `_placements` counts how often anything was given away in this run of the tree, so a later incarnation has a larger
      `Node.fencing_token`.
    """

    def __init__(self, hosts: Hosts, log: NodeLog, run: int) -> None:
        self._hosts = hosts
        self._log = log
        self._run = run
        self._connected: dict[str, Host] = {}
        self._placements = count(1)
        self._last: dict[tuple[str, ...], RemoteProcess] = {}
        self._seeking: set[asyncio.Task[None]] = set()

    async def launch(self, order: Order, take: Callable[[Event], None]) -> RemoteProcess:
        """A process for this order, on the first of its hosts that can be reached. It is returned at once; its place may take long.

        Raises `DeclarationError` for a host that the tree does not know.
        """
        for name in order.spec.hosts:
            if name not in self._hosts.names:
                raise DeclarationError(
                    f"{order.spec!r}: run(hosts=...) does not say where {name!r} is{did_you_mean(name, self._hosts.names)}"
                )
        hosts = [self._connect(name) for name in order.spec.hosts]
        process, before = RemoteProcess(order, take), self._last.get(order.path)
        self._last[order.path] = process
        task = asyncio.get_running_loop().create_task(self._place(process, before, hosts), name=f"place of {process!r}")
        self._seeking.add(task)
        task.add_done_callback(self._seeking.discard)
        return process

    async def close(self) -> None:
        """Let go of all hosts."""
        for task in self._seeking:
            task.cancel()
        for host in self._connected.values():
            await host.close()

    def leases(self) -> Iterator[HostLease]:
        """Those of the hosts that a child may have been given to, by name."""
        return (self._connected[name].lease for name in sorted(self._connected))

    def _connect(self, name: str) -> Host:
        if name not in self._connected:
            self._connected[name] = Host(name, self._hosts.lease, self._hosts.dial, self._log)
        return self._connected[name]

    async def _place(self, process: RemoteProcess, before: RemoteProcess | None, hosts: list[Host]) -> None:
        """Give the process to the first of the hosts that takes it, once the process before it has ended."""
        if before is not None:
            await asyncio.wait([before.ended])
        waits = False
        while not process.ended.done():
            if (host := _first_usable(hosts)) is not None:
                placement = Placement(self._run, next(self._placements))
                order = structs.replace(process.order, placement=placement, transport=transport_here)
                try:
                    host.launch(process, order)
                except Exception as error:  # something in it cannot be copied
                    process.take(Over(Failed(error)))
                    process.end(error)
                return
            if not waits and all(one.tried for one in hosts):
                waits = True
                self._log.warning(
                    "waiting for a host", child="/".join(process.order.path), hosts=[host.name for host in hosts]
                )
            await asyncio.sleep(LOOKING_SECONDS)


def _first_usable(hosts: list[Host]) -> Host | None:
    """The first host that takes a process; None if there is none yet, or one before it has not been tried yet."""
    for host in hosts:
        if host.usable:
            return host
        if not host.tried:
            return None
    return None
