"""Topics across processes: every publisher and subscription of another process takes part as one of this process does."""

from __future__ import annotations

import asyncio
from random import Random
from typing import Any

import pytest

from actors import Child, Node, QoS, Topic, publishes, qos, subscribes
from actors.graph.interceptor import TopicInterceptor
from actors.interfaces import encode, type_hash
from actors.interfaces.geometry_msgs.msg import Twist
from actors.interfaces.message import make_message
from actors.interfaces.nav_msgs.msg import OccupancyGrid
from actors.interfaces.sensor_msgs.msg import CompressedImage, Image, JointState, LaserScan, PointCloud2
from actors.interfaces.std_msgs.msg import Int32, String
from actors.qos.policies import Durability, History, Liveliness
from actors.testing import Rig
from actors.transport.format.attachments import Attachment, parse_attachment, write_attachment
from actors.transport.format.gids import gid_of
from actors.transport.format.names import new_session
from actors.transport.keyed.protocol import Delivery, Sample
from tests.actors.transport.hosts import Hosts
from tests.stage import NUMBERS, WORDS, events, number, values, word

pytestmark = pytest.mark.virtual

LATCHED = Topic(Int32, "latched", qos.LATCHED.replace(depth=3))
IMAGES = Topic(Image, "images")
NUMBERS_KEY = (
    "0/numbers/std_msgs::msg::dds_::Int32_/RIHS01_b6578ded3c58c626cfe8d1a6fb6e04f706f97e9f03d2727c9ff4e74b1cef0deb"
)
EVERYTHING = Delivery(depth=100)


class Talker(Node):
    out = publishes(NUMBERS)


class Listener(Node):
    numbers = subscribes(NUMBERS)


def sniffed(hosts: Hosts, rig: Rig, key: str) -> list[Sample]:
    """What is put on a key by others than the process of `rig`, from now on; heard without a token."""
    heard: list[Sample] = []
    hosts.ends[rig].subscribe(key, EVERYTHING, heard.append)
    return heard


# Messages ------------------------------------------------------------------------------------------------------------------


async def test_messages_cross_in_order_both_ways_and_those_of_a_process_do_not_come_back(hosts: Hosts) -> None:
    first, second = await hosts.start(Talker), await hosts.start(Talker)
    probes = first.probe(NUMBERS), second.probe(NUMBERS)
    await first.quiet()

    for value in range(3):
        first.node(Talker).out(number(value))
        second.node(Talker).out(number(10 + value))
    await first.quiet()

    assert [values(probe) for probe in probes] == [[0, 1, 2, 10, 11, 12], [10, 11, 12, 0, 1, 2]]


async def test_a_message_is_encoded_and_put_once_for_all_subscriptions_elsewhere(hosts: Hosts) -> None:
    talker = await hosts.start(Talker)
    listeners = [await hosts.start(*(Child(Listener, name=f"listener_{index}") for index in range(3))) for _ in "ab"]
    out, sent = talker.node(Talker).out, number(7)
    assert out.subscription_count == 6

    out(sent)
    await talker.quiet()

    assert (hosts.network.puts, len(out.targets)) == (1, 1)
    for rig in listeners:
        received = [await rig.node(f"listener_{index}").numbers.next() for index in range(3)]  # type: ignore[attr-defined]
        assert received == [sent] * 3
        assert received[0] is received[1] is received[2], "decoded once"
        assert received[0] is not sent


async def test_an_interceptor_is_for_subscriptions_of_its_process_and_those_elsewhere_still_share_one_put(
    hosts: Hosts,
) -> None:
    talker = await hosts.start(Talker)
    wrapped: list[str] = []

    class Wrapping(TopicInterceptor):
        def delivering(self, publisher: Any, subscription: Any, target: Any) -> Any:
            wrapped.append(subscription.node.fqn)
            return lambda sent: target(sent)

    talker.system.graph.intercept(Wrapping())
    here = talker.probe(NUMBERS)
    there = [(await hosts.start(Node)).probe(NUMBERS) for _ in range(3)]
    await talker.quiet()

    talker.node(Talker).out(number(7))
    await talker.quiet()

    assert (hosts.network.puts, wrapped) == (1, ["/rig"])
    assert [values(probe) for probe in (here, *there)] == [[7]] * 4


