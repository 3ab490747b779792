"""What survives a crash, what does not, and who hears of it."""

from __future__ import annotations

import asyncio
from typing import Any, ClassVar

import pytest

from actors import (
    Backoff,
    Child,
    DynamicSupervisor,
    Intensity,
    Node,
    StartFailed,
    Supervisor,
    SupervisorGaveUp,
    Tick,
    every,
    one_for_all,
    parameter,
    publishes,
    rest_for_one,
    subscribes,
    temporary,
    transient,
)
from actors.errors import NodeRestarting, NotRunning, TickMissed
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int32
from actors.runtime.runtime import KEPT_RESTARTS
from actors.testing import Rig
from tests.facts import lacks
from tests.stage import ADD, NUMBERS, WORDS, events, number, total, two, values, word


def supervisor_of(rig: Rig) -> Any:
    assert rig.system.supervisor is not None
    return rig.system.supervisor


class Odometer(Node):
    """Counts kilometers; remembers them in one of three ways."""

    def __init__(self, way: str = "") -> None:
        self.way = way
        self.kilometers = 0
        self.resumed: list[Any] = []

    def resume(self, state: Any) -> None:
        self.kilometers = state
        self.resumed.append(state)

    def handover(self) -> Any:
        return self.kilometers if self.way == "handover" else None

    @NUMBERS.on()
    async def drive(self, message: Int32) -> None:
        if message.data < 0:
            raise ValueError("backwards")
        self.kilometers += message.data
        if self.way == "checkpoint":
            self.checkpoint(self.kilometers)


async def test_a_node_that_crashes_is_restarted_and_the_others_never_notice(rig: Rig) -> None:
    rig.expect_failure(ValueError)

    class Beacon(Node):
        out = publishes(WORDS)

        @every(hz=10)
        async def shine(self) -> None:
            self.out(word("here"))

    await rig.start(Odometer, Beacon)
    light = rig.probe(WORDS)
    await rig.advance(1.0)
    rig.publish(NUMBERS, number(-1))
    await rig.advance(1.0)
    assert len(light) == 20
    assert (rig.incarnation(Odometer), rig.incarnation(Beacon)) == (2, 1)
    rig.publish(NUMBERS, number(5))
    await rig.quiet()
    assert rig.node(Odometer).kilometers == 5
    (report,) = [report for report in rig.reports if report.context == "child_terminated"]
    assert str(report) == "system: child_terminated: odometer (incarnation 1): it raised ValueError: backwards"
    assert rig.state(Odometer).restarts == [(1.0, "it raised ValueError: backwards")]
    assert rig.state(Odometer).restart_count == 1


async def test_of_many_restarts_the_newest_are_remembered_and_all_are_counted(rig: Rig) -> None:
    await rig.start(Child(Odometer))
    for k in range(KEPT_RESTARTS + 20):
        rig.crash(Odometer, RuntimeError(str(k)))
        await rig.advance(10.0)
    state = rig.state(Odometer)
    assert state.restart_count == KEPT_RESTARTS + 20
    assert len(state.restarts) == KEPT_RESTARTS
    assert state.restarts[0] == (200.0, "it raised RuntimeError: 20")
    assert state.restarts[-1][1] == f"it raised RuntimeError: {KEPT_RESTARTS + 19}"


@pytest.mark.parametrize(("way", "after_crash"), [("", 0), ("handover", 0), ("checkpoint", 7)])
async def test_only_what_was_checkpointed_survives_a_crash(rig: Rig, way: str, after_crash: int) -> None:
    rig.expect_failure(ValueError)
    await rig.start(Child(Odometer, args=(way,)))
    for value in (3, 4, -1):
        rig.publish(NUMBERS, number(value))
    await rig.settled()
    assert rig.node(Odometer).kilometers == after_crash
    assert rig.node(Odometer).resumed == ([7] if way == "checkpoint" else [])


@pytest.mark.parametrize(("way", "after_stop"), [("", 0), ("handover", 7), ("checkpoint", 7)])
async def test_an_orderly_end_hands_over_what_the_node_says(rig: Rig, way: str, after_stop: int) -> None:
    tree = Supervisor("system", strategy=one_for_all, children=[Child(Node, name="head"), Child(Odometer, args=(way,))])
    await rig.start(tree)
    for value in (3, 4):
        rig.publish(NUMBERS, number(value))
    await rig.quiet()
    rig.crash("head")
    await rig.settled()
    assert rig.incarnation(Odometer) == 2
    assert rig.node(Odometer).kilometers == after_stop


