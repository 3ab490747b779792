"""Hostile frames and requests for the web server, on every protocol, while an honest client goes on: its words all arrive."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import json
import resource
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from random import Random
from typing import Any

from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidHandshake, InvalidMessage
from websockets.typing import Subprotocol

from actors import Child, Node, Supervisor, System, Topic, parameter, run
from actors.interfaces.std_msgs.msg import String
from actors.logs import ERROR, LogRecord
from cli.web.server.server import WebServer
from cli.web.server.settings import WebSettings

ATTACKERS = 4
"""Connections at the same time."""
AT_ONCE = 50
"""Frames that an attacker sends at once."""
EVERY = 200
"""Hostile frames between two words of the honest client."""
WORDS = Topic(String, "/words")

OBJECTS: tuple[dict[str, Any], ...] = (
    {"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 1}]},
    {"op": "unsubscribe", "subscriptionIds": [1]},
    {"op": "advertise", "channels": [{"id": 1, "topic": "/a", "encoding": "json", "schemaName": "std_msgs/msg/String"}]},
    {"op": "unadvertise", "channelIds": [1]},
    {"op": "getParameters", "parameterNames": ["/victim.speed"], "id": "x"},
    {"op": "setParameters", "parameters": [{"name": "/victim.speed", "value": 1.0}], "id": "x"},
    {"op": "subscribeParameterUpdates", "parameterNames": ["/victim.speed"]},
    {"op": "unsubscribeParameterUpdates", "parameterNames": []},
    {"op": "subscribeConnectionGraph"},
    {"op": "fetchAsset", "uri": "package://robot/x.stl", "requestId": 1},
    {"op": "robactor.subscribeSystem"},
    {"op": "robactor.bags", "id": 1},
    {"op": "robactor.readBag", "id": 1, "name": "x", "file": "y", "offset": 0},
    {"op": "robactor.killNode", "node": "/nobody", "id": 1},
    {"op": "advertise", "topic": "/b", "type": "std_msgs/String", "latch": False, "queue_size": 1},
    {"op": "publish", "topic": "/b", "msg": {"data": "x"}},
    {"op": "subscribe", "topic": "/b", "type": "std_msgs/String", "throttle_rate": 1, "queue_length": 1, "compression": "cbor", "id": "s",
     "fragment_size": 100},
    {"op": "unsubscribe", "topic": "/b", "id": "s"},
    {"op": "call_service", "service": "/victim/get_parameters", "args": {"names": ["speed"]}, "id": "c", "timeout": 1, "fragment_size": 9,
     "compression": "png"},
    {"op": "call_service", "service": "/rosapi/topics", "args": {}, "id": "r"},
    {"op": "call_service", "service": "/rosapi/get_param", "args": {"name": "/victim:speed"}, "id": "r"},
    {"op": "call_service", "service": "/rosapi/message_details", "args": {"type": "sensor_msgs/Imu"}, "id": "r"},
    {"op": "advertise_service", "service": "/mine", "type": "std_srvs/SetBool"},
    {"op": "unadvertise_service", "service": "/mine"},
    {"op": "service_response", "id": "1", "service": "/mine", "values": {}, "result": True},
    {"op": "advertise_action", "action": "/act", "type": "example_interfaces/Fibonacci"},
    {"op": "unadvertise_action", "action": "/act"},
    {"op": "action_feedback", "id": "1", "action": "/act", "values": {"sequence": [1]}},
    {"op": "action_result", "id": "1", "action": "/act", "values": {}, "status": 4, "result": True},
    {"op": "send_action_goal", "id": "g", "action": "/act", "action_type": "example_interfaces/Fibonacci", "args": {}, "timeout": 0.1},
    {"op": "cancel_action_goal", "id": "g", "action": "/act"},
    {"op": "fragment", "id": "f", "data": '{"op":', "num": 0, "total": 2},
    {"op": "set_level", "level": "none"},
    {"op": "auth", "mac": "x"},
)  # fmt: skip
"""Requests that are in order, of both protocols; each is sent to both."""

VALUES: tuple[Any, ...] = (
    None, True, -1, 0, 2**31, 2**63, 2**64, 10**40, 10**400, -0.5, 1e308, float("inf"), float("nan"),
    "", "/", "//", "/a//b", "/a b", "\0", "\ud7ff", "é" * 300, "x" * 5000,
    "../../etc/passwd", "a/b", "a/msg/b", "../msg/..", "std_msgs/msg/String", "/victim.", ".", [], [[]], [None], [{}], {}, {"a": {}},
    {"op": "subscribe"}, [1] * 1000, {"header": 3}, {"data": 5}, {"data": None},
)  # fmt: skip

REQUESTS: tuple[bytes, ...] = (
    b"GET /../../etc/passwd HTTP/1.1\r\nHost: localhost\r\n\r\n",
    b"GET /%2e%2e/%2e%2e/server.py HTTP/1.1\r\nHost: localhost\r\n\r\n",
    b"GET /%ff%fe HTTP/1.1\r\nHost: localhost\r\n\r\n",
    b"GET //[::1 HTTP/1.1\r\nHost: localhost\r\n\r\n",
    b"GET /" + b"a" * 5000 + b" HTTP/1.1\r\nHost: localhost\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: [::\r\nHost: b\r\n\r\n",
    b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 5\r\n\r\nhello",
    b"GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 8\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nOrigin: http://[\r\n\r\n",
    b"GET /metrics HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer \xff\r\n\r\n",
    b"\x16\x03\x01\x02\x00\x01\x00",
    b"\r\n\r\n",
    b"",
)


class Victim(Node):
    """Has a parameter, and nothing to hide."""

    speed = parameter(1.0)


@dataclass
class WebOutcome:
    """What has become of it."""

    sent: Counter[str] = field(default_factory=Counter[str])
    closed: Counter[int] = field(default_factory=Counter[int])
    """How connections ended, by code."""
    status: Counter[str] = field(default_factory=Counter[str])
    """What raw requests were answered with; empty: nothing."""
    told: list[str] = field(default_factory=list[str])
    heard: list[str] = field(default_factory=list[str])
    errors: list[str] = field(default_factory=list[str])
    """Lines of the log that are errors, and what has reached the event loop's exception handler."""
    left: list[str] = field(default_factory=list[str])
    """Nodes of clients that are there after all clients have gone."""
    grown: int = 0
    """By so many kilobytes the process has grown after the first fifth."""