async def test_nothing_is_put_while_nobody_elsewhere_listens(hosts: Hosts) -> None:
    rig, other = await hosts.start(Talker, Listener), await hosts.start(Node)
    out = rig.node(Talker).out
    out(number(1))
    async with other.me.subscribe(NUMBERS) as stream:
        await rig.quiet()
        out(number(2))
        assert (await stream.next()).data == 2
    await rig.quiet()
    out(number(3))

    assert (hosts.network.puts, out.subscription_count) == (1, 1)


async def test_who_listens_without_a_token_is_sent_to_and_not_counted(hosts: Hosts) -> None:
    rig, other = await hosts.start(Talker), await hosts.start(Node)
    out = rig.node(Talker).out
    heard: list[Sample] = []
    tap = hosts.ends[other].subscribe(NUMBERS_KEY, EVERYTHING, heard.append)
    await rig.quiet()

    out(number(1))
    other.probe(NUMBERS)
    await rig.quiet()
    out(number(2))
    await rig.quiet()
    tap.close()

    assert [sample.payload for sample in heard] == [encode(number(1)), encode(number(2))]
    assert hosts.network.puts == 2, "once, although a subscription with a token has joined"
    assert out.subscription_count == 1


async def test_a_subscription_that_is_shown_before_it_can_be_reached_counts_nothing_as_lost(hosts: Hosts) -> None:
    rig, other = await hosts.start(Talker), await hosts.start(Node)
    out, end = rig.node(Talker).out, hosts.ends[other]
    out(number(1))
    mangled = NUMBERS_KEY.split("/", 1)[1].replace("numbers/", "%numbers/", 1)
    shown = end.announce(f"@ros2_lv/0/77/1/2/MS/%/%/elsewhere/{mangled}/::,10:,:,:,,")
    await rig.quiet()
    assert out.subscription_count == 1
    out(number(2))  # goes nowhere, and has its number

    heard: list[Sample] = []
    tap = end.subscribe(NUMBERS_KEY, EVERYTHING, heard.append)
    await rig.quiet()
    out(number(3))
    shown.close()
    out(number(4))
    await rig.quiet()
    tap.close()

    assert [parse_attachment(sample.attachment).sequence_number for sample in heard] == [3, 4]


async def test_a_message_carries_number_time_and_the_gid_of_its_publishers_token(hosts: Hosts) -> None:
    rig, other = await hosts.start(Talker), await hosts.start(Node)
    heard = sniffed(hosts, other, NUMBERS_KEY)
    await rig.advance(1.5)

    rig.node(Talker).out(number(1))
    rig.node(Talker).out(number(2))
    await rig.quiet()

    (token,) = (token for token in hosts.network.tokens if "/MP/" in token and "numbers" in token)
    start = rig.system.clock.wall_ns_at(0.0)
    assert [parse_attachment(sample.attachment) for sample in heard] == [
        Attachment(1, start + 1_500_000_000, gid_of(token)),
        Attachment(2, start + 1_500_000_000, gid_of(token)),
    ]


async def test_a_sample_without_attachment_is_dropped_and_one_of_an_unknown_publisher_is_delivered(
    hosts: Hosts,
) -> None:
    rig, other = await hosts.start(Node), await hosts.start(Node)
    plain, brief = rig.probe(NUMBERS), rig.probe(NUMBERS, qos=1)
    outlet = hosts.ends[other].outlet(NUMBERS_KEY, Delivery())

    outlet.put(encode(number(1)), b"")
    outlet.put(encode(number(2)), write_attachment(Attachment(1, 0, bytes(16))))
    await rig.quiet()

    assert (values(plain), values(brief)) == ([2], [2])


