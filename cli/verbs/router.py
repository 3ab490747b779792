"""`router`: a meeting point for several machines, as `rmw_zenohd` is one."""

from __future__ import annotations

import argparse
import asyncio
import os

from actors.transport.environment import security_from_environment
from actors.transport.protocol import WireUnavailable
from actors.transport.zenoh.router import router
from cli.command import CommandFailed
from cli.parsing import Parser
from cli.verb import Verb

ENDPOINT = "tcp/0.0.0.0:7447"
"""Where ROS 2's router listens: all interfaces, its port."""

SECURE_ENDPOINT = "tls/0.0.0.0:7447"
"""The same, with a security file."""


def _arguments(parser: Parser) -> None:
    parser.add_argument(
        "--listen", action="append", default=[], metavar="ENDPOINT", help=f"where others connect to ({ENDPOINT})"
    )
    parser.add_argument("--connect", action="append", default=[], metavar="ENDPOINT", help="another router to join")
    parser.add_argument("--security", metavar="FILE", help="TLS, and who may do what (docs/howto/security.md)")


async def _run(options: argparse.Namespace) -> int:
    try:
        security = security_from_environment(os.environ, options.security)
        listen = tuple(options.listen) or (ENDPOINT if security is None else SECURE_ENDPOINT,)
        async with router(listen, tuple(options.connect), security) as identity:
            print(f"router {identity} listens at {', '.join(listen)}; Ctrl-C ends it", flush=True)
            await asyncio.get_running_loop().create_future()
    except WireUnavailable as error:
        raise CommandFailed(str(error)) from error
    raise AssertionError("a router runs until it is interrupted")


COMMAND = Verb(
    "router",
    "the meeting point of several machines",
    _arguments,
    _run,
    description="A Zenoh router: programs on several machines find each other through it.",
)
