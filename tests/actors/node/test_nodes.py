"""The life of one node: its handlers never overlap, its hooks come in order, and it ends as it should."""

from __future__ import annotations

import asyncio
from typing import Any, ClassVar

import pytest

from actors import (
    Child,
    DeclarationError,
    Done,
    Node,
    Skip,
    StartFailed,
    Steps,
    Stop,
    Supervisor,
    Tick,
    Topic,
    background,
    every,
    parameter,
    publishes,
    temporary,
    transient,
)
from actors.errors import Ended, NotStarted
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int32
from actors.runtime.incarnation import incarnation_of
from actors.supervision import Failed, Killed, Leaked, Stopped
from actors.supervision.reasons import ExitReason
from actors.testing import Rig
from tests.facts import lacks
from tests.stage import ADD, COUNT, NUMBERS, events, number, order, result, step, total, two


def supervisor_of(rig: Rig) -> Any:
    assert rig.system.supervisor is not None
    return rig.system.supervisor


# -- the actor rule --------------------------------------------------------------------------------------------------


class Exclusive(Node):
    """Notices when two of its handlers overlap."""

    out = publishes(NUMBERS)

    def __init__(self) -> None:
        self.inside = self.most = 0
        self.story: list[str] = []

    async def busy(self, what: str) -> None:
        self.story.append(what)
        self.inside += 1
        self.most = max(self.most, self.inside)
        await self.clock.sleep(0.015)
        self.inside -= 1

    @every(hz=20)
    async def tick(self) -> None:
        await self.busy("tick")

    @NUMBERS.on()
    async def take(self, message: Int32) -> None:
        await self.busy("take")

    @ADD.serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        await self.busy("add")
        return total(request.a + request.b)

    @COUNT.accepts
    async def check(self, goal: Fibonacci.Goal) -> None:
        await self.busy("check")

    @COUNT.serve(arrivals="parallel")
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        yield Done(result())


async def test_handlers_of_one_node_never_overlap_whatever_calls_for_them(rig: Rig) -> None:
    await rig.start(Exclusive)
    for value in range(10):
        rig.publish(NUMBERS, number(value))
    calls = [asyncio.create_task(rig.call(ADD, two(value, 0), timeout=9.0)) for value in range(10)]
    goals = [asyncio.create_task(rig.send_goal(COUNT, order(value))) for value in range(10)]
    await asyncio.wait([*calls, *goals])
    await rig.advance(1.0)
    node = rig.node(Exclusive)
    assert node.most == 1
    assert {name: node.story.count(name) for name in ("take", "add", "check")} == {"take": 10, "add": 10, "check": 10}
    assert node.story.count("tick") > 5


async def test_order_is_the_order_of_arrival_and_control_goes_first(rig: Rig) -> None:
    await rig.start(Exclusive)
    rig.publish(NUMBERS, number(0))
    call = asyncio.create_task(rig.call(ADD, two(1, 2)))
    await asyncio.sleep(0)
    rig.publish(NUMBERS, number(1))
    goal = asyncio.create_task(rig.send_goal(COUNT, order(1)))
    await asyncio.wait([call, goal])
    await rig.advance(0.045)
    assert rig.node(Exclusive).story[:4] == ["take", "check", "add", "take"]


