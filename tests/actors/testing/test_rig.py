"""The rig: what a test sees of a system, how it moves time, and what it does not let pass."""

from __future__ import annotations

import asyncio
import re
import threading
from typing import Any, ClassVar

import pytest

import actors.testing
from actors import (
    Child,
    Done,
    GoalRejected,
    GoalStatus,
    Intensity,
    Node,
    Steps,
    Supervisor,
    SupervisorGaveUp,
    Topic,
    every,
    open_node,
    publishes,
    qos,
)
from actors.checks import create
from actors.errors import NotStarted
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int32
from actors.runtime.incarnation import incarnation_of
from actors.supervision.reasons import ExitReason
from actors.testing import Leak, Probe, Rig, UnexpectedFailure, VirtualLoop
from tests.stage import ADD, COUNT, NUMBERS, number, order, result, step, total, two, values


class Counter(Node):
    """Publishes its count ten times a second; echoes, adds and counts on request."""

    out = publishes(NUMBERS)
    count = 0

    @every(hz=10)
    async def tick(self) -> None:
        self.count += 1
        self.out(number(self.count))

    @ADD.serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return total(request.a + request.b)

    @COUNT.serve()
    async def work(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        yield step(1)
        await self.clock.sleep(1.0)
        yield Done(result(1))


# -- starting --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "tree",
    [Counter, Child(Counter), Supervisor("system", children=[Child(Counter)])],
    ids=["class", "child", "tree"],
)
async def test_it_starts_a_class_a_child_or_a_tree(rig: Rig, tree: Any) -> None:
    system = await rig.start(tree)
    assert Rig().lines() == []
    assert rig.system is system
    assert rig.node(Counter).fqn == "/counter"
    assert rig.me.fqn == "/rig"


async def test_it_starts_several_and_runs_one_system_only(rig: Rig) -> None:
    await rig.start(Counter, Child(Counter, name="other", remap={"add": "add_2", "count": "count_2"}), seed=9)
    assert sorted(state.identity.name for state in rig.system.nodes.values()) == ["counter", "other", "rig"]
    assert rig.system.seed == 9
    with pytest.raises(RuntimeError, match="one rig, one system"):
        await rig.start(Counter)


async def test_before_the_start_there_is_nothing_to_see(rig: Rig) -> None:
    for look in (lambda: rig.system, lambda: rig.me, lambda: rig.now, lambda: rig.reports, lambda: rig.probe(NUMBERS)):
        with pytest.raises(NotStarted, match=r"the rig runs no system yet: await rig\.start\(tree\) first"):
            look()
    assert rig.timeline() == "rig: seed=0 t=- s; the last 0 log lines:"


async def test_it_needs_the_virtual_clock() -> None:
    with pytest.raises(RuntimeError, match="a Rig needs the virtual clock: use the `rig` fixture"):
        Rig()


def test_it_needs_the_loop_it_was_made_in() -> None:
    async def make() -> Rig:
        return Rig()

    async def use(rig: Rig) -> None:
        with pytest.raises(RuntimeError, match="this test runs in another event loop than its rig"):
            await rig.start(Counter)

    with asyncio.Runner(loop_factory=VirtualLoop) as one, asyncio.Runner(loop_factory=VirtualLoop) as other:
        other.run(use(one.run(make())))


def test_the_room_hands_out_its_names_late() -> None:
    for name in actors.testing.__all__:
        assert getattr(actors.testing, name).__name__ == name
    with pytest.raises(AttributeError, match="has no attribute 'Nonsense'"):
        actors.testing.Nonsense  # noqa: B018


# -- time ------------------------------------------------------------------------------------------------------------


async def test_advance_moves_time_and_includes_what_is_due_at_its_last_instant(rig: Rig) -> None:
    await rig.start(Counter)
    await rig.advance(0.5)
    assert (rig.now, rig.node(Counter).count) == (0.5, 5)
    await rig.advance(0.0)
    assert rig.now == 0.5


async def test_quiet_lets_everything_happen_that_can_happen_now(rig: Rig) -> None:
    await rig.start(Counter)
    depth: list[int] = []

    async def dig(level: int) -> None:
        depth.append(level)
        if level < 50:
            await asyncio.create_task(dig(level + 1))

    task = asyncio.create_task(dig(0))
    await rig.quiet()
    assert task.done()
    assert depth[-1] == 50
    assert rig.now == 0.0


