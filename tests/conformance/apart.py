"""A client in another process, by remote control."""

from __future__ import annotations

import asyncio
import pickle
import subprocess
import sys
import tempfile
from collections.abc import Collection
from pathlib import Path
from typing import Any

from actors import Service, Topic
from actors.contracts.contracts import Action
from tests.conformance.client import News, SentGoal
from tests.conformance.pickled import dumps


class ClientProcess:
    """One process of `tests.conformance.elsewhere`, with the clients of all cases."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory()
        self._socket = str(Path(self._folder.name) / "client")
        command = [sys.executable, "-m", "tests.conformance.elsewhere", self._socket]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, cwd=Path(__file__).parents[2])
        assert self.process.stdout is not None
        assert self.process.stdout.readline() == b"ready\n", "the process of the client has not started"

    async def do(self, verb: str, client: int, *arguments: Any) -> Any:
        """Have something done by a client there; what it returned. Raises RuntimeError with the text of an error there."""
        reader, writer = await asyncio.open_unix_connection(self._socket)
        writer.write(dumps((verb, client, arguments)))
        writer.write_eof()
        answer = await reader.read()
        writer.close()
        done, value = pickle.loads(answer)
        if not done:
            raise RuntimeError(f"in the process of the client: {value}")
        return value

    def close(self) -> None:
        """End the process."""
        with self.process:
            self.process.terminate()
        self._folder.cleanup()


class Remote:
    """A client in that process, called by its port; see `tests.conformance.client.Told`."""

    def __init__(self, process: ClientProcess, place: int, wire: str = "zenoh") -> None:
        """`place` is where it meets the server: a gossip port, or over `dds` a domain."""
        self._process = process
        self._place = place
        self._wire = wire

    async def _do(self, verb: str, *arguments: Any) -> Any:
        return await self._process.do(verb, self._place, *arguments)

    async def open(self, name: str) -> None:
        await self._do("make", self._wire)
        await self._do("open", name)

    async def wait_for_nodes(self, names: Collection[str]) -> None:
        await self._do("wait_for_nodes", set(names))

    async def listen(self, number: int, topic: Topic[Any], everything: bool) -> None:
        await self._do("listen", number, topic, everything)

    async def wait_for_publisher(self, number: int) -> None:
        await self._do("wait_for_publisher", number)

    async def next(self, number: int) -> Any:
        return await self._do("next", number)

    async def call(self, service: Service[Any, Any], request: Any, timeout: float) -> Any:
        return await self._do("call", service, request, timeout)

    async def send_goal(self, action: Action[Any, Any, Any], message: Any) -> SentGoal:
        sent: SentGoal = await self._do("send_goal", action, message)
        return sent

    async def news(self) -> News:
        news: News = await self._do("news")
        return news

    async def close(self) -> None:
        await self._do("close")
