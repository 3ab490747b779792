"""Every kind of error out of every place where a node's code runs: who waits is answered, who began has its last word, nothing is left."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Sequence
from itertools import product
from random import Random
from typing import Any, ClassVar

from actors import (
    Action,
    ActorError,
    Child,
    Done,
    GoalAborted,
    GoalRejected,
    Node,
    Parameter,
    Service,
    ServiceFailed,
    SetResult,
    Skip,
    StartFailed,
    Steps,
    Stop,
    Supervisor,
    Topic,
    background,
    every,
    parameter,
)
from actors.checks import create
from actors.errors import NotRunning  # fmt: skip
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.rcl_interfaces.srv import SetParameters
from actors.interfaces.std_msgs.msg import Int32
from actors.parameters.messages import to_parameter
from actors.runtime.incarnation import incarnation_of
from actors.system import System, system_here
from actors.testing.fuzz import FuzzLoop
from actors.time.virtual_loop import VirtualLoop
from tests.properties.trials import check_trials, in_loop
from tests.stage import number, order, result, step, total, two

NUMBERS = Topic(Int32, "numbers")
PLAIN, MANY = Service(AddTwoInts, "plain"), Service(AddTwoInts, "many")
COUNT = Action(Fibonacci, "count")
PARAMETERS = Service(SetParameters, "/faulty/set_parameters")


class Panic(BaseException):
    """As the errors of some native libraries, it is no `Exception`."""


KINDS: dict[str, Callable[[], BaseException]] = {
    "Exception": lambda: ValueError("odd"),
    "stray cancellation": lambda: asyncio.CancelledError("of something else"),
    "BaseException": lambda: Panic("native"),
    "SystemExit": lambda: SystemExit(5),
    "KeyboardInterrupt": lambda: KeyboardInterrupt(),
    "ExceptionGroup": lambda: ExceptionGroup("several", [ValueError(1)]),
    "BaseExceptionGroup": lambda: BaseExceptionGroup("several", [Panic(1)]),
    "StopIteration": lambda: StopIteration(3),
    "StopAsyncIteration": lambda: StopAsyncIteration(3),
    "GeneratorExit": lambda: GeneratorExit(),
    "Stop": lambda: Stop("enough"),
    "Skip": lambda: Skip("not here"),
}
EXITS = {"SystemExit": 5, "KeyboardInterrupt": 130}
NO_EXCEPTION = ("BaseException", "BaseExceptionGroup")

STARTING = ("__init__", "on_start")
ASKED = {
    "service": ServiceFailed,
    "concurrent service": ServiceFailed,
    "parameter callback": ServiceFailed,
    "goal": GoalAborted,
    "goal, after a feedback": GoalAborted,
    "accepts": GoalRejected,
    "accepts, after a wait": GoalRejected,
    "cancels": GoalAborted,
}
"""Where somebody waits for an answer, and what it may be."""
ALONE = ("timer", "plain timer", "topic", "concurrent topic", "on_error", "background", "spawned")
ENDING = ("on_stop", "handover")
PLACES = (*STARTING, "resume", *ASKED, *ALONE, *ENDING, "callback")
CELLS = list(product(PLACES, KINDS))


class Faulty(Node):
    """Raises one error of one kind, once, at one place."""

    place: ClassVar[str]
    kind: ClassVar[str]
    armed: ClassVar[bool]
    diary: ClassVar[list[str]]

    speed = parameter(1.0)

    def __init__(self) -> None:
        self.fail_at("__init__")

    @classmethod
    def fail_at(cls, place: str) -> None:
        if cls.armed and cls.place == place:
            Faulty.armed = False
            raise KINDS[cls.kind]()

    def resume(self, state: int) -> None:
        self.fail_at("resume")

    async def on_start(self) -> None:
        self.diary.append(f"begin {self.incarnation}")
        incarnation_of(self).parameters.add_on_set_callback(self.check)
        self.fail_at("on_start")
        self.create_task(self.spawned())
        asyncio.get_running_loop().call_later(0.1, self.fail_at, "callback")

    def check(self, changes: Sequence[Parameter]) -> SetResult:
        self.fail_at("parameter callback")
        return SetResult(True)

    async def spawned(self) -> None:
        await self.clock.sleep(0.1)
        self.fail_at("spawned")

    @background
    async def forever(self) -> None:
        await self.clock.sleep(0.1)
        self.fail_at("background")
        await self.clock.sleep(1e6)

    @every(hz=10)
    async def tick(self) -> None:
        self.fail_at("timer")

    @every(hz=10)
    def plain_tick(self) -> None:
        self.fail_at("plain timer")
        if self.armed and self.place == "on_error":
            raise LookupError("on_error hears this")

    def on_error(self, error: Exception, handler: str) -> None:
        self.fail_at("on_error")

    @NUMBERS.on()
    async def take(self, message: Int32) -> None:
        self.fail_at("topic")

    @NUMBERS.on(concurrent=2)
    async def take_beside(self, message: Int32) -> None:
        self.fail_at("concurrent topic")

    @PLAIN.serve()
    async def plain(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        self.fail_at("service")
        return total(request.a + request.b)

    @MANY.serve(concurrent=2)
    async def many(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        self.fail_at("concurrent service")
        return total(request.a + request.b)

    @COUNT.serve()
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        self.fail_at("goal")
        yield step(1)
        await self.clock.sleep(0.3)
        self.fail_at("goal, after a feedback")
        yield Done(result(2))

    @COUNT.accepts
    async def accepts(self, goal: Fibonacci.Goal) -> None:
        self.fail_at("accepts")
        await asyncio.sleep(0)
        self.fail_at("accepts, after a wait")

    @COUNT.cancels
    async def cancels(self, goal: Fibonacci.Goal) -> bool:
        self.fail_at("cancels")
        return True

    def handover(self) -> int:
        self.fail_at("handover")
        return 1

    async def on_stop(self, reason: object) -> None:
        self.diary.append(f"end {self.incarnation}")
        self.fail_at("on_stop")


# -- what must follow --------------------------------------------------------------------------------------------------


def fate(place: str, kind: str) -> str:
    """What becomes of the node: it goes on, has another life, has no more, has not started, or the whole system stops."""
    if place == "callback":
        return "goes on"  # the loop ran it, not the node; what the loop does then is asyncio's
    if kind in EXITS:
        return "all stops"
    if place in STARTING or place == "resume":
        return "declines" if kind == "Skip" else "restarts" if place == "resume" else "does not start"
    if place in ASKED and kind != "Stop" and kind not in NO_EXCEPTION:
        return "goes on"
    return "restarts"


class Trial:
    """One error at one place."""

    def __init__(self, place: str, kind: str) -> None:
        Faulty.place, Faulty.kind, Faulty.armed, Faulty.diary = place, kind, True, []
        self.place = place
        self.fate = fate(place, kind)
        self.code = EXITS.get(kind)
        self.problems: list[str] = []

    def expect(self, holds: bool, problem: object) -> None:
        if not holds:
            self.problems.append(str(problem))

    async def run(self) -> list[str]:
        self.system = system = create(System, sinks=())
        try:
            await system.start(Supervisor("system", children=[Child(Faulty, stop=2.0)]))
        except (StartFailed, NotRunning) as error:
            self.expect(self.place in STARTING, f"the start failed: {error!r}")
            self.expect(isinstance(error, NotRunning) == (self.fate == "all stops"), f"the start failed with {error!r}")
        else:
            self.expect(self.fate != "does not start", "it has started")
            self.me = (await system.join(Child(Node, name="me"))).node
            await self.provoke()
            await system.clock.sleep(1.0)
            await self.look()
            await system.stop("the trial is over")
        self.look_back()
        return self.problems

    async def provoke(self) -> None:
        """Do what makes the code at the place run."""
        system, me = self.system, self.me
        assert system.supervisor is not None
        await system.clock.sleep(0.2)
        me.publisher(NUMBERS)(number(1))
        if self.place in ASKED:
            await self.answered(self.ask())
        elif self.place in ENDING:
            await self.answered(system.supervisor.terminate_child("faulty"))
            if self.fate != "all stops":
                await system.supervisor.restart_child("faulty")
        elif self.place == "resume":
            state = system.nodes["system", "faulty"]
            assert state.running is not None
            state.saved = 1
            state.running.fail(OSError("so that there is a second life"), "the trial")
        await system.clock.sleep(0.2)

    async def ask(self) -> object:
        me = self.me
        if self.place == "service":
            return await me.call(PLAIN, two(1, 2), timeout=30.0)
        if self.place == "concurrent service":
            return await me.call(MANY, two(1, 2), timeout=30.0)
        if self.place == "parameter callback":
            request = SetParameters.Request(parameters=[to_parameter(Parameter("speed", 2.0))])
            (verdict,) = (await me.call(PARAMETERS, request, timeout=30.0)).results
            self.expect(not verdict.successful, "the parameter was set")
            return verdict
        async with me.send_goal(COUNT, order(1), timeout=30.0) as goal:
            if self.place == "cancels":
                await me.clock.sleep(0.1)
                self.expect(not await goal.cancel(), "a goal was canceled whose hook had failed")
            return await goal

    async def answered(self, question: Coroutine[Any, Any, object]) -> None:
        """Whoever asks hears the answer of this place long before it gives up waiting."""
        asked = self.system.clock.now()
        try:
            answer: object = await question
        except ActorError as error:
            answer = error
            self.expect(isinstance(error, ASKED.get(self.place, ())), f"answered with {error!r}")
        else:
            silent = self.place in ENDING or (self.place == "cancels" and self.fate == "goes on")
            self.expect(silent or self.place == "parameter callback", f"answered with {answer!r}")
        self.expect(self.system.clock.now() - asked < 1.0, f"answered after {self.system.clock.now() - asked} s")

    async def look(self) -> None:
        """A second later: the number of lives, and whether the next one who asks is served."""
        system = self.system
        state = system.nodes["system", "faulty"]
        lives = {"goes on": 1, "declines": 1, "restarts": 2}
        if self.fate == "declines" and self.place == "__init__":
            lives["declines"] = 0
        if self.place == "resume":
            lives |= {"restarts": 3, "declines": 2, "all stops": 2}
        self.expect(state.incarnation == lives.get(self.fate, 1), f"it is in its life {state.incarnation}")
        self.expect(system.running == (self.fate != "all stops"), f"the tree runs: {system.running}")
        restarts = [each for each in system.reports if each.context in ("child_terminated", "start_error")]
        expected = max(0, state.incarnation - 1) if self.place not in ENDING else 0
        self.expect(len(restarts) == expected, f"restarts: {restarts}")
        if self.fate in ("goes on", "restarts"):
            self.expect(await self.me.call(PLAIN, two(1, 2)) == total(3), "the next one is not served")
        else:
            try:
                self.expect(False, await self.me.call(PLAIN, two(1, 2), timeout=5.0))
            except ActorError as error:  # nobody is told to wait for a life that will not come
                self.expect(isinstance(error, NotRunning) or self.place == "__init__", f"the next one hears {error!r}")

    def look_back(self) -> None:
        """After the end of everything."""
        system, diary = self.system, Faulty.diary
        begun = [line.removeprefix("begin ") for line in diary if line.startswith("begin ")]
        ended = [line.removeprefix("end ") for line in diary if line.startswith("end ")]
        if self.fate == "declines" and self.place == "on_start":
            ended = [*ended, "1"]  # a node that is not needed here has nothing to end
        self.expect(begun == ended, f"on_start and on_stop: {diary}")
        self.expect(not Faulty.armed, "the place was never reached")
        if self.fate == "all stops":
            self.expect(system.exit_code == self.code, f"exit code {system.exit_code}")
        left = [task.get_name() for task in asyncio.all_tasks() if task is not asyncio.current_task()]
        for entry in system.graph.topics.values():
            left += [repr(endpoint) for endpoint in (*entry.publishers, *entry.subscriptions)]
        for state in system.nodes.values():
            left += [repr(each) for each in state.actions.values() if each.running or each.waiting]
        self.expect(not left and not len(system.master.joined) and system_here() is None, f"left: {left}")


def fail_somewhere(seed: int) -> tuple[str, list[str]]:
    """Every error at every place in plain order; then again, in other orders."""
    place, kind = CELLS[seed % len(CELLS)]
    shuffled = seed >= len(CELLS)
    loop = FuzzLoop(Random(f"order {seed}").getrandbits(30)) if shuffled else VirtualLoop()
    problems = in_loop(loop, Trial(place, kind).run())
    if place == "callback":  # of asyncio's, and it says so itself
        sentence = "the loop was left by" if kind in EXITS else "the loop was told: Exception in callback"
        problems = (
            [] if len(problems) == 1 and problems[0].startswith(sentence) else [f"instead of '{sentence}': {problems}"]
        )
    return f"{kind} out of {place}{', shuffled' if shuffled else ''}", problems


def test_chaos_any_error_anywhere_is_answered_and_leaves_nothing_behind() -> None:
    check_trials("any_error_anywhere", fail_somewhere, usual=2 * len(CELLS))
