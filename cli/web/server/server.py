"""The web server: one port for the page, for viewers that speak the Foxglove protocol, for rosbridge clients, and for figures.

Plain HTTP gets the page, `/metrics` and `/healthz`. A WebSocket with one of Foxglove's subprotocols speaks Foxglove, one without speaks
rosbridge.
"""

from __future__ import annotations

import asyncio
import errno
import logging
from collections.abc import Sequence
from contextlib import AsyncExitStack
from http import HTTPStatus
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import parse_qs, urlsplit

from actors import ExitReason, Node, background, system_of
from actors.transport.zenoh.memory import give_back
from cli.web.clients.client import OVERLOADED, Client, farewell
from cli.web.clients.errors import Refused
from cli.web.foxglove.session import SUBPROTOCOLS
from cli.web.graph.feeds import Feeds
from cli.web.graph.overview import Here, Told
from cli.web.hub import make_hub
from cli.web.recordings.bags import Bags
from cli.web.server import figures
from cli.web.server.admission import host_refusal, is_own_page, origin_refusal, token_refusal
from cli.web.server.audience import Audience
from cli.web.server.http import Files, answer, refusal
from cli.web.server.recordings import Recordings
from cli.web.server.settings import WebSettings, WebUnavailable

if TYPE_CHECKING:
    from websockets.asyncio.server import Server, ServerConnection
    from websockets.http11 import Request, Response

MOST_CLIENTS: Final = 64
FOR_THE_PAGE: Final = 8
"""Places beside these that only the server's own page gets: its STOP is not locked out."""
SILENCE: Final = 2.0
"""Seconds in which a client asks for something; one that has not loses its place when there is no other."""
MOST_FRAME: Final = 4 * 1024 * 1024
"""The largest frame that a client may send, bytes."""
OPENING: Final = 10.0
"""Seconds for the handshake of a connection."""

AFTERWARDS: Final = 2.0
"""Seconds after which the memory of a client that has left is given back."""
CLOSING: Final = 2.0
"""Seconds that a client has for its farewell."""

UNPLAYABLE: Final = 1008
"""The code with which a connection to a recording is closed that cannot be played."""

QUIET: Final = logging.getLogger("cli.web.websockets")
QUIET.addHandler(logging.NullHandler())
QUIET.propagate = False


