"""Captures take what other processes publish as it was sent; it is decoded only where somebody needs the object."""

from __future__ import annotations

from math import inf, nan
from typing import Any

import pytest

from actors import DeclarationError, Node, QoS, Topic, publishes, qos
from actors.bag.capture import Capture
from actors.bag.ring import Channel
from actors.graph.interceptor import TopicInterceptor
from actors.interfaces import encode
from actors.interfaces.std_msgs.msg import Int32
from actors.runtime.incarnation import incarnation_of
from actors.testing import Rig
from actors.topics import lazy_message
from actors.topics.lazy_message import LazyMessage
from actors.transport.format.attachments import Attachment, write_attachment
from actors.transport.format.gids import gid_of
from actors.transport.keyed.protocol import Delivery, Sample
from tests.actors.transport.hosts import Hosts
from tests.stage import NUMBERS, events, number, values

pytestmark = pytest.mark.virtual

LATCHED = Topic(Int32, "latched", qos.LATCHED.replace(depth=3))
BRIEF = Topic(Int32, "brief", QoS(depth=10, lifespan=1.0))
NO_MESSAGE = b"\0\1\0\0"


class Talker(Node):
    out = publishes(NUMBERS)
    latched = publishes(LATCHED)
    brief = publishes(BRIEF)


def capture(
    rig: Rig, topic: Topic[Int32] = NUMBERS, *, decoded: bool = False, patience: float = 0.0
) -> tuple[list[LazyMessage], Capture]:
    """What a capture of the rig's own node takes from now on."""
    taken: list[LazyMessage] = []
    channel, entry = Channel(f"/{topic.name}", Int32), rig.system.graph.topic(f"/{topic.name}")
    return taken, Capture(
        incarnation_of(rig.me), entry, channel, topic.qos, lambda channel, publisher, one: taken.append(one),
        decoded=decoded, patience=patience,
    )  # fmt: skip


@pytest.fixture
def decoded(monkeypatch: pytest.MonkeyPatch) -> list[bytes]:
    """What messages of topics are decoded from, in order."""
    found: list[bytes] = []
    plain = lazy_message.decode

    def decode(kind: Any, data: bytes) -> Any:
        found.append(data)
        return plain(kind, data)

    monkeypatch.setattr(lazy_message, "decode", decode)
    return found


def put(hosts: Hosts, rig: Rig, *payloads: bytes) -> None:
    """Send these in the name of the rig's talker, beginning with number 1."""
    (token,) = (token for token in hosts.network.tokens if "/MP/" in token and "numbers" in token)
    (key,) = {one.key for end in hosts.network.ends.values() for one in end.subscriptions if "numbers" in one.key}
    outlet = hosts.ends[rig].outlet(key, Delivery())
    for index, payload in enumerate(payloads, start=1):
        outlet.put(payload, write_attachment(Attachment(index, 17, gid_of(token))))


async def test_what_only_captures_take_is_passed_on_as_it_was_sent_and_never_decoded(
    hosts: Hosts, decoded: list[bytes]
) -> None:
    rig, other = await hosts.start(Talker), await hosts.start(Node)
    taken, _ = capture(other)
    again, _ = capture(other)
    await rig.quiet()
    for value in range(3):
        rig.node(Talker).out(number(value))
    await rig.quiet()

    assert [one.cdr for one in taken] == [encode(number(value)) for value in range(3)]
    assert [one.sent_ns for one in taken] == [rig.system.clock.wall_ns()] * 3
    assert not decoded
    assert values(one.message for one in taken) == values(one.message for one in again) == [0, 1, 2]
    assert len(decoded) == 3, "once for both"


async def test_beside_a_subscription_that_reads_them_messages_are_decoded_once_for_all(
    hosts: Hosts, decoded: list[bytes]
) -> None:
    rig, other = await hosts.start(Talker), await hosts.start(Node)
    taken, _ = capture(other)
    probe = other.probe(NUMBERS)
    seldom = other.probe(NUMBERS, qos=5)  # a subscription of the network of its own: everything arrives twice
    await rig.quiet()
    rig.node(Talker).out(number(7))
    await rig.quiet()

    assert taken[0].message is next(iter(probe)) is next(iter(seldom))
    assert decoded == [encode(number(7))]


async def test_what_is_no_message_is_passed_on_and_lost_by_those_that_read_it(hosts: Hosts) -> None:
    rig, other = await hosts.start(Talker), await hosts.start(Node)
    taken, raw = capture(other)
    read, strict = capture(other, decoded=True)
    probe = other.probe(NUMBERS)
    await rig.quiet()
    put(hosts, rig, encode(number(1)), NO_MESSAGE, encode(number(3)))
    await rig.quiet()

    assert [one.cdr for one in taken] == [encode(number(1)), NO_MESSAGE, encode(number(3))]
    assert (values(probe), values(one.message for one in read)) == ([1, 3], [1, 3])
    assert (raw.dropped, strict.dropped, probe.dropped) == (0, 1, 1)
    assert [line.node for line in events(other.logs, "a message cannot be decoded")] == ["/rig"]


