"""The web server: one port for the page, for viewers that speak the Foxglove protocol, for rosbridge clients, and for figures.

Plain HTTP gets the page, `/metrics` and `/healthz`. A WebSocket with one of Foxglove's subprotocols speaks Foxglove, one without speaks
rosbridge.
"""

from __future__ import annotations

import asyncio
import errno
import logging
from collections.abc import Sequence
from http import HTTPStatus
from itertools import count
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlsplit

from actors import ExitReason, Node, Topic, background, system_of
from actors.interfaces.rcl_interfaces.msg import ParameterEvent
from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.qos import CLOCK, PARAMETER_EVENTS
from cli.web import figures
from cli.web.admission import host_refusal, origin_refusal, token_refusal
from cli.web.client import Client, Session
from cli.web.feeds import Feeds
from cli.web.foxglove.catalog import Catalog
from cli.web.foxglove.session import SUBPROTOCOLS, FoxgloveSession
from cli.web.guests import Guests
from cli.web.http import Files, answer, refusal
from cli.web.hub import Hub
from cli.web.overview import Here, Told
from cli.web.parameters import Parameters
from cli.web.rosbridge.session import RosbridgeSession
from cli.web.settings import WebSettings, WebUnavailable
from cli.web.types import Types

if TYPE_CHECKING:
    from websockets.asyncio.server import Server, ServerConnection
    from websockets.http11 import Request, Response

    from actors import Stream
    from actors.topics.peers import PublisherPeer

__all__ = ["WebServer"]

MOST_CLIENTS: Final = 64
MOST_FRAME: Final = 4 * 1024 * 1024
"""The largest frame that a client may send, bytes."""
SETTLE: Final = 0.1
"""Seconds from a change of the graph to the look at it: what changes together is told together."""
REPORT_EVERY: Final = 1.0
"""Seconds between two reports of the state of the system."""
OPENING: Final = 10.0
"""Seconds for the handshake of a connection."""

CLOSING: Final = 2.0
"""Seconds that a client has for its farewell."""

QUIET: Final = logging.getLogger("cli.web.websockets")
QUIET.addHandler(logging.NullHandler())
QUIET.propagate = False