class WebServer(Node):
    """Serves the graph of its system on one port, from `on_start` to `on_stop`. A client never makes another node wait.

    With `teller`, the name of a `TreePublisher` in another process, it shows the tree of that one; else that of its own process.

    Invariant: `_clients` holds every client, by its number, whatever it looks at: the graph, or a recording.
    """

    no_replay = "serves a port, and files, which no journal carries"

    def __init__(self, settings: WebSettings, teller: str | None = None) -> None:
        self._settings = settings
        self._teller = teller
        self._files = Files()
        self._numbers = count(1)
        self._clients: dict[int, Client] = {}
        self._left = asyncio.Event()
        self._refused = 0
        self._ends = AsyncExitStack()
        """What is to be ended: a stop may come in the midst of the start."""

    # -- life -----------------------------------------------------------------------------------------------------------------

    async def on_start(self) -> None:
        system = system_of(self)
        overview = Here(system) if self._teller is None else Told(self, system, self._teller)
        self._bags = Bags(system, self._settings.bags)
        self._recordings = Recordings(self, self._bags, self._clients)
        self._audience = Audience(make_hub(self, system, Feeds(self, system), self._clients, self._bags, overview))
        self._ends.push_async_callback(self._bags.stop)
        self._ends.push_async_callback(self._audience.hub.client_nodes.close)
        self._ends.callback(await self._audience.begin())
        self._server = await self._open()
        self._ends.push_async_callback(self._server.wait_closed)
        self._ends.callback(self._server.close, reason="the server stops")
        self._announce()

    def _announce(self) -> None:
        because: dict[str, Any] = {} if self._taken is None else {"because": self._taken}
        self.log.info("web page", url=self.url, **because)

    async def on_stop(self, reason: ExitReason) -> None:
        await self._ends.aclose()

    @property
    def url(self) -> str:
        """The address of the page, without the token."""
        host = self._settings.host
        shown = f"[{host}]" if ":" in host else host
        return f"{'https' if self._settings.security else 'http'}://{shown}:{self.port}/"

    @property
    def told(self) -> str:
        """The address of the page, and why it is another one than was asked for."""
        return self.url if self._taken is None else f"{self.url} ({self._taken})"

    @property
    def _taken(self) -> str | None:
        port = self._settings.port
        return None if port in (0, self.port) else f"port {port} is in use"

    @property
    def port(self) -> int:
        """The port on which it listens."""
        port: int = next(iter(self._server.sockets)).getsockname()[1]
        return port

    @property
    def clients(self) -> tuple[Client, ...]:
        """The clients that are connected."""
        return tuple(self._clients.values())

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

        from cli.web.server.connection import Connection

        return await serve(
            self._connected, self._settings.host, port, process_request=self._requested, select_subprotocol=_select, ssl=tls,
            create_connection=Connection, compression=None, max_size=MOST_FRAME, open_timeout=OPENING, close_timeout=CLOSING, server_header=None, logger=QUIET,
        )  # fmt: skip

    # -- HTTP -----------------------------------------------------------------------------------------------------------------

    async def _requested(self, connection: ServerConnection, request: Request) -> Response | None:
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
                return answer(HTTPStatus.OK, figures.health(self._audience.hub), "application/json")
            case "/metrics":
                self._audience.asked_for_metrics()
                return answer(HTTPStatus.OK, figures.metrics(self._audience.hub, self._refused), figures.METRICS_TYPE)
            case _:
                return await self._files.get(request)

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
        if upgrade and (why := self._bag_refusal(request)) is not None:
            return refusal(HTTPStatus.NOT_FOUND, why)
        if upgrade and not self._has_room(request):
            return refusal(HTTPStatus.SERVICE_UNAVAILABLE, f"{MOST_CLIENTS} clients are connected already")
        return None

    def _has_room(self, request: Request) -> bool:
        """Whether there is a place for a client. The one that has been silent for longest, since it came, may lose its own for it."""
        present = [one for one in self._clients.values() if not one.ending]
        most = MOST_CLIENTS + FOR_THE_PAGE if is_own_page(request) else MOST_CLIENTS
        if len(present) < most:
            return True
        silent = next((one for one in present if not one.received and one.connected_for >= SILENCE), None)
        if silent is not None:
            silent.end(OVERLOADED, "it has asked for nothing, and another client needs its place")
        return silent is not None

    def _bag_refusal(self, request: Request) -> str | None:
        try:
            self._recording(request)
        except Refused as error:
            return str(error)
        return None

    # -- WebSockets -----------------------------------------------------------------------------------------------------------

    async def _connected(self, socket: ServerConnection) -> None:
        protocol = "foxglove" if socket.subprotocol else "rosbridge"
        client = Client(socket, protocol, next(self._numbers), self.log, lambda: len(self._clients))
        assert socket.request is not None
        recording = self._recording(socket.request)
        self._clients[client.number] = client
        try:
            if recording is None:
                await self._audience.serve(client)
            else:
                async with self._recordings.watching(recording) as audience:
                    await audience.serve(client)
        except Refused as error:
            await socket.close(UNPLAYABLE, farewell(str(error)))
        finally:
            del self._clients[client.number]
            self._left.set()

    @background
    async def tidy(self) -> None:
        """Give back the memory of what has waited for clients that have left."""
        while True:
            await self._left.wait()
            await self.clock.sleep(AFTERWARDS)
            self._left.clear()
            await self.offload(give_back, thread=True)

    def _recording(self, request: Request) -> Path | None:
        """The recording that a connection is to; None if it is to the graph. Raises `Refused` for one that is not there."""
        name = parse_qs(urlsplit(request.path).query).get("bag", [""])[0]
        return self._bags.path(name) if name else self._settings.recording


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