async def test_a_text_that_no_wire_can_carry_is_lost_and_its_publisher_warns(hosts: Hosts) -> None:
    rig, other = await hosts.start(Node), await hosts.start(Node)
    probe = other.probe(WORDS)
    await rig.quiet()
    rig.publish(WORDS, word("\udc00"))
    rig.publish(WORDS, word("after it"))
    await rig.quiet()

    assert [message.data for message in probe] == ["after it"]
    assert probe.dropped == 0
    (line,) = events(rig.logs, "a message cannot be encoded")
    assert (line.node, line.fields["topic"]) == ("/rig", "/words")
    assert "String.data" in str(line.fields["error"])


async def test_bytes_that_are_no_message_are_lost_and_the_subscriber_warns(hosts: Hosts) -> None:
    rig, other = await hosts.start(Talker), await hosts.start(Node)
    probe = other.probe(NUMBERS)
    await rig.quiet()
    (token,) = (token for token in hosts.network.tokens if "/MP/" in token and "numbers" in token)
    outlet = hosts.ends[rig].outlet(NUMBERS_KEY, Delivery())

    outlet.put(b"\0\1\0\0", write_attachment(Attachment(1, 0, gid_of(token))))
    outlet.put(encode(number(5)), write_attachment(Attachment(2, 0, gid_of(token))))
    await rig.quiet()

    assert (values(probe), probe.dropped) == ([5], 1)
    assert [line.node for line in events(other.logs, "a message cannot be decoded")] == ["/rig"]


async def test_what_is_unusual_among_many_messages_takes_its_place_and_each_loss_is_counted_once(hosts: Hosts) -> None:
    """After the first message the next ones of a publisher go a shorter way, as long as nothing is unusual."""
    rig, other = await hosts.start(Talker), await hosts.start(Node)
    probe = other.probe(NUMBERS)
    await rig.quiet()
    (token,) = (token for token in hosts.network.tokens if "/MP/" in token and "numbers" in token)
    outlet = hosts.ends[rig].outlet(NUMBERS_KEY, Delivery())
    for value, payload in {
        1: encode(number(1)),
        2: encode(number(2)),
        3: b"\0\0\0\0" + (3).to_bytes(4, "big"),
        4: b"\0\1\0\0",  # it ends too early
        5: encode(number(5)),
        6: encode(number(6)),
        8: encode(number(8)),
        9: encode(number(9)),
    }.items():
        outlet.put(payload, write_attachment(Attachment(value, 0, gid_of(token))))
    outlet.put(encode(number(9)), write_attachment(Attachment(9, 0, gid_of(token))))  # once more
    await rig.quiet()

    assert (values(probe), probe.dropped) == ([1, 2, 3, 5, 6, 8, 9], 2)


async def test_a_second_subscription_and_one_that_leaves_change_nothing_for_the_first(hosts: Hosts) -> None:
    rig, other = await hosts.start(Talker), await hosts.start(Node)
    probe = other.probe(NUMBERS)
    await rig.quiet()
    for value in (1, 2):
        rig.publish(NUMBERS, number(value))
    await rig.quiet()
    async with other.me.subscribe(NUMBERS) as stream:
        await rig.quiet()
        for value in (3, 4):
            rig.publish(NUMBERS, number(value))
        await rig.quiet()
        second = [(await anext(stream)).data for _ in range(2)]
    await rig.quiet()
    for value in (5, 6):
        rig.publish(NUMBERS, number(value))
    await rig.quiet()

    assert (values(probe), second, probe.dropped) == ([1, 2, 3, 4, 5, 6], [3, 4], 0)


async def test_a_gap_in_the_numbers_is_counted_as_lost_once_and_repeated_numbers_are_not_delivered(
    hosts: Hosts,
) -> None:
    rig, other = await hosts.start(Talker), await hosts.start(Node)
    probe = other.probe(NUMBERS)
    await rig.quiet()
    (token,) = (token for token in hosts.network.tokens if "/MP/" in token and "numbers" in token)
    outlet = hosts.ends[rig].outlet(NUMBERS_KEY, Delivery())

    for count in (4, 5, 5, 9, 7, 10):
        outlet.put(encode(number(count)), write_attachment(Attachment(count, 0, gid_of(token))))
    await rig.quiet()

    assert values(probe) == [4, 5, 9, 10]
    assert probe.status.message_lost == probe.dropped == 3