class WebServer(Node):
    """Serves the graph of its system on one port, from `on_start` to `on_stop`. A client never makes another node wait.

    With `teller`, the name of a `TreeTeller` in another process, it shows the tree of that one; else that of its own process.

    Invariant: `_sessions` holds the session of every client of the hub, by its number.
    """

    def __init__(self, settings: WebSettings, teller: str | None = None) -> None:
        self._settings = settings
        self._teller = teller
        self._files = Files()
        self._numbers = count(1)
        self._sessions: dict[int, Session] = {}
        self._changed = asyncio.Event()
        self._clock: Stream[Clock] | None = None
        self._refused = 0

    # -- life -----------------------------------------------------------------------------------------------------------------

    async def on_start(self) -> None:
        system = system_of(self)
        types = Types(self, system)
        overview = Here(system) if self._teller is None else Told(self, system, self._teller)
        self._hub = Hub(
            node=self, system=system, overview=overview, types=types, feeds=Feeds(self, system), catalog=Catalog(self, system, types),
            guests=Guests(system), parameters=Parameters(self, system),
        )  # fmt: skip
        await self._hub.catalog.update()
        self._forget = system.graph.on_change(self._graph_changed)
        self._server = await self._open()
        self._announce()

    def _announce(self) -> None:
        if self._settings.port in (0, self.port):
            self.log.info("web page", url=self.url)
        else:
            self.log.info("web page", url=self.url, because=f"port {self._settings.port} is in use")

    async def on_stop(self, reason: ExitReason) -> None:
        self._forget()
        self._server.close(reason="the server stops")
        await self._server.wait_closed()

    @property
    def url(self) -> str:
        """The address of the page, without the token."""
        host = self._settings.host
        shown = f"[{host}]" if ":" in host else host
        return f"{'https' if self._settings.security else 'http'}://{shown}:{self.port}/"

    @property
    def port(self) -> int:
        """The port on which it listens."""
        port: int = next(iter(self._server.sockets)).getsockname()[1]
        return port

    @property
    def clients(self) -> tuple[Client, ...]:
        """The clients that are connected."""
        return tuple(self._hub.clients.values())

    async def _open(self) -> Server:
        settings, tls = self._settings, self._settings.tls()
        last = settings.port + (settings.tries if settings.port else 1)
        for port in range(settings.port, last):
            try:
                return await self._listen(port, tls)
            except OSError as error:
                if error.errno != errno.EADDRINUSE:
                    raise WebUnavailable(
                        f"the web server cannot listen on {settings.host}:{port}: {error.strerror}"
                    ) from None
        raise WebUnavailable(
            f"the ports {settings.port} to {last - 1} of {settings.host} are all in use: choose another one"
        )

    async def _listen(self, port: int, tls: Any) -> Server:
        from websockets.asyncio.server import serve

        return await serve(
            self._connected, self._settings.host, port, process_request=self._requested, select_subprotocol=_select, ssl=tls,
            compression=None, max_size=MOST_FRAME, open_timeout=OPENING, close_timeout=CLOSING, server_header=None, logger=QUIET,
        )  # fmt: skip

    # -- HTTP -----------------------------------------------------------------------------------------------------------------

    def _requested(self, connection: ServerConnection, request: Request) -> Response | None:
        refused = self._refusal(request)
        if refused is not None:
            self._refused += 1
            return refused
        if _is_upgrade(request):
            return None
        if getattr(request, "method", "GET") != "GET":  # before websockets 16 there is no other
            return refusal(HTTPStatus.METHOD_NOT_ALLOWED, "only GET is understood")
        match urlsplit(request.path).path:
            case "/healthz":
                return answer(HTTPStatus.OK, figures.health(self._hub), "application/json")
            case "/metrics":
                return answer(HTTPStatus.OK, figures.metrics(self._hub, self._refused), figures.METRICS_TYPE)
            case _:
                return self._files.get(request)

    def _refusal(self, request: Request) -> Response | None:
        try:
            path = urlsplit(request.path).path
        except ValueError:
            return refusal(HTTPStatus.BAD_REQUEST, "the address cannot be read")
        if (why := host_refusal(self._settings, request)) is not None:
            return refusal(HTTPStatus.MISDIRECTED_REQUEST, why)
        upgrade = _is_upgrade(request)
        if (upgrade or path == "/metrics") and (why := token_refusal(self._settings, request)) is not None:
            return refusal(HTTPStatus.UNAUTHORIZED, why)
        if upgrade and (why := origin_refusal(self._settings, request)) is not None:
            return refusal(HTTPStatus.FORBIDDEN, why)
        if upgrade and len(self._hub.clients) >= MOST_CLIENTS:
            return refusal(HTTPStatus.SERVICE_UNAVAILABLE, f"{MOST_CLIENTS} clients are connected already")
        return None

    # -- WebSockets -----------------------------------------------------------------------------------------------------------

    async def _connected(self, socket: ServerConnection) -> None:
        protocol = "foxglove" if socket.subprotocol else "rosbridge"
        client = Client(socket, protocol, next(self._numbers), self.log)
        session: Session = (FoxgloveSession if socket.subprotocol else RosbridgeSession)(self._hub, client)
        self._hub.clients[client.number] = client
        self._sessions[client.number] = session
        try:
            await client.run(session)
        finally:
            del self._sessions[client.number], self._hub.clients[client.number]

    def _viewers(self) -> list[FoxgloveSession]:
        return [one for one in self._sessions.values() if isinstance(one, FoxgloveSession)]

    # -- what all clients are told --------------------------------------------------------------------------------------------

    def _graph_changed(self) -> None:
        self._hub.feeds.refit()
        self._changed.set()

    @background
    async def tell_changes(self) -> None:
        while True:
            await self._changed.wait()
            await asyncio.sleep(SETTLE)
            self._changed.clear()
            changes = await self._hub.catalog.update()
            self._follow_clock()
            for viewer in self._viewers():
                viewer.changed(changes)
            watching = [viewer for viewer in self._viewers() if viewer.wants_graph]
            snapshot = self._hub.overview.snapshot() if watching else None
            for viewer in watching:
                assert snapshot is not None
                viewer.graph_changed(snapshot)

    @background
    async def report_state(self) -> None:
        while True:
            await asyncio.sleep(REPORT_EVERY)
            watching = [viewer for viewer in self._viewers() if viewer.wants_state]
            if watching:
                snapshot = self._hub.overview.snapshot()
                for viewer in watching:
                    viewer.report(snapshot)

    @background
    async def tell_parameters(self) -> None:
        async for event in self.subscribe(Topic(ParameterEvent, "/parameter_events"), qos=PARAMETER_EVENTS):
            for viewer in self._viewers():
                viewer.parameters_changed(event)

    def _follow_clock(self) -> None:
        """Pass `/clock` on while somebody publishes it."""
        entry = self._hub.system.graph.topics.get("/clock")
        publishers: Sequence[PublisherPeer] = entry.publishers if entry is not None else ()
        if publishers and self._clock is None:
            self._clock = self.subscribe(Topic(Clock, "/clock"), qos=CLOCK)
            self.spawn(self._pass_clock_on(self._clock), name="web clock")
        elif not publishers and self._clock is not None:
            self._clock.close()
            self._clock = None

    async def _pass_clock_on(self, stream: Stream[Clock]) -> None:
        async for message in stream:
            at_ns = message.clock.sec * 10**9 + message.clock.nanosec
            for viewer in self._viewers():
                viewer.time(at_ns)


def _is_upgrade(request: Request) -> bool:
    return "websocket" in ", ".join(request.headers.get_all("Upgrade")).lower()


def _select(connection: ServerConnection, offered: Sequence[Any]) -> Any:
    """Foxglove's newest subprotocol that is offered; none for clients that offer none, which speak rosbridge."""
    from websockets.exceptions import NegotiationError

    for name in SUBPROTOCOLS:
        if name in offered:
            return name
    if offered:
        raise NegotiationError(
            f"none of the subprotocols is known: offer {' or '.join(SUBPROTOCOLS)}, or none for rosbridge"
        )
    return None
