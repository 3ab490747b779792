"""Messages that come in one piece are handed on together. A subscription gets the same as if they came one by one."""

from __future__ import annotations

from typing import Any

import pytest

from actors import Node, publishes
from actors.interfaces import encode
from actors.interfaces.std_msgs.msg import Int32
from actors.testing import Rig
from actors.transport.format.attachments import Attachment, write_attachment
from actors.transport.format.gids import gid_of
from actors.transport.keyed.protocol import Sample
from tests.actors.transport.hosts import Hosts
from tests.stage import NUMBERS, number

pytestmark = pytest.mark.virtual

DEPTH = NUMBERS.qos.depth
FIRST = [(1, encode(number(1)))]
"""The number and the payload of a message. From the first one the subscription knows its publisher."""
THREE = [(n, encode(number(n))) for n in (2, 3, 4)]
BROKEN = (3, b"\0\1\0\0")
SWAPPED = (3, b"\0\0\0\0\0\0\0\3")
"""In the other byte order, as some may write it."""


class Talker(Node):
    out = publishes(NUMBERS)


class Handling(Node):
    def __init__(self) -> None:
        self.got: list[int] = []

    @NUMBERS.on()
    def note(self, message: Int32) -> None:
        self.got.append(message.data)


class Beside(Node):
    def __init__(self) -> None:
        self.got: list[int] = []

    @NUMBERS.on(concurrent=2)
    async def note(self, message: Int32) -> None:
        self.got.append(message.data)


def sent(hosts: Hosts, rig: Rig, pieces: list[list[tuple[int, bytes]]], *, together: bool, gid: bytes = b"") -> None:
    """Let messages arrive: each piece at once, or each message by itself."""
    (end,) = (one for one in hosts.ends[rig].subscriptions if "numbers" in one.key)
    if not gid:
        (token,) = (token for token in hosts.network.tokens if "/MP/" in token and "numbers" in token)
        gid = gid_of(token)
    for piece in pieces:
        payloads = [payload for _, payload in piece]
        attachments = [write_attachment(Attachment(n, 17, gid)) for n, _ in piece]
        take: Any = end._take
        if not (together and take.together(payloads, attachments)):
            for payload, attachment in zip(payloads, attachments, strict=True):
                end.take(Sample(end.key, payload, attachment))


@pytest.mark.parametrize(
    "pieces",
    [
        pytest.param([FIRST, THREE], id="in order"),
        pytest.param([THREE, THREE], id="the first ones, and once more"),
        pytest.param([FIRST, [(9, encode(number(9))), (10, encode(number(10)))]], id="after a loss"),
        pytest.param([FIRST, [THREE[0], BROKEN, THREE[2]], [(5, encode(number(5)))]], id="one cannot be decoded"),
        pytest.param([FIRST, [THREE[0], SWAPPED, THREE[2]]], id="one is in the other byte order"),
        pytest.param([FIRST, [THREE[0], THREE[2], THREE[1]]], id="not in order"),
        pytest.param([FIRST, [(n, encode(number(n))) for n in range(2, 3 * DEPTH)]], id="more than there is room for"),
    ],
)
@pytest.mark.parametrize("kind", [Handling, Beside])
async def test_what_comes_together_is_taken_as_if_it_came_one_by_one(
    hosts: Hosts, kind: type[Handling], pieces: list[list[tuple[int, bytes]]]
) -> None:
    outcomes: list[object] = []
    await hosts.start(Talker)
    for together in (False, True):
        rig = await hosts.start(kind)
        sent(hosts, rig, pieces, together=together)
        await rig.quiet()
        (subscription,) = (one for one in rig.system.graph.topic("/numbers").subscriptions if one.here)
        (publisher,) = (one for one in rig.system.graph.topic("/numbers").publishers if not one.here)
        got = rig.node(kind).got
        assert got
        outcomes.append((got, subscription.received, subscription.dropped, publisher.count, publisher.carried_bytes))  # type: ignore[attr-defined]
    assert outcomes[0] == outcomes[1]


async def test_what_comes_together_is_taken_at_once(hosts: Hosts) -> None:
    await hosts.start(Talker)
    rig = await hosts.start(Handling)
    sent(hosts, rig, [FIRST], together=False)
    (end,) = (one for one in hosts.ends[rig].subscriptions if "numbers" in one.key)
    (token,) = (token for token in hosts.network.tokens if "/MP/" in token and "numbers" in token)
    take: Any = end._take
    attachments = [write_attachment(Attachment(n, 17, gid_of(token))) for n, _ in THREE]
    assert take.together([payload for _, payload in THREE], attachments)
    assert not take.together([THREE[0][1]], [b"none"]), "it is one by one that what is wrong is reported"
    assert not take.together([THREE[0][1]], [write_attachment(Attachment(5, 17, bytes(16)))]), "nobody is known by it"
    await rig.quiet()
    assert rig.node(Handling).got == [1, 2, 3, 4]
