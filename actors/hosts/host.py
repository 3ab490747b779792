"""`Host`: the connection of a tree with the agent of one machine."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from functools import partial
from itertools import count
from typing import Any, Final, Protocol

from msgspec import structs

from actors.errors import ActorError, described
from actors.hosts.events import UnreadableEvent, read_event
from actors.hosts.lease import Granting
from actors.hosts.messages import (
    FromAgent,
    Hello,
    Launch,
    Launched,
    LeaseGrant,
    LeaseRequest,
    ProcessEnded,
    ProcessEvent,
    Wire,
)
from actors.hosts.remote import Place, RemoteProcess
from actors.logs import NodeLog
from actors.processes.messages import Event, Line, NodeFacts, Nodes, Order
from actors.processes.pickling import pack
from actors.runtime.runtime import HostLease
from actors.waiting import wake


class HostLost(ActorError):
    """The agent of `host` did not renew its lease for `seconds`: the machine is down, cut off or too slow, or its agent has ended.

    What ran there for this tree has ended by then, or ends with the machine.
    """

    def __init__(self, host: str, seconds: float) -> None:
        super().__init__(f"host {host} is lost: its lease of {seconds:g} s was not renewed")
        self.host = host
        self.seconds = seconds


CONNECTING_SECONDS: Final = 1.0
"""How long an attempt to connect to an agent may take."""
PAUSE_SECONDS: Final = 0.2
"""Seconds between two attempts."""


class Dial(Protocol):
    """Opens a wire to the agent of a host."""

    async def __call__(self, host: str, take: Callable[[Any], None], lost: Callable[[], None], /) -> Wire:
        """Returns when the agent can be talked to; then `take` gets what it sends, and `lost` is called when the connection has ended.
        Raises OSError if there is none, or none that may be talked to."""
        ...


class Host:
    """One machine, for one tree. It looks for the agent, again and again, until `close`.

    Invariants:

    - What was launched there has ended, or `_granting.until` is to come. Then all that has not been told to have ended counts as lost.
    - `_wire` is the connection; None while there is none. A connection that has ended is not replaced before its lease is over, and what
      still comes from it then is ignored.
    - `_ahead` is by how much the clock of this process is ahead of that of the agent, seconds, and by the shortest way of a message.
    """

    def __init__(self, name: str, lease: float, dial: Dial, log: NodeLog) -> None:
        self.name = name
        self._dial = dial
        self._log = log
        self._loop = loop = asyncio.get_running_loop()
        self._granting = Granting(lease)
        self._wire: Wire | None = None
        self._spoken: asyncio.Future[bool] | None = None
        """The present connection, and whether its agent holds a lease."""
        self._leaving = False
        self._failed = False
        """Whether it has been logged that it cannot be reached."""
        self.tried = False
        """Whether the first attempt to reach it is over."""
        self._ahead = 0.0
        self._numbers = count(1)
        self._processes: dict[int, RemoteProcess] = {}
        self._task = loop.create_task(self._stay_connected(), name=f"connection with host {name}")

    @property
    def usable(self) -> bool:
        """Whether it takes a process now: it was heard lately, and said that it hears this side, too."""
        return self._wire is not None and not self._leaving and self._granting.fresh(self._loop.time())

    @property
    def lease(self) -> HostLease:
        """What its agent holds now."""
        left = max(0.0, self._granting.until - self._loop.time())
        return HostLease(self.name, left, len(self._processes))

    def launch(self, process: RemoteProcess, order: Order) -> None:
        """Have the agent launch a process for this order, which may differ from its own. Raises what `pack` raises."""
        assert self._wire is not None
        number = next(self._numbers)
        nodes = tuple(_shifted(facts, -self._ahead) for facts in order.nodes)
        self._wire.send(Launch(number, order.path, order.spec.hang, pack(structs.replace(order, nodes=nodes))))
        self._processes[number] = process
        process.place(Place(number, self._send))

    async def close(self) -> None:
        """Let go of the agent. What still runs there stops when it sees that, and at the end of the lease at the latest."""
        self._task.cancel()
        await asyncio.wait([self._task])
        self._part()

    # -- the connection -----------------------------------------------------------------------------------------------------

    async def _stay_connected(self) -> None:
        while True:
            try:
                async with asyncio.timeout(CONNECTING_SECONDS):
                    await self._connect()
            except (OSError, TimeoutError) as error:
                self.tried = True
                self._part()
                self._failed_to_connect(error)
                await asyncio.sleep(PAUSE_SECONDS)
                continue
            self.tried, self._failed = True, False
            self._log.info("a host is connected", host=self.name)
            while (left := self._granting.until - self._loop.time()) > 0.0:
                await asyncio.sleep(left)
            self._lose()

    async def _connect(self) -> None:
        """Open a connection, and wait until the agent holds a lease. Raises OSError."""
        spoken = self._spoken = self._loop.create_future()
        self._leaving, self._ahead = False, math.inf
        wire = await self._dial(self.name, partial(self._take, spoken), partial(self._gone, spoken))
        if not spoken.done():
            self._wire = wire
            wire.send(Hello(self._granting.seconds))
        if not await spoken:
            raise ConnectionError(
                "its agent ended the connection: this tree's certificate has ended, or names nobody from whom it takes anything"
            )

    def _failed_to_connect(self, error: Exception) -> None:
        if not self._failed:
            because = described(error) if str(error) else "it does not answer"
            self._log.warning("a host cannot be reached", host=self.name, because=because)
        self._failed = True

    def _gone(self, connection: asyncio.Future[bool]) -> None:
        """The connection has ended. What runs there may do so until its lease is over."""
        wake(connection, False)
        if self._spoken is connection:
            self._wire = None

    def _lose(self) -> None:
        """The lease is over."""
        lost, self._processes = self._processes, {}
        if not self._leaving:
            self._log.warning("a host is lost", host=self.name, processes=len(lost))
        self._part()
        for process in lost.values():
            process.end(HostLost(self.name, self._granting.seconds))

    def _part(self) -> None:
        wire, self._wire, self._spoken = self._wire, None, None
        if wire is not None:
            wire.close()

    def _send(self, value: object) -> None:
        if self._wire is not None:
            self._wire.send(value)

    # -- what the agent tells -----------------------------------------------------------------------------------------------

    def _take(self, connection: asyncio.Future[bool], message: FromAgent) -> None:
        if self._spoken is not connection:  # it is over, whatever still comes from there
            return
        if isinstance(message, LeaseRequest):
            self._renew(message)
            if message.left > 0.0:
                wake(connection, True)
        elif isinstance(message, (Launched, ProcessEvent, ProcessEnded)):
            if (process := self._processes.get(message.number)) is not None:
                self._about(process, message)
        else:
            self._leaving = True

    def _renew(self, message: LeaseRequest) -> None:
        """Grant the lease, before it is told: the agent counts from an instant that is earlier still."""
        now = self._loop.time()
        self._ahead = min(self._ahead, now - message.at)
        self._granting.grant(now, message.left)
        self._send(LeaseGrant(message.number))

    def _about(self, process: RemoteProcess, message: Launched | ProcessEvent | ProcessEnded) -> None:
        if isinstance(message, Launched):
            process.id = message.process
        elif isinstance(message, ProcessEnded):
            del self._processes[message.number]
            process.end(message.how)
        else:
            try:
                event = read_event(message.event)
            except UnreadableEvent as error:
                self._log.error("what a process tells cannot be read", host=self.name, because=str(error))
                return
            process.take(_at_home(event, self._ahead))


def _at_home(event: Event, ahead: float) -> Event:
    """The event with the times of this machine."""
    if isinstance(event, Line):
        return structs.replace(event, at=event.at + ahead)
    if isinstance(event, Nodes):
        return structs.replace(event, changed=tuple(_shifted(facts, ahead) for facts in event.changed))
    return event


def _shifted(facts: NodeFacts, by: float) -> NodeFacts:
    return (
        structs.replace(facts, restarts=tuple((at + by, why) for at, why in facts.restarts))
        if facts.restarts
        else facts
    )
