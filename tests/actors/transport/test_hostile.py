"""Hostile bytes on every key of a system. `python -m tests.hostile wire --messages 1000000` is the same at length."""

from __future__ import annotations

from typing import Any

import pytest

from actors import Action, Child, Node, QoS, Topic, publishes, qos
from actors.interfaces import encode
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.std_msgs.msg import Int32
from actors.transport.format.attachments import Attachment, write_attachment
from actors.transport.format.gids import gid_of
from actors.transport.keyed.protocol import Delivery
from actors.transport.unreadable import Unreadable
from tests.actors.transport.hosts import Hosts
from tests.actors.transport.test_bridge_actions import Counter
from tests.actors.transport.test_bridge_services import Adder
from tests.actors.transport.test_bridge_topics import NUMBERS_KEY, Listener, Talker
from tests.hostile.scene import Tokens
from tests.hostile.wire import attack, findings
from tests.stage import NUMBERS, events, number, order, values

pytestmark = pytest.mark.virtual

KEPT = Topic(Int32, "kept", QoS(depth=1_000_000, durability="transient_local"))


class Keeper(Node):
    out = publishes(KEPT)


@pytest.mark.parametrize("seed", range(4))
async def test_hostile_messages_lose_nothing_and_are_counted_and_reported_once(seed: int) -> None:
    outcome = await attack(2000, seed)
    assert findings(outcome) == []
    assert len(outcome.heard) == 40
    assert outcome.logs.unreadable > outcome.unreadable > 200
    assert set(outcome.answers) <= {"an answer", "CallTimeout", "ServiceFailed", "NotRunning"}
    assert outcome.logs.lines.total() < 60


@pytest.mark.parametrize(("claimed", "lost"), [(1, 1), (3, 3), (2**63 - 1, 3), (-(2**63), 1)])
async def test_bytes_in_the_name_of_a_publisher_hide_none_of_its_messages(
    hosts: Hosts, claimed: int, lost: int
) -> None:
    """A number that is not above the last one counts as a repetition."""
    rig, other = await hosts.start(Talker), await hosts.start(Node)
    probe = other.probe(NUMBERS)
    await rig.quiet()
    (token,) = (token for token in hosts.network.tokens if "/MP/" in token and "numbers" in token)
    outlet = hosts.ends[rig].outlet(NUMBERS_KEY, Delivery())

    for value in (1, 2, 3):
        outlet.put(b"\0\1\0\0", write_attachment(Attachment(claimed, 0, gid_of(token))))
        outlet.put(encode(number(value)), write_attachment(Attachment(value, 0, gid_of(token))))
    await rig.quiet()

    assert (values(probe), probe.dropped) == ([1, 2, 3], lost)
    assert [line.node for line in events(other.logs, "a message cannot be decoded")] == ["/rig"]


async def test_other_messages_under_the_numbers_of_kept_ones_stop_none_of_the_later_ones(hosts: Hosts) -> None:
    class Three(Node):
        out = publishes(Topic(Int32, "kept", KEPT.qos.replace(depth=3)))

    rig, other = await hosts.start(Three), await hosts.start(Node)
    probe = other.probe(KEPT)
    await rig.quiet()
    (token,) = (token for token in hosts.network.tokens if "/MP/" in token and "kept" in token)
    outlet = hosts.ends[rig].outlet(NUMBERS_KEY.replace("numbers", "kept"), Delivery())

    numbers = (5, 6, 7, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13)
    for value, claimed in enumerate(numbers):
        outlet.put(encode(number(value)), write_attachment(Attachment(claimed, 0, gid_of(token))))
    await rig.quiet()

    assert values(probe) == [value for value in range(len(numbers)) if numbers[value] != 3]
    (publisher,) = other.system.graph.topic("/kept").publishers
    assert [message.data for message in publisher.latched] == [11, 12, 13]


async def test_what_nobody_could_read_is_told_once_when_it_comes_and_in_sum_at_the_end(hosts: Hosts) -> None:
    rig, stranger = await hosts.start(Listener), await hosts.start(Node)
    outlet = hosts.ends[stranger].outlet(NUMBERS_KEY, Delivery())
    for size in (0, 32, 33, 5):
        outlet.put(b"", b"\xff" * size)
    await rig.quiet()

    (line,) = events(rig.logs, "an attachment cannot be read")
    assert (line.fields["key"], line.fields["next"]) == (NUMBERS_KEY, "further ones are counted only")
    await rig.system.stop("the test is over")
    (line,) = events(rig.logs, "data of other processes could not be read")
    assert line.fields["count"] == 4
    assert events(stranger.logs, "could not be read") == []


