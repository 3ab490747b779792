"""Qualities of service between our nodes and those of zenoh-ros2-sdk and pyzeros.

Over Zenoh no quality of service keeps a message back, and every pair of endpoints is compatible, as for ROS 2's rmw_zenoh. pyzeros knows no
transient local; a publisher of the SDK announces it, and keeps nothing. The SDK sends a GID that has nothing to do with its token.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from itertools import product
from typing import Any

import pytest

from actors import QoS, Topic
from actors.interfaces.std_msgs.msg import String
from actors.qos import Durability, Reliability
from actors.transport.format.gids import gid_of
from tests.interop.parties import Ours, Program, deliver, until

pytestmark = [pytest.mark.interop, pytest.mark.realtime]

StartProgram = Callable[[str], Awaitable[Program]]
WORDS = Topic(String, "/words")
TYPE = "std_msgs/msg/String"
SOME = [{"data": "first"}, {"data": "second"}, {"data": "third"}]

RELIABILITIES = ("RELIABLE", "BEST_EFFORT")
DURABILITIES = ("VOLATILE", "TRANSIENT_LOCAL")
PROFILES = tuple(product(RELIABILITIES, DURABILITIES))
OF_PYZEROS = tuple(("with_pyzeros", reliability, "VOLATILE") for reliability in RELIABILITIES)
OF_SDK = tuple(("with_zenoh_ros2_sdk", *profile) for profile in PROFILES)


def ours_is(reliability: str, durability: str) -> QoS:
    return QoS(depth=10, reliability=Reliability[reliability], durability=Durability[durability])


def theirs_is(reliability: str, durability: str) -> dict[str, str]:
    return {"reliability": reliability, "durability": durability}


@pytest.mark.parametrize("offered", PROFILES, ids="-".join)
@pytest.mark.parametrize("theirs", OF_PYZEROS + OF_SDK, ids="-".join)
async def test_what_we_offer_reaches_every_subscription_and_we_count_it(
    theirs: tuple[str, str, str], offered: tuple[str, str], ours: Ours, start: StartProgram
) -> None:
    publisher = ours.node.publisher(WORDS, qos=ours_is(*offered))
    there = await start(theirs[0])
    await there.do("subscription", topic="/words", type=TYPE, qos=theirs_is(*theirs[1:]))

    await deliver(lambda one: publisher(String(**one)), lambda: there.heard("/words"), TYPE, SOME)

    assert (publisher.subscription_count, publisher.status.incompatible_qos) == (1, 0)


@pytest.mark.parametrize("wanted", PROFILES, ids="-".join)
@pytest.mark.parametrize("theirs", OF_PYZEROS, ids="-".join)
async def test_what_they_offer_is_taken(
    theirs: tuple[str, str, str], wanted: tuple[str, str], ours: Ours, start: StartProgram
) -> None:
    anything = ours.listen(WORDS, QoS(depth=10, reliability=Reliability.BEST_EFFORT))
    stream = ours.node.subscribe(WORDS, qos=ours_is(*wanted))
    there = await start(theirs[0])
    await there.do("publisher", topic="/words", type=TYPE, qos=theirs_is(*theirs[1:]))
    token, gid = (await there.do("token", kind="publisher", name="/words")).split()

    await deliver(lambda one: there.do("publish", topic="/words", message=one), lambda: anything, TYPE, SOME)

    assert (stream.publisher_count, stream.received) == (1, len(anything))
    assert stream.status.incompatible_qos == 0
    assert gid_of(token).hex() == gid


@pytest.mark.parametrize("wanted", PROFILES, ids="-".join)
@pytest.mark.parametrize("theirs", OF_SDK, ids="-".join)
async def test_what_the_sdk_offers_is_taken_although_its_gid_is_unknown(
    theirs: tuple[str, str, str], wanted: tuple[str, str], ours: Ours, start: StartProgram
) -> None:
    got = ours.listen(WORDS, ours_is(*wanted))
    stream = ours.node.subscribe(WORDS, qos=ours_is(*wanted))
    there = await start(theirs[0])
    await there.do("publisher", topic="/words", type=TYPE, qos=theirs_is(*theirs[1:]))
    token, gid = (await there.do("token", kind="publisher", name="/words")).split()

    await deliver(lambda one: there.do("publish", topic="/words", message=one), lambda: got, TYPE, SOME)

    assert (stream.publisher_count, stream.status.incompatible_qos) == (1, 0)
    assert gid_of(token).hex() != gid


# Late joiners -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("reliability", RELIABILITIES)
async def test_a_late_subscription_of_the_sdk_gets_the_newest_of_what_we_keep_and_all_that_follows(
    reliability: str, ours: Ours, start: StartProgram
) -> None:
    """It asks for several, but lets Zenoh throw away all replies of a key but the newest; ROS 2 gets them all."""
    publisher = ours.node.publisher(WORDS, qos=ours_is(reliability, "TRANSIENT_LOCAL").replace(depth=3))
    for number in range(5):
        publisher(String(data=f"kept {number}"))
    there = await start("with_zenoh_ros2_sdk")
    while not (info := await there.do("topic_info", topic="/words")) or not info["publishers"]:
        pass  # it looks for publishers only once
    await there.do("subscription", topic="/words", type=TYPE, qos=theirs_is(reliability, "TRANSIENT_LOCAL"))

    await until(lambda: there.heard("/words"), "what is kept has come")
    publisher(String(data="live"))
    await until(lambda: {"data": "live"} in there.heard("/words"), "what follows has come")

    assert there.heard("/words") == [{"data": text} for text in ("kept 4", "live")]


@pytest.mark.parametrize("durability", DURABILITIES)
async def test_a_late_volatile_subscription_of_the_sdk_gets_nothing_of_before(
    durability: str, ours: Ours, start: StartProgram
) -> None:
    publisher = ours.node.publisher(WORDS, qos=ours_is("RELIABLE", durability))
    publisher(String(data="before"))
    there = await start("with_zenoh_ros2_sdk")
    await there.do("subscription", topic="/words", type=TYPE, qos=theirs_is("RELIABLE", "VOLATILE"))

    await deliver(lambda one: publisher(String(**one)), lambda: there.heard("/words"), TYPE, SOME)

    assert {"data": "before"} not in there.heard("/words")


async def test_a_publisher_of_the_sdk_keeps_nothing_although_it_announces_transient_local(
    ours: Ours, start: StartProgram
) -> None:
    early: list[Any] = ours.listen(WORDS)
    there = await start("with_zenoh_ros2_sdk")
    await there.do("publisher", topic="/words", type=TYPE, qos=theirs_is("RELIABLE", "TRANSIENT_LOCAL"))
    await deliver(lambda one: there.do("publish", topic="/words", message=one), lambda: early, TYPE, SOME)

    late = ours.node.subscribe(WORDS, qos=ours_is("RELIABLE", "TRANSIENT_LOCAL"))
    assert late.publisher_count == 1
    await deliver(
        lambda one: there.do("publish", topic="/words", message=one), lambda: early[3:], TYPE, [{"data": "live"}]
    )

    assert (await late.next(timeout=10.0)).data == "live"


@pytest.mark.parametrize("what", ["publisher", "subscription"])
async def test_pyzeros_refuses_transient_local(what: str, ours: Ours, start: StartProgram) -> None:
    there = await start("with_pyzeros")
    with pytest.raises(AssertionError, match="NotImplementedError: TRANSIENT_LOCAL durability is not implemented"):
        await there.do(what, topic="/words", type=TYPE, qos=theirs_is("RELIABLE", "TRANSIENT_LOCAL"))
