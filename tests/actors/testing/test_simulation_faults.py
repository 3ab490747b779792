"""Faults as values, how seeds draw them, and what each does to a message on its way."""

from __future__ import annotations

import asyncio
import math
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors import CallTimeout, Node, QoS, Service, Supervisor, Topic, every, publishes
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.geometry_msgs.msg import Twist, Vector3
from actors.interfaces.sensor_msgs.msg import LaserScan
from actors.interfaces.std_msgs.msg import Int32
from actors.interfaces.trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from actors.supervision.child import Child
from actors.testing import Rig
from actors.testing.fault_values import OF_NETWORK
from actors.testing.faults import (
    ALL,
    KINDS,
    ClockJump,
    Crash,
    Delay,
    Fault,
    Freeze,
    Kind,
    Lose,
    NotANumber,
    Possible,
    Profile,
    SlowHandler,
    SlowStart,
    SlowStep,
    draw,
    parse,
)
from actors.testing.simulation.links import has_numbers, not_a_number
from actors.testing.simulation.trial import Outcome, Scenario
from tests.actors.testing.buggy_systems import TICKS, Listener, Source

ADD = Service(AddTwoInts, "add")

faults = st.builds(
    Fault,
    st.sampled_from(get_args(Kind)),
    st.sampled_from(["/scan>/planner", "/planner", "clock", "/a/b_c>/d/e"]),
    st.integers(0, 10**6),
    st.integers(-60_000, 60_000).map(lambda milliseconds: milliseconds / 1000.0),
)

PROFILE = Profile(
    links={"/scan>/planner": 100, "/ticks>/listener": 50, "/silent>/planner": 0},
    numeric={"/scan>/planner"},
    awaits={"/planner": 40, "/arm/listener": 7, "/idle": 0},
    handled={"/planner": 30},
    steps={"/planner>Planner.scan": 30, "/arm/listener>Listener.take": 5, "/arm/listener>work": 9},
    seconds=10.0,
)


@given(st.lists(faults, max_size=5))
def test_faults_are_written_down_and_read_back(written: list[Fault]) -> None:
    assert parse(" ".join(map(str, written))) == tuple(written)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("lose:/scan>/planner#12", "message 12 of /scan to /planner is lost"),
        ("delay:/scan>/planner#12+0.25", "message 12 of /scan to /planner is 0.25 s late"),
        (
            "freeze:/scan>/planner#2+1.5",
            "for 1.5 s the message before message 2 of /scan to /planner arrives again in the place of each",
        ),
        ("kill:/planner#2500", "/planner dies 2.5 s after the start"),
        ("crash:/planner#7", "/planner dies at its await number 7"),
        ("crash:/planner>Planner.scan#7", "/planner dies at step 7 of Planner.scan"),
        ("slow-step:/planner>Planner.scan#7+0.25", "step 7 of Planner.scan in /planner is 0.25 s late"),
        ("clock-jump:clock#1000-60", "the time of day jumps by -60 s, 1 s after the start"),
    ],
)
def test_a_fault_is_said_in_words(text: str, words: str) -> None:
    (fault,) = parse(text)
    assert fault.in_words() == words


@given(faults)
def test_every_kind_of_fault_has_words(fault: Fault) -> None:
    assert fault.target.partition(">")[0] in fault.in_words() or fault.kind == "clock-jump"


@pytest.mark.parametrize("text", ["lose", "lose:/a>/b", "steal:/a>/b#1", "lose:/a>/b#one", "delay:/a>/b#1*2"])
def test_what_is_no_fault_is_named(text: str) -> None:
    with pytest.raises(ValueError, match="is not a fault: write KIND:TARGET#NTH"):
        parse(text)


@given(st.integers(0, 10**6))
def test_a_seed_draws_the_same_faults_every_time_and_only_what_there_is(seed: int) -> None:
    drawn = draw(ALL, seed, PROFILE)
    assert drawn == draw(ALL, seed, PROFILE)
    assert bool(drawn) == bool(seed % 3)
    for fault in drawn:
        if fault.kind in ("lose", "delay", "duplicate", "swap", "freeze", "nan"):
            assert 1 <= fault.nth <= PROFILE.links[fault.target]
        elif fault.kind == "slow-step" or ">" in fault.target:
            assert 1 <= fault.nth <= PROFILE.steps[fault.target]
        elif fault.kind == "crash":
            assert 1 <= fault.nth <= PROFILE.awaits[fault.target]
        elif fault.kind == "slow-handler":
            assert 1 <= fault.nth <= PROFILE.handled[fault.target]
        elif fault.kind in ("kill", "slow-start"):
            assert fault.target in PROFILE.awaits
        if fault.kind == "nan":
            assert fault.target in PROFILE.numeric