async def test_until_waits_for_a_condition_and_fails_with_the_timeline(rig: Rig) -> None:
    await rig.start(Counter)
    await rig.until(lambda: rig.node(Counter).count == 3)
    assert rig.now == pytest.approx(0.3)
    await rig.until(lambda: True, within=0.0)
    with pytest.raises(AssertionError, match=r"not true within 2 s \(now t=2\.300 s\)\nrig: seed=0 t=2\.3") as caught:
        await rig.until(lambda: False, within=2.0)
    assert "debug system: started counter child='system/counter'" in str(caught.value)


async def test_settled_waits_until_every_node_runs_or_has_ended_and_nothing_waits(rig: Rig) -> None:
    class Slow(Node):
        seen: ClassVar[list[int]] = []

        @NUMBERS.on()
        async def take(self, message: Int32) -> None:
            await self.clock.sleep(0.5)
            self.seen.append(message.data)

    await rig.start(Slow)
    for value in range(3):
        rig.publish(NUMBERS, number(value))
    await rig.settled()
    assert Slow.seen == [0, 1, 2]
    assert rig.now == pytest.approx(1.5)


# -- talking ---------------------------------------------------------------------------------------------------------


async def test_a_probe_keeps_everything_with_its_times(rig: Rig) -> None:
    await rig.start(Counter)
    probe = rig.probe(NUMBERS, qos=1)
    assert (len(probe), probe.last) == (0, None)
    await rig.advance(20.0)
    assert (len(probe), probe[0], probe.last, probe.received, probe.dropped) == (200, number(1), number(200), 200, 0)
    assert values(probe)[:3] == [1, 2, 3]
    assert probe.times[:3] == pytest.approx([0.1, 0.2, 0.3])
    probe.clear()
    assert (len(probe), probe.times) == (0, [])


async def test_a_probe_of_a_latched_topic_sees_what_was_before_it(rig: Rig) -> None:
    state = Topic(Int32, "state", qos.LATCHED)
    await rig.start(Counter)
    rig.publish(state, number(1))
    rig.publish(state, number(2))
    probe: Probe[Int32] = rig.probe(state)
    assert values(probe) == [2]
    assert values(rig.probe(state, name="/elsewhere")) == []


async def test_what_it_publishes_comes_from_one_publisher_for_each_topic(rig: Rig) -> None:
    await rig.start(Counter)
    probe = rig.probe(NUMBERS)
    for value in (7, 8):
        rig.publish(NUMBERS, number(value))
    assert values(probe) == [7, 8]
    assert [each.entry.name for each in incarnation_of(rig.me).endpoints.publishers] == ["/numbers"]


async def test_it_calls_services_and_starts_goals(rig: Rig) -> None:
    await rig.start(Counter)
    assert (await rig.call(ADD, two(1, 2))).sum == 3
    goal = await rig.send_goal(COUNT, order(1))
    await rig.until(lambda: goal.feedback_count == 1)
    with pytest.raises(GoalRejected):
        await rig.send_goal(COUNT, order(1), timeout=1.0)
    await rig.advance(1.0)
    assert goal.status is GoalStatus.SUCCEEDED


# -- nodes -----------------------------------------------------------------------------------------------------------


async def test_a_node_is_found_by_class_name_or_full_name(rig: Rig) -> None:
    class Base(Node): ...

    class Derived(Base): ...

    await rig.start(Child(Derived, name="one", namespace="/ns"), Counter)
    found = rig.state("one")
    assert rig.state("/ns/one") is rig.state(Derived) is rig.state(Base) is found
    assert isinstance(rig.node(Base), Derived)
    there = re.escape("there are: /counter (Counter), /ns/one (Derived)")
    with pytest.raises(LookupError, match=f"^no node in this system is called 'two'; {there}$"):
        rig.state("two")
    with pytest.raises(
        LookupError, match="3 nodes are a Node: say which one by its full name: /counter, /ns/one, /rig"
    ):
        rig.state(Node)


async def test_a_crash_of_a_node_that_is_not_in_the_tree_says_what_is_there(rig: Rig) -> None:
    class Other(Node): ...

    await rig.start(Counter)
    with pytest.raises(LookupError, match=r"no node in this system is a Other; there are: /counter \(Counter\)$"):
        rig.crash(Other)


async def test_a_crash_is_like_that_of_a_handler(rig: Rig) -> None:
    await rig.start(Counter)
    rig.crash(Counter)
    rig.crash("counter", OSError("cable"))  # the second one is dropped with the first incarnation
    await rig.settled()
    assert rig.incarnation(Counter) == rig.incarnation("counter") == 2
    assert [str(report.reason) for report in rig.reports if report.context == "child_terminated"] == [
        "it raised RuntimeError: crashed by the rig"
    ]


