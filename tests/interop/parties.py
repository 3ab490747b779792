"""The two sides of a test: programs that we did not write, as processes that obey lines of JSON, and a system of ours."""

from __future__ import annotations

import asyncio
import json
import os
import tempfile
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from itertools import count
from pathlib import Path
from typing import Any, TypeVar

from actors import Child, Node, Topic, run
from actors.interfaces import from_plain, get_message, to_plain
from actors.interfaces.message import Message
from actors.logs import LogRecord
from actors.system import System
from actors.transport import Transport
from actors.transport.zenoh import ZenohConfig, ZenohTransport

T = TypeVar("T")
PATIENCE = 60.0
"""Seconds after which a test gives up. No test that passes waits so long."""

_PROGRAMS = Path(__file__).parent / "programs"


async def until(condition: Callable[[], T], what: str) -> T:
    """Wait until `condition` returns something true, and return it. It is asked again and again, because other processes do not tell."""
    try:
        async with asyncio.timeout(PATIENCE):
            while not (found := condition()):
                await asyncio.sleep(0.02)
            return found
    except TimeoutError:
        raise AssertionError(f"waited {PATIENCE:g} s in vain until {what}") from None


class Program:
    """A program of the folder `programs` under its own Python, and all that it has written."""

    def __init__(self, process: asyncio.subprocess.Process, name: str) -> None:
        self.process = process
        self.name = name
        self.lines: list[dict[str, Any]] = []
        self._numbers = count()
        self._reading = asyncio.create_task(self._read())

    @classmethod
    async def start(cls, python: Path | str, name: str, *arguments: object, **environment: str) -> Program:
        """Start ``name.py`` with these arguments, and wait until it obeys."""
        pipe = asyncio.subprocess.PIPE
        process = await asyncio.create_subprocess_exec(
            str(python), str(_PROGRAMS / f"{name}.py"), *map(str, arguments),
            stdin=pipe, stdout=pipe, env={**os.environ, **environment}, limit=2**24,
            cwd=tempfile.gettempdir(),  # some keep what they have compiled where they are started
        )  # fmt: skip
        program = cls(process, name)
        await program.until("ready")
        return program

    async def _read(self) -> None:
        assert self.process.stdout is not None
        async for line in self.process.stdout:
            self.lines.append(json.loads(line))

    def said(self, kind: str, **more: object) -> list[dict[str, Any]]:
        """The lines of that kind and content."""
        return [line for line in self.lines if line["kind"] == kind and more.items() <= line.items()]

    async def until(self, kind: str, **more: object) -> dict[str, Any]:
        """The newest line of that kind and content; waits for the first one."""

        def found() -> list[dict[str, Any]]:
            if self._reading.done() and not self.said(kind, **more):
                raise AssertionError(f"{self.name} has ended without saying {kind} {more}")
            return self.said(kind, **more)

        return (await until(found, f"{self.name} says {kind} {more}"))[-1]

    async def do(self, what: str, **arguments: object) -> Any:
        """Let it do something, and return the result. Raises AssertionError with the error that it had."""
        number = next(self._numbers)
        assert self.process.stdin is not None
        self.process.stdin.write((json.dumps({"do": what, "number": number, **arguments}) + "\n").encode())

        def answered() -> list[dict[str, Any]]:
            ended = [{"kind": "failed", "error": "it has ended"}] if self._reading.done() else []
            return self.said("done", number=number) + self.said("failed", number=number) or ended

        answer = (await until(answered, f"{self.name} has done {what} {arguments}"))[0]
        assert answer["kind"] == "done", f"{self.name}: {what} {arguments}: {answer['error']}"
        return answer["value"]

    def heard(self, topic: str) -> list[Any]:
        """The messages of a topic that it has received, as plain data."""
        return [line["message"] for line in self.said("heard", topic=topic)]

    async def end(self) -> None:
        """End it as it wants to be ended; kill it if it does not."""
        assert self.process.stdin is not None
        if self.process.returncode is None:
            self.process.stdin.close()
            try:
                async with asyncio.timeout(10.0):
                    await self.process.wait()
            except TimeoutError:
                self.process.kill()
        await self.process.wait()
        await self._reading


class Ours:
    """A system of ours on the network, with one node, ``/ours/robot``."""

    def __init__(self, system: System, port: int, logs: list[LogRecord]) -> None:
        self.system = system
        self.port = port
        self.logs = logs
        self.node: Node = system.node("robot")
        self.got: dict[str, list[Any]] = {}

    def listen(self, topic: Topic[Any], qos: Any = None) -> list[Any]:
        """What a new subscription of the node receives, as plain data."""
        got = self.got[topic.name] = []

        def heard(message: Message) -> None:
            got.append(to_plain(message))

        self.node.on(topic, heard, qos=qos)
        return got

    def view(self, topic: str) -> Any:
        """The topic in a snapshot; None if it is not known."""
        return next((view for view in self.system.snapshot().topics if view.name == topic), None)

    def publishers(self, topic: str) -> dict[str, str]:
        """node -> quality of service, of the publishers of a topic."""
        view = self.view(topic)
        return {} if view is None else {edge.node: edge.qos for edge in view.publishers}

    def subscriptions(self, topic: str) -> dict[str, str]:
        """node -> quality of service, of the subscriptions of a topic."""
        view = self.view(topic)
        return {} if view is None else {edge.node: edge.qos for edge in view.subscriptions}

    def nodes(self) -> set[str]:
        return {view.name for view in self.system.snapshot().nodes}

    def services(self) -> dict[str, str]:
        """service -> node of its server."""
        return {view.name: view.server for view in self.system.snapshot().services}


@asynccontextmanager
async def our_system(
    port: int, *nodes: Child, transport: Transport | None = None, **environment: Any
) -> AsyncIterator[Ours]:
    """A system of ours whose processes and peers meet by this transport, or by Zenoh at a port of the loopback interface."""
    logs: list[LogRecord] = []
    tree = (Child(Node, name="robot", namespace="/ours"), *nodes)
    transport = transport or ZenohTransport(ZenohConfig(gossip_port=port, **environment))
    async with run(*tree, transport=transport, signals=False, sinks=(logs.append,)) as system:
        yield Ours(system, port, logs)


async def deliver(send: Callable[[Any], Any], received: Callable[[], list[Any]], type: str, wanted: list[Any]) -> None:
    """Send messages, given as plain data, until all of them have arrived in order and unchanged.

    What is sent at once after two endpoints have found each other may be lost, because the route is not there yet. Therefore the first
    message is sent until it arrives; after that nothing may be lost.
    """
    cls = get_message(type)
    first, *rest = [to_plain(from_plain(cls, one)) for one in wanted]

    async def sent(one: Any) -> None:
        result = send(one)
        if asyncio.iscoroutine(result):
            await result

    async with asyncio.timeout(PATIENCE):
        while not received():
            await sent(first)
            await asyncio.sleep(0.05)
    for one in rest:
        await sent(one)

    def others() -> list[Any]:
        return [one for one in received() if one != first]

    await until(lambda: len(others()) >= len(rest), f"{len(rest)} messages have arrived; {len(others())} have")
    assert others() == rest
