"""`Edge`: what the border of a node, or of a subtree, does both when a journal is written and when it is replayed."""

from __future__ import annotations

import asyncio
from abc import abstractmethod
from collections.abc import Callable
from contextvars import Context
from typing import TYPE_CHECKING, Any, Final, TypeVar
from weakref import WeakKeyDictionary

from actors.errors import described
from actors.inbox.border import INSIDE, Border, Timed, outside
from actors.replay.loop_seam import OwnedTask

if TYPE_CHECKING:
    from actors.actions.peers import GoalFollower, Outcome
    from actors.replay.loop_seam import Callback
    from actors.runtime.incarnation import Incarnation
    from actors.topics.peers import PublisherPeer, SubscriptionPeer, Target

T = TypeVar("T")

CANCELED: Final = "canceled"


class Edge(Border):
    """The border of the nodes `members`: of one, or of those of a subtree. A derived class says what is done with what passes (`enter`,
    `leave`, `send`), and how callbacks run. What a member sends to members alone does not pass.

    Invariants:

    - The numbers that stand for callbacks, tasks, timers, futures and subscriptions of the members are given in the order in which their
      own code brings them about. So they are the same whenever their code is given the same.
    - `members` has each node from its first life on.
    - `lives` has each life of a member, by its task, until that has ended.
    - `futures` are those of others that a member was given, and those of calls between members; each has its number until it is dropped.
    """

    def __init__(self) -> None:
        self.members: set[str] = set()
        self.lives: dict[asyncio.Task[Any], Incarnation] = {}
        self.tasks: dict[int, OwnedTask] = {}
        self.timers: list[tuple[str, Timed]] = []
        """Each with its name: its node, method and rate."""
        self.answers: dict[int, Answer] = {}
        self.followers: dict[int, Any] = {}
        self.subscriptions: list[Any] = []
        self.futures: WeakKeyDictionary[asyncio.Future[Any], int] = WeakKeyDictionary()
        self._subscription_numbers: dict[int, int] = {}
        self._scheduled = self._begun = self._awaited = self._followed = self._owing = 0

    # -- what a derived class does ------------------------------------------------------------------------------------------

    @abstractmethod
    def leave(
        self, kind: str, name: str, value: Any, function: Callable[..., T], *arguments: Any, inner: bool = False
    ) -> T:
        """As `send`, and call `function`, which takes it, as code of others. A future that it returns is one of theirs."""

    @abstractmethod
    def send(self, kind: str, name: str, value: Any, *, inner: bool = False) -> None:
        """Note what goes out, or is drawn; with `inner`, what goes to other members alone."""

    @abstractmethod
    def plan(
        self, plain: Callable[..., asyncio.Handle], when: float | None, number: int, callback: Callback, arguments: tuple[Any, ...],
        context: Context | None,
    ) -> asyncio.Handle:  # fmt: skip
        """Have the callback with this number called."""

    @abstractmethod
    def expected(self, future: asyncio.Future[Any], number: int) -> None:
        """A member was given a future that others complete, or may."""

    # -- the lives of the members -------------------------------------------------------------------------------------------

    async def live(self, life: Incarnation, started: Callable[[], None]) -> None:
        """Run one life of a member in the present task, as its code, and send how it has ended."""
        task = asyncio.current_task()
        assert isinstance(task, OwnedTask)
        self.begin(task)
        self.lives[task] = life
        task.add_done_callback(self.lives.pop, context=Context())
        token = INSIDE.set(self)
        try:
            await life.run(_outside(started))
        except BaseException as error:
            self.send("end", life.fqn, described(error))
            raise
        else:
            self.send("end", life.fqn, "")
        finally:
            INSIDE.reset(token)

    # -- the event loop -----------------------------------------------------------------------------------------------------

    def schedule(
        self,
        plain: Callable[..., asyncio.Handle],
        when: float | None,
        callback: Callback,
        arguments: tuple[Any, ...],
        context: Context | None,
    ) -> asyncio.Handle:
        self._scheduled += 1
        return self.plan(plain, when, self._scheduled, callback, arguments, context)

    def begin(self, task: OwnedTask) -> None:
        self._begun += 1
        border: Any = self
        task.border, task.number = border, self._begun
        self.tasks[task.number] = task
        task.add_done_callback(_forgets(self.tasks), context=Context())

    def cancel(self, task: OwnedTask, cancel: Callable[[Any], bool], message: Any) -> bool:
        return self.enter("interrupt", (task.number, None), cancel, message)

    # -- what comes in ------------------------------------------------------------------------------------------------------

    def tick(self, timer: Timed) -> Callable[[int, float], None]:
        number, name = len(self.timers), self._name_of(timer)
        self.timers.append((name, timer))

        def ticked(k: int, due: float) -> None:
            self.enter("tick", (number, name, k, due), timer.on_tick, k, due)

        return ticked

    def _name_of(self, timer: Timed) -> str:
        node = next((life.fqn for life in self.lives.values() if life.inbox is timer.inbox), "")
        return f"{node} {timer.label.rpartition('.')[2]} at {timer.hz:g} Hz"

    def request(self, submit: Callable[..., Any], server: str, message: Any, caller: Any, timeout: float) -> Any:
        number = self._owing = self._owing + 1
        details = (number, server, message, caller.fqn, timeout)
        return self.enter("request", details, self._take, number, submit, message, caller, timeout)

    def goal(
        self, submit: Callable[..., Any], server: str, goal_id: bytes, message: Any, client: GoalFollower | None
    ) -> Any:
        number = self._owing = self._owing + 1
        follower = None if client is None else OutwardFollower(self, server, goal_id, client)
        details = (number, server, goal_id, message, None if client is None else client.owner)
        return self.enter("goal", details, self._take, number, submit, goal_id, message, follower)

    def _take(self, number: int, submit: Callable[..., Any], *arguments: Any) -> Any:
        request = submit(*arguments)
        request.future = self.answers[number] = Answer(self, number)
        return request

    def number_of(self, subscription: SubscriptionPeer) -> int:
        """The number of a subscription of a member, which it gets when the graph first meets it."""
        number = self._subscription_numbers.get(id(subscription))
        if number is None:
            number = self._subscription_numbers[id(subscription)] = len(self.subscriptions)
            self.subscriptions.append(subscription)
        return number

    # -- what goes out ------------------------------------------------------------------------------------------------------

    def outward(self, publisher: PublisherPeer, targets: tuple[Target, ...]) -> tuple[Target, ...]:
        if not self.owns(publisher):
            return targets
        mine: Any = publisher
        name, matched = publisher.entry.name, mine.peers
        others = {one.node.fqn for one in matched} - {publisher.node.fqn}
        inner = bool(others) and all(map(self.owns, matched))

        def deliver(message: Any) -> None:
            for target in targets:
                target(message)

        def publish(message: Any) -> None:
            if INSIDE.get() is self:
                self.leave("publish", name, getattr(message, "message", message), deliver, message, inner=inner)
            else:
                deliver(message)

        return (publish,)

    def owns(self, peer: PublisherPeer | SubscriptionPeer) -> bool:
        """Whether an end of a topic belongs to a member."""
        return peer.here and peer.node.fqn in self.members

    def to_itself(self, target: Target) -> Target:
        """`target`, called as code of the members: one hears what it, or another, has published."""

        def deliver(message: Any) -> None:
            token = INSIDE.set(self)
            try:
                target(message)
            finally:
                INSIDE.reset(token)

        return deliver

    def call(self, server: Any, name: str, message: Any, caller: Any, timeout: float) -> Any:
        if self._is_inside(server):
            self.send("call", name, (message, timeout), inner=True)
            call = server.submit(message, caller, timeout)
        else:
            call = self.leave("call", name, (message, timeout), server.submit, message, caller, timeout)
        self.expect(call.future)
        return call

    def start_goal(self, server: Any, name: str, goal_id: bytes, message: Any, follower: Any) -> Any:
        if self._is_inside(server):
            self.send("goal", name, (goal_id, message), inner=True)
            request = server.submit(goal_id, message, follower)
        else:
            self._followed += 1
            self.followers[self._followed] = follower
            inward = InwardFollower(self, self._followed, follower)
            request = self.leave("goal", name, (goal_id, message), server.submit, goal_id, message, inward)
        self.expect(request.future)
        return request

    def cancel_goal(self, server: Any, name: str, goal_id: bytes, reason: str) -> Any:
        if not self._is_inside(server):
            return self.leave("cancel", name, (goal_id, reason), server.cancel, goal_id, reason)
        self.send("cancel", name, (goal_id, reason), inner=True)
        answer = server.cancel(goal_id, reason)
        self.expect(answer)
        return answer

    def _is_inside(self, server: Any) -> bool:
        return server.node is not None and server.node.fqn in self.members

    def expect_if_future(self, answer: object) -> None:
        """Expect what others have returned to a member, if it is to be awaited."""
        if asyncio.isfuture(answer):
            self.expect(answer)

    def expect(self, future: asyncio.Future[Any]) -> None:
        """Give a number to a future that is completed, or may be, by others."""
        self._awaited += 1
        self.futures[future] = self._awaited
        self.expected(future, self._awaited)
        future.add_done_callback(_nothing)  # so that its end is always noticed as a callback of the node