async def test_what_does_not_run_cannot_be_seen_or_crashed(rig: Rig) -> None:
    await rig.start(Child(Counter, restart="temporary"))
    rig.crash(Counter)
    await rig.settled()
    with pytest.raises(NotStarted, match="Counter is not running now"):
        rig.node(Counter)
    with pytest.raises(NotStarted, match="/counter is not running: it cannot crash now"):
        rig.crash(Counter)
    assert rig.incarnation(Counter) == 1


async def test_the_timeline_has_the_newest_events_with_their_times(rig: Rig) -> None:
    class Talkative(Node):
        @every(hz=1)
        def tick(self) -> None:
            self.log.info("tick", at=self.clock.now())

    await rig.start(Talkative, seed=5)
    await rig.advance(50.0)
    lines = rig.timeline(3).splitlines()
    assert lines == [
        "rig: seed=5 t=50.000000 s; the last 3 log lines:",
        "[    48.000] info /talkative: tick at=48.0",
        "[    49.000] info /talkative: tick at=49.0",
        "[    50.000] info /talkative: tick at=50.0",
    ]
    assert len(rig.timeline().splitlines()) == 31


# -- failures ----------------------------------------------------------------------------------------------------------


class Brittle(Node):
    """Fails when it is sent a negative number."""

    @NUMBERS.on()
    async def take(self, message: Int32) -> None:
        if message.data < 0:
            raise ValueError(f"{message.data} is negative")


def brittle(restarts: int = 3) -> Supervisor:
    return Supervisor("system", intensity=Intensity(restarts, within=5.0), children=[Child(Brittle)])


async def test_a_node_that_fails_unexpectedly_fails_the_test_where_time_passes(rig: Rig) -> None:
    await rig.start(Brittle)
    await rig.advance(1.0)
    rig.publish(NUMBERS, number(-1))
    with pytest.raises(UnexpectedFailure) as caught:
        await rig.advance(1.0)
    (first,), (remedy,) = str(caught.value).splitlines(), caught.value.__notes__
    assert first.startswith("system/brittle (incarnation 1) failed at t=1.000 s: ValueError: -1 is negative (at ")
    assert first.endswith("in Brittle.take)")
    assert "rig.expect_failure(ValueError)" in remedy
    assert isinstance(caught.value.__cause__, ValueError)
    await rig.advance(1.0)  # said once


@pytest.mark.virtual
async def test_a_node_that_failed_fails_the_test_at_the_rigs_end_when_no_time_passed() -> None:
    rig = Rig()
    await rig.start(Brittle)
    rig.publish(NUMBERS, number(-1))
    await rig.quiet()
    with pytest.raises(UnexpectedFailure, match=r"system/brittle .incarnation 1. failed at t=0.000 s: ValueError"):
        await rig.close()


@pytest.mark.virtual
async def test_a_system_that_gave_up_fails_the_test_even_after_planned_crashes() -> None:
    rig = Rig()
    await rig.start(brittle(restarts=0))
    rig.crash(Brittle)
    with pytest.raises(UnexpectedFailure, match=r"^supervisor system gave up: brittle has ended") as caught:
        await rig.advance(1.0)
    assert "rig.expect_failure(SupervisorGaveUp)" in caught.value.__notes__[0]
    await rig.close()


@pytest.mark.virtual
async def test_an_end_that_is_not_in_order_fails_the_test() -> None:
    class Clumsy(Node):
        async def on_stop(self, reason: ExitReason) -> None:
            raise OSError("door stuck")

    rig = Rig()
    await rig.start(Clumsy)
    with pytest.raises(
        UnexpectedFailure, match=r"system/clumsy .* did not stop in order at t=0.000 s: OSError: door stuck"
    ):
        await rig.close()


@pytest.mark.virtual
async def test_a_handler_of_the_rigs_own_node_that_fails_fails_the_test() -> None:
    def refuse(message: Int32) -> None:
        raise ValueError("not my number")

    rig = Rig()
    await rig.start(Counter)
    rig.me.on(NUMBERS, refuse)
    with pytest.raises(UnexpectedFailure, match="/rig, a node beside the tree, failed: ValueError: not my number"):
        await rig.advance(0.2)
    await rig.close()


async def test_an_error_of_a_node_beside_the_tree_is_for_who_opened_it(rig: Rig) -> None:
    def refuse(message: Int32) -> None:
        raise ValueError("not my number")

    await rig.start(Counter)
    with pytest.raises(ValueError, match="not my number"):
        async with open_node("listener") as node:
            node.on(NUMBERS, refuse)
            await rig.advance(1.0)


