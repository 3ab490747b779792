"""Topics: talker and listener both ways, with every quality of service, late joiners, and a type known from its definition only."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from itertools import product
from typing import Any

from actors import QoS, Topic
from actors.interfaces import from_plain, get_message, load
from actors.interfaces.std_msgs.msg import String
from actors.qos import Durability, History, Liveliness, Reliability
from tests.interop.parties import deliver, until
from tests.interop.ros2.bench import Bench, Check
from tests.interop.test_topics import MESSAGES

TYPE = "std_msgs/msg/String"
SOME = [{"data": "first"}, {"data": "zwölf 🦊"}, {"data": ""}, {"data": "last"}]
PROFILES = tuple(product(("RELIABLE", "BEST_EFFORT"), ("VOLATILE", "TRANSIENT_LOCAL")))


def theirs(profile: tuple[str, str], depth: int = 10) -> dict[str, Any]:
    return {"reliability": profile[0], "durability": profile[1], "depth": depth}


def ours_is(profile: tuple[str, str], depth: int = 10) -> QoS:
    return QoS(depth=depth, reliability=Reliability[profile[0]], durability=Durability[profile[1]])


def fits(offered: tuple[str, str], wanted: tuple[str, str]) -> bool:
    """ROS 2's rule: a publisher must offer at least what the subscription asks for."""
    return (offered[0], wanted[0]) != ("BEST_EFFORT", "RELIABLE") and (offered[1], wanted[1]) != (
        "VOLATILE",
        "TRANSIENT_LOCAL",
    )


def checks(middleware: str = "zenoh") -> Iterator[tuple[str, Check]]:
    for offered, wanted in product(PROFILES, PROFILES):
        if fits(offered, wanted):
            names = f"{'-'.join(offered).lower()} to {'-'.join(wanted).lower()}"
            yield f"our talker, their listener, {names}", our_talker(offered, wanted)
            yield f"their talker, our listener, {names}", their_talker(offered, wanted)
    for type in MESSAGES:
        yield f"our talker, their listener, {type}", our_talker(PROFILES[0], PROFILES[0], type)
        yield f"their talker, our listener, {type}", their_talker(PROFILES[0], PROFILES[0], type)
    for reliability in (
        ("RELIABLE", "BEST_EFFORT") if middleware == "zenoh" else ("RELIABLE",)
    ):  # DDS keeps nothing for others
        yield f"their late joiner gets what we keep, {reliability.lower()}", their_late_joiner(reliability)
        yield f"our late joiner gets what they keep, {reliability.lower()}", our_late_joiner(reliability)
    if middleware == "zenoh":
        yield "what DDS would refuse is exchanged in both directions", incompatible
    else:
        yield "what DDS refuses is not exchanged, and both sides are told", refused
        yield "who asserts its liveliness stays alive on the other side, without a message", liveliness
    yield "keep all: 2000 messages at once arrive in order", in_order
    yield "a type known from its definition only", unknown_type


_numbers = iter(range(10_000))


def fresh() -> str:
    """A topic of its own for each check, as all share one bench."""
    return f"/topic_{next(_numbers)}"


def our_talker(offered: tuple[str, str], wanted: tuple[str, str], type: str = TYPE) -> Check:
    async def check(bench: Bench) -> None:
        topic, there, cls = fresh(), await bench.peer(), get_message(type)
        publisher = bench.ours.node.publisher(Topic(cls, topic), qos=ours_is(offered))
        await there.do("subscription", topic=topic, type=type, qos=theirs(wanted))
        await until(lambda: publisher.subscription_count, "their listener is matched")
        wanted_messages = SOME if type == TYPE else MESSAGES[type]
        await deliver(lambda one: publisher(from_plain(cls, one)), lambda: there.heard(topic), type, wanted_messages)
        assert (await there.do("counts", topic=topic)) == [1, 1]

    return check


