"""The transport over Zenoh: opening, closing, and the way in between."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Final

from actors.transport import protocol
from actors.transport.format.names import new_session
from actors.transport.keyed.protocol import Answer, Delivery, Events, KeyTransport, Outlet, Query, Take
from actors.transport.protocol import Handle, Link, WireUnavailable
from actors.transport.worker import Worker
from actors.transport.zenoh import objects
from actors.transport.zenoh.config import ZenohConfig, session_settings, write_config
from actors.transport.zenoh.connection import Connection
from actors.transport.zenoh.gossip_point import GossipPoint
from actors.transport.zenoh.library import cannot_listen, import_zenoh, one_line
from actors.transport.zenoh.memory import keep_freed_memory, leave_no_segments

_LOOKING: Final = 0.2
"""Seconds after which it is seen that the gossip point has gone."""


class _Running:
    """What there is between `open` and `close`.

    Invariants: calls that may wait are made by the worker, in order; a timer for the gossip point is running until `close`.
    """

    def __init__(
        self, connection: Connection, worker: Worker, point: GossipPoint, loop: asyncio.AbstractEventLoop
    ) -> None:
        self.connection = connection
        self._worker = worker
        self._point = point
        self._loop = loop
        self._timer = loop.call_later(_LOOKING, self._look)

    async def close(self) -> None:
        """Close everything. The workers finish that if this is cancelled."""
        self._timer.cancel()
        self.connection.close()
        try:
            await self._worker.result(self._point.close)
        finally:
            self._worker.close()

    def _look(self) -> None:
        if not self._point.held and not self.connection.is_linked_with(self._point.endpoint):
            self._worker.do(self._point.hold)
        self._timer = self._loop.call_later(_LOOKING, self._look)


class ZenohKeys(KeyTransport):
    """A transport of keys by a Zenoh session.

    Invariant: it is opened at most once. Methods that declare something raise RuntimeError unless it is open.
    """

    def __init__(self, config: ZenohConfig | None = None) -> None:
        self._config = config or ZenohConfig()
        self._session = new_session(secrets.SystemRandom())
        self._opened = False
        self._running: _Running | None = None

    @property
    def session(self) -> str:
        """The identity of this process on the network."""
        return self._session

    async def open(self, tokens: str, events: Events) -> None:
        """Connect, and watch for all tokens that match `tokens`. Raises WireUnavailable, also if a client finds no router."""
        if self._opened:
            raise RuntimeError("a transport is opened once")
        self._opened = True
        loop = asyncio.get_running_loop()
        worker = Worker("zenoh worker")
        point = GossipPoint(self._config)
        sessions: list[objects.Session] = []

        def abandon() -> None:
            point.close()
            for session in sessions:
                session.close()

        try:
            await worker.result(lambda: sessions.append(_open_session(self._config, self._session, point)))
            connection = Connection(
                sessions[0], tokens, events, loop, worker, self._config.thin_links, self._config.shared_memory
            )
        except BaseException:
            worker.do(abandon)  # after the opening, which goes on if this was cancelled
            worker.close()
            raise
        self._running = _Running(connection, worker, point, loop)

    async def close(self) -> None:
        """Withdraw everything and disconnect. Never raises; harmless if it is not open."""
        self._opened = True
        running, self._running = self._running, None
        if running is not None:
            await running.close()

    def announce(self, token: str) -> Handle:
        """Show `token` to all other processes."""
        return self._connection.announce(token)

    def outlet(self, key: str, delivery: Delivery) -> Outlet:
        """Open the sending end of `key`."""
        return self._connection.outlet(key, delivery)

    def subscribe(self, key: str, delivery: Delivery, take: Take) -> Handle:
        """Call `take` with each sample of `key`."""
        return self._connection.subscribe(key, delivery, take)

    def serve(self, key: str, take: Callable[[Query], None]) -> Handle:
        """Call `take` with each question on `key`."""
        return self._connection.serve(key, take)

    def ask(
        self, key: str, payload: bytes, attachment: bytes, timeout: float | None, done: Callable[[Answer], None]
    ) -> Handle:
        """Ask the other processes a question."""
        return self._connection.ask(key, payload, attachment, timeout, done)

    def prepare(self, key: str) -> Handle:
        """Let routers say what they know of servers of `key`."""
        return self._connection.prepare(key)

    def report(self) -> tuple[Link, ...]:
        """What has been exchanged with each process that is connected now; nothing if it is not open."""
        return self._running.connection.report() if self._running is not None else ()

    def sibling(self) -> Callable[[], ZenohTransport]:
        """What makes a transport of another process of this machine: it listens at a port of its own, and meets this one."""
        config, listen = self._config, () if self._config.gossip_point else self._config.listen
        return partial(ZenohTransport, replace(config, listen=(), connect=(*config.connect, *listen)))

    @property
    def _connection(self) -> Connection:
        if self._running is None:
            raise RuntimeError("the transport is not open")
        return self._running.connection


class ZenohTransport:
    """A `Transport` by a Zenoh session in the format of ROS 2's `rmw_zenoh`. It joins one domain, once."""

    def __init__(self, config: ZenohConfig | None = None) -> None:
        self._keys = ZenohKeys(config)

    @property
    def session(self) -> str:
        """The identity of this process on the network."""
        return self._keys.session

    async def join(self, domain_id: int, events: protocol.Events, *, beyond: bool = False) -> protocol.Participant:
        """Connect; see `Transport.join`. Raises WireUnavailable, also if a client finds no router."""
        return await self._keys.join(domain_id, events, beyond=beyond)

    async def close(self) -> None:
        """Withdraw everything and disconnect. Never raises; harmless if it is not open."""
        await self._keys.close()

    def report(self) -> tuple[Link, ...]:
        """What has been exchanged with each process that is connected now; nothing if it is not open."""
        return self._keys.report()

    def sibling(self) -> Callable[[], ZenohTransport]:
        """What makes a transport of another process of this machine: it listens at a port of its own, and meets this one."""
        return self._keys.sibling()


def _open_session(config: ZenohConfig, session: str, point: GossipPoint) -> objects.Session:
    settings = write_config(config.file, session_settings(config, session))
    keep_freed_memory()
    if config.shared_memory:
        leave_no_segments()
    point.hold()
    library = import_zenoh()
    try:
        opened: objects.Session = library.open(settings)
    except library.ZError as error:
        text = one_line(error)
        if "Unable to connect" in text:
            known = "" if config.security is None else f", or it does not take what {config.security.file} says"
            raise WireUnavailable(
                f"no router answers at {', '.join(config.connect)}{known}; start one there, or be a peer"
            ) from error
        raise cannot_listen(config.listen, error) from error
    return opened
