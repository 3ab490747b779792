"""Action servers: they accept goals, start and cancel them, and keep their results.

The requests for the acceptance of a goal and for its cancellation are items of the node's inbox: both are decided there, like all handlers
of the node, because the deciding hooks may read the node's state.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Collection, Coroutine
from typing import Any, Final, NamedTuple

from actors.actions.driver import GoalDriver, GoalHandlers, Host
from actors.actions.goals import CancelOutcome, GoalEvent, GoalRecord, GoalStatus, GoalTable
from actors.actions.peers import GoalFollower, Outcome
from actors.checks import create, is_flag
from actors.contracts.contracts import Action, ArrivalPolicy
from actors.errors import Reject, described
from actors.inbox.control import blame
from actors.interfaces.message import F, G, Message, R
from actors.services.peers import Registration

_EVENTS: Final = {
    GoalStatus.SUCCEEDED: GoalEvent.SUCCEED,
    GoalStatus.CANCELED: GoalEvent.CANCELED,
    GoalStatus.ABORTED: GoalEvent.ABORT,
}


class GoalRequest:
    """A request to accept a goal.

    Invariant: `future` is completed once: with the time of acceptance (nanoseconds), with `Reject`, or with the error that describes the
    end of the node. A client that gives up cancels it.
    """

    __slots__ = ("client", "future", "goal_id", "message", "server")

    def __init__(self, server: ActionServer, goal_id: bytes, message: Message, client: GoalFollower | None) -> None:
        self.server = server
        self.goal_id = goal_id
        self.message = message
        self.client = client
        self.future: asyncio.Future[int] = server.node.inbox.loop.create_future()

    @property
    def label(self) -> str:
        return f"{self.server.label} (acceptance)"

    @property
    def answered(self) -> bool:
        """Whether the server has answered or the client has given up."""
        return self.future.done()

    def run(self) -> Coroutine[object, None, None]:
        return self.server.consider(self)

    def fail(self, error: Exception) -> None:
        """Give the client `error`, unless the request has been answered."""
        if not self.future.done():
            self.future.set_exception(error)


class CancelRequest:
    """A question to the hook that decides whether a goal may be canceled.

    If `reason` is given, the goal is canceled as soon as the hook agrees, even if nobody awaits the answer any more.

    Invariant: `future` is completed once, with the answer. A node that ends before it answers counts as having refused.
    """

    __slots__ = ("future", "goal", "reason", "server")

    def __init__(self, server: ActionServer, goal: GoalRecord, reason: str | None) -> None:
        self.server = server
        self.goal = goal
        self.reason = reason
        self.future: asyncio.Future[bool] = server.node.inbox.loop.create_future()

    @property
    def label(self) -> str:
        return f"{self.server.label} (cancel check)"

    def run(self) -> Coroutine[object, None, None]:
        return self.server.consider_cancel(self)

    def answer(self, agreed: bool) -> None:
        """Complete the future, unless it is already completed."""
        if not self.future.done():
            self.future.set_result(agreed)

    def fail(self, error: Exception) -> None:
        """Answer False, because the node has ended."""
        self.answer(False)


class ServedGoals(NamedTuple):
    """The functions through which the goals of a server go. Interceptors replace some of them by their own."""

    submit: Callable[[bytes, Message, GoalFollower | None], GoalRequest]
    """Takes in a request; see `ActionServer.submit`."""
    cancel: Callable[[bytes, str], Awaitable[bool]]
    """Takes in a cancellation; see `ActionServer.cancel`."""
    run: Callable[[GoalRecord], Coroutine[object, None, None]]
    """Runs a goal, in a task of its own."""
    ended: Callable[[GoalRecord, Outcome], None]
    """Tells the client, and all who wait for it, that a goal has ended."""


class ActionServer:
    """Serves one action for one node: decides which goals are accepted, when each runs, and how long its result is kept.

    Invariants:

    * A goal is in `table` from its acceptance until its result expires. Its `GoalRecord` is the only state of the goal.
    * An unanswered request, for a goal or for a cancellation, is in `requests`. `fail_all` answers those that are left.
    * At most as many goals run as the arrival policy allows, and no goal waits while another could start.
    * A waiting goal has no task. A running goal has one, in which `GoalDriver.run` ends it. The server itself ends only goals whose body
      has not begun, and those that are left when the node has ended.
    * The goal's client is told of every change of status, and last of the outcome. The reference to it is then dropped, so that neither
      keeps the other alive.
    * While there are results that expire, `_expiry` is the one timer that removes them.
    """

    __slots__ = (
        "_expiry",
        "_places",
        "action",
        "arrivals",
        "entry",
        "goals",
        "handlers",
        "label",
        "node",
        "on_feedback",
        "on_status",
        "requests",
        "table",
        "type",
        "ways",
    )

    def __init__(
        self,
        node: Host,
        entry: Registration,
        action: Action[G, R, F],
        handlers: GoalHandlers,
        arrivals: ArrivalPolicy,
        result_timeout: float,
    ) -> None:
        self.node = node
        self.entry = entry
        self.action = action
        self.type: type[Any] = action.type
        self.handlers = handlers
        self.label = handlers.label
        self.arrivals = arrivals
        self.table = GoalTable(round(result_timeout * 1e9))
        self.requests: dict[GoalRequest | CancelRequest, None] = {}
        self.on_status: list[Callable[[], None]] = []
        """Called after every change of a goal's status. They must not raise."""
        self.goals = 0
        """The number of goals that have been requested."""
        self._places = places(arrivals)
        driver = GoalDriver(node, action, handlers, self._end, self._start_next)
        self.on_feedback = driver.on_feedback
        self.ways = ServedGoals(self._submit, self._take_cancel, driver.run, self._tell_end)
        self._expiry: asyncio.TimerHandle | asyncio.Future[bool] | None = None

    def __repr__(self) -> str:
        return f"<server of {self.entry.name} in {self.node.fqn}: {len(self.running)} running, {len(self.waiting)} waiting>"

    @property
    def host(self) -> str:
        return self.node.fqn

    @property
    def running(self) -> Collection[GoalRecord]:
        """The goals that run or are about to begin, in the order in which they were started."""
        return self.table.running

    @property
    def waiting(self) -> Collection[GoalRecord]:
        """The goals that are accepted and have not been started, in order of acceptance."""
        return self.table.waiting

    @property
    def active(self) -> int:
        return len(self.running) + len(self.waiting)

    def describe(self, goal: GoalRecord) -> str:
        """A description of a goal, for reports."""
        return f"<goal {goal.goal_id.hex()[:8]} of {self.entry.name}: {goal.status.name}>"

    def unanswered(self, seconds: float) -> str:
        busy = self.node.inbox.current
        work = f"busy with {busy.label}" if busy is not None else "not ready"
        return (
            f"{self.host}, which serves {self.entry.name}, neither accepted nor rejected the goal within {seconds:g} s: it is {work}; "
            "declare a handler that waits concurrent=n, or give the goal more time"
        )

    # -- acceptance ----------------------------------------------------------------------------------------------------------

    def submit(self, goal_id: bytes, message: Message, client: GoalFollower | None) -> GoalRequest:
        """Request the acceptance of a goal, which is decided in the node's inbox. `client` follows the goal if it is accepted."""
        return self.ways.submit(goal_id, message, client)

    def _submit(self, goal_id: bytes, message: Message, client: GoalFollower | None) -> GoalRequest:
        self.goals += 1
        request = GoalRequest(self, goal_id, message, client)
        self.requests[request] = None
        self.node.inbox.put_control(request)
        return request

    async def consider(self, request: GoalRequest) -> None:
        """Accept or reject a goal. No other goal is affected unless this one is certain to be accepted."""
        if request.answered:  # the client has canceled it
            self.requests.pop(request, None)
            return
        try:
            self._expire()
            if request.goal_id in self.table:
                raise Reject(f"goal id {request.goal_id.hex()} is in use already: make a new id for each goal")
            if self.handlers.accepts is not None:
                verdict: object = self.handlers.accepts(request.message)
                if isinstance(verdict, Awaitable):
                    verdict = await verdict
                if verdict is not None:
                    raise TypeError(
                        f"@{self.action!r}.accepts returned {verdict!r:.40}: return None to accept, raise Reject(reason) to reject"
                    )
            if not request.answered:
                self._make_place()
        except Reject as rejection:
            self._reject(request, rejection)
        except BaseException as error:
            failure = blame(error, self.label)
            if failure is None:
                raise
            self._reject(request, Reject(f"the acceptance check failed: {described(failure)}"))
            if not isinstance(failure, Exception):
                raise
            self.node.goal_failed(self.label, failure)
        else:
            self.requests.pop(request, None)
            if not request.answered:
                self._accept(request)

    def _accept(self, request: GoalRequest) -> None:
        goal = self.table.accept(request.goal_id, self.node.clock.wall_ns(), request.message, request.client)
        self._changed(goal)
        request.future.set_result(goal.stamp_ns)
        self._start_next()

    def _reject(self, request: GoalRequest, rejection: Reject) -> None:
        self.requests.pop(request, None)
        request.fail(rejection)

    def _make_place(self) -> None:
        """Make room for a goal as the arrival policy says, or raise `Reject`."""
        if self.arrivals.policy == "preempt":
            for other in (*self.waiting, *self.running):
                self._cancel(other, "preempted by a newer goal")
        elif (why := refusal(self.arrivals, len(self.waiting), len(self.running))) is not None:
            raise Reject(why)

    def _start_next(self) -> None:
        table = self.table
        while table.waiting and len(table.running) < self._places:
            goal = next(iter(table.waiting))
            table.execute(goal)
            self._changed(goal)
            goal.task = self.node.create_task(self.ways.run(goal), name=self.label)

    # -- cancellation --------------------------------------------------------------------------------------------------------

    def cancel(self, goal_id: bytes, reason: str) -> Awaitable[bool]:
        """Cancel a goal if the hook agrees, even if nobody awaits the answer. The answer is False if the node ends first."""
        return self.ways.cancel(goal_id, reason)

    def _take_cancel(self, goal_id: bytes, reason: str) -> Awaitable[bool]:
        goal = self.table.get(goal_id)
        if goal is not None and goal.interruption is None and goal.is_open and self.handlers.cancels is not None:
            return asyncio.shield(self._ask(goal, reason))
        answer: asyncio.Future[bool] = self.node.inbox.loop.create_future()
        if goal is not None and goal.interruption is not None:
            answer.set_result(goal.status.is_active)
        else:
            answer.set_result(goal is not None and self._cancel(goal, reason))
        return answer

    async def cancel_goals(self, goal_id: bytes, stamp_ns: int, reason: str) -> CancelOutcome:
        """Handle a cancel request in one of the four forms of `GoalTable.select`. Asks the hook about each selected goal."""
        self._expire()
        selection = self.table.select(goal_id, stamp_ns)
        asked = [goal for goal in selection.candidates if self._is_cancelable(goal) and await self._may_cancel(goal)]
        outcome = self.table.begin_cancel(selection, [goal for goal in asked if self._is_cancelable(goal)])
        for goal in outcome.goals:
            self._interrupt(goal, reason)
        return outcome

    async def consider_cancel(self, request: CancelRequest) -> None:
        """Ask the hook. Cancel the goal if the hook agrees and the request has a reason."""
        hook, goal = self.handlers.cancels, request.goal
        assert hook is not None
        agreed = False
        try:
            if goal.is_open:
                verdict: object = hook(goal.message)
                if isinstance(verdict, Awaitable):
                    verdict = await verdict
                if not is_flag(verdict):
                    raise TypeError(
                        f"@{self.action!r}.cancels returned {verdict!r:.40}: return True to let the goal be canceled, False to refuse"
                    )
                agreed = bool(verdict)
        except BaseException as error:
            failure = blame(error, request.label)
            if not isinstance(failure, Exception):
                raise
            self.node.goal_failed(request.label, failure, "cancel check failed")
        else:
            if agreed and request.reason is not None:
                agreed = self._cancel(goal, request.reason)
        finally:
            self.requests.pop(request, None)
            request.answer(agreed)

    @staticmethod
    def _is_cancelable(goal: GoalRecord) -> bool:
        return goal.is_open and goal.interruption is None

    async def _may_cancel(self, goal: GoalRecord) -> bool:
        """Whether the hook allows the goal to be canceled; False if the node ends first."""
        return self.handlers.cancels is None or await asyncio.shield(self._ask(goal, None))

    def _ask(self, goal: GoalRecord, reason: str | None) -> asyncio.Future[bool]:
        """Let the node ask the hook, in its inbox. The request goes on even if nobody awaits the answer any more."""
        request = CancelRequest(self, goal, reason)
        self.requests[request] = None
        if self.node.inbox.task is asyncio.current_task():  # this handler holds the inbox and may wait for the answer
            self.node.create_task(request.run(), name=request.label)
        else:
            self.node.inbox.put_control(request)
        return request.future

    def _cancel(self, goal: GoalRecord, reason: str) -> bool:
        """Begin to cancel a goal. Returns False if it is too late. The body is interrupted where it waits, and may clean up."""
        if not goal.is_open:
            return False
        if goal.interruption is None:
            self.table.cancel(goal.goal_id)
            self._interrupt(goal, reason)
        return True

    def _interrupt(self, goal: GoalRecord, reason: str) -> None:
        """Interrupt the body of a goal. A goal whose body has not begun ends at once."""
        goal.interruption = reason
        goal.interrupted_at = (self.node.inbox.loop.time(), goal.feedback_count)
        self._changed(goal)
        if goal.task is not None:
            goal.task.cancel()
        if goal.task is None or goal.body is None:  # a task that is canceled before its first step never runs
            self._end(goal, create(Outcome, goal.interrupted_as, reason=reason))
            self._start_next()

    # -- the end of a goal ---------------------------------------------------------------------------------------------------

    def _end(self, goal: GoalRecord, outcome: Outcome) -> None:
        """Store the outcome of a goal, by legal transitions only, and tell all who wait for it. A second outcome is ignored."""
        if goal.status.is_terminal:
            return
        if goal.status is GoalStatus.ACCEPTED:  # it never ran because its node ended first
            self.table.execute(goal)
        self.table.end(goal, _EVENTS[outcome.status], self.node.clock.now_ns(), outcome.result, outcome.reason)
        if self._expiry is None:
            self._expire_later(0)
        self._observe()
        self.ways.ended(goal, outcome)

    def _tell_end(self, goal: GoalRecord, outcome: Outcome) -> None:
        client, goal.client = goal.client, None
        if client is not None:
            client.on_result(outcome)
        goal.waiters.wake_all()

    def _changed(self, goal: GoalRecord) -> None:
        if goal.client is not None:
            goal.client.on_status(goal.status)
        self._observe()

    def _observe(self) -> None:
        for observer in self.on_status:
            observer()

    async def result_of(self, goal_id: bytes) -> tuple[GoalStatus, object]:
        """Wait for the end of a goal and return its status and result (None if there is none). For an unknown id, return UNKNOWN at
        once."""
        self._expire()
        goal = self.table.get(goal_id)
        if goal is None:
            return GoalStatus.UNKNOWN, None
        while goal.status.is_active:
            await goal.waiters.wait()
        return goal.status, goal.result

    def _expire(self) -> None:
        self.table.expire(self.node.clock.now_ns())

    def _expire_later(self, wait_ns: int) -> None:
        """Set the timer that removes the next result to expire, even if no further goal arrives, but no sooner than `wait_ns` from now."""
        due = self.table.next_expiry()
        if due is not None:
            clock = self.node.clock
            self._expiry = clock.call_at((max(due, clock.now_ns() + wait_ns) + 1) / 1e9, self._expire_now)

    def _expire_now(self) -> None:
        """Remove the results that have expired, and set the timer again. Results may be removed late, by up to a tenth of the timeout."""
        if self._expiry is not None:
            self._expiry = None
            self._expire()
            self._expire_later(self.table.result_timeout_ns // 10)

    # -- the end of the node -------------------------------------------------------------------------------------------------

    def stop(self, reason: str) -> list[asyncio.Task[None]]:
        """Interrupt every goal because the node ends. Returns the tasks that still have to clean up."""
        for goal in (*self.waiting, *self.running):
            if not goal.is_open:
                assert goal.task is not None
                goal.task.cancel()  # it has yielded its last item, which decides its outcome
            elif goal.interruption is None:
                self._interrupt(goal, reason)
        return [goal.task for goal in self.running if goal.task is not None]

    def fail_all(self, error: Callable[[], Exception]) -> None:
        """Abort the goals that are still active, and fail unanswered requests with `error()`, because the node has ended."""
        for goal in (*self.waiting, *self.running):
            self._end(goal, create(Outcome, GoalStatus.ABORTED, reason=str(error())))
        for request in self.requests:
            request.fail(error())
        self.requests.clear()
        expiry, self._expiry = self._expiry, None
        if expiry is not None:
            expiry.cancel()


def places(arrivals: ArrivalPolicy) -> int:
    """The number of goals that may run at once."""
    return arrivals.size if arrivals.policy == "parallel" else 1


def refusal(arrivals: ArrivalPolicy, waiting: int, running: int) -> str | None:
    """Why a goal that arrives now is rejected; None if it is accepted. A goal that preempts others is always accepted."""
    policy, size = arrivals.policy, arrivals.size
    if policy == "queue" and waiting >= size:
        return f"the queue is full: {size} goals wait"
    if policy == "parallel" and waiting + running >= size:
        return f"{size} goals run already"
    if policy == "reject" and waiting + running:
        return "another goal is running"
    return None
