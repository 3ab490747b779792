"""Faults in the middle of a handler, of a goal's body and of a task: a step that is late, a death between two awaits."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import pytest

from actors import ActorError, Child, Done, GoalFailed, Node, Service, Steps, Supervisor, background, every
from actors.errors import CallCycle
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.std_msgs.msg import Int32
from actors.interfaces.std_srvs.srv import Trigger
from actors.testing import Rig
from actors.testing.faults import parse
from actors.testing.simulation.invariants import InvariantBroken
from actors.testing.simulation.steps import Watched, target_of
from actors.testing.simulation.trial import Outcome, Scenario
from tests.actors.testing.buggy_systems import TICKS
from tests.stage import COUNT, order

ASK = Service(Trigger, "ask")
FOREIGN = Service(Trigger, "foreign")


class Worker(Node):
    """Works in every way that there is, and writes down when each step came."""

    seen: list[tuple[str, float]] = []

    def note(self, what: str) -> None:
        Worker.seen.append((what, round(self.clock.now(), 3)))

    async def on_start(self) -> None:
        Worker.seen = []
        self.create_task(self.walk("spawned"), name="a walk, with blanks")

    async def walk(self, what: str) -> None:
        for _ in range(3):
            await self.clock.sleep(0.1)
            self.note(what)

    @TICKS.on()
    async def plain(self, message: Int32) -> None:
        await self.walk("plain")

    @TICKS.on(concurrent=2)
    async def beside(self, message: Int32) -> None:
        await self.walk("beside")

    @ASK.serve()
    async def answer(self, request: Trigger.Request) -> Trigger.Response:
        await self.walk("answer")
        return Trigger.Response(success=True)

    @COUNT.serve()
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        await self.walk("count")
        yield Done(Fibonacci.Result())

    @background
    async def hum(self) -> None:
        await self.walk("hum")

    async def on_stop(self, reason: object) -> None:
        self.note("stopped")


def play(*texts: str, order_too: bool = False) -> Outcome:
    """One goal, one message and one request at the first second; what came of them is in `Worker.seen`."""

    async def body(rig: Rig) -> None:
        await rig.start(Supervisor("works", children=[Child(Worker, restart="temporary")]))
        await rig.advance(1.0)
        rig.publish(TICKS, Int32(data=1))
        try:
            async with rig.me.send_goal(COUNT, order(1)) as goal:
                await rig.advance(1.0)
                await rig.call(ASK, Trigger.Request(), timeout=2.0)
                await goal
        except (ActorError, GoalFailed):
            pass
        await rig.advance(2.0)

    return Scenario(body).run(2, shuffled=order_too, faults=parse(" ".join(texts)))


def times(what: str) -> list[float]:
    return [at for name, at in Worker.seen if name == what]


WORKS = {
    "plain": "/worker>Worker.plain",
    "beside": "/worker>Worker.beside",
    "answer": "/worker>Worker.answer",
    "count": "/worker>Worker.count",
    "hum": "/worker>hum",
    "spawned": "/worker>a-walk-with-blanks",
}


def test_every_piece_of_work_is_counted_by_its_name() -> None:
    outcome = play()
    assert outcome.error is None
    assert set(WORKS.values()) <= set(outcome.profile.steps)
    assert outcome.profile.steps["/worker>Worker.plain"] == 3
    assert outcome.profile.steps["/worker>Worker.answer"] == 3
    assert "/rig" not in {work.partition(">")[0] for work in outcome.profile.steps}


@pytest.mark.parametrize("what", WORKS)
def test_a_step_of_each_is_late_and_what_follows_too(what: str) -> None:
    assert play().error is None
    plain = times(what)
    first = 2 if what in ("plain", "answer") else 3  # a task has its first step when it begins
    assert play(f"slow-step:{WORKS[what]}#{first}+0.25").error is None
    assert times(what) == pytest.approx([plain[0], plain[1] + 0.25, plain[2] + 0.25])


@pytest.mark.parametrize("what", WORKS)
def test_a_node_dies_at_a_step_of_each_at_once_and_without_a_clean_up(what: str) -> None:
    play()
    plain = times(what)
    outcome = play(f"crash:{WORKS[what]}#{2 if what in ('plain', 'answer') else 3}")
    assert outcome.error is None
    assert times(what) == [plain[0]]
    assert max(at for _, at in Worker.seen) <= plain[1], "nothing of the node goes on"
    assert not times("stopped")


def test_a_goal_whose_server_dies_in_its_body_is_aborted() -> None:
    outcome = play("crash:/worker>Worker.count#3")
    assert outcome.error is None
    assert "/worker was ended here by the simulation" in outcome.timeline


def test_a_late_step_does_not_outlast_a_cancellation() -> None:
    heard: list[tuple[str, float]] = []

    class Patient(Node):
        @background
        async def wait(self) -> None:
            try:
                async with asyncio.timeout(0.5):
                    await self.clock.sleep(0.1)
                    heard.append(("woke", self.clock.now()))
            except TimeoutError:
                heard.append(("timeout", self.clock.now()))

    async def body(rig: Rig) -> None:
        await rig.start(Patient)
        await rig.advance(5.0)

    assert Scenario(body).run(0, shuffled=False, faults=parse("slow-step:/patient>wait#2+2")).error is None
    assert heard == [("timeout", 0.5)]


def test_nothing_is_late_while_time_stands_still_for_the_real_world() -> None:
    """A step that only time could wake, while time waits for what that step has to end, would wait for ever."""

    class Starts(Node):
        @every(hz=1)
        async def start_one(self) -> None:
            process = await asyncio.create_subprocess_exec("true")
            assert await process.wait() == 0

    async def body(rig: Rig) -> None:
        await rig.start(Starts)
        await rig.advance(2.5)

    faults = " ".join(f"slow-step:/starts>Starts.start_one#{nth}+0.3" for nth in range(1, 8))
    assert Scenario(body).run(0, shuffled=False, faults=parse(faults)).error is None


def test_a_watched_coroutine_looks_like_the_one_that_it_watches() -> None:
    async def work() -> int:
        await asyncio.sleep(0)
        return 7

    async def main() -> None:
        inner = work()
        watched = Watched(inner, lambda: 0.0)
        assert watched.__qualname__ == inner.__qualname__
        assert watched.cr_code is inner.cr_code
        assert await asyncio.create_task(watched) == 7
        early = asyncio.create_task(Watched(work(), lambda: 0.0))
        early.cancel()
        with pytest.raises(asyncio.CancelledError):
            await early
        Watched(work(), lambda: 0.0).close()

    asyncio.run(main())


def test_names_of_work_are_one_word() -> None:
    assert target_of("/a/b", "Worker.on_start.<locals>.loop (2)") == "/a/b>Worker.on_start.-locals-.loop-2"
    (fault,) = parse(f"slow-step:{target_of('/a/b', 'one + two # three')}#3+0.5")
    assert fault.target == "/a/b>one-two-three"


# -- calls that would wait for themselves --------------------------------------------------------------------------------------


def caught_cycle(of: str) -> Outcome:
    class Selfish(Node):
        @ASK.serve()
        async def answer(self, request: Trigger.Request) -> Trigger.Response:
            return Trigger.Response(success=True)

        @COUNT.serve()
        async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
            yield Done(Fibonacci.Result())

        @every(hz=1)
        async def tick(self) -> None:
            try:
                if of == "service":
                    await self.call(ASK, Trigger.Request())
                else:
                    async with self.send_goal(COUNT, order(1)):
                        pass
            except CallCycle as cycle:
                self.log.warning("no answer", why=str(cycle))

    async def body(rig: Rig) -> None:
        await rig.start(Selfish)
        await rig.advance(3.0)

    return Scenario(body).run(0, shuffled=False)


@pytest.mark.parametrize("of", ["service", "action"])
def test_a_call_that_would_wait_for_itself_is_a_failure_also_when_its_error_is_caught(of: str) -> None:
    outcome = caught_cycle(of)
    assert isinstance(outcome.error, CallCycle)
    assert outcome.signature[0] == "CallCycle"
    assert outcome.signature[1].startswith(f"{__file__}:"), "the user's own line"


def test_calls_and_goals_that_are_answered_are_no_failures() -> None:
    class Client(Node):
        @every(hz=5)
        async def ask(self) -> None:
            await self.call(ASK, Trigger.Request())
            async with self.send_goal(COUNT, order(1)) as goal:
                await goal

    async def body(rig: Rig) -> None:
        await rig.start(Worker, Client)
        await rig.advance(5.0)

    for seed in range(4):
        assert Scenario(body).run(seed).error is None


# -- where what does not end waits ------------------------------------------------------------------------------------------------


def not_ended(node: Callable[[], type[Node]]) -> str:
    async def body(rig: Rig) -> None:
        await rig.start(Supervisor("shop", children=[Child(node())]))
        await rig.advance(1.0)

    error = Scenario(body).run(0).error
    assert isinstance(error, InvariantBroken)
    return str(error)


class HungHandler(Node):
    @every(hz=2)
    async def wait(self) -> None:
        await asyncio.Event().wait()


class HungGoal(Node):
    @COUNT.serve()
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        try:
            await self.clock.sleep(100.0)
        finally:
            await self.clock.sleep(8.0)
        yield Done(Fibonacci.Result())

    @background
    async def begin(self) -> None:
        async with self.send_goal(COUNT, order(1)) as goal:
            await goal


def test_a_node_that_does_not_end_is_told_with_the_line_at_which_it_waits() -> None:
    said = not_ended(lambda: HungHandler)
    assert (
        "shop/hung_handler did not end as it was asked to: it was killed after 5 s of clean-up; it waited at " in said
    )
    assert f"{__file__}:" in said
    assert said.endswith(" in HungHandler.wait")


def test_what_a_clean_up_waits_for_is_told_too() -> None:
    said = not_ended(lambda: HungGoal)
    assert "its task /hung_goal HungGoal.count waited at " in said
    assert said.split("HungGoal.count waited at ")[1].startswith(f"{__file__}:")
