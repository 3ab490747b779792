"""The graph of a domain as one command sees it: by a hidden node of its own, for as long as the command runs."""

from __future__ import annotations

import argparse
import asyncio
import os
from collections.abc import AsyncGenerator
from contextlib import AsyncExitStack, asynccontextmanager

from actors import Child, Node, System, run
from actors.logs import ERROR, LogRecord
from actors.transport import WireUnavailable, transport_from_environment
from cli.command import CommandFailed

__all__ = ["Seen", "add_graph_options", "seen"]

QUIET = 0.06
"""Seconds without a change after which the graph counts as complete: other processes of a host are found within 40 ms."""


class Seen:
    """The graph, seen from a node of this command."""

    def __init__(self, system: System, node: Node) -> None:
        self.system = system
        self.node = node

    async def settle(self, most: float) -> None:
        """Return when other processes have been found and nothing has changed for a moment; after `most` seconds in any case."""
        changed = asyncio.Event()
        graph = self.system.graph
        forget = graph.on_change(changed.set)
        try:
            async with asyncio.timeout(most):
                while True:
                    changed.clear()
                    try:
                        async with asyncio.timeout(QUIET):
                            await changed.wait()
                    except TimeoutError:
                        if any(True for _ in graph.elsewhere()):
                            return
                        await changed.wait()
        except TimeoutError:
            return
        finally:
            forget()


@asynccontextmanager
async def seen(options: argparse.Namespace) -> AsyncGenerator[Seen]:
    """Take part in the graph of ROS_DOMAIN_ID as the options say. Raises `CommandFailed` if that is not possible."""
    refused: list[str] = []

    def alone(record: LogRecord) -> None:
        if "because" in record.fields and record.level >= ERROR:
            refused.append(record.fields["because"])

    name = f"_robactor_cli_{os.getpid()}"
    async with AsyncExitStack() as stack:
        try:
            transport = transport_from_environment(
                os.environ,
                listen=tuple(options.listen),
                connect=tuple(options.connect),
                security=options.security,
            )
            whole = run(Child(Node, name=name), transport=transport, signals=False, sinks=(alone,))
            system = await stack.enter_async_context(whole)
        except (WireUnavailable, ValueError) as error:
            raise CommandFailed(str(error)) from error
        if refused:
            raise CommandFailed(refused[0])
        graph = Seen(system, system.node(name))
        await graph.settle(options.spin_time)
        yield graph


def add_graph_options(parser: argparse.ArgumentParser) -> None:
    """The options of every command that looks at the graph."""
    group = parser.add_argument_group("network")
    group.add_argument(
        "--spin-time", type=float, default=0.5, metavar="S", help="look for other processes at most S seconds (0.5)"
    )
    group.add_argument(
        "--connect", action="append", default=[], metavar="ENDPOINT", help="also connect to tcp/HOST:PORT"
    )
    group.add_argument(
        "--listen", action="append", default=[], metavar="ENDPOINT", help="let others connect to tcp/HOST:PORT"
    )
    group.add_argument("--security", metavar="FILE", help="TLS, and who may do what (docs/security.md)")
    group.add_argument("--no-daemon", action="store_true", help="accepted for ros2's sake: there is no daemon")
