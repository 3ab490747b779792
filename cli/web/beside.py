"""The web server beside a tree, in a process of its own."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Awaitable, Callable
from importlib import import_module
from pathlib import Path

from actors import ActorError, Child, System
from actors.transport import WireUnavailable
from actors.transport.environment import security_from_environment
from cli.web.server.settings import WebUnavailable, make_settings

NAME = "_robactor_web"


async def serve_beside(
    system: System,
    *,
    host: str,
    port: int | None,
    origins: tuple[str, ...],
    security: str | None,
    bags: str | None,
    apart: Callable[[Child], Awaitable[object]],
) -> None:
    """Start the server by `apart`, which starts a node in another process. It logs its address. Raises `WebUnavailable`."""
    try:
        settings = make_settings(
            os.environ, host=host, port=port, origins=origins, security=security_from_environment(os.environ, security),
            bags=None if bags is None else Path(bags),
        )  # fmt: skip
        for module in ("websockets.asyncio.server", "cli.web.server.server"):
            await asyncio.to_thread(import_module, module)  # the nodes that run go on meanwhile
        from cli.web.graph.overview import TreePublisher
        from cli.web.server.server import WebServer

        teller = f"{NAME}_tree_{os.getpid()}"
        await system.join(Child(TreePublisher, name=teller))
        await apart(Child(WebServer, name=NAME, args=(settings, teller)))
    except (WireUnavailable, ActorError) as error:
        raise WebUnavailable(str(error)) from None
