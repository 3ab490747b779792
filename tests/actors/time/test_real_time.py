"""One story of each family on the real clock: what the virtual clock shows to be right also holds where time really passes.

Nothing here asserts how quick the machine is. What is waited for is a condition; only the limit that ends a hanging test is a time.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Coroutine
from functools import wraps
from typing import Any

import pytest

from actors import (
    CallTimeout,
    Child,
    Done,
    GoalCanceled,
    GoalStatus,
    LifecycleNode,
    Node,
    Parameter,
    Service,
    ServiceFailed,
    Steps,
    Supervisor,
    System,
    Tick,
    Topic,
    every,
    execute,
    open_node,
    parameter,
    publishes,
    qos,
    run,
)
from actors.errors import NodeRestarting
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.rcl_interfaces import srv
from actors.interfaces.rcl_interfaces.msg import ParameterEvent
from actors.interfaces.std_msgs.msg import Int32
from actors.lifecycle import LifecycleState, bring_up
from actors.nodes.clock_publisher import ClockPublisher
from actors.parameters.messages import to_parameter
from actors.runtime.incarnation import incarnation_of
from tests.stage import ADD, COUNT, NUMBERS, number, order, result, step, total, two, values

pytestmark = pytest.mark.realtime

PATIENCE = 60.0
"""Seconds after which a story that hangs is ended."""


def story(test: Callable[[], Coroutine[Any, Any, None]]) -> Callable[[], None]:
    """A test on the real clock, in the event loop of `python -m robot`."""

    async def bounded() -> None:
        async with asyncio.timeout(PATIENCE):
            await test()

    @wraps(test)
    def run_it() -> None:
        execute(bounded)

    return run_it


def quiet(*children: Child) -> Any:
    return run(Supervisor("lab", children=list(children)), sinks=(), signals=False)


def living(system: System, name: str) -> Any:
    """The living object of a node."""
    core = system.runtime.directory.find(f"/{name}")
    assert core is not None
    return core.node


class Counting(Node):
    """Publishes 1, 2, 3, ... a hundred times a second, and latches the newest on `newest`."""

    newest = publishes(Topic(Int32, "newest", qos.LATCHED))
    numbers = publishes(NUMBERS)
    count = 0

    @every(hz=100)
    async def tick(self) -> None:
        self.count += 1
        self.numbers(number(self.count))
        self.newest(number(self.count))


@story
async def test_topics_messages_come_in_order_and_late_joiners_get_the_latched_one() -> None:
    async with quiet(Child(Counting)) as system, open_node("listener") as me:
        stream = me.subscribe(NUMBERS)
        seen = [await stream.next(timeout=PATIENCE) for _ in range(20)]
        first = seen[0].data
        assert values(seen) == list(range(first, first + 20))
        counting = living(system, "counting")
        counted = counting.count
        late = await me.subscribe(Topic(Int32, "newest", qos.LATCHED)).next(timeout=PATIENCE)
        assert counted <= late.data <= counting.count
        assert stream.dropped == 0


class Adder(Node):
    """Adds; never answers for zeros; cannot add negative numbers."""

    @ADD.serve(concurrent=8)
    async def add(self, request: Any) -> Any:
        if request.a < 0:
            raise ValueError("only natural numbers")
        if request.a == request.b == 0:
            await asyncio.Event().wait()
        return total(request.a + request.b)


@story
async def test_services_every_call_ends_in_an_answer_or_an_error() -> None:
    async with quiet(Child(Adder)), open_node("client") as me:
        answers = await asyncio.gather(*(me.call(ADD, two(n, 1), timeout=PATIENCE) for n in range(100)))
        assert [answer.sum for answer in answers] == list(range(1, 101))
        with pytest.raises(ServiceFailed, match="only natural numbers"):
            await me.call(ADD, two(-1, 1), timeout=PATIENCE)
        begun = time.monotonic()
        with pytest.raises(CallTimeout):
            await me.call(ADD, two(0, 0), timeout=0.1)
        assert time.monotonic() - begun >= 0.099


class Counter(Node):
    """Counts, a hundredth of a second for each number; says how far it came when it is canceled."""

    @COUNT.serve(arrivals="parallel")
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        done: list[int] = []
        try:
            for n in range(goal.order):
                await self.clock.sleep(0.01)
                done.append(n)
                yield Fibonacci.Feedback(sequence=done)
        except asyncio.CancelledError:
            yield Done(result(*done))
            raise
        yield Done(result(*done))


@story
async def test_actions_feedback_result_and_cancel() -> None:
    async with quiet(Child(Counter)), open_node("client") as me:
        endless = me.send_goal(COUNT, order(1_000_000), timeout=PATIENCE)
        short = me.send_goal(COUNT, order(3), timeout=PATIENCE)
        async with endless, short:
            assert [feedback async for feedback in short] == [step(0), step(0, 1), step(0, 1, 2)]
            assert await short == result(0, 1, 2)
            async for feedback in endless:
                if len(feedback.sequence) >= 3:
                    break
            assert await endless.cancel()
            with pytest.raises(GoalCanceled) as canceled:
                await endless
            partial = canceled.value.result
            assert isinstance(partial, Fibonacci.Result)
            assert len(partial.sequence) >= 3
        assert (short.status, endless.status) == (GoalStatus.SUCCEEDED, GoalStatus.CANCELED)


class Mover(Node):
    speed = parameter(0.5, ge=0.0, le=2.0)


@story
async def test_parameters_are_set_by_services_within_their_bounds_and_every_change_is_told() -> None:
    setting = Service(srv.SetParameters, "/mover/set_parameters")
    async with quiet(Child(Mover)) as system, open_node("tool") as me:
        changes = me.subscribe(Topic(ParameterEvent, "/parameter_events", qos.PARAMETER_EVENTS))

        async def set_speed(value: float) -> bool:
            request = srv.SetParameters.Request(parameters=[to_parameter(Parameter("speed", value))])
            return (await me.call(setting, request, timeout=PATIENCE)).results[0].successful

        assert await set_speed(1.5)
        assert not await set_speed(9.0)
        assert living(system, "mover").speed == 1.5
        while (change := await changes.next(timeout=PATIENCE)).node != "/mover":
            pass
        assert [(one.name, one.value.double_value) for one in change.changed_parameters] == [("speed", 1.5)]


class Metronome(Node):
    """Keeps the ticks of a timer at 200 Hz; a hundred are enough."""

    def __init__(self) -> None:
        self.ticks: list[Tick] = []
        self.enough = asyncio.Event()

    @every(hz=200)
    async def tick(self, tick: Tick) -> None:
        self.ticks.append(tick)
        if len(self.ticks) == 100:
            self.enough.set()


@story
async def test_timers_at_200_Hz_are_on_their_grid_never_early_and_every_tick_is_accounted_for() -> None:
    begun = time.monotonic()
    async with quiet(Child(Metronome)) as system:
        metronome = living(system, "metronome")
        await metronome.enough.wait()
        (record,) = incarnation_of(metronome).record.timers.values()
        fired, missed, last = record.fired, record.missed, metronome.ticks[-1]
        lasted = time.monotonic() - begun
    assert fired >= 100
    assert fired <= last.k <= fired + missed  # every tick is delivered or counted as missed
    start = metronome.ticks[0].due - metronome.ticks[0].k / 200.0
    assert all(tick.due == pytest.approx(start + tick.k / 200.0, abs=1e-6) for tick in metronome.ticks)
    assert all(tick.late > -1e-3 for tick in metronome.ticks)
    assert [tick.k for tick in metronome.ticks] == sorted({tick.k for tick in metronome.ticks})
    assert lasted >= last.k / 200.0 - 1e-3


class Frail(Node):
    """Fails at the number 3; tells on `lives` which life it is in."""

    lives = publishes(Topic(Int32, "lives", qos.LATCHED))

    async def on_start(self) -> None:
        self.lives(number(self.incarnation))

    @NUMBERS.on()
    async def take(self, message: Int32) -> None:
        if message.data == 3:
            raise OSError("the cable came off")

    @ADD.serve()
    async def add(self, request: Any) -> Any:
        return total(request.a + request.b)


@story
async def test_restarts_the_supervisor_brings_a_failed_node_back() -> None:
    async with quiet(Child(Frail), Child(Adder, name="other", remap={"add": "other/add"})) as system:
        async with open_node("witness") as me:
            lives = me.subscribe(Topic(Int32, "lives", qos.LATCHED))
            assert (await lives.next(timeout=PATIENCE)).data == 1
            talk = me.publisher(NUMBERS)
            for n in (1, 2, 3):
                talk(number(n))
            assert (await lives.next(timeout=PATIENCE)).data == 2
            while True:
                try:
                    answer = await me.call(ADD, two(20, 22), timeout=PATIENCE)
                    break
                except NodeRestarting:
                    await asyncio.sleep(0)
            assert answer.sum == 42
        (report,) = [report for report in system.reports if report.context == "child_terminated"]
        assert report.child.path == ("lab", "frail")
        assert "the cable came off" in str(report.reason)
        assert living(system, "other").incarnation == 1


class Camera(LifecycleNode):
    """Publishes frames while it is active."""

    frames = publishes(NUMBERS)
    count = 0

    @every(hz=100)
    async def frame(self) -> None:
        self.count += 1
        self.frames(number(self.count))


@story
async def test_lifecycle_a_node_ticks_and_publishes_only_while_it_is_active() -> None:
    async with quiet(Child(Camera)) as system, open_node("viewer") as me:
        camera, frames = living(system, "camera"), me.subscribe(NUMBERS)
        assert (camera.state, incarnation_of(camera).timers.declared) == (LifecycleState.UNCONFIGURED, ())
        await bring_up(system)
        assert camera.state is LifecycleState.ACTIVE
        for n in range(1, 6):
            assert (await frames.next(timeout=PATIENCE)).data == n
        assert await camera.change_state("deactivate")
        count = camera.count
        camera.frames(number(-1))  # discarded
        assert incarnation_of(camera).timers.declared == ()
        assert await camera.change_state("activate")
        while (frame := await frames.next(timeout=PATIENCE)).data <= count:
            assert frame.data > 0
        assert frame.data == count + 1


class Planner(Node):
    """Ticks fifty times a second of simulated time."""

    def __init__(self) -> None:
        self.ticks: list[Tick] = []
        self.enough = asyncio.Event()

    @every(hz=50)
    async def plan(self, tick: Tick) -> None:
        self.ticks.append(tick)
        if len(self.ticks) == 20:
            self.enough.set()


@story
async def test_simulated_time_a_follower_lives_on_the_clock_that_another_node_publishes() -> None:
    began = time.time()
    planner = Child(Planner, parameters={"use_sim_time": True})
    async with quiet(Child(ClockPublisher, args=(200.0,)), planner) as system:
        node = living(system, "planner")
        await node.enough.wait()
        assert await node.clock.sleep(0.05)
        assert began - 1.0 < node.clock.now() <= time.time() + 1.0
        assert node.clock.stamp().sec == int(node.clock.now())
    assert all(tick.late >= 0.0 for tick in node.ticks)
    assert [tick.k for tick in node.ticks] == sorted({tick.k for tick in node.ticks})
