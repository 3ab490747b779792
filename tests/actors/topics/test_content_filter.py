"""Content filters: which messages an expression takes, and what is no expression."""

from __future__ import annotations

import asyncio
import time
from typing import Any, cast

import pytest

from actors import Child, ContentFilter, DeclarationError, Node, QoS, Service, Topic, qos, subscribes
from actors.errors import InvalidFilter
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.geometry_msgs.msg import Twist, Vector3
from actors.interfaces.sensor_msgs.msg import JointState
from actors.interfaces.std_msgs.msg import Bool, Header, Int32
from actors.testing import Rig
from tests.stage import NUMBERS, WORDS, number, values, word

OTHERS = Topic(Int32, "others")
JOINTS = JointState(header=Header(stamp=Time(sec=7), frame_id="arm"), name=["hip", "knee"], position=[0.5, -1.5])


@pytest.mark.parametrize(
    ("expression", "message", "taken"),
    [
        ("data = 5", number(5), True), ("data = 5", number(4), False), ("data <> 5", number(4), True), ("data != 5", number(5), False),
        ("data < 5", number(4), True), ("data <= 5", number(5), True), ("data > 5", number(5), False), ("data >= 5", number(5), True),
        ("data > -3.5e0 AND data < 0x10", number(-3), True), ("data>4.5", number(5), True), ("5 < data", number(6), True),
        ("data BETWEEN 2 AND 4", number(4), True), ("data BETWEEN 2 AND 4", number(5), False), ("data NOT BETWEEN 2 AND 4", number(5), True),
        ("data = 1 OR data = 2 AND data = 3", number(1), True),  # AND binds closer
        ("(data = 1 OR data = 2) AND data = 3", number(1), False), ("NOT data = 1", number(2), True), ("not (data = 1 or data = 2)", number(3), True),
        ("data = 'it''s'", word("it's"), True), ("data LIKE 'ar%'", word("arm 1"), True), ("data like 'a_m'", word("arm"), True),
        ("data LIKE 'a_m'", word("alarm"), False), ("data LIKE '%.*'", word("a.*"), True), ("data LIKE '%.*'", word("abc"), False),
        ("data NOT LIKE 'ar%'", word("leg"), True), ("data = TRUE", Bool(data=True), True), ("data = false", Bool(data=True), False),
        ("header.stamp.sec = 7 AND header.frame_id = 'arm'", JOINTS, True), ("position[1] < position[0]", JOINTS, True),
        ("name[0] = 'hip'", JOINTS, True), ("name[9] = 'hip'", JOINTS, False), ("velocity[0] > 0", JOINTS, False),
        ("linear.x > angular.z", Twist(linear=Vector3(x=1.0)), True),
        ("data > 'text'", number(5), False), ("data LIKE 5", word("5"), False), ("", number(5), True), ("  ", number(5), True),
    ],
)  # fmt: skip
def test_an_expression_takes_what_it_says(expression: str, message: Any, taken: bool) -> None:
    assert ContentFilter(expression).takes(message) is taken


def test_like_takes_time_that_grows_with_the_text_alone() -> None:
    """Texts come from others: to try every way of splitting one up would take hours here."""
    chosen, long = ContentFilter("data LIKE '%a%a%a%a%a%a%b'"), "a" * 100_000
    begun = time.process_time()
    assert not chosen.takes(word(long))
    assert chosen.takes(word(long + "b"))
    assert time.process_time() - begun < 1.0
    assert ContentFilter("data LIKE '%ab%%b_'").takes(word("aabbc")) and not ContentFilter("data LIKE '%ab%b_'").takes(
        word("abc")
    )


def test_parameters_stand_for_literals() -> None:
    chosen = ContentFilter("data > %0 AND data < %1", ["2", "0x5"])
    assert [value for value in range(8) if chosen.takes(number(value))] == [3, 4]
    assert ContentFilter("data = %10", ["0"] * 10 + ["'x'"]).takes(word("x"))
    assert ContentFilter("data = %0", ["TRUE"]).takes(Bool(data=True))
    assert repr(chosen) == "ContentFilter('data > %0 AND data < %1', ['2', '0x5'])" and chosen.fields == ("data",)


@pytest.mark.parametrize(
    ("expression", "said"),
    [
        ("data >", "a field, a literal or a parameter is expected, and there is the end"),
        ("data > >", "a field, a literal or a parameter is expected, and there is '>'"),
        ("data", "a comparison is expected, and there is the end"),
        ("data 5", "a comparison is expected, and there is '5'"),
        ("data NOT = 5", "a comparison is expected"),
        ("(data = 5", "a closing parenthesis is expected, and there is the end"),
        ("data = 5 data", "the end, AND or OR is expected, and there is 'data'"),
        ("data BETWEEN 1 OR 2", "AND of BETWEEN is expected, and there is 'OR'"),
        ("data = $5", "what is '$5'?"),
        ("data = 'open", "what is"),
        ("data = %1", "has no parameter for %1: 1 are given"),
        ("data = %0", "the parameter %0 must be a literal such as 5 or 'text', not '> 5'"),
    ],
)
def test_what_is_no_expression_is_refused(expression: str, said: str) -> None:
    with pytest.raises(InvalidFilter) as refused:
        ContentFilter(expression, ["> 5"])
    assert said in str(refused.value)