def test_every_kind_is_drawn_by_some_seed() -> None:
    hosts = replace(PROFILE, hosts={"robot": True, "desk": True}, router=True, faulty_seconds=10.0)
    drawn = {fault.kind for seed in range(300) for fault in draw(ALL, seed, PROFILE)}
    drawn_on_hosts = {fault.kind for seed in range(300) for fault in draw(ALL, seed, hosts)}
    assert drawn == set(get_args(Kind)) - set(OF_NETWORK), "where there is no network there are no faults of it"
    assert drawn_on_hosts == set(get_args(Kind))
    assert set(KINDS) == set(get_args(Kind)) - {"kill"}


def test_of_two_crashes_many_come_within_one_window_of_restarts() -> None:
    pairs = [drawn for seed in range(300) if len(drawn := draw([Crash(at_most=2)], seed, PROFILE)) == 2]
    assert len(pairs) > 60
    kills = [pair for pair in pairs if all(fault.kind == "kill" for fault in pair)]
    soon = [pair for pair in kills if pair[1].nth - pair[0].nth in range(1, 5001)]
    assert len(soon) > len(pairs) // 3
    assert all(0 <= fault.nth <= 10_000 for pair in kills for fault in pair)
    assert len({pair[0].target for pair in kills} | {pair[1].target for pair in kills}) == 3
    assert max(len(draw([KINDS["crash"]], seed, PROFILE)) for seed in range(300)) == 2, "so many explore draws"
    assert max(len(draw([Crash()], seed, PROFILE)) for seed in range(300)) == 1


def test_nothing_is_drawn_where_nothing_can_go_wrong() -> None:
    assert all(draw(ALL, seed, Profile()) == () for seed in range(100))
    assert draw([], 1, PROFILE) == ()


def test_a_fault_is_confined_to_what_it_names() -> None:
    scan = Topic(LaserScan, "scan")
    planned: list[Possible] = [
        Lose(scan),
        Delay("/ticks"),
        Crash(Listener),
        SlowHandler("planner"),
        SlowStart("/arm/*"),
        SlowStep("/planner"),
    ]
    drawn = [fault for seed in range(200) for fault in draw(planned, seed, PROFILE)]
    assert {(fault.kind, fault.target) for fault in drawn} == {
        ("lose", "/scan>/planner"),
        ("delay", "/ticks>/listener"),
        ("crash", "/arm/listener"),
        ("crash", "/arm/listener>Listener.take"),
        ("crash", "/arm/listener>work"),
        ("kill", "/arm/listener"),
        ("slow-step", "/planner>Planner.scan"),
        ("slow-handler", "/planner"),
        ("slow-start", "/arm/listener"),
    }
    assert all(0.0 < fault.by <= 0.5 for fault in drawn if fault.kind == "delay")
    assert draw([Freeze("/none"), NotANumber("/ticks")], 1, PROFILE) == ()
    jumps = [fault.by for seed in range(200) for fault in draw([ClockJump(up_to=5.0)], seed, PROFILE)]
    assert min(jumps) < 0.0 < max(jumps)


def test_not_a_number_reaches_every_floating_point_field_and_nothing_else() -> None:
    scan = not_a_number(LaserScan(angle_min=1.0, ranges=np.array([1.0, 2.0]), intensities=np.array([])))
    assert math.isnan(scan.angle_min)
    assert np.isnan(scan.ranges).all()
    assert scan.header == LaserScan().header
    points = JointTrajectory(joint_names=("hip",), points=(JointTrajectoryPoint(positions=np.array([1.0])),))
    assert np.isnan(not_a_number(points).points[0].positions).all()
    assert not_a_number(points).joint_names == ("hip",)
    assert has_numbers(points)
    assert has_numbers(Twist())
    assert not has_numbers(Int32())
    assert not_a_number(Int32(data=3)) == Int32(data=3)


class Hearer(Node):
    """Writes down what it hears, and when."""

    heard: list[tuple[float, int]]

    async def on_start(self) -> None:
        Hearer.heard = []

    @TICKS.on()
    def take(self, message: Int32) -> None:
        Hearer.heard.append((round(self.clock.now(), 6), message.data))


def play(*texts: str, seconds: float = 1.0) -> tuple[list[tuple[float, int]], Outcome]:
    """Run a source and a hearer for a second with some faults: what was heard."""

    async def body(rig: Rig) -> None:
        await rig.start(Source, Hearer)
        await rig.advance(seconds)

    outcome = Scenario(body).run(0, shuffled=False, faults=parse(" ".join(texts)))
    assert outcome.error is None, outcome.error
    return list(Hearer.heard), outcome


WAY = "/ticks>/hearer"


def numbers(*texts: str) -> list[int]:
    return [number for _, number in play(*texts)[0]]