def test_strangers_fill_neither_memory_nor_log() -> None:
    lines: list[dict[str, Any]] = []
    unreadable = Unreadable(lambda what, **fields: lines.append({"what": what, **fields}))
    for topic in range(5000):
        unreadable.note("a message cannot be decoded", f"/topic_{topic}", ValueError("bad"))
    assert (len(lines), unreadable.count) == (1000, 5000)
    assert lines[0] == {
        "what": "a message cannot be decoded",
        "because": "bad",
        "next": "further ones are counted only",
    }


async def test_a_publisher_that_claims_to_keep_everything_is_not_given_the_memory(hosts: Hosts) -> None:
    rig, other = await hosts.start(Keeper), await hosts.start(Node)
    probe = other.probe(KEPT)
    await rig.quiet()
    for value in range(10_200):
        rig.node(Keeper).out(number(value))
    await rig.quiet()
    remote: Any = other.system.graph.topics["/kept"].publishers[0]
    assert len(probe) == 10_200
    assert len(remote.latched) == 10_000


async def test_each_kind_of_data_is_counted_and_told_at_its_place(hosts: Hosts) -> None:
    rig = await hosts.start(Listener, Adder, Counter)
    await hosts.start(Child(Counter, name="far", remap={"count": "far_count"}))
    stranger = hosts.network.end()
    far = Action(Fibonacci, "far_count")
    await rig.send_goal(far, order(0))  # from now on feedback and status of the far action are heard
    await stranger.open("@ros2_lv/0/**", Tokens())
    await rig.quiet()
    sound = write_attachment(Attachment(1, 0, bytes(16)))
    served = {one.key for one in hosts.ends[rig].servers}
    heard = {one.key for one in hosts.ends[rig].subscriptions}

    def key(part: str, keys: set[str]) -> str:
        (found,) = (one for one in keys if one.startswith(f"0/{part}/"))
        return found

    stranger.ask(key("add", served), b"", b"short", None, lambda answer: None)
    stranger.ask(key("add", served), b"", sound, None, lambda answer: None)
    stranger.ask(key("count/_action/send_goal", served), b"", sound, None, lambda answer: None)
    stranger.outlet(key("far_count/_action/feedback", heard), Delivery()).put(b"", sound)
    stranger.outlet(key("numbers", heard), Delivery()).put(b"", sound)
    stranger.outlet(key("numbers", heard), Delivery()).put(b"", b"short")
    stranger.announce("@ros2_lv/0/no token").close()
    await rig.quiet()

    told = [
        (line.event, str(line.fields.get("service") or line.fields.get("topic") or ""))
        for line in rig.logs
        if line.fields.get("next") == "further ones are counted only"
    ]
    assert sorted(told) == [
        ("a message cannot be decoded", "/far_count/_action/feedback"),
        ("a message cannot be decoded", "/numbers"),
        ("a request cannot be decoded", "/add"),
        ("a request cannot be decoded", "/count/_action/send_goal"),
        ("a request has no attachment that can be read", "/add"),
        ("a token cannot be read", ""),
        ("an attachment cannot be read", ""),
    ]
    await stranger.close()
    await rig.system.stop("the test is over")
    (line,) = events(rig.logs, "data of other processes could not be read")
    assert line.fields["count"] == 7


async def test_a_message_that_cannot_be_decoded_and_a_gap_are_each_counted_once(hosts: Hosts) -> None:
    rig, other = await hosts.start(Talker), await hosts.start(Node)
    probe = other.probe(NUMBERS)
    await rig.quiet()
    (token,) = (token for token in hosts.network.tokens if "/MP/" in token and "numbers" in token)
    outlet = hosts.ends[rig].outlet(NUMBERS_KEY, Delivery())
    for value, payload in ((1, encode(number(1))), (2, b"\0\1\0\0"), (4, encode(number(4))), (6, encode(number(6)))):
        outlet.put(payload, write_attachment(Attachment(value, 0, gid_of(token))))
    await rig.quiet()
    assert (values(probe), probe.dropped) == ([1, 4, 6], 3)


@pytest.mark.parametrize("history", [qos.DEFAULT, qos.LATCHED], ids=["volatile", "latched"])
async def test_a_forged_number_does_not_mute_a_publisher(hosts: Hosts, history: QoS) -> None:
    rig, other = await hosts.start(Node), await hosts.start(Node)
    out = rig.me.publisher(NUMBERS, qos=history)
    probe = other.probe(NUMBERS, qos=history)
    taps: list[object] = []
    other.system.graph.tap(lambda publisher: taps.append)
    await rig.quiet()
    (token,) = (token for token in hosts.network.tokens if "/MP/" in token and "numbers" in token)
    outlet = hosts.ends[rig].outlet(NUMBERS_KEY, Delivery())

    for value in range(50):
        out(number(value))
        if value == 20:
            outlet.put(encode(number(-1)), write_attachment(Attachment(2**62, 0, gid_of(token))))
    await rig.quiet()

    assert values(probe) == [*range(21), -1, *range(21, 50)]
    assert probe.dropped == 0
    assert len([one for one in taps if one in map(number, range(-1, 50))]) == 51
