"""A small system with a web server, and the simplest clients that speak its protocols."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncGenerator, AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any

from websockets.asyncio.client import ClientConnection, connect

from actors import Action, Child, Done, Node, Service, Steps, Supervisor, System, Topic, parameter, publishes, qos, run
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from cli.web.server.server import WebServer
from cli.web.server.settings import WebSettings

CHATTER = Topic(String, "/chatter")
LATCHED = Topic(String, "/latched", qos.STATE)
ADD = Service(AddTwoInts, "/add")
COUNT = Action(Fibonacci, "/count")
WAIT = 10.0
"""Seconds after which a test gives up waiting."""


class Talker(Node):
    """Publishes what it is told to."""

    chatter = publishes(CHATTER)
    latched = publishes(LATCHED)
    speed = parameter(0.5, ge=0.0, le=2.0)
    gains = parameter([1.0, 2.0])
    label = parameter("red")
    count = parameter(3)
    code = parameter([b"\x01"])


class Worker(Node):
    """Adds, and counts."""

    @ADD.serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        if request.a == 13:
            raise ValueError("13 is not added")
        return AddTwoInts.Response(sum=request.a + request.b)

    @COUNT.serve()
    async def count_up(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        numbers = [0, 1]
        for _ in range(goal.order - 1):
            numbers.append(numbers[-1] + numbers[-2])
            yield Fibonacci.Feedback(sequence=numbers)
        while goal.order > 50:
            await self.clock.sleep(0.01)
        yield Done(Fibonacci.Result(sequence=numbers))


@dataclass
class Stage:
    """A system that serves, and where."""

    system: System
    server: WebServer

    @property
    def url(self) -> str:
        return self.server.url.replace("http", "ws", 1)

    @property
    def talker(self) -> Talker:
        return self.system.node(Talker)

    @asynccontextmanager
    async def foxglove(self, name: str = "foxglove.sdk.v1") -> AsyncGenerator[Foxglove]:
        async with connect(self.url, subprotocols=[name], max_size=None) as socket:  # type: ignore[list-item]
            yield Foxglove(socket)

    @asynccontextmanager
    async def rosbridge(self) -> AsyncGenerator[Bridge]:
        async with connect(self.url, max_size=None) as socket:
            yield Bridge(socket)

    async def get(self, path: str, *headers: str) -> tuple[int, dict[str, str], bytes]:
        """Status, headers and body of a plain request."""
        return await request(self.server.port, f"GET {path} HTTP/1.1", f"Host: localhost:{self.server.port}", *headers)


async def request(port: int, *lines: str) -> tuple[int, dict[str, str], bytes]:
    """Send lines as they are, and read the answer to its end."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write("".join(f"{line}\r\n" for line in (*lines, "")).encode("latin-1"))
    async with asyncio.timeout(WAIT):
        answer = await reader.read()
    writer.close()
    await writer.wait_closed()
    head, _, body = answer.partition(b"\r\n\r\n")
    first, *rest = head.decode("latin-1").split("\r\n")
    return (
        int(first.split(" ")[1]),
        {name.lower(): value for name, _, value in (line.partition(": ") for line in rest)},
        body,
    )


class Socket:
    """One connection, whose frames wait to be looked through."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.frames: list[Any] = []

    async def say(self, op: str, **fields: Any) -> None:
        await self.socket.send(json.dumps({"op": op, **fields}))

    async def next(self) -> Any:
        """The next frame: an object, or bytes."""
        async with asyncio.timeout(WAIT):
            frame = await self.socket.recv()
        return json.loads(frame) if isinstance(frame, str) else frame

    async def find(self, op: str, **fields: Any) -> Any:
        """The first object of this op with these fields; what came before it is looked through, too."""
        for index, frame in enumerate(self.frames):
            if isinstance(frame, dict) and _fits(frame, op, fields):
                return self.frames.pop(index)
        while True:
            frame = await self.next()
            if isinstance(frame, dict) and _fits(frame, op, fields):
                return frame
            self.frames.append(frame)

    async def binary(self) -> bytes:
        """The first binary frame."""
        while True:
            for index, frame in enumerate(self.frames):
                if isinstance(frame, bytes):
                    self.frames.pop(index)
                    return frame
            self.frames.append(await self.next())


def _fits(frame: Any, op: str, fields: dict[str, Any]) -> bool:
    return frame.get("op") == op and all(frame.get(key) == value for key, value in fields.items())


class Foxglove(Socket):
    """A Foxglove client."""

    async def channel(self, topic: str) -> Any:
        """A channel, once it is advertised."""
        return await self._advertised("advertise", "channels", "topic", topic)

    async def service(self, name: str) -> Any:
        """A service, once it is advertised."""
        return await self._advertised("advertiseServices", "services", "name", name)

    async def _advertised(self, op: str, kind: str, key: str, name: str) -> Any:
        while True:
            for frame in self.frames:
                if isinstance(frame, dict) and frame["op"] == op:
                    for one in frame[kind]:
                        if one[key] == name:
                            return one
            self.frames.append(await self.next())


class Bridge(Socket):
    """A rosbridge client."""

    async def call(self, service: str, args: Any = None, **more: Any) -> Any:
        """The response of a service."""
        await self.say("call_service", id=f"call {service}", service=service, args=args or {}, **more)
        return await self.find("service_response", id=f"call {service}")


@asynccontextmanager
async def served_beside(tree: Supervisor, settings: WebSettings | None = None) -> AsyncIterator[Stage]:
    """A system, and a web server on a free port."""
    async with run(tree, signals=False, sinks=()) as system:
        joined = await system.join(Child(WebServer, name="_web", args=(settings or WebSettings(port=0),)))
        server = joined.node
        assert isinstance(server, WebServer)
        yield Stage(system, server)


@asynccontextmanager
async def serving(settings: WebSettings | None = None) -> AsyncIterator[Stage]:
    """A system with a talker and a worker, and a web server on a free port."""
    async with served_beside(Supervisor("tree", children=[Child(Talker), Child(Worker)]), settings) as stage:
        yield stage


async def until(condition: Any) -> None:
    """Wait until something is so."""
    async with asyncio.timeout(WAIT):
        while not condition():
            await asyncio.sleep(0.005)