async def attack(count: int, seed: int) -> WebOutcome:
    """Send so many frames and requests, on the real clock."""
    outcome = WebOutcome()
    asyncio.get_running_loop().set_exception_handler(lambda _, context: outcome.errors.append(str(context)))

    def sink(record: LogRecord) -> None:
        if record.level >= ERROR and "BrowserFailed" not in str(
            record.fields
        ):  # a hostile answer to a call is that call's error
            outcome.errors.append(f"{record.event} {dict(record.fields)}")

    tree = Supervisor("tree", children=[Child(Victim)])
    async with run(tree, signals=False, sinks=(sink,)) as system:
        joined = await system.join(Child(WebServer, name="_web", args=(WebSettings(port=0),)))
        server = joined.node
        assert isinstance(server, WebServer)
        await _beside_an_honest_client(system, server, count, seed, outcome)
        async with asyncio.timeout(60):
            while outcome.left:
                await asyncio.sleep(0.02)
                outcome.left = [path[-1] for path in system.nodes if path[-1].startswith("_web_client")]
    return outcome


async def _beside_an_honest_client(
    system: System, server: WebServer, count: int, seed: int, outcome: WebOutcome
) -> None:
    url = server.url.replace("http", "ws", 1)
    async with connect(url) as honest:
        await honest.send(json.dumps({"op": "subscribe", "topic": WORDS.name, "type": "std_msgs/String"}))
        entry = system.graph.topic(WORDS.name)
        while not entry.subscriptions:
            await asyncio.sleep(0.01)
        words = system.node(Victim).publisher(WORDS)

        def progress(sent: int) -> None:
            if sent % EVERY == 0:
                outcome.told.append(f"word {sent}")
                words(String(data=outcome.told[-1]))

        listening = asyncio.ensure_future(_listen(honest, outcome))
        for part in (count // 5, count - count // 5):
            shares = [part // ATTACKERS] * ATTACKERS
            await asyncio.gather(
                *(
                    _attacker(url, server.port, share, Random(seed * 100 + n), outcome, progress)
                    for n, share in enumerate(shares)
                )
            )
            gc.collect()
            before = outcome.grown
            outcome.grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        outcome.grown -= before
        async with asyncio.timeout(30):
            while len(outcome.heard) < len(outcome.told):
                await asyncio.sleep(0.02)
        listening.cancel()
    outcome.left = ["not looked at yet"]


async def _listen(socket: Any, outcome: WebOutcome) -> None:
    async for frame in socket:
        message = json.loads(frame)
        if message["op"] == "publish":
            outcome.heard.append(message["msg"]["data"])


async def _attacker(
    url: str, port: int, count: int, random: Random, outcome: WebOutcome, progress: Callable[[int], None]
) -> None:
    sent = 0
    while sent < count:
        if random.random() < 0.4:
            for _ in range(40):
                await _raw(port, random, outcome)
            sent += 40
            continue
        protocol = random.choice(("foxglove.sdk.v1", "foxglove.websocket.v1", None))
        try:
            offered = None if protocol is None else [Subprotocol(protocol)]
            async with connect(url, subprotocols=offered, max_size=None, close_timeout=0.2) as socket:
                silent = random.random() < 0.5  # half of them never read
                reader = None if silent else asyncio.ensure_future(_drain(socket))
                try:
                    for _ in range(random.randrange(1, 800)):
                        await socket.send(_frame(random))
                        sent += 1
                        outcome.sent[protocol or "rosbridge"] += 1
                        progress(outcome.sent.total())
                        if sent % AT_ONCE == 0:
                            await asyncio.sleep(0.02)  # an answer, or a farewell, has time to come
                    if not silent:
                        async with asyncio.timeout(30):
                            await (await socket.ping())  # all frames have been handled
                finally:
                    if reader is not None:
                        reader.cancel()
                if random.random() < 0.3:
                    socket.transport.abort()
        except ConnectionClosed as closed:
            outcome.closed[closed.rcvd.code if closed.rcvd is not None else 0] += 1
        except (InvalidHandshake, InvalidMessage, OSError):
            outcome.closed[-1] += 1


async def _drain(socket: Any) -> None:
    with contextlib.suppress(ConnectionClosed):
        async for _ in socket:
            pass


async def _raw(port: int, random: Random, outcome: WebOutcome) -> None:
    request = bytearray(random.choice(REQUESTS))
    for _ in range(random.choice((0, 0, 0, 1, 2))):
        if request:
            request[random.randrange(len(request))] = random.randrange(256)
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    try:
        writer.write(bytes(request))
        try:
            async with asyncio.timeout(0.05):
                answer = await reader.read()
        except TimeoutError:  # the request is not complete: the server waits for the rest
            answer = b""
        outcome.status[answer[9:12].decode("latin-1")] += 1
    except OSError:
        outcome.status["reset"] += 1
    finally:
        writer.close()
        with contextlib.suppress(OSError):
            await writer.wait_closed()
    outcome.sent["http"] += 1


def _frame(random: Random) -> str | bytes:
    """A frame: a request in which something is wrong, or nothing; or no request at all."""
    kind = random.randrange(10)
    if kind == 0:
        return random.randbytes(random.randrange(60))
    if kind == 1:
        return bytes([random.randrange(5)]) + random.randbytes(random.randrange(40))
    if kind == 2:
        return random.choice(
            (
                "",
                "[",
                "[" * 100_000,
                "{}",
                "7",
                '{"op":5}',
                '{"op":"x"}',
                '{"op":NaN}',
                '"\\ud800"',
                "\0",
                '{"op":{"op":1}}',
            )
        )
    request = dict(random.choice(OBJECTS))
    for _ in range(random.randrange(3)):
        _spoil(request, random)
    try:
        text = json.dumps(request)
    except ValueError:
        text = "null"
    if kind == 3:
        cut = random.randrange(len(text))
        text = text[:cut] + random.choice(("", "\\", "}", "é")) + text[cut + 1 :]
    return text


def _spoil(request: dict[str, Any], random: Random) -> None:
    key = random.choice([*request, "other"])
    value = request.get(key)
    if isinstance(value, list) and value and isinstance(value[0], dict) and random.random() < 0.7:
        inner = dict(value[0])
        _spoil(inner, random)
        request[key] = [inner]
    elif isinstance(value, dict) and value and random.random() < 0.7:
        inner = dict(value)
        _spoil(inner, random)
        request[key] = inner
    elif random.random() < 0.2:
        request.pop(key, None)
    else:
        request[key] = random.choice(VALUES)


def findings(outcome: WebOutcome) -> list[str]:
    """Which promises are broken, one line each."""
    wrong = [f"error: {error}" for error in outcome.errors[:10]]
    if 1011 in outcome.closed:
        wrong.append(f"{outcome.closed[1011]} connections ended because the server had failed")
    if outcome.heard != outcome.told:
        wrong.append(f"the honest client heard {len(outcome.heard)} of {len(outcome.told)} words, or in another order")
    if outcome.left:
        wrong.append(f"nodes of clients are left: {outcome.left[:5]}")
    return wrong
