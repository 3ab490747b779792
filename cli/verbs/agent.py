"""`agent`: takes parts of trees that run on other machines (docs/howto/machines.md)."""

from __future__ import annotations

import argparse
import asyncio
import os
from pathlib import Path

from actors.errors import DeclarationError
from actors.hosts.launcher import CONNECT, LISTEN, transport_here
from actors.hosts.tls import PORT, address_of, serve
from actors.running.signals import listen
from actors.transport.environment import SECURITY, security_from_environment
from actors.transport.protocol import WireUnavailable
from actors.waiting import wake
from cli.command import CommandFailed
from cli.parsing import Parser
from cli.verb import Verb


def _arguments(parser: Parser) -> None:
    parser.add_argument(
        "--owner",
        action="append",
        required=True,
        metavar="NAME",
        help="whose trees: the common name in a certificate of the fleet; may be given again",
    )
    parser.add_argument(
        "--at", default=f"0.0.0.0:{PORT}", metavar="ADDRESS:PORT", help=f"where trees connect to (0.0.0.0:{PORT})"
    )
    parser.add_argument(
        "--listen",
        action="append",
        default=[],
        metavar="ENDPOINT",
        help="where its nodes are reached, with port 0: tls/192.168.1.6:0",
    )
    parser.add_argument(
        "--connect",
        action="append",
        default=[],
        metavar="ENDPOINT",
        help="where its nodes find the others: tls/ROBOT:7448",
    )
    parser.add_argument(
        "--import",
        action="append",
        default=[],
        metavar="MODULE",
        dest="modules",
        help="what its nodes will need: imported before they come",
    )
    parser.add_argument(
        "--security", metavar="FILE", help="who this machine is, and whom it trusts (docs/howto/security.md)"
    )


def _agent(options: argparse.Namespace) -> int:
    return asyncio.run(_run(options))  # it listens to signals itself


async def _run(options: argparse.Namespace) -> int:
    """The processes that it launches take from its environment how they are connected."""
    try:
        security = security_from_environment(os.environ, options.security)
        if security is None:
            raise CommandFailed(
                f"an agent runs what others send it, so it must know who they are: --security FILE, or {SECURITY}=FILE (docs/howto/security.md)"
            )
        os.environ[SECURITY] = str(Path(security.file).absolute())  # noqa: ASYNC240  # nothing waits yet
        os.environ[LISTEN], os.environ[CONNECT] = ",".join(options.listen), ",".join(options.connect)
        transport_here()  # what forbids it shows here, not when the first child comes
        address, port = address_of(options.at)
        agent = serve(address, port, owners=options.owner, security=security, say=_say, modules=options.modules)
        async with agent as (at, bound):
            loop = asyncio.get_running_loop()
            ended: asyncio.Future[int] = loop.create_future()

            def end(number: int) -> bool:
                wake(ended, 128 + number)
                return True

            leave = listen(loop, end)  # before the line: who reads it may send a signal at once
            _say(f"the agent waits at {at}:{bound} for trees of {', '.join(options.owner)}; Ctrl-C ends it")
            try:
                return await ended
            finally:
                leave()
    except (WireUnavailable, DeclarationError) as error:
        raise CommandFailed(str(error)) from error
    except OSError as error:
        raise CommandFailed(f"cannot listen at {options.at}: {error.strerror}") from error


def _say(line: str) -> None:
    print(line, flush=True)


COMMAND = Verb(
    "agent",
    "takes parts of trees elsewhere",
    _arguments,
    _agent,
    description="Takes parts of trees that run on other machines, Child(..., host=NAME), over mutual TLS only.",
)
