"""Who is let in and to what, on real links of the loopback interface."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from pathlib import Path
from typing import Any

import msgspec
import pytest
import pytest_asyncio

from actors import Child, Done, Node, Steps, System, Topic, publishes, qos, run, subscribes
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int32
from actors.transport import WireUnavailable
from actors.transport.keyed.protocol import Delivery
from actors.transport.security import Secret, Security
from actors.transport.zenoh import ZenohConfig
from actors.transport.zenoh.transport import ZenohKeys
from tests.actors.transport.contract.parties import Changes, Party
from tests.actors.transport.security.fleet import Fleet
from tests.actors.transport.zenoh.wires import free_port
from tests.stage import ADD, COUNT, NUMBERS, WORDS, number, order, result, step, total, two

SECRET_KEY, MARKER_KEY = "7/secret/a::msg::dds_::B_/H", "7/marker/a::msg::dds_::B_/H"
MARKER = {"peers": ["desk"], "publish": ["/marker"]}
PUBLISHES = {"peers": ["desk"], "publish": ["/marker", "/secret"]}
Case = Callable[[Fleet, Fleet], tuple[Security, Security]]


def _both(fleet: Fleet, desk: dict[str, Any] | None = None, **robot: Any) -> tuple[Security, Security]:
    return fleet.security("robot", **robot), fleet.security("desk", **(desk or {}))


def no_certificate(ours: Fleet, theirs: Fleet) -> tuple[Security, Security]:
    robot, desk = _both(ours)
    return robot, msgspec.structs.replace(desk, tls=msgspec.structs.replace(desk.tls, mutual=False))


def wrong_certificate(ours: Fleet, theirs: Fleet) -> tuple[Security, Security]:
    robot, desk = _both(ours)
    other = theirs.security("desk").tls
    return robot, msgspec.structs.replace(desk, tls=msgspec.structs.replace(other, authority=desk.tls.authority))


def right_certificate(ours: Fleet, theirs: Fleet) -> tuple[Security, Security]:
    return _both(ours)


def no_user(ours: Fleet, theirs: Fleet) -> tuple[Security, Security]:
    return _both(ours, desk={"user": None})


def wrong_password(ours: Fleet, theirs: Fleet) -> tuple[Security, Security]:
    robot, desk = _both(ours)
    return robot, msgspec.structs.replace(desk, password=Secret("guessed"))


def right_user(ours: Fleet, theirs: Fleet) -> tuple[Security, Security]:
    return _both(ours)


def no_key(ours: Fleet, theirs: Fleet) -> tuple[Security, Security]:
    return _both(ours, access=[MARKER])


def wrong_key(ours: Fleet, theirs: Fleet) -> tuple[Security, Security]:
    return _both(ours, access=[MARKER, {"peers": ["desk"], "publish": ["/secret/of_another"]}])


def right_key(ours: Fleet, theirs: Fleet) -> tuple[Security, Security]:
    return _both(ours, access=[PUBLISHES])


def no_direction(ours: Fleet, theirs: Fleet) -> tuple[Security, Security]:
    return _both(ours, access=[MARKER, {"peers": ["somebody"], "publish": ["/**"]}])


def wrong_direction(ours: Fleet, theirs: Fleet) -> tuple[Security, Security]:
    everything_else = {"peers": ["desk"], "subscribe": ["/**"], "serve": ["/**"], "call": ["/**"]}
    # What serves actions publishes their feedback; a topic that looks like that of an action is no way in.
    return _both(ours, access=[MARKER, everything_else])


def right_direction(ours: Fleet, theirs: Fleet) -> tuple[Security, Security]:
    return _both(ours, access=[{"peers": ["*"], "publish": ["/**"]}])


TABLE: list[tuple[Case, str]] = [
    (no_certificate, "no link"),
    (wrong_certificate, "no link"),
    (right_certificate, "heard"),
    (no_user, "no link"),
    (wrong_password, "no link"),
    (right_user, "heard"),
    (no_key, "not heard"),
    (wrong_key, "not heard"),
    (right_key, "heard"),
    (no_direction, "not heard"),
    (wrong_direction, "not heard"),
    (right_direction, "heard"),
]


@asynccontextmanager
async def opened(config: ZenohConfig, changes: Changes) -> AsyncIterator[Party]:
    party = Party(ZenohKeys(config), changes)
    await party.open()
    try:
        yield party
    finally:
        await party.transport.close()


async def outcome(robot: Security, desk: Security) -> str:
    """What becomes of a message of the desk for the robot: heard, not heard although the next one is, or no link at all."""
    changes, where = Changes(), f"tls/127.0.0.1:{free_port()}"
    async with opened(ZenohConfig(listen=(where,), gossip_port=0, security=robot), changes) as listener:
        secret, marker = listener.listen(SECRET_KEY)[0], listener.listen(MARKER_KEY)[0]
        config = ZenohConfig(mode="client", connect=(where,), security=desk, overrides="connect/timeout_ms=1000")
        try:
            async with opened(config, changes) as sender:
                secrets = sender.transport.outlet(SECRET_KEY, Delivery())
                markers = await sender.outlet(MARKER_KEY, Delivery())
                secrets.put(b"sit", b"")
                markers.put(b"1", b"")
                await changes.until(lambda: marker.payloads, "what was sent afterwards has come")
        except WireUnavailable:
            return "no link"
        return "heard" if secret.payloads == [b"sit"] else "not heard"


@pytest.mark.realtime
@pytest.mark.parametrize(("case", "expected"), TABLE, ids=[case.__name__ for case, _ in TABLE])
async def test_no_wrong_and_right_certificate_user_key_and_direction(case: Case, expected: str, tmp_path: Path) -> None:
    ours = Fleet(tmp_path / "ours", "robot", "desk", passwords=True)
    theirs = Fleet(tmp_path / "theirs", "desk")
    assert await outcome(*case(ours, theirs)) == expected


# A whole graph -------------------------------------------------------------------------------------------------------------

LATCHED = Topic(Int32, "latched", qos.LATCHED)
RULES = [
    {
        "peers": ["desk"],
        "nodes": ["/desk"],
        "publish": ["/numbers"],
        "subscribe": ["/latched"],
        "call": ["/add", "/count"],
    }
]


class Robot(Node):
    numbers = subscribes(NUMBERS)
    words = subscribes(WORDS)
    latched = publishes(LATCHED)

    async def on_start(self) -> None:
        self.latched(number(4))

    @ADD.serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return total(request.a + request.b)

    @COUNT.serve()
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        yield step(1)
        yield Done(result(1, goal.order))


class Desk(Node):
    words = publishes(WORDS)
    numbers = publishes(NUMBERS)
    latched = subscribes(LATCHED)


@pytest_asyncio.fixture
async def pair(tmp_path: Path) -> AsyncIterator[tuple[System, System]]:
    """The systems of a robot with `RULES`, and of a desk."""
    fleet = Fleet(tmp_path / "fleet", "robot", "desk")
    port, systems = free_port(), []
    async with AsyncExitStack() as stack:
        for name, tree, rules in (
            ("robot", (Child(Robot, name="robot"),), RULES),
            ("desk", (Child(Desk, name="desk"), Child(Node, name="spy")), None),
        ):
            transport = ZenohKeys(ZenohConfig(gossip_port=port, security=fleet.security(name, access=rules)))
            context = run(*tree, transport=transport, signals=False, sinks=())
            systems.append(await stack.enter_async_context(context))
        yield systems[0], systems[1]


async def until(system: System, condition: Callable[[], object]) -> None:
    """Wait until it holds; it is looked at whenever the graph changes."""
    changed = asyncio.Event()
    forget = system.graph.on_change(changed.set)
    try:
        async with asyncio.timeout(30):
            while not condition():
                changed.clear()
                await changed.wait()
    finally:
        forget()


def ends(system: System, topic: str) -> tuple[list[str], list[str]]:
    """The nodes that publish and that subscribe to a topic, as a system sees it."""
    for view in system.snapshot().topics:
        if view.name == topic:
            return [edge.node for edge in view.publishers], [edge.node for edge in view.subscriptions]
    return [], []


async def test_what_the_rules_allow_works_with_history_calls_and_goals(pair: tuple[System, System]) -> None:
    robot, desk = pair
    node, far = desk.node("desk"), robot.node("robot")
    assert isinstance(node, Desk)
    assert isinstance(far, Robot)

    assert await node.call(ADD, two(1, 2), timeout=30) == total(3)
    async with node.send_goal(COUNT, order(7)) as goal:
        assert [feedback async for feedback in goal] == [step(1)]
        assert await goal == result(1, 7)
    await until(desk, lambda: ends(desk, "/numbers")[1] == ["/robot"])
    node.numbers(number(5))
    async with asyncio.timeout(30):
        assert await far.numbers.next() == number(5)
        assert await node.latched.next() == number(4)


async def test_what_no_rule_allows_is_not_even_seen(pair: tuple[System, System]) -> None:
    robot, desk = pair
    await until(robot, lambda: ends(robot, "/numbers")[0] == ["/desk"])
    await until(robot, lambda: "/desk" in ends(robot, "/latched")[1])

    # declared before what has been seen by now
    assert ends(robot, "/words") == ([], ["/robot"])
    assert [node.name for node in robot.snapshot().nodes if node.state == "elsewhere"] == ["/desk"]
    await until(desk, lambda: "/robot" in ends(desk, "/words")[1])
    assert desk.node("desk").words.subscription_count == 1, "the graph of the robot is shown to all who are let in"  # type: ignore[attr-defined]


# What a listener on the link can read ---------------------------------------------------------------------------------------


class Tap:
    """A port that leads to another one, and keeps what passes."""

    def __init__(self, port: int) -> None:
        self.port = free_port()
        self.bytes = bytearray()
        self._to = port

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        far_reader, far_writer = await asyncio.open_connection("127.0.0.1", self._to)
        await asyncio.gather(self._pass(reader, far_writer), self._pass(far_reader, writer))

    async def _pass(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with suppress(OSError):
            while data := await reader.read(65536):
                self.bytes += data
                writer.write(data)
                await writer.drain()
        writer.close()


@pytest.mark.realtime
@pytest.mark.parametrize("secure", [True, False], ids=["with TLS", "without"])
async def test_only_without_tls_can_be_read_what_passes(secure: bool, tmp_path: Path) -> None:
    fleet = Fleet(tmp_path / "fleet", "robot", "desk", passwords=True)
    robot, desk = (fleet.security(name) if secure else None for name in ("robot", "desk"))
    changes, protocol, port = Changes(), "tls" if secure else "tcp", free_port()
    tap = Tap(port)
    server = await asyncio.start_server(tap.serve, "127.0.0.1", tap.port)
    listening = ZenohConfig(listen=(f"{protocol}/127.0.0.1:{port}",), gossip_port=0, security=robot)
    connecting = ZenohConfig(mode="client", connect=(f"{protocol}/127.0.0.1:{tap.port}",), security=desk)
    async with server, opened(listening, changes) as listener, opened(connecting, changes) as sender:
        heard = listener.listen(SECRET_KEY)[0]
        outlet = await sender.outlet(SECRET_KEY)
        outlet.put(b"the key is under the mat" * 10, b"attached")
        await changes.until(lambda: heard.payloads, "it has come")

    assert len(tap.bytes) > 240
    for text in (b"under the mat", b"attached", b"secret", b"@robactor", sender.session.encode()):
        assert (text in tap.bytes) is not secure, text
    password = (tmp_path / "fleet" / "desk" / "password").read_bytes().strip()
    assert password not in tap.bytes