def test_without_faults_everything_arrives_and_is_counted() -> None:
    heard, outcome = play()
    assert heard == [(k / 10, k) for k in range(1, 11)]
    assert outcome.profile.links[WAY] == 10
    assert outcome.profile.handled == {"/source": 10, "/hearer": 10}
    assert set(outcome.profile.awaits) == {"/source", "/hearer"}
    assert outcome.profile.seconds == 1.0


def test_a_lost_message_does_not_arrive() -> None:
    assert numbers(f"lose:{WAY}#3") == [1, 2, 4, 5, 6, 7, 8, 9, 10]


def test_a_duplicated_message_arrives_twice() -> None:
    assert numbers(f"duplicate:{WAY}#3") == [1, 2, 3, 3, 4, 5, 6, 7, 8, 9, 10]


def test_a_swapped_message_arrives_after_its_successor() -> None:
    assert numbers(f"swap:{WAY}#3") == [1, 2, 4, 3, 5, 6, 7, 8, 9, 10]


def test_a_delayed_message_arrives_late_and_is_overtaken() -> None:
    heard, _ = play(f"delay:{WAY}#3+0.25")
    assert heard[2:6] == [(0.4, 4), (0.5, 5), (0.55, 3), (0.6, 6)]


def test_a_delayed_message_does_not_reach_a_subscription_that_has_left() -> None:
    async def body(rig: Rig) -> None:
        await rig.start(Source)
        stream = rig.me.subscribe(TICKS)
        await rig.advance(0.15)
        stream.close()
        await rig.advance(1.0)
        assert stream.received == 0

    assert Scenario(body).run(0, faults=parse("delay:/ticks>/rig#1+0.25")).error is None


def test_a_frozen_sensor_repeats_itself() -> None:
    assert numbers(f"freeze:{WAY}#4+0.25") == [1, 2, 3, 3, 3, 3, 7, 8, 9, 10]
    assert numbers(f"freeze:{WAY}#1+0.25") == list(range(1, 11)), "there was nothing to repeat yet"


def test_a_slow_handler_holds_up_those_behind_it() -> None:
    heard, _ = play("slow-handler:/hearer#3+0.25")
    assert heard[2:5] == [(0.55, 3), (0.55, 4), (0.55, 5)]


def test_what_the_test_itself_begins_is_no_part_of_the_tree_and_meets_no_fault() -> None:
    done: list[float] = []

    async def body(rig: Rig) -> None:
        await rig.start(Source, Hearer)

        async def wait() -> None:
            await rig.me.clock.sleep(0.1)
            done.append(rig.now)

        await rig.me.create_task(wait())

    assert Scenario(body).run(0, faults=parse("crash:/hearer#9")).error is None
    assert done == [0.1]


def test_a_slow_async_handler_is_awaited() -> None:
    done: list[float] = []

    class Slow(Node):
        @TICKS.on()
        async def take(self, message: Int32) -> None:
            await self.clock.sleep(0.01)
            done.append(round(self.clock.now(), 6))

    async def body(rig: Rig) -> None:
        await rig.start(Source, Slow)
        await rig.advance(0.28)

    assert Scenario(body).run(0, faults=parse("slow-handler:/slow#2+0.05")).error is None
    assert done == [0.11, 0.26]


def test_a_node_that_is_stopped_before_its_slow_start_has_begun_leaves_nothing() -> None:
    ended: list[str] = []

    class Late(Hearer):
        async def on_start(self) -> None:
            ended.append("started")

    async def body(rig: Rig) -> None:
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.2):
                await rig.start(Source, Late)
        ended.append(f"{asyncio.get_running_loop().time():g}")

    assert Scenario(body).run(0, faults=parse("slow-start:/late#1+5")).error is None
    assert ended == ["0.2"]


def test_a_slow_start_holds_up_the_first_life_or_a_later_one() -> None:
    async def body(rig: Rig) -> None:
        await rig.start(Source, Hearer)
        assert rig.now == 0.5
        rig.crash(Hearer)
        await rig.advance(0.25)
        assert rig.state(Hearer).state != "running"
        await rig.advance(0.25)
        assert rig.state(Hearer).state == "running"

    assert Scenario(body).run(0, faults=parse("slow-start:/hearer#1+0.5 slow-start:/hearer#2+0.4")).error is None


def test_a_crash_hits_a_node_at_its_await_without_a_clean_up() -> None:
    story: list[str] = []

    class Doomed(Node):
        @TICKS.on()
        async def take(self, message: Int32) -> None:
            try:
                story.append(f"begin {message.data}")
                await self.clock.sleep(0.01)
                story.append(f"end {message.data}")
            except Exception:
                story.append("caught")  # a death is not an error that could be caught

        async def on_stop(self, reason: object) -> None:
            story.append("stopped")

    async def body(rig: Rig) -> None:
        await rig.start(Source, Doomed)
        await rig.advance(0.35)
        assert rig.incarnation(Doomed) == 2

    assert Scenario(body).run(0, shuffled=False, faults=parse("crash:/doomed#4")).error is None
    assert story == ["begin 1", "end 1", "begin 2", "begin 3", "end 3", "stopped"]


