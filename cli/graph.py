"""The graph of a domain as one command sees it: by a hidden node of its own, for as long as the command runs."""

from __future__ import annotations

import argparse
import asyncio
import os
from collections.abc import AsyncGenerator, Callable
from contextlib import AsyncExitStack, asynccontextmanager

from actors import Child, Node, System, run
from actors.logs import ERROR, LogRecord
from actors.names.names import InvalidName, validate_node_name
from actors.transport import WireUnavailable, transport_from_environment
from cli.command import CommandFailed
from cli.parsing import add_graph_options
from cli.types import learn_folders
from cli.view import LATE, QUIET

__all__ = ["Seen", "add_graph_options", "seen"]


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

    async def late(self, wanted: Callable[[], bool], most: float) -> bool:
        """Wait until `wanted`, which looks at the graph, is true, and return whether it is; `most` seconds, or `LATE` if that is longer.

        The graph may seem complete too early where the machine is busy, or a process has just been started.
        """
        changed = asyncio.Event()
        forget = self.system.graph.on_change(changed.set)
        try:
            async with asyncio.timeout(max(most, LATE)):
                while not wanted():
                    changed.clear()
                    await changed.wait()
        except TimeoutError:
            return False
        finally:
            forget()
        return True


@asynccontextmanager
async def seen(options: argparse.Namespace, node_name: str | None = None) -> AsyncGenerator[Seen]:
    """Take part in the graph of ROS_DOMAIN_ID as the options say, by a hidden node or one of this name.

    Raises `CommandFailed` if that is not possible.
    """
    refused: list[str] = []

    def alone(record: LogRecord) -> None:
        if "because" in record.fields and record.level >= ERROR:
            refused.append(record.fields["because"])

    name = node_name or f"_robactor_cli_{os.getpid()}"
    try:
        validate_node_name(name)
    except InvalidName as error:
        raise CommandFailed(str(error)) from None
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
        learn_folders(options)
        graph = Seen(system, system.node(name))
        await graph.settle(options.spin_time)
        yield graph
