"""The web server beside a tree: in this process, or in one of its own."""

from __future__ import annotations

import asyncio
import os
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from actors import ActorError, Child
from actors.transport import WireUnavailable
from actors.transport.environment import security_from_environment
from cli.web.settings import WebUnavailable, make_settings

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from actors import System

__all__ = ["NAME", "serve_beside"]

NAME = "_robactor_web"


async def serve_beside(
    system: System,
    *,
    host: str,
    port: int | None,
    origins: tuple[str, ...],
    security: str | None,
    bags: str | None,
    apart: Callable[[Child], Awaitable[object]] | None,
) -> None:
    """Start the server, which logs its address. Raises `WebUnavailable`.

    `apart` starts a node in another process; the server is then told of the tree of this one. None: the server joins the system here.
    """
    try:
        settings = make_settings(
            os.environ, host=host, port=port, origins=origins, security=security_from_environment(os.environ, security),
            bags=None if bags is None else Path(bags),
        )  # fmt: skip
        for module in ("websockets.asyncio.server", "cli.web.server"):
            await asyncio.to_thread(import_module, module)  # the nodes that run go on meanwhile
        from cli.web.overview import TreeTeller
        from cli.web.server import WebServer

        if apart is None:
            await system.join(Child(WebServer, name=NAME, args=(settings,)))
        else:
            teller = f"{NAME}_tree_{os.getpid()}"
            await system.join(Child(TreeTeller, name=teller))
            await apart(Child(WebServer, name=NAME, args=(settings, teller)))
    except (WireUnavailable, ActorError) as error:
        raise WebUnavailable(str(error)) from None