async def test_a_stream_gets_what_its_filter_takes_and_nothing_else_waits_in_it(rig: Rig) -> None:
    await rig.start(Node)
    even = ContentFilter("data > %0", ["2"])
    stream = rig.me.subscribe(NUMBERS, qos=2, filter=even)
    for value in (3, 1, 2, 4, 0, 1):
        rig.publish(NUMBERS, number(value))
    assert [(await stream.next()).data, (await stream.next()).data] == [3, 4]
    assert (stream.received, stream.dropped, stream.publisher_count) == (2, 0, 1)
    even.set("data < 0")
    rig.publish(NUMBERS, number(9))
    rig.publish(NUMBERS, number(-1))
    assert (await stream.next()).data == -1 and values([stream.latest] if stream.latest else []) == [-1]
    with pytest.raises(InvalidFilter):
        even.set("data <")
    assert even.expression == "data < 0"


async def test_latched_and_expiring_messages_are_filtered_too(rig: Rig) -> None:
    await rig.start(Node)
    topic = Topic(Int32, "latched", qos.LATCHED.replace(depth=5, lifespan=60.0))
    publisher = rig.me.publisher(topic)
    for value in range(5):
        publisher(number(value))
    stream = rig.me.subscribe(
        topic, qos=QoS(depth=5, durability=qos.Durability.TRANSIENT_LOCAL), filter=ContentFilter("data >= 3")
    )
    assert [(await stream.next()).data, (await stream.next()).data] == [3, 4] and stream.received == 2


async def test_a_field_that_the_messages_lack_is_refused_with_the_subscription(rig: Rig) -> None:
    await rig.start(Node)
    with pytest.raises(InvalidFilter, match="std_msgs/msg/String has no field 'text', which the filter"):
        rig.me.subscribe(WORDS, filter=ContentFilter("text = 'a'"))
    assert "/words" not in rig.system.graph.topics or not rig.system.graph.topics["/words"].subscriptions
    joints = Topic(JointState, "joints")
    assert rig.me.subscribe(joints, filter=ContentFilter("position[5] > 0")).received == 0


class Picky(Node):
    """Takes what is large, in three ways."""

    kept = subscribes(NUMBERS, filter=ContentFilter("data > 2"))

    def __init__(self) -> None:
        self.seen: list[int] = []

    async def on_start(self) -> None:
        self.on(OTHERS, self.note, filter=ContentFilter("data < 0"))

    def note(self, message: Int32) -> None:
        self.seen.append(message.data)

    @NUMBERS.on(filter=ContentFilter("data > 2"))
    def take(self, message: Int32) -> None:
        self.seen.append(message.data)


async def test_handlers_and_declared_streams_are_filtered_as_well_and_still_are_after_a_restart(rig: Rig) -> None:
    await rig.start(Child(Picky))
    for life in range(2):
        for value in (1, 3, 2, 4):
            rig.publish(NUMBERS, number(value))
        rig.publish(OTHERS, number(5))
        rig.publish(OTHERS, number(-5 - life))
        await rig.advance(0.1)
        node = rig.node(Picky)
        assert (sorted(node.seen), node.kept.received) == ([-5 - life, 3, 4], 2)
        assert rig.incarnation(Picky) == life + 1
        rig.crash(Picky)
        await rig.advance(0.1)


async def test_a_latched_message_that_the_filter_rejects_is_not_redelivered_to_the_next_life(rig: Rig) -> None:
    latched = Topic(Int32, "latched", qos.LATCHED.replace(depth=5))
    seen: list[int] = []

    class Late(Node):
        @latched.on(filter=ContentFilter("data >= 3"))
        def take(self, message: Int32) -> None:
            seen.append(message.data)

    await rig.start(Child(Late))
    publisher = rig.me.publisher(latched)
    for value in range(5):
        publisher(number(value))
    await rig.advance(0.1)
    rig.crash(Late)
    await rig.advance(0.1)
    assert seen == [3, 4, 3, 4]


async def test_what_is_no_filter_and_no_patience_is_refused_wherever_it_is_given(rig: Rig) -> None:
    await rig.start(Node)
    wrong: Any = "data > 2"
    for refused in (
        lambda: NUMBERS.on(filter=wrong),
        lambda: subscribes(NUMBERS, filter=wrong),
        lambda: rig.me.subscribe(NUMBERS, filter=wrong),
        lambda: rig.me.on(NUMBERS, print, filter=wrong),
    ):
        with pytest.raises(DeclarationError, match=r"filter='data > 2'\): give a ContentFilter\(expression\)"):
            refused()
    with pytest.raises(DeclarationError, match=r"/rig.on\(patience='1'\): give a number of seconds of at least 0"):
        rig.me.on(NUMBERS, print, patience=cast("Any", "1"))
    with pytest.raises(DeclarationError, match="concurrent=-1 must be 0"):
        rig.me.on(NUMBERS, print, concurrent=-1)


async def test_a_handler_and_a_server_that_are_given_while_the_node_runs_may_be_concurrent(rig: Rig) -> None:
    await rig.start(Node)
    begun: list[int] = []

    async def slowly(message: Int32) -> None:
        begun.append(message.data)
        await rig.me.clock.sleep(1.0)

    async def add(request: AddTwoInts.Request) -> AddTwoInts.Response:
        await rig.me.clock.sleep(1.0)
        return AddTwoInts.Response(sum=request.a + request.b)

    rig.me.on(NUMBERS, slowly, concurrent=2)
    adding = Service(AddTwoInts, "add")
    rig.me.serve(adding, add, concurrent=2)
    for value in range(3):
        rig.publish(NUMBERS, number(value))
    asked = [asyncio.create_task(rig.call(adding, AddTwoInts.Request(a=1, b=n), timeout=5.0)) for n in range(2)]
    await rig.advance(0.5)
    assert begun == [0, 1]
    await rig.advance(1.0)
    assert begun == [0, 1, 2]
    assert [(await one).sum for one in asked] == [1, 2]