class Answer(asyncio.Future[Any]):
    """The answer that a member owes to a request or to the request for a goal."""

    def __init__(self, edge: Edge, number: int) -> None:
        super().__init__()
        self._edge = edge
        self._number = number

    def set_result(self, result: Any, /) -> None:
        self._owed(super().set_result, result, result)

    def set_exception(self, exception: Any, /) -> None:
        self._owed(super().set_exception, exception, exception)

    def cancel(self, msg: Any = None) -> bool:
        if self.done() or INSIDE.get() is self._edge:
            return super().cancel(msg)
        return self._edge.enter("given up", (self._number, CANCELED), super().cancel, msg)

    def _owed(self, complete: Callable[[Any], None], value: Any, note: Any) -> None:
        self._edge.answers.pop(self._number, None)
        if INSIDE.get() is self._edge:
            told = described(note) if isinstance(note, BaseException) else note
            self._edge.leave("answer", f"#{self._number}", told, complete, value)
        else:
            self._edge.enter("given up", (self._number, note), complete, value)


class InwardFollower:
    """What a server of others tells of a goal of a member."""

    def __init__(self, edge: Edge, number: int, follower: GoalFollower) -> None:
        self._edge = edge
        self._number = number
        self._follower = follower
        self.owner: Final = follower.owner

    def on_status(self, status: Any) -> None:
        self._edge.enter("goal status", (self._number, status), self._follower.on_status, status)

    def on_feedback(self, feedback: Any) -> None:
        self._edge.enter("feedback", (self._number, feedback), self._follower.on_feedback, feedback)

    def on_result(self, outcome: Outcome) -> None:
        told = (self._number, outcome.status, outcome.result, outcome.reason)
        self._edge.enter("outcome", told, self._follower.on_result, outcome)
        self._edge.followers.pop(self._number, None)


class OutwardFollower:
    """What a member tells the client of a goal that it serves."""

    def __init__(self, edge: Edge, action: str, goal_id: bytes, client: GoalFollower) -> None:
        self._edge = edge
        self._name = action
        self._goal_id = goal_id
        self._client = client
        self.owner: Final = client.owner

    def on_status(self, status: Any) -> None:
        self._edge.leave("status", self._name, (self._goal_id, status.name), self._client.on_status, status)

    def on_feedback(self, feedback: Any) -> None:
        self._edge.leave("feedback", self._name, feedback, self._client.on_feedback, feedback)

    def on_result(self, outcome: Outcome) -> None:
        told = (self._goal_id, outcome.status.name, outcome.result, outcome.reason)
        self._edge.leave("outcome", self._name, told, self._client.on_result, outcome)


def _outside(started: Callable[[], None]) -> Callable[[], None]:
    """`started`, called as code of the supervisor, which then starts other nodes."""

    def call() -> None:
        with outside():
            started()

    return call


def _forgets(tasks: dict[int, OwnedTask]) -> Callable[[Any], None]:
    def forget(task: OwnedTask) -> None:
        tasks.pop(task.number, None)

    return forget


def _nothing(_: object) -> None:
    """Do nothing."""
