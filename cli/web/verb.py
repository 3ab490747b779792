"""`web`: serve the graph as this process sees it."""

from __future__ import annotations

import argparse
import asyncio
import os

from actors import ActorError, Child
from actors.transport import WireUnavailable
from actors.transport.environment import security_from_environment
from cli.command import CommandFailed, Exit
from cli.graph import seen
from cli.web.server import WebServer
from cli.web.settings import WebUnavailable, make_settings

__all__ = ["serve"]


async def serve(options: argparse.Namespace) -> Exit:
    """Serve until the verb is canceled."""
    try:
        security = security_from_environment(os.environ, options.security)
        settings = make_settings(
            os.environ, host=options.host, port=options.port, origins=tuple(options.origin), security=security
        )
    except (WebUnavailable, WireUnavailable) as error:
        raise CommandFailed(str(error)) from None
    async with seen(options) as graph:
        try:
            joined = await graph.system.join(Child(WebServer, name=f"_robactor_web_{os.getpid()}", args=(settings,)))
        except (WebUnavailable, ActorError) as error:
            raise CommandFailed(str(error)) from None
        server = joined.node
        assert isinstance(server, WebServer)
        print(f"web page: {server.url}")
        await asyncio.Event().wait()
    return Exit.DONE
