"""`web`: serve the graph as this process sees it, or a recording."""

from __future__ import annotations

import argparse
import asyncio
import os
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager

from actors import ActorError, Child, Node, System, run
from actors.bag import BagError, BagReader
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
            os.environ, host=options.host, port=options.port, origins=tuple(options.origin), security=security,
            bags=options.bags, recording=options.recording,
        )  # fmt: skip
    except (WebUnavailable, WireUnavailable) as error:
        raise CommandFailed(str(error)) from None
    async with _alone(options) if options.recording is not None else _graph(options) as system:
        try:
            joined = await system.join(Child(WebServer, name=f"_robactor_web_{os.getpid()}", args=(settings,)))
        except (WebUnavailable, ActorError) as error:
            raise CommandFailed(str(error)) from None
        server = joined.node
        assert isinstance(server, WebServer)
        print(f"web page: {server.url}")
        await asyncio.Event().wait()
    return Exit.DONE


@asynccontextmanager
async def _graph(options: argparse.Namespace) -> AsyncGenerator[System]:
    """The graph of ROS_DOMAIN_ID."""
    async with seen(options) as graph:
        yield graph.system


@asynccontextmanager
async def _alone(options: argparse.Namespace) -> AsyncGenerator[System]:
    """A system that nobody else hears of: a recording is no part of any graph. Raises `CommandFailed` if it cannot be read."""
    try:
        with BagReader(options.recording):
            pass
    except BagError as error:
        raise CommandFailed(str(error)) from None
    async with run(Child(Node, name=f"_robactor_cli_{os.getpid()}"), signals=False, sinks=()) as system:
        yield system
