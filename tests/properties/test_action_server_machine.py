"""Random lives of an action server: arrivals, cancellations, clients that vanish, crashes, and what is known of a goal afterwards.

The table of goals by itself has a machine of its own (`test_goals_machine`); here are the policies, the bodies and the clients around it.
"""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import Any, Literal, TypeVar

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from actors import (
    Aborted,
    Child,
    Done,
    GoalRejected,
    GoalStatus,
    Intensity,
    Node,
    Reject,
    Service,
    Steps,
    Supervisor,
)
from actors.actions import parallel, queue
from actors.contracts.contracts import Arrivals
from actors.errors import NodeRestarting
from actors.interfaces.derived import get_result_service
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.unique_identifier_msgs.msg import UUID
from actors.testing import Rig
from actors.time.virtual_loop import VirtualLoop
from actors.typing import Goal
from tests.stage import COUNT, order, result, step

T = TypeVar("T")
Kind = Literal["plain", "stubborn", "partial", "slow"]
"""How a goal takes its cancellation: it ends; its server refuses; it hands over what it has; it cleans up for a second, or until told."""
KINDS: tuple[Kind, ...] = ("plain", "stubborn", "partial", "slow")
CLEANING = 1.0
PLACES: dict[str, tuple[Arrivals, int]] = {
    "reject": ("reject", 1), "preempt": ("preempt", 1), "queue": (queue(2), 1), "parallel": (parallel(2), 2),
}  # fmt: skip
GET_RESULT: Any = Service(get_result_service(Fibonacci), "/count/_action/get_result")
ENDED = (GoalStatus.SUCCEEDED, GoalStatus.CANCELED, GoalStatus.ABORTED)
AS_TOLD = {
    "done": GoalStatus.SUCCEEDED,
    "abort": GoalStatus.ABORTED,
    "raise": GoalStatus.ABORTED,
    "return": GoalStatus.ABORTED,
}


def kind_of(goal: Fibonacci.Goal) -> Kind:
    return KINDS[goal.order % len(KINDS)]


class Body:
    """What the machine tells the body of one goal to do, by the goal's number."""

    orders: dict[int, asyncio.Queue[str]]


async def told_within(orders: asyncio.Queue[str], seconds: float) -> str:
    try:
        return await asyncio.wait_for(orders.get(), seconds)
    except TimeoutError:
        return ""


def server(arrivals: Arrivals, keep: float) -> type[Node]:
    class Server(Node):
        """Accepts what is not negative, and cancels what is not stubborn."""

        @COUNT.accepts
        def check(self, goal: Fibonacci.Goal) -> None:
            if goal.order < 0:
                raise Reject("negative")

        @COUNT.cancels
        def may_cancel(self, goal: Fibonacci.Goal) -> bool:
            return kind_of(goal) != "stubborn"

        @COUNT.serve(arrivals=arrivals, result_timeout=keep)
        async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
            """Do as it is told, and take the cancellation as this goal's kind is."""
            orders = Body.orders[goal.order]
            try:
                while (told := await orders.get()) == "feedback":
                    yield step(goal.order)
            except asyncio.CancelledError:
                if kind_of(goal) == "partial":
                    yield Done(result(goal.order))
                    return
                if kind_of(goal) != "slow" or (told := await told_within(orders, CLEANING)) == "":
                    raise
            if told == "done":
                yield Done(result(goal.order))
            elif told == "abort":
                yield Aborted(result(), "told to")
            elif told == "raise":
                raise OSError("broken")

    return Server


class Known:
    """A goal, its client, and what the model knows of it."""

    def __init__(self, number: int, kind: Kind) -> None:
        self.number = number
        self.kind: Kind = kind
        self.goal: Goal[Any, Any] | None = None
        self.client: asyncio.Task[None] | None = None
        self.status = GoalStatus.UNKNOWN
        self.has_result = False
        self.feedback = 0
        self.verdict = GoalStatus.CANCELED
        self.cleaned_at: float | None = None
        """When its clean-up is over, once it has begun."""
        self.forgotten_at: float | None = None
        self.askers: list[asyncio.Task[Any]] = []

    def __repr__(self) -> str:
        return f"<goal {self.number}, {self.kind}>"

    @property
    def ended(self) -> bool:
        return self.status in ENDED


PICKS = st.integers(0, 11)
"""Which of the goals that come into question a rule is about."""
there_are_goals = precondition(lambda self: self.accepted)
goals_are_active = precondition(lambda self: self.waiting or self.running)
goals_run = precondition(lambda self: self.running)