async def test_a_handover_comes_before_the_last_checkpoint_and_a_new_kind_of_node_takes_it_up(rig: Rig) -> None:
    class Both(Odometer):
        def handover(self) -> Any:
            return 1000 + self.kilometers

    class Better(Odometer):
        pass

    await rig.start(Child(Both, name="odometer", args=("checkpoint",)))
    rig.publish(NUMBERS, number(5))
    await rig.quiet()
    await supervisor_of(rig).replace("odometer", Better)
    assert rig.node(Better).resumed == [1005]
    rig.publish(NUMBERS, number(1))
    await rig.quiet()
    assert rig.node(Better).kilometers == 1006


async def test_a_resume_that_fails_is_a_failed_start(rig: Rig) -> None:
    rig.expect_failure((ValueError, TypeError, SupervisorGaveUp))

    class Picky(Odometer):
        def resume(self, state: Any) -> None:
            raise TypeError("cannot read this")

    await rig.start(
        Supervisor("system", intensity=Intensity(2, within=5.0), children=[Child(Picky, args=("checkpoint",))])
    )
    for value in (1, -1):
        rig.publish(NUMBERS, number(value))
    with pytest.raises(SupervisorGaveUp, match="TypeError: cannot read this"):
        await rig.system.wait()


async def test_rest_for_one_restarts_those_that_build_on_the_failed_one_and_keeps_their_messages(rig: Rig) -> None:
    class Part(Node):
        seen: ClassVar[list[tuple[str, int, int]]] = []

        @NUMBERS.on()
        async def take(self, message: Int32) -> None:
            await self.clock.sleep(0.1)
            self.seen.append((self.name, self.incarnation, message.data))

    names = ("motor", "gait", "navigation")
    await rig.start(Supervisor("system", strategy=rest_for_one, children=[Child(Part, name=name) for name in names]))
    for value in (1, 2, 3):
        rig.publish(NUMBERS, number(value))
    await rig.advance(0.05)
    rig.crash("gait")
    await rig.settled()
    assert [rig.incarnation(name) for name in names] == [1, 2, 2]
    assert [(life, value) for name, life, value in Part.seen if name == "motor"] == [(1, 1), (1, 2), (1, 3)]
    assert [(life, value) for name, life, value in Part.seen if name == "gait"] == [(1, 1), (2, 2), (2, 3)]
    navigation = [(life, value) for name, life, value in Part.seen if name == "navigation"]
    assert [value for _, value in navigation] == [1, 2, 3]  # each once, in the old life or the new
    assert navigation[-1][0] == 2


async def test_messages_wait_through_a_backoff_up_to_the_depth_of_their_queue(rig: Rig) -> None:
    class Bounded(Node):
        seen: ClassVar[list[int]] = []

        @NUMBERS.on(qos=3)
        async def take(self, message: Int32) -> None:
            self.seen.append(message.data)

    await rig.start(Child(Bounded, backoff=Backoff(2.0, 10.0, jitter=0.0)))
    rig.crash(Bounded)
    await rig.advance(1.0)
    for value in range(5):
        rig.publish(NUMBERS, number(value))
    assert Bounded.seen == []
    await rig.settled()
    assert rig.now == 2.0
    assert Bounded.seen == [2, 3, 4]
    assert rig.system.graph.topic("/numbers").dropped == 2


async def test_a_nested_supervisors_restart_keeps_the_messages_of_its_nodes_too(rig: Rig) -> None:
    rig.expect_failure((ValueError, SupervisorGaveUp))
    group = Supervisor(
        "group", intensity=Intensity(0, within=5.0), children=[Child(Odometer), Child(Node, name="other")]
    )
    await rig.start(Supervisor("system", children=[group]))
    for value in (-1, 3, 4):
        rig.publish(NUMBERS, number(value))
    await rig.settled()
    assert rig.node(Odometer).kilometers == 7
    assert rig.incarnation(Odometer) == 2


async def test_a_group_that_ends_for_good_takes_its_nodes_out_of_the_graph(rig: Rig) -> None:
    class Adder(Node):
        @ADD.serve()
        async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            return total(request.a + request.b)

    group = Supervisor("group", restart=temporary, children=[Child(Adder), Child(Odometer)])
    await rig.start(Supervisor("system", children=[group, Child(Node, name="other")]))
    await rig.call(ADD, two(1, 2))
    await supervisor_of(rig).terminate_child("group")
    assert [rig.state(name).state for name in ("adder", "odometer", "other")] == ["stopped", "stopped", "running"]
    with pytest.raises(NotRunning):
        await rig.call(ADD, two(1, 2))
    assert rig.system.graph.topic("/numbers").subscriptions == []


