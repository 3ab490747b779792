"""The graph of a domain as one command sees it: by a hidden node of its own, for as long as the command runs."""

from __future__ import annotations

import argparse
import asyncio
import os
from collections.abc import AsyncGenerator, Callable, Generator
from contextlib import AsyncExitStack, asynccontextmanager, contextmanager

from actors import Child, Node, System, run
from actors.logs import ERROR, LogRecord
from actors.names.names import InvalidName, validate_node_name
from actors.transport import WireUnavailable, transport_from_environment
from cli.command import CommandFailed
from cli.graph.looking import late, settle
from cli.graph.types import learn_folders


class Seen:
    """The graph, seen from a node of this command."""

    def __init__(self, system: System, node: Node) -> None:
        self.system = system
        self.node = node

    async def settle(self, most: float) -> None:
        """See `cli.graph.looking.settle`."""
        with self._news() as news:
            graph = self.system.graph
            await settle(news, lambda: any(True for _ in graph.elsewhere()), graph.complete, most)

    async def late(self, wanted: Callable[[], bool], most: float) -> bool:
        """Wait for something that is asked for by its name. See `cli.graph.looking.late`."""
        with self._news() as news:
            return await late(news, wanted, most)

    @contextmanager
    def _news(self) -> Generator[asyncio.Event]:
        """An event that is set at every change of the graph, for as long as the block lasts."""
        news = asyncio.Event()
        forget = self.system.graph.on_change(news.set)
        try:
            yield news
        finally:
            forget()


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