async def test_of_publishers_that_have_gone_only_so_many_are_remembered(
    hosts: Hosts, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("actors.transport.local_topics._MOST_LEFT", 2)
    rig, other = await hosts.start(Node), await hosts.start(Node)
    probe = rig.probe(NUMBERS)
    tokens = [
        f"@ros2_lv/0/77/0/{at}/MP/%/%/brief/%numbers/std_msgs::msg::dds_::Int32_/{type_hash(Int32)}/::,10:,:,:,,"
        for at in range(3)
    ]
    outlet = hosts.ends[other].outlet(NUMBERS_KEY, Delivery())

    async def speak(token: str, *numbers: int) -> None:
        shown = hosts.ends[other].announce(token)
        for one in numbers:
            outlet.put(encode(number(one)), write_attachment(Attachment(one, 0, gid_of(token))))
        await rig.quiet()
        shown.close()
        await rig.quiet()

    for token in tokens:
        await speak(token, 1, 2)
    await speak(tokens[2], 2, 3)  # the second one is known
    await speak(tokens[0], 2, 3)  # of this one nothing is known any more

    assert values(probe) == [1, 2, 1, 2, 1, 2, 3, 2, 3]


async def test_a_publisher_that_begins_its_numbers_again_keeps_what_it_has_kept_if_its_messages_are_none(
    hosts: Hosts,
) -> None:
    rig, other = await hosts.start(Node), await hosts.start(Node)
    rig.me.publisher(LATCHED)
    probe = other.probe(LATCHED)
    await rig.quiet()
    (token,) = (token for token in hosts.network.tokens if "/MP/" in token and "latched" in token)
    outlet = hosts.ends[rig].outlet(NUMBERS_KEY.replace("numbers", "latched"), Delivery())
    for at in (100, 101, 102):
        outlet.put(encode(number(at)), write_attachment(Attachment(at, 0, gid_of(token))))
    for at in (5, 6):
        outlet.put(b"\0\1\0\0", write_attachment(Attachment(at, 0, gid_of(token))))
    await rig.quiet()

    assert (values(probe), probe.dropped) == ([100, 101, 102], 1)


async def test_who_comes_back_does_not_count_what_was_sent_in_between_as_lost(hosts: Hosts) -> None:
    rig, away, here = await hosts.start(Talker), await hosts.start(Node), await hosts.start(Node)
    here.probe(NUMBERS)
    out = rig.node(Talker).out
    dropped = []
    for _ in range(2):
        async with away.me.subscribe(NUMBERS) as stream:
            await rig.quiet()
            out(number(1))
            await stream.next()
            dropped.append(stream.dropped)
        await rig.quiet()
        out(number(2))
    assert dropped == [0, 0]


# Who matches whom ----------------------------------------------------------------------------------------------------------


async def test_both_sides_count_a_match_and_its_end(hosts: Hosts) -> None:
    rig, other = await hosts.start(Talker), await hosts.start(Node)
    out = rig.node(Talker).out
    probe = other.probe(NUMBERS)
    await rig.quiet()
    matched = out.status.matched, probe.status.matched, [peer.node.fqn for peer in out.peers]
    probe.close()
    await rig.quiet()

    assert matched == (1, 1, ["/rig"])
    assert (out.status.matched, out.status.matched_total) == (0, 1)


async def test_a_process_that_is_lost_takes_its_endpoints_and_nodes_with_it(hosts: Hosts) -> None:
    rig, other = await hosts.start(Talker), await hosts.start(Listener, Talker)
    out = rig.node(Talker).out
    probe = rig.probe(NUMBERS)
    before = out.subscription_count, probe.publisher_count
    hosts.lose(other)
    await rig.quiet()

    assert before == (2, 2)
    assert (out.subscription_count, probe.publisher_count) == (1, 1)
    assert [node.name for node in rig.system.snapshot().nodes] == ["/rig", "/talker"]


async def test_an_incompatible_quality_of_service_is_told_on_both_sides_and_nothing_is_delivered(hosts: Hosts) -> None:
    rig, other = await hosts.start(Node), await hosts.start(Node)
    out = rig.me.publisher(NUMBERS, qos=qos.SENSOR_DATA)
    strict, lenient = other.probe(NUMBERS), other.probe(NUMBERS, qos=qos.SENSOR_DATA)
    await rig.quiet()
    out(number(1))
    await rig.quiet()

    assert (values(strict), values(lenient)) == ([], [1])
    assert (out.status.incompatible_qos, strict.status.incompatible_qos) == (1, 1)
    for side in (rig, other):
        (line,) = events(side.logs, "Last incompatible policy: RELIABILITY")
        assert line.node == "/rig"


@pytest.mark.parametrize(("offered", "requested"), [(qos.SENSOR_DATA, qos.DEFAULT), (qos.DEFAULT, qos.STATE)])
async def test_with_a_process_of_ros2_what_does_not_fit_is_exchanged_as_there_and_told_once(
    hosts: Hosts, offered: QoS, requested: QoS
) -> None:
    """`rmw_zenoh` matches what DDS would refuse."""
    ours = await hosts.start(Node, session=new_session(Random(1)))
    theirs = await hosts.start(Node, session="1234")
    out = ours.me.publisher(NUMBERS, qos=offered)
    theirs.probe(NUMBERS, qos=requested)
    back = Topic(Int32, "back")
    probes = [ours.probe(back, qos=requested) for _ in range(2)]
    await ours.quiet()
    theirs.me.publisher(back, qos=offered)(number(1))
    await ours.quiet()

    assert [values(probe) for probe in probes] == [[1], [1]]
    assert (out.subscription_count, out.status.incompatible_qos, probes[0].status.incompatible_qos) == (1, 0, 0)
    lines = events(ours.logs, "messages are exchanged all the same")
    assert [line.event.split()[1] for line in lines] == ["subscription", "publisher"]
    assert not events(ours.logs, "No messages")


async def test_other_types_of_the_same_name_are_told_apart_by_their_hashes_on_both_sides(hosts: Hosts) -> None:
    rig, other = await hosts.start(Node), await hosts.start(Node)
    namespace = {"__module__": "shop.msg", "__qualname__": "Till", "__ros_type__": "shop/msg/Till"}
    body: Any = {**namespace, "__annotations__": {"amount": int}}
    out = rig.me.publisher(Topic(make_message("Till", dict(body)), "till"))
    body["__annotations__"] = {"amount": float}
    probe = other.probe(Topic(make_message("Till", dict(body)), "till"))
    await rig.quiet()

    assert (out.status.incompatible_type, probe.status.incompatible_type) == (1, 1)
    for side in (rig, other):
        (line,) = events(side.logs, "Incompatible types on topic '/till'")
        assert str(line.fields["why"]).count("shop/msg/Till (RIHS01_") == 2


async def test_a_topic_of_another_type_elsewhere_does_not_match(hosts: Hosts) -> None:
    rig, other = await hosts.start(Talker), await hosts.start(Node)
    probe = other.probe(Topic(String, "numbers"))
    await rig.quiet()
    rig.node(Talker).out(number(1))

    assert (len(probe), probe.status.incompatible_type, hosts.network.puts) == (0, 1, 0)


async def test_a_type_that_becomes_known_later_matches_then(hosts: Hosts) -> None:
    rig, other = await hosts.start(Node), await hosts.start(Node)
    endpoint = "@ros2_lv/0/2/90/91/MP/%/%/camera/%late/later::msg::dds_::Late_/"
    body = {"__module__": "later.msg", "__qualname__": "Late", "__ros_type__": "later/msg/Late"}
    hashed = "RIHS01_" + "0" * 64
    shown = hosts.ends[other].announce(f"{endpoint}{hashed}/::,10:,:,:,,")
    await rig.quiet()
    (unknown,) = rig.system.graph.topics["/late"].publishers
    assert (unknown.type.__ros_type__, repr(unknown.type)) == ("later/msg/Late", "<foreign type later/msg/Late>")
    shown.close()

    late = make_message("Late", {**body, "__annotations__": {"amount": int}})
    shown = hosts.ends[other].announce(f"{endpoint}{type_hash(late)}/::,10:,:,:,,")
    await rig.quiet()
    probe = rig.probe(Topic(late, "late"))
    assert probe.publisher_count == 1
    shown.close()


async def test_endpoints_of_two_other_processes_are_not_matched_here(hosts: Hosts) -> None:
    rig = await hosts.start(Node)
    await hosts.start(Talker)
    await hosts.start(Listener)
    topic = rig.system.graph.topics["/numbers"]

    assert [publisher.leave() for publisher in topic.publishers] == [()]
    assert [subscription.leave() for subscription in topic.subscriptions] == [()]


async def test_best_available_adapts_to_the_endpoints_of_other_processes(hosts: Hosts) -> None:
    rig, other = await hosts.start(Node), await hosts.start(Node)
    rig.me.publisher(NUMBERS, qos=qos.SENSOR_DATA)
    await rig.quiet()
    probe = other.me.subscribe(NUMBERS, qos=qos.BEST_AVAILABLE)
    assert probe.publisher_count == 1


# Kept messages -------------------------------------------------------------------------------------------------------------


async def test_a_late_joiner_gets_what_is_kept_elsewhere_then_what_is_new(hosts: Hosts) -> None:
    rig, other = await hosts.start(Node), await hosts.start(Node)
    out = rig.me.publisher(LATCHED)
    for value in range(5):
        out(number(value))
    first, plain = other.probe(LATCHED), other.probe(LATCHED, qos=10)
    await rig.quiet()
    out(number(5))
    await rig.quiet()
    late = other.probe(LATCHED, qos=qos.LATCHED.replace(depth=2))
    await rig.quiet()

    assert [values(probe) for probe in (first, plain, late)] == [[2, 3, 4, 5], [5], [4, 5]]
    assert first[3] is plain[0] is late[1], "decoded once"
    assert [probe.dropped for probe in (first, plain, late)] == [0, 0, 0]


async def test_what_was_kept_before_the_transport_was_open_is_kept_for_late_joiners_elsewhere(hosts: Hosts) -> None:
    class Early(Node):
        out = publishes(LATCHED)

        async def on_start(self) -> None:
            self.out(number(1))

    await hosts.start(Early)
    other = await hosts.start(Node)
    probe = other.probe(LATCHED)
    await other.quiet()

    assert values(probe) == [1]


async def test_a_publisher_that_comes_late_delivers_what_it_keeps(hosts: Hosts) -> None:
    rig = await hosts.start(Node)
    probe = rig.probe(LATCHED)
    other = await hosts.start(Node)
    other.publish(LATCHED, number(1))
    other.publish(LATCHED, number(2))
    await rig.quiet()

    assert values(probe) == [1, 2]


async def test_a_new_incarnation_gets_again_what_is_kept_elsewhere(hosts: Hosts) -> None:
    heard: list[tuple[int, int]] = []

    class Reader(Node):
        @LATCHED.on()
        async def keep(self, message: Int32) -> None:
            heard.append((rig.incarnation(Reader), message.data))

    rig, other = await hosts.start(Reader), await hosts.start(Node)
    out = other.me.publisher(LATCHED)
    for value in range(4):
        out(number(value))
    await rig.quiet()
    rig.crash(Reader)
    await rig.settled()

    assert heard == [(1, 1), (1, 2), (1, 3), (2, 1), (2, 2), (2, 3)]


# Time limits ---------------------------------------------------------------------------------------------------------------


async def test_a_lifespan_counts_from_the_time_of_sending(hosts: Hosts) -> None:
    brief = Topic(Int32, "brief", QoS(depth=10, lifespan=1.0, durability=Durability.TRANSIENT_LOCAL))
    rig, other = await hosts.start(Node), await hosts.start(Node)
    out = rig.me.publisher(brief)
    out(number(1))
    await rig.advance(0.9)
    out(number(2))
    await rig.advance(0.5)
    stream = other.me.subscribe(brief)

    assert (await stream.next()).data == 2


async def test_a_publisher_elsewhere_that_must_show_its_life_does_so_by_its_messages(hosts: Hosts) -> None:
    manual = Topic(Int32, "manual", QoS(depth=1, liveliness=Liveliness.MANUAL_BY_TOPIC, liveliness_lease=1.0))
    rig, other = await hosts.start(Node), await hosts.start(Node)
    out = rig.me.publisher(manual)
    stream = other.me.subscribe(manual)
    changes = stream.events()
    await rig.quiet()
    out(number(1))
    await rig.advance(0.5)
    alive = stream.status.alive
    await rig.advance(0.6)
    late = stream.status.alive, stream.status.not_alive
    out(number(2))
    await rig.quiet()

    assert (alive, late, stream.status.alive) == (1, (0, 1), 1)
    changes.close()


async def test_a_publisher_with_automatic_liveliness_lives_as_long_as_its_token(hosts: Hosts) -> None:
    leased = Topic(Int32, "leased", QoS(depth=1, liveliness_lease=1.0))
    rig, other = await hosts.start(Node), await hosts.start(Node)
    rig.me.publisher(leased)
    stream = other.me.subscribe(leased)
    await rig.advance(5.0)

    assert (stream.status.alive, stream.status.not_alive) == (1, 0)


async def test_a_deadline_counts_messages_from_elsewhere(hosts: Hosts) -> None:
    punctual = Topic(Int32, "punctual", QoS(depth=10, deadline=1.0))
    rig, other = await hosts.start(Node), await hosts.start(Node)
    out = rig.me.publisher(punctual)
    probe = other.probe(punctual)
    await rig.quiet()
    for _ in range(4):
        out(number(1))
        await rig.advance(0.8)
    in_time = probe.status.deadline_missed
    await rig.advance(1.0)

    assert (in_time, probe.status.deadline_missed) == (0, 1)


# What a transport is told ---------------------------------------------------------------------------------------------------


async def test_a_keep_all_publisher_waits_for_nobody_elsewhere(hosts: Hosts) -> None:
    everything = Topic(Int32, "everything", QoS(history=History.KEEP_ALL, limit=2))
    rig, other = await hosts.start(Node), await hosts.start(Node)
    out = rig.me.publisher(everything)
    probe = other.probe(everything)
    await rig.quiet()
    for value in range(5):
        await out.send(number(value))
    await rig.quiet()

    assert values(probe) == [0, 1, 2, 3, 4]
    (outlet,) = (outlet for outlet in hosts.ends[rig].outlets if "everything" in outlet.key)
    assert outlet.delivery == Delivery(reliable=True, keep_all=True, depth=2, history=0)


async def test_a_full_keep_all_subscription_has_its_transport_wait_until_something_is_taken(hosts: Hosts) -> None:
    everything = Topic(Int32, "everything", QoS(history=History.KEEP_ALL, limit=2))
    rig, other = await hosts.start(Node), await hosts.start(Node)
    out, stream = rig.me.publisher(everything), other.me.subscribe(everything)
    await rig.quiet()
    (end,) = (one for one in hosts.ends[other].subscriptions if "everything" in one.key)
    waits: list[Any] = []
    take, end._take = end._take, lambda sample: waits.append(take(sample))
    for value in range(2):
        await out.send(number(value))
    await rig.quiet()

    first, second = waits
    waiting = asyncio.create_task(second())
    await rig.quiet()
    assert (first, waiting.done()) == (None, False)
    assert await stream.next(1.0) == number(0)
    await waiting


async def test_images_are_also_read_from_the_key_of_newer_distributions(hosts: Hosts) -> None:
    rig, other = await hosts.start(Node), await hosts.start(Node)
    probe = rig.probe(IMAGES)
    await rig.quiet()
    (token,) = (token for token in hosts.network.tokens if "/MS/" in token and "images" in token)
    keys = [one.key for one in hosts.ends[rig].subscriptions if "images" in one.key]
    sent = Image(height=1, width=1, step=1, data=b"x")
    outlet = hosts.ends[other].outlet(keys[1], Delivery())
    outlet.put(encode(sent), write_attachment(Attachment(1, 0, bytes(16))))
    await rig.quiet()

    assert token.endswith("/backends:cpu:")
    assert [key.removeprefix(keys[0]) for key in keys] == ["", "/_buf_cpu"]
    assert list(probe) == [sent]
    probe.close()
    assert not hosts.ends[rig].subscriptions


async def test_a_topic_elsewhere_is_tapped_as_far_as_it_arrives(hosts: Hosts) -> None:
    rig, other = await hosts.start(Node), await hosts.start(Talker)
    seen: list[Any] = []
    rig.system.graph.tap(lambda publisher: seen.append)
    rig.probe(NUMBERS)
    rig.probe(NUMBERS, qos=5)
    await rig.quiet()
    other.node(Talker).out(number(3))
    await rig.quiet()

    assert seen == [number(3)]


async def test_stand_ins_say_what_they_stand_for(hosts: Hosts) -> None:
    rig, other = await hosts.start(Talker, Listener), await hosts.start(Node)
    topic = other.system.graph.topics["/numbers"]

    assert list(map(repr, (*topic.publishers, *topic.subscriptions))) == [
        "<publisher of /numbers [std_msgs/msg/Int32] in /talker, elsewhere: 0 arrived>",
        "<subscription of /numbers [std_msgs/msg/Int32] in /listener, elsewhere>",
    ]
    assert [repr(one.node) for one in topic.publishers] == [f"<node /talker of {hosts.ends[rig].session}>"]
    view = next(topic for topic in other.system.snapshot().topics if topic.name == "/numbers")
    assert ([edge.node for edge in view.publishers], view.types) == (["/talker"], ("std_msgs/msg/Int32",))
    assert rig.system.snapshot().topics[0].name == "/numbers"


async def test_a_node_that_is_restarted_has_new_publishers_elsewhere_and_is_still_the_same_node(hosts: Hosts) -> None:
    rig, other = await hosts.start(Talker), await hosts.start(Node)
    probe = other.probe(NUMBERS)
    before = [token for token in hosts.network.tokens if "/talker" in token]
    rig.crash(Talker)
    await rig.settled()
    await rig.quiet()
    after = [token for token in hosts.network.tokens if "/talker" in token]
    rig.node(Talker).out(number(1))
    await rig.quiet()

    assert [token for token in before if "/NN/" in token] == [token for token in after if "/NN/" in token]
    assert not set(before) & {token for token in after if "%numbers" in token}
    assert (values(probe), probe.status.matched, probe.status.matched_total) == ([1], 1, 2)


async def test_a_twist_crosses_as_it_is(hosts: Hosts) -> None:
    velocity = Topic(Twist, "cmd_vel", qos.COMMANDS)
    rig, other = await hosts.start(Node), await hosts.start(Node)
    probe = other.probe(velocity)
    await rig.quiet()
    sent = Twist(linear=Twist().linear.replace(x=0.1))
    rig.publish(velocity, sent)
    await rig.quiet()

    assert list(probe) == [sent]


@pytest.mark.parametrize(
    ("type", "priority"),
    [
        (Image, 6),
        (CompressedImage, 6),
        (PointCloud2, 6),
        (OccupancyGrid, 6),
        (Twist, 5),
        (JointState, 5),
        (LaserScan, 5),
        (String, 5),
    ],
)
async def test_images_clouds_and_maps_let_all_other_messages_pass(hosts: Hosts, type: Any, priority: int) -> None:
    rig = await hosts.start(Node)
    rig.me.publisher(Topic(type, "something"))
    await rig.quiet()
    (outlet,) = [each for each in hosts.ends[rig].outlets if "/something/" in each.key]
    assert outlet.delivery.priority == priority
