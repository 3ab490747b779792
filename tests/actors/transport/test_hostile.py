"""Hostile bytes on every key of a system. `python -m tests.hostile wire --messages 1000000` is the same at length."""

from __future__ import annotations

from typing import Any

import pytest

from actors import Node, QoS, Topic, publishes
from actors.interfaces import encode
from actors.interfaces.std_msgs.msg import Int32
from actors.transport.format.attachments import Attachment, write_attachment
from actors.transport.format.gids import gid_of
from actors.transport.protocol import Delivery
from actors.transport.unreadable import Unreadable
from tests.actors.transport.hosts import Hosts, hosts
from tests.actors.transport.test_bridge_topics import NUMBERS_KEY, Listener, Talker
from tests.hostile.wire import attack, findings
from tests.stage import NUMBERS, events, number, values

__all__ = ["hosts"]
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