@pytest.mark.virtual
async def test_a_node_that_joined_and_failed_and_that_nobody_asked_fails_the_test() -> None:
    rig = Rig()
    system = await rig.start(Counter)
    await system.join(Child(Brittle))
    rig.publish(NUMBERS, number(-1))
    await rig.advance(1.0)
    with pytest.raises(UnexpectedFailure, match="/brittle, a node beside the tree, failed: ValueError"):
        await rig.close()


async def test_a_failure_that_the_test_expects_is_fine_and_its_error_is_kept(rig: Rig) -> None:
    await rig.start(brittle(restarts=1))
    expected = rig.expect_failure(ValueError, node=Brittle, match="^-1 is")
    rig.publish(NUMBERS, number(-1))
    await rig.settled()
    assert [str(error) for error in expected.errors] == ["-1 is negative"]
    with rig.expect_failure((ValueError, SupervisorGaveUp)) as end:
        rig.publish(NUMBERS, number(-2))
        await rig.advance(1.0)
    assert [type(error) for error in end.errors] == [ValueError, SupervisorGaveUp]


@pytest.mark.parametrize(
    "other", [{"error": OSError}, {"node": Counter}, {"node": "counter"}, {"match": "positive"}], ids=str
)
@pytest.mark.virtual
async def test_another_failure_than_the_expected_one_fails_the_test(other: dict[str, Any]) -> None:
    rig = Rig()
    await rig.start(Brittle, Counter)
    with pytest.raises(UnexpectedFailure, match="-1 is negative"):
        with rig.expect_failure(**other):
            rig.publish(NUMBERS, number(-1))
            await rig.quiet()
    await rig.close()


@pytest.mark.virtual
async def test_an_expected_failure_that_does_not_come_fails_the_test() -> None:
    rig = Rig()
    await rig.start(Brittle)
    sentence = r"expected a failure \(ValueError matching 'neg' of Brittle\), but none had come by the end of "
    with pytest.raises(AssertionError, match=f"{sentence}its block"):
        with rig.expect_failure(ValueError, node=Brittle, match="neg"):
            await rig.advance(1.0)
    rig.expect_failure(ValueError, node=Brittle, match="neg")
    with pytest.raises(AssertionError, match=f"{sentence}the test"):
        await rig.close()


@pytest.mark.virtual
async def test_after_the_block_a_failure_is_unexpected_again() -> None:
    rig = Rig()
    await rig.start(Brittle)
    with rig.expect_failure():
        rig.publish(NUMBERS, number(-1))
        await rig.advance(1.0)
    rig.publish(NUMBERS, number(-2))
    with pytest.raises(UnexpectedFailure, match="-2 is negative"):
        await rig.advance(1.0)
    await rig.close()


class Fatalist(Node):
    """Cancels the task that its handlers run in."""

    @NUMBERS.on()
    async def take(self, message: Int32) -> None:
        task = asyncio.current_task()
        assert task is not None
        task.cancel()
        await self.clock.sleep(1.0)


@pytest.mark.virtual
async def test_a_node_that_is_ended_without_an_error_is_no_failure_with_one() -> None:
    rig = Rig()
    await rig.start(Fatalist)
    with pytest.raises(UnexpectedFailure, match="it was cancelled by somebody other than its supervisor"):
        with rig.expect_failure(ValueError):
            rig.publish(NUMBERS, number(1))
            await rig.settled()
    await rig.close()


@pytest.mark.virtual
async def test_a_failure_without_an_error_is_expected_by_the_words_that_the_report_recommends() -> None:
    rig = Rig()
    await rig.start(Fatalist)
    try:
        with rig.expect_failure(node=Fatalist) as expected:
            rig.publish(NUMBERS, number(1))
            await rig.settled()
        assert expected.errors == []
    finally:
        await rig.close()


@pytest.mark.virtual
async def test_what_a_test_raises_itself_hides_no_error_and_asks_for_no_failure() -> None:
    rig = Rig()
    await rig.start(Brittle)
    with pytest.raises(KeyError, match="the test's own"):
        with rig.expect_failure(ValueError):
            raise KeyError("the test's own")
    await rig.close()


# -- leaks -----------------------------------------------------------------------------------------------------------