def test_a_kill_ends_a_node_between_two_handlers_and_a_dead_one_stays_as_it_is() -> None:
    async def body(rig: Rig) -> None:
        await rig.start(Supervisor("s", children=[Child(Hearer, restart="temporary"), Child(Source)]))
        await rig.advance(0.5)
        assert rig.state(Hearer).state == "stopped"
        assert rig.incarnation(Source) == 1

    assert Scenario(body).run(0, faults=parse("kill:/hearer#250 kill:/hearer#300")).error is None


def test_a_clock_jump_moves_the_time_of_day_and_nothing_else() -> None:
    async def body(rig: Rig) -> None:
        system = await rig.start(Source)
        await rig.advance(1.0)
        assert system.clock.now() == 1.0
        assert system.clock.wall() == pytest.approx(-4.0)

    assert Scenario(body).run(0, faults=parse("clock-jump:clock#500-5")).error is None


class Twister(Node):
    out = publishes(Topic(Twist, "twist"))

    async def on_start(self) -> None:
        self.out(Twist())


def test_not_a_number_is_delivered_where_there_are_numbers() -> None:
    async def body(rig: Rig) -> None:
        await rig.start(Source)
        probe = rig.probe(Topic(Twist, "twist"))
        rig.publish(Topic(Twist, "twist"), Twist())
        assert probe.last is not None
        assert math.isnan(probe.last.linear.x)

    outcome = Scenario(body).run(0, faults=parse("nan:/twist>/rig#1"))
    assert outcome.error is None
    assert outcome.profile.numeric == {"/twist>/rig"}


def test_a_message_spoiled_by_not_a_number_expires_when_it_would_have_without_the_fault() -> None:
    turns = Topic(Twist, "turns", QoS(depth=10, lifespan=0.5))
    heard: list[tuple[float, float]] = []

    class Turner(Node):
        @turns.on()
        async def take(self, message: Twist) -> None:
            heard.append((self.clock.now(), message.linear.x))
            await self.clock.sleep(1.0)

    async def body(rig: Rig) -> None:
        await rig.start(Turner)
        rig.publish(turns, twist(1.0))
        rig.publish(turns, twist(2.0))  # has expired when the first one has been handled
        await rig.advance(0.6)
        rig.publish(turns, twist(3.0))  # has not
        await rig.advance(2.0)

    def twist(x: float) -> Twist:
        return Twist(linear=Vector3(x=x))

    assert Scenario(body).run(0, faults=parse("nan:/turns>/turner#2 nan:/turns>/turner#3")).error is None
    assert heard == [(0.0, 1.0), (1.0, pytest.approx(math.nan, nan_ok=True))]


def test_a_slow_service_answers_when_its_caller_has_given_up() -> None:
    served: list[int] = []
    late: list[str] = []

    class Adder(Node):
        @ADD.serve()
        async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            served.append(request.a)
            return AddTwoInts.Response(sum=request.a)

    async def body(rig: Rig) -> None:
        await rig.start(Adder)
        for number in range(3):
            try:
                await rig.call(ADD, AddTwoInts.Request(a=number))
            except CallTimeout as error:
                late.append(str(error))
        await rig.advance(1.0)

    outcome = Scenario(body).run(0, faults=parse("slow-handler:/adder#2+1.5"))
    assert outcome.error is None
    assert outcome.profile.handled == {"/adder": 3}
    assert served == [0, 1, 2]
    assert len(late) == 1, "the one behind it has waited for half a second"


def test_a_frozen_message_that_is_answered_at_once_lets_time_pass() -> None:
    hops = Topic(Int32, "hops")
    heard: list[int] = []

    class Relay(Node):
        hop = publishes(hops)

        @every(hz=10)
        def first(self) -> None:
            self.hop(Int32(data=1))

        @hops.on()
        async def take(self, message: Int32) -> None:
            heard.append(message.data)
            if message.data < 3:
                self.hop(Int32(data=message.data + 1))

    async def body(rig: Rig) -> None:
        await rig.start(Relay)
        await rig.advance(1.0)

    outcome = Scenario(body).run(0, shuffled=False, faults=parse("freeze:/hops>/relay#5+0.15"))
    assert outcome.error is None
    assert 100 < len(heard) < 300
    assert heard[-3:] == [1, 2, 3]


def test_the_slow_may_be_slower_than_a_call_waits() -> None:
    late = [fault.by for seed in range(300) for fault in draw(ALL, seed, PROFILE) if fault.kind.startswith("slow-")]
    assert sum(seconds > 1.0 for seconds in late) > len(late) / 5