class Actions(RuleBasedStateMachine):
    """Clients send goals, cancel them, vanish and ask for results; bodies go on and end; the node crashes; time passes."""

    def __init__(self) -> None:
        super().__init__()
        self.loop = VirtualLoop()
        self.known: list[Known] = []
        self.accepted: list[Known] = []
        self.waiting: list[Known] = []
        self.running: list[Known] = []
        self.restarting = False
        Body.orders = {}

    def run(self, work: Coroutine[Any, Any, T]) -> T:
        return self.loop.run_until_complete(work)

    @initialize(policy=st.sampled_from(list(PLACES)), keep=st.sampled_from([0.0, 2.0, -1.0]))
    def start(self, policy: str, keep: float) -> None:
        self.policy, self.keep = policy, keep
        arrivals, self.places = PLACES[policy]

        async def begin() -> None:
            self.rig = Rig()
            factory = Child(server(arrivals, keep), name="server")
            await self.rig.start(Supervisor("system", intensity=Intensity(1000, within=1.0), children=[factory]))

        self.run(begin())

    def teardown(self) -> None:
        if hasattr(self, "rig"):
            self.run(self.go_home())
        self.loop.close()

    async def go_home(self) -> None:
        tasks = [task for each in self.known for task in (each.client, *each.askers) if task is not None]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await self.rig.close()

    def settle(self) -> None:
        self.run(self.rig.quiet())

    # -- the model ----------------------------------------------------------------------------------------------------------

    def end_in_model(self, each: Known, status: GoalStatus, has_result: bool = False) -> None:
        each.status, each.has_result, each.cleaned_at = status, has_result, None
        each.forgotten_at = None if self.keep < 0 else self.rig.now + self.keep
        for group in (self.waiting, self.running):
            if each in group:
                group.remove(each)

    def interrupt_in_model(self, each: Known, verdict: GoalStatus) -> None:
        if each in self.waiting or each.kind in ("plain", "stubborn"):
            self.end_in_model(each, verdict)
        elif each.kind == "partial":
            self.end_in_model(each, verdict, has_result=True)
        else:
            each.verdict, each.cleaned_at = verdict, self.rig.now + CLEANING

    def cancel_in_model(self, each: Known) -> bool:
        """What the server does when it is to cancel; whether it does."""
        if each.ended:
            return False
        if each.status is not GoalStatus.CANCELING:
            each.status = GoalStatus.CANCELING
            self.interrupt_in_model(each, GoalStatus.CANCELED)
        return True

    def start_next_in_model(self) -> None:
        while self.waiting and len(self.running) < self.places and not self.restarting:
            each = self.waiting.pop(0)
            each.status = GoalStatus.EXECUTING
            self.running.append(each)

    def is_refused(self, negative: bool) -> bool:
        busy = len(self.running) + len(self.waiting)
        return negative or {
            "reject": busy > 0, "preempt": False, "queue": len(self.waiting) >= 2, "parallel": busy >= 2,
        }[self.policy]  # fmt: skip

    # -- clients ------------------------------------------------------------------------------------------------------------

    def active(self, pick: int) -> Known:
        goals = [*self.waiting, *self.running]
        return goals[pick % len(goals)]

    @rule(kinds=st.lists(st.sampled_from((*KINDS, None)), min_size=1, max_size=4))
    def send(self, kinds: list[Kind | None]) -> None:
        for kind in kinds:
            self.send_one(kind or "plain", negative=kind is None)

    def send_one(self, kind: Kind, *, negative: bool) -> None:
        number = len(self.known) * len(KINDS) + KINDS.index(kind)
        each = Known(number, kind)
        Body.orders[number] = asyncio.Queue()
        self.known.append(each)
        each.client = self.loop.create_task(self.stay(each, -1 - number if negative else number))
        self.settle()
        if self.is_refused(negative):
            assert each.client.done()
            assert isinstance(each.client.exception(), GoalRejected)
            return
        assert not each.client.done()
        if self.policy == "preempt":
            for other in (*self.waiting, *self.running):
                self.cancel_in_model(other)
        each.status = GoalStatus.ACCEPTED
        self.accepted.append(each)
        self.waiting.append(each)
        self.start_next_in_model()

    async def stay(self, each: Known, number: int) -> None:
        """A client that stays in its goal's block until it is sent away."""
        async with self.rig.me.send_goal(COUNT, order(number)) as goal:
            each.goal = goal
            await asyncio.get_running_loop().create_future()

    @goals_are_active
    @rule(pick=PICKS)
    def cancel(self, pick: int) -> None:
        each = self.active(pick)
        assert each.goal is not None
        answer = self.run(each.goal.cancel())
        self.settle()
        if each.kind == "stubborn" and each.status is not GoalStatus.CANCELING:
            assert not answer
            return
        assert answer == self.cancel_in_model(each)
        self.start_next_in_model()

    @there_are_goals
    @rule(pick=PICKS)
    def cancel_too_late(self, pick: int) -> None:
        each = self.accepted[-1 - pick % len(self.accepted)]
        if each.ended and each.goal is not None:
            assert not self.run(each.goal.cancel())

    @goals_are_active
    @rule(pick=PICKS)
    def vanish(self, pick: int) -> None:
        """The client is canceled; leaving its block cancels the goal, and waits while that is cleaned up."""
        each = self.active(pick)
        if each.client is None or each.client.done() or each.client.cancelling():
            return
        each.client.cancel()
        self.settle()
        if each.kind != "stubborn":
            self.cancel_in_model(each)
        self.start_next_in_model()
        assert each.client.done() == (each.ended or each.kind == "stubborn")

    @there_are_goals
    @rule(pick=PICKS)
    def ask_for_the_result(self, pick: int) -> None:
        each = self.accepted[-1 - pick % len(self.accepted)]
        assert each.goal is not None
        ask = GET_RESULT.request(goal_id=UUID(uuid=each.goal.goal_id))
        asker = self.loop.create_task(self.rig.call(GET_RESULT, ask, timeout=1e6))
        self.settle()
        if not each.ended and each.forgotten_at is None:
            assert not asker.done()
            each.askers.append(asker)
            return
        told = asker.result()
        if each.forgotten_at is not None and each.forgotten_at <= self.rig.now:
            assert (told.status, told.result) == (GoalStatus.UNKNOWN, result())
        else:
            assert (told.status, told.result) == (each.status, result(each.number) if each.has_result else result())

    # -- bodies -------------------------------------------------------------------------------------------------------------

    @goals_run
    @rule(pick=PICKS, steps=st.integers(0, 2), how=st.sampled_from(["", *AS_TOLD]))
    def tell_the_body(self, pick: int, steps: int, how: str) -> None:
        each = self.running[pick % len(self.running)]
        for _ in range(steps if each.cleaned_at is None else 0):
            Body.orders[each.number].put_nowait("feedback")
            self.settle()
            each.feedback += 1
        if how:
            self.end(each, how)

    def end(self, each: Known, how: str) -> None:
        Body.orders[each.number].put_nowait(how)
        self.settle()
        status = each.verdict if how == "done" and each.cleaned_at is not None else AS_TOLD[how]
        self.end_in_model(each, status, has_result=how == "done")
        self.start_next_in_model()

    @rule(halves=st.integers(1, 5))
    def pass_time(self, halves: int) -> None:
        for _ in range(halves):
            self.run(self.rig.advance(0.5))
            for each in list(self.running):
                if each.cleaned_at is not None and each.cleaned_at <= self.rig.now:
                    self.end_in_model(each, each.verdict)
            self.start_next_in_model()

    @goals_are_active
    @rule()
    def crash(self) -> None:
        """The server's node fails, cleans up, and lives again, without any memory of its goals."""
        self.rig.crash("server")
        self.restarting = True
        for each in (*self.waiting, *self.running):
            if each.cleaned_at is None:
                self.interrupt_in_model(each, GoalStatus.ABORTED)
        lives = self.rig.incarnation("server")
        self.pass_time(2)
        self.restarting = False
        assert self.rig.incarnation("server") == lives + 1
        assert (self.waiting, self.running) == ([], [])
        for each in self.known:
            if each.goal is not None:
                each.forgotten_at = 0.0
            for asker in each.askers:
                assert asker.done()
                if isinstance(asker.exception(), NodeRestarting):
                    each.askers = []

    # -- what always holds --------------------------------------------------------------------------------------------------

    @invariant()
    def every_goal_stands_where_the_model_has_it(self) -> None:
        for each in self.known:
            if each.goal is None:
                assert each.status is GoalStatus.UNKNOWN
                continue
            assert (each.goal.status, each.goal.done) == (each.status, each.ended)
            assert each.goal.feedback_count == each.feedback
            if each.ended:
                outcome = self.run(each.goal.ended())
                assert outcome.result == (result(each.number) if each.has_result else outcome.result)
                assert (outcome.result is None) == (not each.has_result) or each.status is GoalStatus.ABORTED

    @invariant()
    def who_asked_in_time_is_told_the_end_and_nobody_before_it(self) -> None:
        for each in self.known:
            for asker in each.askers:
                assert asker.done() == each.ended
                if asker.done() and asker.exception() is None:
                    assert asker.result().status == each.status


TestActions = Actions.TestCase
TestActions.settings = settings(deadline=None, stateful_step_count=40)
