"""`web`: serve the graph as this process sees it, or a recording."""

from __future__ import annotations

import argparse
import asyncio
import os
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager

from actors import ActorError, Backoff, Child, Intensity, Node, Supervisor, System, run
from actors.bag import BagError, BagReader
from actors.transport import WireUnavailable
from actors.transport.environment import security_from_environment
from cli.command import CommandFailed, Exit
from cli.graph.seen import seen
from cli.web.server.server import WebServer
from cli.web.server.settings import WebUnavailable, make_settings

AGAIN = Backoff(0.5, 30.0)
"""The pause before a server that has failed is started again: the STOP of its page must not stay away."""
ANY = Intensity(100, within=60.0)
"""More restarts than `AGAIN` allows."""


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
        server = Child(WebServer, name=f"_robactor_web_{os.getpid()}", args=(settings,), backoff=AGAIN)
        assert system.supervisor is not None
        try:
            await system.supervisor.start_child(Supervisor("web", intensity=ANY, children=[server]))
        except (WebUnavailable, ActorError) as error:
            raise CommandFailed(str(_unavailable(error) or error)) from None
        print(f"web page: {system.node(WebServer).told}", flush=True)
        await asyncio.Event().wait()
    return Exit.DONE


def _unavailable(error: BaseException) -> WebUnavailable | None:
    """Why the server could not be had, where that is behind an error."""
    behind: BaseException | None = error
    while behind is not None and not isinstance(behind, WebUnavailable):
        behind = behind.__cause__ or behind.__context__
    return behind


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