async def test_a_gap_is_counted_and_a_repetition_left_out_without_decoding(hosts: Hosts, decoded: list[bytes]) -> None:
    rig, other = await hosts.start(Talker), await hosts.start(Node)
    taken, raw = capture(other)
    await rig.quiet()
    (token,) = (token for token in hosts.network.tokens if "/MP/" in token and "numbers" in token)
    (key,) = (one.key for one in hosts.ends[other].subscriptions if "numbers" in one.key)
    outlet = hosts.ends[rig].outlet(key, Delivery())
    for value in (1, 2, 2, 5, 4):
        outlet.put(encode(number(value)), write_attachment(Attachment(value, 0, gid_of(token))))
    await rig.quiet()

    assert (values(one.message for one in taken), raw.dropped, len(decoded)) == ([1, 2, 5], 2, 3)


async def test_a_tap_sees_the_object_though_only_a_capture_takes_it(hosts: Hosts) -> None:
    rig, other = await hosts.start(Talker), await hosts.start(Node)
    seen: list[Any] = []
    other.system.graph.tap(lambda publisher: seen.append)
    taken, _ = capture(other)
    await rig.quiet()
    put(hosts, rig, NO_MESSAGE, encode(number(2)))
    await rig.quiet()

    assert seen == [number(2)]
    assert [one.cdr for one in taken] == [NO_MESSAGE, encode(number(2))]


async def test_what_stands_between_publisher_and_capture_has_the_object_in_its_hands(hosts: Hosts) -> None:
    """A journal, or a simulated fault: what it passes on in place of a message has not been sent by anybody."""
    rig, other = await hosts.start(Talker), await hosts.start(Node)

    class Changing(TopicInterceptor):
        def delivering(self, publisher: Any, subscription: Any, target: Any) -> Any:
            return lambda sent: target(sent if sent.data else number(99))

    other.system.graph.intercept(Changing())
    taken, _ = capture(other)
    await rig.quiet()
    for value in (5, 0):
        rig.node(Talker).out(number(value))
    await rig.quiet()

    assert [(one.cdr, one.sent_ns is None) for one in taken] == [(encode(number(5)), False), (encode(number(99)), True)]


async def test_what_is_kept_for_late_joiners_and_what_expires_is_captured_bare(hosts: Hosts) -> None:
    rig, other = await hosts.start(Talker), await hosts.start(Node)
    talker = rig.node(Talker)
    for value in range(5):
        talker.latched(number(value))
    taken, _ = capture(other, LATCHED)
    brief, _ = capture(other, BRIEF)
    here, _ = capture(rig, BRIEF)
    await rig.quiet()
    talker.brief(number(8))
    await rig.quiet()

    assert values(one.message for one in taken) == [2, 3, 4]
    (publisher,) = other.system.graph.topic("/latched").publishers
    assert publisher.latched == [one.message for one in taken]
    assert [(one.message, one.sent_ns is None) for one in (*brief, *here)] == [(number(8), False), (number(8), True)]


class Noter(Node):
    """Notes what comes; its messages may wait."""

    def __init__(self) -> None:
        self.noted: list[int] = []

    @NUMBERS.on(qos=5, patience=0.25)
    def note(self, message: Int32) -> None:
        self.noted.append(message.data)

    @NUMBERS.on(concurrent=2, patience=0.5)
    async def note_beside(self, message: Int32) -> None: ...


async def test_the_messages_of_a_patient_handler_may_wait_in_the_transport(hosts: Hosts) -> None:
    await hosts.start(Talker)
    other = await hosts.start(Noter)
    assert {one.delivery.patience for one in hosts.ends[other].subscriptions if "numbers" in one.key} == {0.25, 0.5}


@pytest.mark.parametrize("patience", [-0.1, inf, nan])
def test_a_patience_that_is_none_is_refused(patience: float) -> None:
    with pytest.raises(DeclarationError, match="give a number of seconds of at least 0"):
        NUMBERS.on(patience=patience)


async def test_a_patient_capture_has_a_patient_subscription_of_the_network_and_hears_when_a_message_came(
    hosts: Hosts,
) -> None:
    rig, other = await hosts.start(Talker), await hosts.start(Node)
    taken, patient = capture(other, patience=0.02)
    probe = other.probe(NUMBERS)
    await rig.quiet()
    deliveries = {one.delivery.patience for one in hosts.ends[other].subscriptions if "numbers" in one.key}
    assert deliveries == {0.02, 0.0}, "nobody else waits"
    probe.close()
    (subscription,) = (one for one in hosts.ends[other].subscriptions if "numbers" in one.key)
    (token,) = (token for token in hosts.network.tokens if "/MP/" in token and "numbers" in token)
    attachment = write_attachment(Attachment(1, 17, gid_of(token)))
    subscription.take(Sample(subscription.key, encode(number(4)), attachment, since=3.25))

    assert [(one.message, one.sent_ns, one.since) for one in taken] == [(number(4), 17, 3.25)]
    patient.close()
    assert not [one for one in hosts.ends[other].subscriptions if "numbers" in one.key]
