"""The handles of a participant, used as the graph does not use them: closed twice, used after that, without a node."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable
from typing import Any

import pytest

from actors.qos import DEFAULT, SERVICES
from actors.transport.dds import topics
from actors.transport.dds.endpoints import Sample, Status
from actors.transport.protocol import NoAnswer, Participant, TypeInfo
from tests.actors.transport.dds.meeting import MeetingTransport, free_domain
from tests.actors.transport.dds.test_known import Told

pytest.importorskip("cyclonedds")
INT32 = TypeInfo("std_msgs/msg/Int32", "TypeHashNotSupported")
UNKNOWN = TypeInfo("nobody/srv/Knows", "TypeHashNotSupported")
ONE = b"\0\1\0\0\1\0\0\0"


class Owner(Told):
    def __init__(self) -> None:
        super().__init__()
        self.messages: list[tuple[Any, ...]] = []

    def wanted(self, publisher: Any) -> None:
        self.log.append(("wanted", publisher.wanted))

    def told(self, data: bytes) -> None:
        self.log.append(("told", data))

    def lost(self, taker: Any, messages: int) -> None:
        self.log.append(("lost", (taker, messages)))

    def arrived(self, *message: Any) -> None:
        self.messages.append(message)

    def has(self, kind: str, what: Any) -> bool:
        return (kind, what) in self.log


@pytest.fixture
async def both() -> AsyncIterator[tuple[Any, Owner, Any, Owner, MeetingTransport]]:
    place = free_domain()
    transports, owners = [MeetingTransport(place) for _ in "ab"], [Owner() for _ in "ab"]
    joined: list[Participant] = [await one.join(0, own) for one, own in zip(transports, owners, strict=True)]
    yield joined[0], owners[0], joined[1], owners[1], transports[1]
    for one in transports:
        await one.close()


async def until(condition: Callable[[], object]) -> None:
    async with asyncio.timeout(20.0):
        while not condition():
            await asyncio.sleep(0.005)


async def test_one_without_a_node_is_heard_and_not_shown_and_a_closed_one_sends_nothing(both: Any) -> None:
    here, owner, there, other, _ = both
    hidden = here.publisher(None, "/hidden", INT32, DEFAULT)
    hidden.put(ONE, 1, 0)
    assert (hidden.gid, hidden.wanted) == (b"", False)
    hidden.show()
    hidden.open()
    hidden.open()
    takes = [there.subscription(None, "/hidden", INT32, DEFAULT, other.arrived, taker, 0.01) for taker in "xy"]
    await until(lambda: hidden.wanted)
    hidden.put(ONE, 1, 0)
    await until(lambda: other.messages)
    (message,) = other.messages
    assert (message[0], message[2], message[4], message[5] is not None) == (("x", "y"), 1, ONE, True)
    for one in takes:
        one.close()
        one.close()
    await until(lambda: owner.has("wanted", False))
    hidden.close()
    hidden.close()
    hidden.put(ONE, 2, 0)
    assert not [one for one in other.log if one[0] == "appeared"]


async def test_losses_are_told_to_those_for_whom_the_messages_were(both: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    here, owner, there, _other, _ = both
    monkeypatch.setattr(topics, "_MOST_WRITERS", 1)
    node = here.node("/node")
    heard = here.subscription(node, "/lossy", INT32, DEFAULT, owner.arrived, "x")
    (receiver,) = here._receivers.values()
    receiver._changed(Status("matched", 1, 1))
    receiver._changed(Status("sample_lost", 3, 3))
    assert owner.has("lost", ("x", 3))
    outs = [there.publisher(there.node(f"/out{index}"), "/lossy", INT32, DEFAULT) for index in range(2)]
    for out in outs:
        out.open()
        await until(lambda out=out: out.wanted)
        out.put(ONE, 1, 0)
    await until(lambda: len(owner.messages) == 2)
    assert len(receiver._numbers) == 1, "of so many writers the numbers are kept"
    heard.close()
    receiver._arrived([Sample(ONE, bytes(16), 0, 0, 0.0)])
    assert len(owner.messages) == 2, "nobody is left for whom it could be"


async def test_a_process_tells_another_one_and_nobody_else(both: Any) -> None:
    here, owner, _there, other, transport = both
    await until(lambda: other.log and owner.log and here._tells.matched)
    here.tell("ab", b"not for anybody here")
    here.tell(transport.session, b"hello")
    await until(lambda: other.has("told", b"hello"))
    assert not [one for one in owner.log if one[0] == "told"]


async def test_a_request_is_given_up_by_its_end_its_time_and_its_client(both: Any) -> None:
    here, owner, there, _other, _ = both
    node = here.node("/asks")
    client = here.client(node, "/nobody", UNKNOWN, SERVICES)
    answers: list[Any] = []
    client.ask(ONE, 1, time.time_ns(), b"", None, answers.append)
    await until(lambda: answers)
    requests: list[Any] = []
    serving = there.server(there.node("/serves"), "/nobody", UNKNOWN, SERVICES, requests.append)
    await until(lambda: owner.has("appeared", ("/serves", "SERVER", "/nobody")))
    client.ask(ONE, 2, time.time_ns(), b"", 0.05, answers.append)
    await until(lambda: len(answers) == 2)
    assert answers == [NoAnswer(timed_out=False), NoAnswer(timed_out=True)]
    asked = client.ask(ONE, 3, time.time_ns(), b"", 5.0, answers.append)
    asked.close()
    asked.close()
    client.ask(ONE, 4, time.time_ns(), b"", 5.0, answers.append)
    await until(lambda: len(requests) >= 2)
    serving.close()
    serving.close()
    for request in requests:
        request.reply(ONE, 0, b"")
        request.reply(ONE, 0, b"")
        request.drop()
    client.close()
    client.close()
    serving.look()
    client.look()
    node.close()
    node.close()
    assert len(answers) == 2