def their_talker(offered: tuple[str, str], wanted: tuple[str, str], type: str = TYPE) -> Check:
    async def check(bench: Bench) -> None:
        topic, there, cls = fresh(), await bench.peer(), get_message(type)
        got = bench.ours.listen(Topic(cls, topic), ours_is(wanted))
        await there.do("publisher", topic=topic, type=type, qos=theirs(offered))
        wanted_messages = SOME if type == TYPE else MESSAGES[type]
        await deliver(lambda one: there.do("publish", topic=topic, message=one), lambda: got, type, wanted_messages)
        assert list(bench.ours.publishers(topic)) == ["/ros/peer"]
        assert (await there.do("counts", topic=topic)) == [1, 1]

    return check


def their_late_joiner(reliability: str) -> Check:
    async def check(bench: Bench) -> None:
        topic, there = fresh(), await bench.peer()
        publisher = bench.ours.node.publisher(
            Topic(String, topic), qos=ours_is((reliability, "TRANSIENT_LOCAL"), depth=3)
        )
        for number in range(5):
            publisher(String(data=f"kept {number}"))
        await there.do("subscription", topic=topic, type=TYPE, qos=theirs((reliability, "TRANSIENT_LOCAL"), depth=5))
        await until(lambda: len(there.heard(topic)) >= 3, "what is kept has come")
        publisher(String(data="live"))
        await until(lambda: len(there.heard(topic)) >= 4, "what follows has come")
        assert [one["data"] for one in there.heard(topic)] == ["kept 2", "kept 3", "kept 4", "live"]

    return check


def our_late_joiner(reliability: str) -> Check:
    async def check(bench: Bench) -> None:
        topic, there = fresh(), await bench.peer()
        await there.do("publisher", topic=topic, type=TYPE, qos=theirs((reliability, "TRANSIENT_LOCAL"), depth=3))
        for number in range(5):
            await there.do("publish", topic=topic, message={"data": f"kept {number}"})
        got = bench.ours.listen(Topic(String, topic), ours_is((reliability, "TRANSIENT_LOCAL"), depth=5))
        await until(lambda: len(got) >= 3, "what is kept has come")
        await there.do("publish", topic=topic, message={"data": "live"})
        await until(lambda: len(got) >= 4, "what follows has come")
        assert [one["data"] for one in got] == ["kept 2", "kept 3", "kept 4", "live"]

    return check


async def incompatible(bench: Bench) -> None:
    topic, there = fresh(), await bench.peer()
    publisher = bench.ours.node.publisher(Topic(String, topic), qos=ours_is(("BEST_EFFORT", "VOLATILE")))
    await there.do("subscription", topic=topic, type=TYPE, qos=theirs(("RELIABLE", "VOLATILE")))
    await until(lambda: publisher.subscription_count, "it is matched, as rmw_zenoh does it")
    assert publisher.status.incompatible_qos == 0
    await deliver(lambda one: publisher(String(**one)), lambda: there.heard(topic), TYPE, SOME)
    back = fresh()
    got = bench.ours.listen(Topic(String, back), ours_is(("RELIABLE", "TRANSIENT_LOCAL")))
    await there.do("publisher", topic=back, type=TYPE, qos=theirs(("BEST_EFFORT", "VOLATILE")))
    await deliver(lambda one: there.do("publish", topic=back, message=one), lambda: got, TYPE, SOME)