async def test_a_streams_messages_do_not_survive_but_a_new_one_listens_from_the_next_start_on(rig: Rig) -> None:
    class Watcher(Node):
        numbers = subscribes(NUMBERS)

    await rig.start(Child(Watcher, backoff=Backoff(1.0, 1.0)))
    rig.crash(Watcher)
    await rig.quiet()
    rig.publish(NUMBERS, number(1))
    await rig.settled()
    assert rig.node(Watcher).numbers.latest is None
    rig.publish(NUMBERS, number(2))
    assert rig.node(Watcher).numbers.latest == number(2)


async def test_intensity_ends_the_tree_when_restarts_come_too_often_and_wait_says_so(rig: Rig) -> None:
    rig.expect_failure((ValueError, SupervisorGaveUp))
    tree = Supervisor(
        "system", intensity=Intensity(2, within=5.0), children=[Child(Odometer), Child(Node, name="other")]
    )
    await rig.start(tree)
    waiting = asyncio.create_task(rig.system.wait())
    for _ in range(3):
        rig.publish(NUMBERS, number(-1))
        await rig.advance(0.5)
    with pytest.raises(SupervisorGaveUp, match="odometer needs another restart, and 2 within 5 s are allowed"):
        await waiting
    assert rig.system.exit_code == 3
    assert not rig.system.running
    with pytest.raises(SupervisorGaveUp):
        await rig.system.wait()
    assert len(events(rig.logs, "child terminated")) == 3
    assert [(record.level, record.event) for record in events(rig.logs, "gives up")] == [
        (40, "system gives up: restart intensity reached")
    ]


async def test_a_caller_hears_at_each_stage_what_became_of_its_server(rig: Rig) -> None:
    rig.expect_failure(OSError)

    class Adder(Node):
        @ADD.serve()
        async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            if request.a < 0:
                self.create_task(self.break_down())
            await self.clock.sleep(0.1)
            return total(request.a + request.b)

        async def break_down(self) -> None:
            raise OSError("gears")

    await rig.start(Child(Adder, restart=transient, backoff=Backoff(1.0, 1.0)))
    assert (await rig.call(ADD, two(-1, 2))).sum == 1  # the answer was under way
    await rig.quiet()
    with pytest.raises(NodeRestarting):
        await rig.call(ADD, two(1, 2))
    await rig.settled()
    assert (await rig.call(ADD, two(1, 2))).sum == 3
    rig.node(Adder).stop()
    await rig.settled()
    with pytest.raises(NotRunning):
        await rig.call(ADD, two(1, 2))


# -- timers ----------------------------------------------------------------------------------------------------------


async def test_a_timer_that_faults_ends_its_incarnation_once_not_every_one_that_follows(rig: Rig) -> None:
    rig.expect_failure(TickMissed)

    class Strict(Node):
        ticks: ClassVar[list[tuple[int, int]]] = []

        @every(hz=10, late="fault")
        async def tick(self, tick: Tick) -> None:
            self.ticks.append((self.incarnation, tick.k))
            if len(self.ticks) == 3:
                await self.clock.sleep(0.35)

    await rig.start(Strict)
    await rig.advance(2.0)
    assert rig.incarnation(Strict) == 2
    (report,) = [report for report in rig.reports if report.context == "child_terminated"]
    assert report.reason is not None
    assert isinstance(report.reason.error, TickMissed)  # type: ignore[union-attr]
    assert lacks(str(report.reason.error), "Strict.tick 2 4 250.0 ms") == []  # type: ignore[union-attr]
    assert [k for incarnation, k in Strict.ticks if incarnation == 2] == list(range(1, 14))


async def test_a_timer_keeps_its_record_over_incarnations_and_reads_its_rate_anew(rig: Rig) -> None:
    class Blinker(Node):
        rate = parameter(1.0)

        @every(hz="rate")
        async def blink(self) -> None: ...

    await rig.start(Child(Blinker, parameters={"rate": 10.0}))
    await rig.advance(1.0)
    supervisor = supervisor_of(rig)
    await supervisor.reconfigure(Supervisor("system", children=[Child(Blinker, parameters={"rate": 20.0})]))
    rig.crash(Blinker)
    await rig.settled()
    await rig.advance(1.0)
    record = rig.state(Blinker).timers["blink"]
    assert (record.fired, record.missed, record.hz) == (30, 0, 20.0)
    assert record.seconds(rig.system.loop.time()) == 2.0