@pytest.mark.virtual
async def test_a_task_that_outlives_the_system_is_a_leak() -> None:
    rig = Rig()
    await rig.start(Counter)
    task = asyncio.create_task(asyncio.sleep(1e6), name="forgotten")
    with pytest.raises(Leak, match="left over after the system's end: task forgotten"):
        await rig.close()
    task.cancel()


@pytest.mark.virtual
async def test_a_thread_that_outlives_the_system_is_a_leak() -> None:
    rig = Rig()
    await rig.start(Counter)
    let_go = threading.Event()
    thread = threading.Thread(target=let_go.wait, name="reader")
    thread.start()
    with pytest.raises(Leak, match="left over after the system's end: thread reader"):
        await rig.close()
    let_go.set()
    thread.join()


@pytest.mark.virtual
async def test_the_threads_of_the_loops_pools_are_no_leak() -> None:
    import anyio.to_thread

    rig = Rig()
    await rig.start(Counter)
    assert await asyncio.to_thread(threading.active_count) > 1
    assert await anyio.to_thread.run_sync(threading.active_count) > 1
    await rig.close()


@pytest.mark.virtual
async def test_an_endpoint_that_outlives_the_system_is_a_leak() -> None:
    from actors.topics.publisher import Publisher
    from actors.topics.stream import Stream, StreamSubscription

    rig = Rig()
    await rig.start(Counter)
    entry = rig.system.graph.topic("/numbers")
    queue = StreamSubscription(incarnation_of(rig.me), entry, Int32, qos.DEFAULT)
    publisher = create(Publisher, incarnation_of(rig.me), entry, Int32, qos.DEFAULT)
    entry.add_subscription(queue)
    entry.add_publisher(publisher)
    stream = create(Stream, queue)
    expected = "<publisher of /numbers [Int32] in /rig: 0 sent>; <subscription of /numbers [Int32] in /rig: 0 waiting, 0 dropped>"
    with pytest.raises(Leak, match=re.escape(expected)):
        await rig.close()
    stream.close()
    publisher.close()
    await rig.close()


@pytest.mark.virtual
async def test_a_goal_and_a_node_that_refuse_to_end_are_leaks() -> None:
    let_go = asyncio.Event()

    class Zombie(Node):
        @COUNT.serve()
        async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
            while not let_go.is_set():
                try:
                    await let_go.wait()
                except asyncio.CancelledError:
                    pass
            yield Done(result())

    rig = Rig()
    await rig.start(Child(Zombie, stop=1.0))
    goal = await rig.send_goal(COUNT, order(1))
    await rig.quiet()
    with pytest.raises(Leak, match=r"task /zombie Zombie\.count"):
        await rig.close()
    assert goal.status is GoalStatus.ABORTED
    let_go.set()
    await rig.quiet()
    await rig.close()


@pytest.mark.virtual
async def test_closing_a_rig_that_never_started_is_fine() -> None:
    await Rig().close()


async def test_a_node_is_found_by_class_name_or_full_name_again(rig: Rig) -> None:
    await rig.start(Child(Node, name="left", namespace="/r1"), Child(Node, name="right", namespace="/r2"))
    right = rig.node("/r2/right")
    assert right.fqn == "/r2/right"
    assert rig.node("right") is right
    assert rig.state("right").running is incarnation_of(right)
    assert rig.incarnation("/r2/right") == 1
    with pytest.raises(LookupError, match="no node in this system is called 'middle'"):
        rig.node("middle")
    rig.crash("right")
    await rig.settled()
    assert rig.incarnation("right") == 2
    assert rig.node("right") is not right
    rig.node("left").stop()
    await rig.settled()


async def test_a_goal_that_the_rig_has_sent_may_be_entered(rig: Rig) -> None:
    await rig.start(Counter)
    goal = await rig.send_goal(COUNT, order(50))
    sent = goal.goal_id
    async with goal as entered:
        assert entered is goal and goal.goal_id == sent
        async for _ in goal:
            break
    assert goal.status is GoalStatus.CANCELED
    with pytest.raises(RuntimeError, match="has been sent already"):
        await goal.send()


async def test_the_newest_of_a_probe_is_a_message_or_a_clear_failure(rig: Rig) -> None:
    await rig.start(Node)
    probe = rig.probe(NUMBERS)
    with pytest.raises(AssertionError, match="nothing has come on /numbers since the probe was made"):
        probe.newest  # noqa: B018
    rig.publish(NUMBERS, Int32(data=1))
    rig.publish(NUMBERS, Int32(data=2))
    await rig.advance(0.0)
    assert probe.newest.data == 2 and probe.last == Int32(data=2)