async def refused(bench: Bench) -> None:
    topic, back, there = fresh(), fresh(), await bench.peer()
    publisher = bench.ours.node.publisher(Topic(String, topic), qos=ours_is(("BEST_EFFORT", "VOLATILE")))
    await there.do("subscription", topic=topic, type=TYPE, qos=theirs(("RELIABLE", "VOLATILE")))
    await until(lambda: publisher.status.incompatible_qos, "our publisher is told")
    got = bench.ours.listen(Topic(String, back), ours_is(("RELIABLE", "TRANSIENT_LOCAL")))
    await there.do("publisher", topic=back, type=TYPE, qos=theirs(("RELIABLE", "VOLATILE")))
    await until(
        lambda: any(back in f"{record.event} {record.fields}" for record in bench.ours.logs), "our subscription is told"
    )
    await our_talker(PROFILES[0], PROFILES[0])(bench)  # what fits is exchanged meanwhile
    assert publisher.subscription_count == 0
    publisher(String(data="unheard"))
    await there.do("publish", topic=back, message={"data": "unheard"})
    await their_talker(PROFILES[0], PROFILES[0])(bench)
    assert not got
    assert not there.heard(topic)


async def liveliness(bench: Bench) -> None:
    topic, back, there = fresh(), fresh(), await bench.peer()
    manual = QoS(depth=10, liveliness=Liveliness.MANUAL_BY_TOPIC, liveliness_lease=2.0)
    publisher = bench.ours.node.publisher(Topic(String, topic), qos=manual)
    await there.do("subscription", topic=topic, type=TYPE, qos={"lease": 2.0})
    await there.do("publisher", topic=back, type=TYPE, qos={"lease": 2.0})

    def counted(name: str) -> int:
        return int((there.said("liveliness", topic=topic) or [{name: 0}])[-1][name])

    async with bench.ours.node.subscribe(Topic(String, back), qos=manual) as stream:
        await until(lambda: publisher.subscription_count and stream.status.matched, "both are matched")
        publisher(String(data="first"))
        await there.do("publish", topic=back, message={"data": "first"})
        await until(lambda: counted("alive") and stream.status.alive, "both are alive")
        for _ in range(30):  # without a message, for longer than twice the lease
            publisher.assert_liveliness()
            await there.do("assert_liveliness", topic=back)
            await asyncio.sleep(0.15)
        assert (counted("alive"), stream.status.alive) == (1, 1)
        assert all(one["not_alive"] == 0 for one in there.said("liveliness", topic=topic))
        await until(lambda: counted("not_alive") and stream.status.not_alive, "both have ceased, and are not alive")


async def in_order(bench: Bench) -> None:
    topic, there = fresh(), await bench.peer()
    # KEEP_LAST promises nothing when a link is slower than its publisher, which a busy machine can make it
    publisher = bench.ours.node.publisher(Topic(String, topic), qos=QoS(history=History.KEEP_ALL))
    await there.do("subscription", topic=topic, type=TYPE, qos={"all": True})
    await deliver(lambda one: publisher(String(**one)), lambda: there.heard(topic), TYPE, SOME[:1])
    for number in range(2000):
        publisher(String(data=str(number)))
    await until(lambda: there.heard(topic)[-1]["data"] == "1999", "the last has come")
    numbers = [one["data"] for one in there.heard(topic) if one["data"] != "first"]
    assert numbers == [str(number) for number in range(2000)]


async def unknown_type(bench: Bench) -> None:
    """`test_msgs` is not among our packages; we know the type by the text of its definition, as ROS 2 has it."""
    name = "test_msgs/msg/BasicTypes"
    cls: Any = load(await bench.run("interface", "show", name), name)
    topic, there = fresh(), await bench.peer()
    plain = {"bool_value": True, "uint8_value": 7, "float64_value": 1.5, "int64_value": -(2**63), "char_value": 100}
    got = bench.ours.listen(Topic(cls, topic))
    await there.do("publisher", topic=topic, type=name, qos={})
    await deliver(lambda one: there.do("publish", topic=topic, message=one), lambda: got, name, [plain])
    back = fresh()
    publisher = bench.ours.node.publisher(Topic(cls, back))
    await there.do("subscription", topic=back, type=name, qos={})
    await until(lambda: publisher.subscription_count, "their listener is matched")
    await until(lambda: publisher(from_plain(cls, plain)) or there.heard(back), "a message has come")
    heard = there.heard(back)[0]
    assert {name: heard[name] for name in plain} == plain