# -- changes while running -------------------------------------------------------------------------------------------


async def test_a_child_whose_declaration_changes_its_name_is_known_by_the_new_one_from_its_next_start_on(
    rig: Rig,
) -> None:
    class Named(Node):
        out = publishes(NUMBERS)

    await rig.start(Child(Named, name="one"))
    supervisor = supervisor_of(rig)
    await supervisor.reconfigure(Supervisor("system", children=[Child(Named, name="one", namespace="/there")]))
    assert rig.node(Named).fqn == "/one"
    rig.crash("one")
    await rig.settled()
    assert rig.node(Named).fqn == "/there/one"
    assert rig.system.runtime.directory.find("/one") is None
    probe = rig.probe(NUMBERS, name="/there/numbers")
    rig.node(Named).out(number(1))
    assert values(probe) == [1]
    await supervisor.start_child(Child(Named, name="two", remap={"__node": "one"}))  # the old name is free
    assert rig.system.runtime.directory.find("/one") is not None


async def test_a_second_node_of_a_name_is_refused_and_the_first_is_named(rig: Rig) -> None:
    first, second = Child(Odometer, name="planner"), Child(Odometer, name="other", remap={"__node": "planner"})
    with pytest.raises(
        StartFailed,
        match="system/other would be the second node named /planner, the first being system/planner: give it another name= or namespace=",
    ):
        await rig.start(Supervisor("system", children=[first, second]))


async def test_instances_of_a_template_come_and_go_and_free_their_names(rig: Rig) -> None:
    class Robot(Node):
        def __init__(self, number: int) -> None:
            self.number = number

        @NUMBERS.on()
        async def take(self, message: Int32) -> None:
            if message.data == self.number:
                self.stop("called in")

    await rig.start(DynamicSupervisor("fleet", Child(Robot, restart=transient)))
    fleet = supervisor_of(rig)
    for index in range(3):
        await fleet.spawn(index, name=f"robot_{index}")
    assert len(rig.system.graph.topic("/numbers").subscriptions) == 3
    rig.publish(NUMBERS, number(1))
    await rig.settled()
    assert sorted(state.identity.name for state in rig.system.nodes.values()) == ["rig", "robot_0", "robot_2"]
    assert len(rig.system.graph.topic("/numbers").subscriptions) == 2
    await fleet.spawn(7, name="robot_1")
    assert rig.incarnation("robot_1") == 1  # another one, of the same name
    assert rig.state("robot_1").node.number == 7  # type: ignore[union-attr]


async def test_an_instance_that_does_not_start_frees_its_name(rig: Rig) -> None:
    rig.expect_failure(OSError)

    class Moody(Node):
        def __init__(self, good: bool) -> None:
            if not good:
                raise OSError("no arm")

    await rig.start(DynamicSupervisor("fleet", Child(Moody)))
    with pytest.raises(StartFailed, match="no arm"):
        await supervisor_of(rig).spawn(False, name="arm")
    await supervisor_of(rig).spawn(True, name="other", parameters={})
    await supervisor_of(rig).spawn(True, name="arm")
    assert rig.state("arm").state == "running"
    assert rig.incarnation("arm") == 1


class Clinging(Node):
    """Takes ten seconds to start, and lets nobody interrupt it."""

    async def on_start(self) -> None:
        until = self.clock.now() + 10.0
        while (left := until - self.clock.now()) > 0.0:
            try:
                await self.clock.sleep(left)
            except asyncio.CancelledError:
                pass

    @ADD.serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return total(request.a + request.b)


@pytest.mark.parametrize("again", [False, True])
async def test_a_node_that_was_given_up_is_not_there_when_it_has_started_at_last(rig: Rig, again: bool) -> None:
    await rig.start(Odometer)
    starting = asyncio.ensure_future(supervisor_of(rig).start_child(Child(Clinging, stop=0.5)))
    await rig.advance(1.0)
    await supervisor_of(rig).terminate_child("clinging")
    assert rig.now == 2.5  # half a second for its clean-up, one more after the kill
    with pytest.raises(StartFailed, match="terminated"):
        await starting
    if again:
        starting = asyncio.ensure_future(supervisor_of(rig).restart_child("clinging"))
    await rig.advance(8.0)  # the first one has started, and ends because it was asked to
    assert rig.state("clinging").state == ("starting" if again else "stopped")
    if again:
        await starting
        assert rig.now == 12.5
        assert (await rig.call(ADD, two(1, 2))).sum == 3
    else:
        with pytest.raises(NotRunning):
            await rig.call(ADD, two(1, 2))