async def test_four_workers_that_increment_ten_thousand_times_each_lose_nothing(rig: Rig) -> None:
    class Register(Node):
        value = 0

        @NUMBERS.on(qos=20_000)
        async def add(self, message: Int32) -> None:
            seen = self.value
            if message.data % 100 == 0:
                await asyncio.sleep(0)
            self.value = seen + 1

        @ADD.serve()
        async def read(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            return total(self.value)

    class Worker(Node):
        out = publishes(NUMBERS)

        async def on_start(self) -> None:
            self.create_task(self.work())

        async def work(self) -> None:
            for value in range(10_000):
                self.out(number(value))
                if value % 500 == 0:
                    await self.clock.sleep(0.01)

    await rig.start(Register, *(Child(Worker, name=f"worker_{index}") for index in range(4)))
    await rig.advance(1.0)
    assert (await rig.call(ADD, two(0, 0))).sum == 40_000


async def test_many_nodes_share_one_loop(rig: Rig) -> None:
    await rig.start(
        *(
            Child(Exclusive, name=f"n{index}", remap={"add": f"add_{index}", "count": f"count_{index}"})
            for index in range(3)
        )
    )
    rig.publish(NUMBERS, number(1))
    await rig.advance(0.01)
    assert [rig.state(f"n{index}").node.story for index in range(3)] == [["take"]] * 3  # type: ignore[union-attr]


async def test_a_node_has_nothing_to_spin(rig: Rig) -> None:
    await rig.start(Exclusive)
    node = rig.node(Exclusive)
    assert not [name for name in dir(node) if "spin" in name]
    assert not hasattr(node, "spin_once") and not hasattr(Node, "spin_once")
    with pytest.raises(AttributeError, match=r"handlers run by themselves; await what you wait for.*spin\(Talker\)"):
        node.spin_once()  # type: ignore[attr-defined]


async def test_a_flood_in_one_node_does_not_starve_the_others(rig: Rig) -> None:
    class Echo(Node):
        """Keeps itself busy without ever waiting."""

        out = publishes(NUMBERS)
        rounds = 0

        async def on_start(self) -> None:
            echoes.append(self)

        @NUMBERS.on()
        async def take(self, message: Int32) -> None:
            self.rounds += 1
            if self.rounds < 2_000:
                self.out(number(self.rounds))

    class Bystander(Node):
        rounds_seen: ClassVar[list[int]] = []

        async def on_start(self) -> None:
            self.create_task(self.watch())

        async def watch(self) -> None:
            while not self.rounds_seen or self.rounds_seen[-1] < 2_000:
                self.rounds_seen.append(echoes[0].rounds)
                await asyncio.sleep(0)

    echoes: list[Echo] = []
    await rig.start(Echo, Bystander)
    rig.publish(NUMBERS, number(0))
    await rig.quiet()
    assert Bystander.rounds_seen[-1] == 2_000
    assert len({count for count in Bystander.rounds_seen if 0 < count < 2_000}) >= 5


async def test_a_handler_that_holds_the_inbox_is_reported_once_with_what_it_awaits_and_a_remedy(rig: Rig) -> None:
    class Holder(Node):
        @NUMBERS.on()
        async def take(self, message: Int32) -> None:
            await self.dawdle()

        async def dawdle(self) -> None:
            await self.clock.sleep(2.0)

    await rig.start(Holder)
    for value in range(4):
        rig.publish(NUMBERS, number(value))
    await rig.advance(20.0)
    (report,) = events(rig.logs, "holds the inbox")
    assert lacks(report.event, "handler inbox 0.5 s") == []
    assert report.time == 0.5
    assert report.node == "/holder"
    assert report.fields["handler"] == "Holder.take"
    assert report.fields["awaits"].endswith("Holder.dawdle")
    assert "test_nodes.py:" in report.fields["awaits"]
    assert report.fields["ticks_lost"] == 0
    assert all(way in report.fields["remedy"] for way in ("concurrent=", "action", "self.offload()"))


async def test_a_timer_that_holds_the_inbox_is_told_what_a_timer_can_do(rig: Rig) -> None:
    class Holder(Node):
        @every(period=5.0)
        async def tick(self) -> None:
            await self.clock.sleep(2.0)

        @NUMBERS.on()
        def take(self, message: Int32) -> None: ...

    await rig.start(Holder)
    await rig.advance(5.1)
    rig.publish(NUMBERS, number(1))
    await rig.advance(2.0)
    (report,) = events(rig.logs, "holds the inbox")
    assert lacks(report.fields["remedy"], "self.create_task() self.offload()") == []


async def test_a_handler_that_outlasts_the_shortest_timer_period_is_reported_with_the_ticks_it_costs(rig: Rig) -> None:
    class Holder(Node):
        ticks = 0

        @every(hz=1)
        async def slow_tick(self) -> None: ...

        @every(hz=50)
        async def fast_tick(self) -> None:
            self.ticks += 1

        @ADD.serve()
        async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            await self.clock.sleep(0.1)
            return total(0)

    await rig.start(Holder)
    await rig.advance(0.001)
    await rig.call(ADD, two(0, 0))
    (report,) = events(rig.logs, "holds the inbox")
    assert lacks(report.event, "handler inbox 0.02 s") == []
    assert report.fields["handler"] == "Holder.add"
    assert report.fields["ticks_lost"] == 1
    await rig.advance(0.899)
    assert rig.node(Holder).ticks == 46  # of 50: four were lost, one came late


async def test_quick_handlers_that_follow_each_other_hold_nothing(rig: Rig) -> None:
    class Busy(Node):
        @NUMBERS.on(qos=100)
        async def take(self, message: Int32) -> None:
            await self.clock.sleep(0.4)

    await rig.start(Busy)
    for value in range(10):
        rig.publish(NUMBERS, number(value))
    await rig.advance(10.0)
    assert events(rig.logs, "holds the inbox") == []


# -- the start -------------------------------------------------------------------------------------------------------


async def test_a_node_is_ready_when_on_start_returns_and_only_then_its_siblings_and_handlers_go_on(rig: Rig) -> None:
    story: list[tuple[float, str]] = []

    class First(Node):
        async def on_start(self) -> None:
            self.on(NUMBERS, self.take)
            story.append((self.clock.now(), "first on_start"))
            await self.clock.sleep(1.0)
            story.append((self.clock.now(), "first ready"))

        @every(hz=2)
        async def tick(self) -> None:
            story.append((self.clock.now(), "first tick"))

        @background
        async def drive(self) -> None:
            story.append((self.clock.now(), "first background"))

        async def take(self, message: Int32) -> None:
            story.append((self.clock.now(), f"first got {message.data}"))

    class Second(Node):
        out = publishes(NUMBERS)

        async def on_start(self) -> None:
            story.append((self.clock.now(), "second on_start"))
            self.out(number(7))

    await rig.start(First, Second)
    await rig.advance(0.75)
    assert story == [
        (0.0, "first on_start"),
        (1.0, "first ready"),
        (1.0, "first background"),
        (1.0, "second on_start"),
        (1.0, "first got 7"),
        (1.5, "first tick"),
    ]


async def test_a_node_knows_who_and_when_it_is(rig: Rig) -> None:
    class Wheel(Node):
        node_name = "left_wheel"

    await rig.start(Child(Wheel, namespace="/base"))
    wheel = rig.node(Wheel)
    assert (wheel.name, wheel.namespace, wheel.fqn, wheel.incarnation) == ("left_wheel", "/base", "/base/left_wheel", 1)
    assert repr(wheel) == "<Wheel /base/left_wheel, incarnation 1>"
    assert repr(incarnation_of(wheel)) == "<incarnation 1 of /base/left_wheel>"
    assert wheel.clock is rig.system.clock


async def test_a_node_without_the_arguments_of_its_class_is_told_where_they_come_from(rig: Rig) -> None:
    class Device(Node):
        def __init__(self, port: str) -> None:
            self.port = int(port) if port else len(None)  # type: ignore[arg-type]

    told = r"missing 1 required positional argument: 'port': a node's arguments come from its place, Child\(Device, args=\(\.\.\.\)\)"
    with pytest.raises(StartFailed, match=told):
        await rig.start(Device)
    with pytest.raises(StartFailed, match=r"TypeError: object of type 'NoneType' has no len\(\)"):  # its own mistake
        await rig.start(Child(Device, args=("",)))


async def test_an_exception_in_on_start_is_a_failed_start_and_on_stop_may_put_things_in_order(rig: Rig) -> None:
    heard: list[ExitReason] = []

    class Broken(Node):
        async def on_start(self) -> None:
            raise OSError("no such device")

        async def on_stop(self, reason: ExitReason) -> None:
            heard.append(reason)

    with pytest.raises(StartFailed, match="broken did not start: it raised OSError: no such device") as caught:
        await rig.start(Node, Broken)
    assert isinstance(caught.value.__cause__, OSError)
    assert len(heard) == 1
    assert isinstance(heard[0], Failed)
    await rig.start(Node)  # nothing of it is left


async def test_a_node_that_never_came_to_on_start_has_no_on_stop(rig: Rig) -> None:
    heard: list[str] = []

    class Two(Node):
        speed = parameter(1.0, le=2.0)

        async def on_start(self) -> None:
            heard.append("on_start")

        async def on_stop(self, reason: ExitReason) -> None:
            heard.append("on_stop")

    with pytest.raises(StartFailed, match="speed"):
        await rig.start(Child(Two, parameters={"speed": 9.0}))
    assert heard == []


async def test_a_factory_that_makes_no_node_is_a_failed_start(rig: Rig) -> None:
    with pytest.raises(StartFailed, match=r"/thing: its factory made list .*, which is not a Node") as caught:
        await rig.start(Child(list, name="thing"))
    assert isinstance(caught.value.__cause__, DeclarationError)


async def test_Skip_in_on_start_declines_and_the_siblings_start_as_usual(rig: Rig) -> None:
    class Optional(Node):
        async def on_start(self) -> None:
            self.create_task(self.clock.sleep(60.0))
            raise Skip("no arm mounted")

        async def on_stop(self, reason: ExitReason) -> None:
            raise AssertionError("there is nothing to stop")

    await rig.start(Optional, Exclusive)
    assert rig.state("optional").state == "stopped"
    assert rig.state(Exclusive).state == "running"


async def test_Skip_after_the_start_is_a_failure_like_any_other(rig: Rig) -> None:
    rig.expect_failure(Skip)
    heard: list[ExitReason] = []

    class Confused(Node):
        @NUMBERS.on()
        async def take(self, message: Int32) -> None:
            raise Skip("too late")

        async def on_stop(self, reason: ExitReason) -> None:
            heard.append(reason)

    await rig.start(Confused)
    rig.publish(NUMBERS, number(1))
    await rig.settled()
    assert rig.incarnation(Confused) == 2
    assert isinstance(heard[0], Failed)


async def test_parameters_come_from_the_tree_and_a_rate_may_be_one(rig: Rig) -> None:
    class Blinker(Node):
        rate = parameter(1.0, unit="Hz", ge=0.1)
        ticks = 0

        @every(hz="rate")
        async def blink(self) -> None:
            self.ticks += 1

    await rig.start(Child(Blinker, parameters={"rate": 8.0}))
    await rig.advance(10.0)
    assert rig.node(Blinker).ticks == 80
    refused = rig.node(Blinker).set_parameter("rate", 0.0)
    assert not refused.successful
    assert "rate" in refused.reason
    assert rig.node(Blinker).set_parameters({"rate": 4.0}).successful
    assert rig.node(Blinker).rate == 4.0


async def test_a_tick_tells_its_number_its_due_time_and_its_lateness(rig: Rig) -> None:
    ticks: list[Tick] = []

    class Clockwork(Node):
        @every(period=0.5)
        async def tick(self, tick: Tick) -> None:
            ticks.append(tick)
            await self.clock.sleep(0.75)

    await rig.start(Clockwork)
    await rig.advance(2.5)
    assert [(tick.k, tick.due, tick.late) for tick in ticks] == [(1, 0.5, 0.0), (2, 1.0, 0.25), (3, 1.5, 0.5)]
    assert repr(ticks[1]) == "Tick(2, due=1.000000, late=0.250000)"


async def test_randomness_depends_on_seed_name_and_incarnation_only(rig: Rig) -> None:
    class Dice(Node):
        rolls: ClassVar[dict[tuple[str, int], float]] = {}

        async def on_start(self) -> None:
            self.rolls[self.fqn, self.incarnation] = self.rng.random()

    await rig.start(Child(Dice, name="a"), Child(Dice, name="b"), seed=3)
    rig.crash("a")
    await rig.settled()
    assert len(set(Dice.rolls.values())) == len(Dice.rolls) == 3
    assert Dice.rolls["/b", 1] == rig.system.runtime.random("/b#1").random()


# -- failures --------------------------------------------------------------------------------------------------------


async def test_on_error_may_say_continue_and_the_node_goes_on(rig: Rig) -> None:
    asked: list[tuple[str, str]] = []

    class Tolerant(Node):
        def __init__(self) -> None:
            self.seen: list[int] = []

        def on_error(self, error: Exception, handler: str) -> Any:
            asked.append((str(error), handler))
            return "continue"

        @NUMBERS.on()
        async def take(self, message: Int32) -> None:
            if message.data < 0:
                raise ValueError("negative")
            self.seen.append(message.data)

        @every(hz=1)
        async def tick(self) -> None:
            raise LookupError("lost")

    await rig.start(Tolerant)
    for value in (1, -1, 2):
        rig.publish(NUMBERS, number(value))
    await rig.advance(1.0)
    assert rig.node(Tolerant).seen == [1, 2]
    assert rig.incarnation(Tolerant) == 1
    assert asked == [("negative", "Tolerant.take"), ("lost", "Tolerant.tick")]


@pytest.mark.parametrize("verdict", [None, "fail"])
async def test_an_exception_in_a_handler_ends_the_incarnation_by_default(rig: Rig, verdict: Any) -> None:
    rig.expect_failure(LookupError)

    class Strict(Node):
        def on_error(self, error: Exception, handler: str) -> Any:
            return verdict

        @every(hz=1)
        def tick(self) -> None:
            raise LookupError("lost")

    await rig.start(Child(Strict, restart=temporary))
    await rig.advance(1.0)
    assert rig.state(Strict).state == "stopped"
    (report,) = [report for report in rig.reports if report.context == "child_terminated"]
    assert isinstance(report.reason, Failed)
    assert str(report.reason) == "it raised LookupError: lost"


async def test_a_handler_that_awaits_something_canceled_is_a_failure_with_its_clean_up(rig: Rig) -> None:
    rig.expect_failure(RuntimeError)
    heard: list[ExitReason] = []

    class Careless(Node):
        @NUMBERS.on()
        async def take(self, message: Int32) -> None:
            task = self.create_task(self.clock.sleep(5.0))
            task.cancel()
            await task

        async def on_stop(self, reason: ExitReason) -> None:
            heard.append(reason)

    await rig.start(Careless)
    rig.publish(NUMBERS, number(1))
    await rig.settled()
    assert rig.incarnation(Careless) == 2
    assert str(heard[0]).startswith("it raised RuntimeError: Careless.take awaited ") and "canceled" in str(heard[0])


async def test_a_background_or_spawned_task_that_fails_ends_the_incarnation(rig: Rig) -> None:
    rig.expect_failure(OSError)

    class Driver(Node):
        @background
        async def read(self) -> None:
            await self.clock.sleep(1.0)
            raise OSError("cable pulled")

    class Spawner(Node):
        async def on_start(self) -> None:
            self.create_task(self.work(), name="worker")

        async def work(self) -> None:
            await self.clock.sleep(1.5)
            raise OSError("disk full")

    await rig.start(Child(Driver, restart=temporary), Child(Spawner, restart=temporary))
    await rig.advance(2.0)
    ended = {report.child.id: str(report.reason) for report in rig.reports if report.context == "child_terminated"}
    assert ended == {"driver": "it raised OSError: cable pulled", "spawner": "it raised OSError: disk full"}


async def test_a_task_failure_waits_for_the_present_handler_and_on_error_may_forgive_it(rig: Rig) -> None:
    class Forgiving(Node):
        forgiven: ClassVar[list[str]] = []

        def on_error(self, error: Exception, handler: str) -> Any:
            self.forgiven.append(handler)
            return "continue"

        async def on_start(self) -> None:
            self.create_task(self.work(), name="worker")

        async def work(self) -> None:
            raise OSError("disk full")

    await rig.start(Forgiving)
    await rig.quiet()
    assert rig.incarnation(Forgiving) == 1
    assert Forgiving.forgiven == ["/forgiving worker"]


async def test_a_task_that_fails_in_its_own_clean_up_does_not_hurt_the_next_incarnation(rig: Rig) -> None:
    class Messy(Node):
        async def on_start(self) -> None:
            if self.incarnation == 1:
                self.create_task(self.work())

        async def work(self) -> None:
            try:
                await self.clock.sleep(60.0)
            finally:
                await self.clock.sleep(1.0)
                raise OSError("cannot tidy up")

    await rig.start(Supervisor("system", children=[Child(Messy, stop="kill")]))
    await supervisor_of(rig).terminate_child("messy")
    await supervisor_of(rig).restart_child("messy")
    await rig.advance(5.0)
    assert rig.incarnation(Messy) == 2
    assert rig.state(Messy).state == "running"
    (line,) = events(rig.logs, "failed after the end of its node")
    assert line.fields["error"] == "OSError: cannot tidy up"


async def test_what_a_node_that_has_not_started_spawns_is_refused(rig: Rig) -> None:
    await rig.start(Node)
    with pytest.raises(NotStarted, match="Exclusive has not been started yet"):
        Exclusive().create_task(rig.me.clock.sleep(1.0))


async def test_what_a_node_that_has_ended_spawns_is_refused(rig: Rig) -> None:
    await rig.start(Exclusive)
    old = rig.node(Exclusive)
    rig.crash(Exclusive)
    await rig.settled()
    work = old.clock.sleep(1.0)
    with pytest.raises(Ended, match="/exclusive, incarnation 1, has ended: ask its successor, if there is one"):
        old.create_task(work)
    with pytest.raises(Ended):
        incarnation_of(old).create_task(old.clock.sleep(1.0))
    with pytest.raises(Ended):
        old.stop()


# -- the end ---------------------------------------------------------------------------------------------------------


class Orderly(Node):
    """Writes down how it ends."""

    story: ClassVar[list[str]] = []
    out = publishes(NUMBERS)

    async def on_start(self) -> None:
        self.story.clear()
        self.create_task(self.work("older"))
        self.create_task(self.work("newer"))

    async def work(self, name: str) -> None:
        try:
            await self.clock.sleep(1e6)
        finally:
            await self.clock.sleep(0.1)
            self.story.append(f"{self.clock.now():.1f} task {name} ended")

    @COUNT.serve()
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        try:
            yield step(1)
            await self.clock.sleep(1e6)
        finally:
            await self.clock.sleep(0.1)
            self.story.append(f"{self.clock.now():.1f} goal ended")

    @NUMBERS.on(concurrent=1)
    async def take(self, message: Int32) -> None:
        try:
            await self.clock.sleep(1e6)
        finally:
            self.story.append(f"{self.clock.now():.1f} handler ended")

    async def on_stop(self, reason: ExitReason) -> None:
        self.out(number(99))
        self.story.append(f"{self.clock.now():.1f} on_stop: {reason}")


ORDER_OF_END = ["1.1 goal ended", "1.1 handler ended", "1.2 task newer ended", "1.3 task older ended"]


async def test_an_orderly_stop_ends_goals_then_tasks_newest_first_then_on_stop_which_may_still_publish(
    rig: Rig,
) -> None:
    await rig.start(Orderly)
    probe = rig.probe(NUMBERS)
    await rig.send_goal(COUNT, order(1))
    rig.publish(NUMBERS, number(1))
    await rig.advance(1.0)
    await supervisor_of(rig).terminate_child("orderly")
    assert Orderly.story == [*ORDER_OF_END, "1.3 on_stop: it stopped: shutdown"]
    assert probe.last == number(99)


async def test_a_failure_cleans_up_in_the_same_order(rig: Rig) -> None:
    await rig.start(Child(Orderly, restart=temporary))
    await rig.send_goal(COUNT, order(1))
    rig.publish(NUMBERS, number(1))
    await rig.advance(1.0)
    rig.crash(Orderly, OSError("bearing seized"))
    await rig.settled()
    assert Orderly.story == [*ORDER_OF_END, "1.3 on_stop: it raised OSError: bearing seized"]


async def test_after_its_end_a_node_is_gone_from_the_graph(rig: Rig) -> None:
    await rig.start(Child(Orderly, restart=temporary))
    await rig.send_goal(COUNT, order(1))
    await supervisor_of(rig).terminate_child("orderly")
    topic = rig.system.graph.topic("/numbers")
    assert (topic.publishers, topic.subscriptions) == ([], [])
    assert repr(topic) == "<topic /numbers: 0 publishers, 0 subscriptions>"
    assert rig.system.graph.action("/count").server is None
    assert rig.system.runtime.directory.find("/orderly") is None


async def test_an_on_stop_that_fails_hides_nothing_and_skips_nothing(rig: Rig) -> None:
    rig.expect_failure(LookupError)

    class Clumsy(Node):
        async def on_stop(self, reason: ExitReason) -> None:
            raise LookupError("lost the key")

    await rig.start(Clumsy)
    rig.crash(Clumsy, OSError("first"))
    await rig.settled()
    (line,) = events(rig.logs, "clean-up failed")
    assert line.fields.pop("at").startswith(f"{__file__}:")
    assert line.fields == {"error": "LookupError: lost the key", "after": "it raised OSError: first"}
    assert line.traceback.endswith("LookupError: lost the key")
    assert rig.state(Clumsy).restarts[0][1] == "it raised OSError: first"
    await supervisor_of(rig).terminate_child("clumsy")
    (report,) = [report for report in rig.reports if report.context == "shutdown_error"]
    assert str(report.reason) == "it raised LookupError: lost the key"


@pytest.mark.parametrize("how", ["self.stop", "raise Stop", "raise Stop in a task"])
async def test_a_node_may_end_itself_in_order_and_a_transient_one_stays_away(rig: Rig, how: str) -> None:
    heard: list[ExitReason] = []

    class Mission(Node):
        def __init__(self) -> None:
            self.seen: list[int] = []

        @NUMBERS.on()
        async def take(self, message: Int32) -> None:
            self.seen.append(message.data)
            if how == "self.stop":
                self.stop("mission accomplished")
                await self.clock.sleep(1.0)
                self.seen.append(-message.data)
            elif how == "raise Stop":
                raise Stop("mission accomplished")
            else:
                self.create_task(self.end())
                await self.clock.sleep(1.0)

        async def end(self) -> None:
            raise Stop("mission accomplished")

        async def on_stop(self, reason: ExitReason) -> None:
            heard.append(reason)

        def on_error(self, error: Exception, handler: str) -> Any:
            raise AssertionError("Stop is no error")

    await rig.start(Child(Mission, restart=transient))
    node = rig.node(Mission)
    rig.publish(NUMBERS, number(1))
    rig.publish(NUMBERS, number(2))
    await rig.settled()
    assert heard == [Stopped("mission accomplished")]
    assert rig.state(Mission).state == "stopped"
    assert node.seen == ([1, -1] if how == "self.stop" else [1])


async def test_a_permanent_node_that_stops_itself_is_started_again(rig: Rig) -> None:
    class Restless(Node):
        @every(hz=1)
        async def tick(self) -> None:
            self.stop("enough for today")

    await rig.start(Restless)
    await rig.advance(1.0)
    assert rig.incarnation(Restless) == 2
    assert rig.state(Restless).restarts == [(1.0, "it stopped: enough for today")]


async def test_a_handler_that_never_ends_is_killed_after_the_stop_timeout(rig: Rig) -> None:
    class Stuck(Node):
        ended: ClassVar[list[float]] = []

        @NUMBERS.on()
        async def take(self, message: Int32) -> None:
            try:
                await self.clock.sleep(1e6)
            finally:
                self.ended.append(self.clock.now())

        async def on_stop(self, reason: ExitReason) -> None:
            raise AssertionError("there is no time for it")

    await rig.start(Child(Stuck, stop=2.0))
    rig.publish(NUMBERS, number(1))
    await rig.quiet()
    await supervisor_of(rig).terminate_child("stuck")
    assert Stuck.ended == [2.0]
    (report,) = [report for report in rig.reports if report.context == "shutdown_error"]
    assert report.reason == Killed(2.0)


async def test_a_node_that_refuses_even_to_be_killed_is_given_up_and_its_place_is_free_for_the_next(rig: Rig) -> None:
    let_go = asyncio.Event()

    class Zombie(Node):
        out = publishes(NUMBERS)
        seen: ClassVar[list[tuple[int, int]]] = []

        @NUMBERS.on()
        async def take(self, message: Int32) -> None:
            self.seen.append((self.incarnation, message.data))
            while message.data == 1 and not let_go.is_set():
                try:
                    await let_go.wait()
                except asyncio.CancelledError:
                    pass

        @ADD.serve()
        async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            return total(self.incarnation)

    await rig.start(Child(Zombie, stop=1.0))
    for value in (1, 2, 3):
        rig.publish(NUMBERS, number(value))
    await rig.quiet()
    old = rig.node(Zombie)
    await supervisor_of(rig).terminate_child("zombie")
    (report,) = [report for report in rig.reports if report.context == "shutdown_error"]
    assert report.reason == Leaked(1.0)
    assert rig.state(Zombie).state == "stopped"
    with pytest.raises(Ended):
        old.out(number(9))
    await supervisor_of(rig).restart_child("zombie")
    assert (await rig.call(ADD, two(0, 0))).sum == 2
    let_go.set()  # the dead hand moves, and finds nothing to hold any more
    await rig.quiet()
    rig.publish(NUMBERS, number(4))
    await rig.quiet()
    assert Zombie.seen == [(1, 1), (2, 4)]
    assert rig.state(Zombie).state == "running"
    assert (await rig.call(ADD, two(0, 0))).sum == 2
    assert not supervisor_of(rig).leaked


async def test_a_zombie_that_is_replaced_by_a_restart_hands_its_waiting_messages_over(rig: Rig) -> None:
    let_go = asyncio.Event()

    class Zombie(Node):
        seen: ClassVar[list[tuple[int, int]]] = []

        @NUMBERS.on()
        async def take(self, message: Int32) -> None:
            self.seen.append((self.incarnation, message.data))
            while message.data == 1 and not let_go.is_set():
                try:
                    await let_go.wait()
                except asyncio.CancelledError:
                    pass

    tree = Supervisor("system", strategy="one_for_all", children=[Child(Node, name="head"), Child(Zombie, stop=1.0)])
    await rig.start(tree)
    for value in (1, 2, 3):
        rig.publish(NUMBERS, number(value))
    await rig.quiet()
    rig.crash("head")
    await rig.advance(5.0)
    assert Zombie.seen == [(1, 1), (2, 2), (2, 3)]
    let_go.set()
    await rig.quiet()
    rig.publish(NUMBERS, number(4))
    await rig.quiet()
    assert Zombie.seen[-1] == (2, 4)


async def test_a_stop_while_on_start_runs_breaks_it_off_and_cleans_up(rig: Rig) -> None:
    story: list[str] = []

    class Slow(Node):
        async def on_start(self) -> None:
            self.create_task(self.work())
            try:
                await self.clock.sleep(60.0)
            finally:
                story.append("on_start broken off")

        async def work(self) -> None:
            try:
                await self.clock.sleep(1e6)
            finally:
                await self.clock.sleep(0.5)
                story.append("task ended")

        async def on_stop(self, reason: ExitReason) -> None:
            story.append(f"on_stop: {reason}")

        def handover(self) -> Any:
            raise AssertionError("it has nothing to hand over")

    await rig.start(Node)
    starting = asyncio.create_task(supervisor_of(rig).start_child(Child(Slow)))
    await rig.advance(1.0)
    await supervisor_of(rig).terminate_child("slow")
    assert rig.now == 1.5
    assert story == ["on_start broken off", "task ended", "on_stop: it stopped: shutdown"]
    with pytest.raises(StartFailed):
        await starting


async def test_a_start_that_swallows_its_stop_is_stopped_when_it_is_through(rig: Rig) -> None:
    class Stubborn(Node):
        ended: ClassVar[list[str]] = []

        async def on_start(self) -> None:
            try:
                await self.clock.sleep(60.0)
            except asyncio.CancelledError:
                await self.clock.sleep(1.0)

        async def on_stop(self, reason: ExitReason) -> None:
            self.ended.append(str(reason))

    await rig.start(Node)
    starting = asyncio.create_task(supervisor_of(rig).start_child(Child(Stubborn)))
    await rig.advance(1.0)
    await supervisor_of(rig).terminate_child("stubborn")
    assert rig.now == 2.0
    assert Stubborn.ended == ["it stopped: shutdown"]
    with pytest.raises(StartFailed):
        await starting


async def test_a_kill_in_the_start_phase_leaves_nothing(rig: Rig) -> None:
    class Slow(Node):
        out = publishes(NUMBERS)

        async def on_start(self) -> None:
            await self.clock.sleep(60.0)

        async def on_stop(self, reason: ExitReason) -> None:
            raise AssertionError("there is no time for it")

    await rig.start(Node)
    starting = asyncio.create_task(supervisor_of(rig).start_child(Child(Slow, stop="kill")))
    await rig.advance(1.0)
    await supervisor_of(rig).terminate_child("slow")
    assert rig.system.graph.topic("/numbers").publishers == []
    with pytest.raises(StartFailed):
        await starting


# -- work elsewhere --------------------------------------------------------------------------------------------------


def square(value: int) -> int:
    return value * value


async def test_offloaded_work_runs_in_order_and_takes_its_declared_time(rig: Rig) -> None:
    class Planner(Node):
        def __init__(self) -> None:
            self.done: list[tuple[float, int]] = []

        @NUMBERS.on(concurrent=3)
        async def plan(self, message: Int32) -> None:
            answer = await self.offload(square, message.data, takes=0.5 * message.data)
            self.done.append((self.clock.now(), answer))

    await rig.start(Planner)
    for value in (3, 1, 2):
        rig.publish(NUMBERS, number(value))
    await rig.advance(5.0)
    assert rig.node(Planner).done == [(0.5, 1), (1.0, 4), (1.5, 9)]


async def test_offloaded_work_that_fails_fails_its_handler(rig: Rig) -> None:
    class Planner(Node):
        @ADD.serve()
        async def plan(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            return total(await self.offload(divmod, request.a, request.b))

    await rig.start(Planner)
    from actors import ServiceFailed

    with pytest.raises(ServiceFailed, match="ZeroDivisionError"):
        await rig.call(ADD, two(1, 0))


# -- a subclass ------------------------------------------------------------------------------------------------------


async def test_a_subclass_inherits_what_its_base_declares(rig: Rig) -> None:
    other = Topic(Int32, "other")

    class Derived(Exclusive):
        copy = publishes(other)

        async def busy(self, what: str) -> None:
            self.copy(number(len(what)))

    await rig.start(Derived)
    probe = rig.probe(other)
    rig.publish(NUMBERS, number(1))
    await rig.call(ADD, two(1, 1))
    assert [message.data for message in probe] == [4, 3]
