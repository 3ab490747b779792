"""`JournalBoundary`: the boundary of a node, or of a subtree, when a journal is written and when it is replayed."""

from __future__ import annotations

import asyncio
from abc import abstractmethod
from collections.abc import Awaitable, Callable, Coroutine
from contextvars import Context
from typing import Any, Final, TypeVar, cast
from weakref import WeakKeyDictionary

from actors.actions.client import SentGoals
from actors.actions.peers import ActionPeer, GoalFollower, Outcome
from actors.actions.server import ActionServer, GoalRequest, ServedGoals
from actors.errors import described
from actors.graph.servers import ActionEntry, S, ServerEntry, ServiceEntry
from actors.inbox.boundary import BOUNDARY, outside
from actors.inbox.inbox import Inbox
from actors.interfaces.message import Message, Req, Resp
from actors.replay.journaled_loop import Callback, OwnedTask
from actors.runtime.incarnation import Incarnation
from actors.runtime.interceptor import Interceptor
from actors.runtime.timers import NodeTimer, Ticked
from actors.services.client import Client
from actors.services.peers import Answering, Caller, OpenCall, Requester, ServiceCall, ServicePeer, Submit
from actors.services.server import Request, Server, Take
from actors.supervision.peers import Life
from actors.topics.peers import PublisherPeer, SubscriptionPeer, Target

T = TypeVar("T")

CANCELED: Final = "canceled"


class JournalBoundary(Interceptor):
    """The boundary of the nodes `members`: of one, or of those of a subtree. Code in whose context `BOUNDARY` is this one belongs to a member.

    What other code does to a member goes through `enter`, what a member does to others through `leave`. A derived class says what these do (`enter`,
    `leave`, `send`), and how callbacks run. What a member sends to members alone does not pass.

    Invariants:

    - The numbers that stand for callbacks, tasks, timers, futures and subscriptions of the members are given in the order in which their
      own code brings them about. So they are the same whenever their code is given the same.
    - `members` has each node from its first life on.
    - `lives` has each life of a member, by its task, until that has ended.
    - `futures` are those of others that a member was given, and those of calls between members; each has its number until it is dropped.
    """

    def __init__(self) -> None:
        self.members: dict[str, Inbox] = {}
        """Full name -> inbox."""
        self.lives: dict[asyncio.Task[object], Incarnation] = {}
        self.tasks: dict[int, OwnedTask] = {}
        self.timers: list[tuple[str, NodeTimer]] = []
        """Each with its name: its node, method and rate."""
        self.answers: dict[int, Answer] = {}
        self.followers: dict[int, object] = {}
        self.subscriptions: list[SubscriptionPeer] = []
        self.futures: WeakKeyDictionary[asyncio.Future[Any], int] = WeakKeyDictionary()
        self._subscription_numbers: dict[int, int] = {}
        self._scheduled = self._begun = self._awaited = self._followed = self._owing = 0

    # -- what a derived class does ------------------------------------------------------------------------------------------

    @abstractmethod
    def enter(self, kind: str, details: tuple[object, ...], function: Callable[..., T], *arguments: object) -> T:
        """Note that something comes in, and call `function`, which takes it in, as code of a member."""

    @abstractmethod
    def compute(self, function: Callable[..., T], arguments: tuple[object, ...]) -> T:
        """See `Boundary.compute`."""

    @abstractmethod
    def elsewhere(self, name: str, work: Callable[[], Coroutine[object, None, object]]) -> asyncio.Future[object]:
        """See `Boundary.elsewhere`."""

    @abstractmethod
    def uses(self, entry: ServiceEntry | ActionEntry) -> None:
        """Note that a member depends on who serves a name."""

    @abstractmethod
    def leave(
        self, kind: str, name: str, value: object, function: Callable[..., T], *arguments: object, inner: bool = False
    ) -> T:
        """As `send`, and call `function`, which takes it, as code of others. A future that it returns is one of theirs."""

    @abstractmethod
    def send(self, kind: str, name: str, value: object, *, inner: bool = False) -> None:
        """Note what goes out, or is drawn; with `inner`, what goes to other members alone."""

    @abstractmethod
    def plan(
        self, plain: Callable[..., asyncio.Handle], when: float | None, number: int, callback: Callback, arguments: tuple[object, ...],
        context: Context | None,
    ) -> asyncio.Handle:  # fmt: skip
        """Have the callback with this number called."""

    @abstractmethod
    def read(self, clock: Callable[[], float]) -> float:
        """The time that a member's code reads from `clock`."""

    @abstractmethod
    def in_thread(self, start: Callable[[], asyncio.Future[T]], name: str) -> asyncio.Future[T]:
        """The future of work in an executor, which `start()` begins."""

    @abstractmethod
    def expected(self, future: asyncio.Future[T], number: int) -> None:
        """A member was given a future that others complete, or may."""

    # -- the lives of the members -------------------------------------------------------------------------------------------

    async def live(self, node: Incarnation, life: Life, started: Callable[[], None]) -> None:
        """Run one life of a member in the present task, as its code, and send how it has ended."""
        task = asyncio.current_task()
        assert isinstance(task, OwnedTask)
        self.begin(task)
        self.lives[task] = node
        task.add_done_callback(self.lives.pop, context=Context())
        token = BOUNDARY.set(self)
        try:
            await life.run(_outside(started))
        except BaseException as error:
            self.send("end", node.fqn, described(error))
            raise
        else:
            self.send("end", node.fqn, "")
        finally:
            BOUNDARY.reset(token)

    # -- the event loop -----------------------------------------------------------------------------------------------------

    def schedule(
        self,
        plain: Callable[..., asyncio.Handle],
        when: float | None,
        callback: Callback,
        arguments: tuple[object, ...],
        context: Context | None,
    ) -> asyncio.Handle:
        """Have `callback` called soon, or at the loop time `when`. `plain(callback, *arguments, context=context)` is the loop's own way."""
        self._scheduled += 1
        return self.plan(plain, when, self._scheduled, callback, arguments, context)

    def begin(self, task: OwnedTask) -> None:
        """A task of a member has been made."""
        self._begun += 1
        task.boundary, task.number = self, self._begun
        self.tasks[task.number] = task
        task.add_done_callback(_forgets(self.tasks), context=Context())

    def cancel(self, task: OwnedTask, cancel: Callable[[object], bool], message: object) -> bool:
        """Other code cancels a task of a member: call `cancel(message)`."""
        return self.enter("interrupt", (task.number, None), cancel, message)

    # -- the graph, which tells of every end that joins or leaves -------------------------------------------------------------

    def publisher_joined(self, publisher: PublisherPeer) -> None:
        """Do nothing."""

    def publisher_left(self, publisher: PublisherPeer) -> None:
        """Do nothing."""

    def subscription_joined(self, subscription: SubscriptionPeer) -> None:
        if self.owns(subscription):
            self.number_of(subscription)

    def subscription_left(self, subscription: SubscriptionPeer) -> None:
        """Do nothing."""

    def server_changed(self, entry: ServerEntry[S]) -> None:
        """Do nothing."""

    def server_sought(self, entry: ServerEntry[S]) -> None:
        """Do nothing."""

    # -- what comes in ------------------------------------------------------------------------------------------------------

    def entering(self, node: Caller, what: str, enter: Callable[..., object]) -> Callable[..., object]:
        if node.fqn not in self.members:
            return enter

        def entered(value: object) -> object:
            return self.enter(what, (node.fqn, value), enter, value)

        return entered

    def ticking(self, timer: NodeTimer, tick: Ticked) -> Ticked:
        node = next((fqn for fqn, inbox in self.members.items() if inbox is timer.inbox), None)
        if node is None:
            return tick
        number, name = len(self.timers), f"{node} {timer.label.rpartition('.')[2]} at {timer.hz:g} Hz"
        self.timers.append((name, timer))
        return lambda k, due: self.enter("tick", (number, name, k, due), tick, k, due)

    def taking(self, server: Server, take: Take) -> Take:
        if server.node.fqn not in self.members:
            return take

        def taken(message: Message, caller: Requester, timeout: float) -> Request:
            if BOUNDARY.get() is self:
                return take(message, caller, timeout)
            number = self._owing = self._owing + 1
            details = (number, server.entry.name, message, caller.fqn, timeout)
            request: Request = self.enter("request", details, self._take, number, take, message, caller, timeout)
            return request

        return taken

    def serving_goals(self, server: ActionServer, ways: ServedGoals) -> ServedGoals:
        if server.node.fqn not in self.members:
            return ways
        name = server.entry.name

        def submit(goal_id: bytes, message: Message, client: GoalFollower | None) -> GoalRequest:
            if BOUNDARY.get() is self:
                return ways.submit(goal_id, message, client)
            number = self._owing = self._owing + 1
            follower = None if client is None else OutwardFollower(self, name, goal_id, client)
            details = (number, name, goal_id, message, None if client is None else client.owner)
            wrapped = (goal_id, message, follower)
            request: GoalRequest = self.enter("goal", details, self._take, number, ways.submit, *wrapped)
            return request

        def cancel(goal_id: bytes, reason: str) -> Awaitable[bool]:
            if BOUNDARY.get() is self:
                return ways.cancel(goal_id, reason)
            return self.enter("cancel", (name, goal_id, reason), ways.cancel, goal_id, reason)

        return ways._replace(submit=submit, cancel=cancel)

    def _take(self, number: int, take: Callable[..., T], *arguments: object) -> T:
        taken = take(*arguments)
        request: Any = taken
        request.future = self.answers[number] = Answer(self, number)
        return taken

    def number_of(self, subscription: SubscriptionPeer) -> int:
        """The number of a subscription of a member, which it gets when the graph first meets it."""
        number = self._subscription_numbers.get(id(subscription))
        if number is None:
            number = self._subscription_numbers[id(subscription)] = len(self.subscriptions)
            self.subscriptions.append(subscription)
        return number

    # -- what goes out ------------------------------------------------------------------------------------------------------

    def tapping(self, publisher: PublisherPeer) -> Target | None:
        return nothing if self.owns(publisher) else None  # so that `publishing` is asked, even if nobody listens

    def publishing(self, publisher: PublisherPeer, targets: tuple[Target, ...]) -> tuple[Target, ...]:
        if not self.owns(publisher):
            return targets
        mine: Any = publisher
        name, matched = publisher.entry.name, mine.peers
        others = {one.node.fqn for one in matched} - {publisher.node.fqn}
        inner = bool(others) and all(map(self.owns, matched))

        def deliver(message: object) -> None:
            for target in targets:
                target(message)

        def publish(message: object) -> None:
            if BOUNDARY.get() is self:
                self.leave("publish", name, getattr(message, "message", message), deliver, message, inner=inner)
            else:
                deliver(message)

        return (publish,)

    def owns(self, peer: PublisherPeer | SubscriptionPeer) -> bool:
        """Whether an end of a topic belongs to a member."""
        return peer.here and peer.node.fqn in self.members

    def to_itself(self, target: Target) -> Target:
        """`target`, called as code of the members: one hears what it, or another, has published."""

        def deliver(message: object) -> None:
            token = BOUNDARY.set(self)
            try:
                target(message)
            finally:
                BOUNDARY.reset(token)

        return deliver

    def calling(self, client: Client[Req, Resp], submit: Submit) -> Submit:
        if client.node.fqn not in self.members:
            return submit
        name = client.entry.name
        self.uses(cast("ServiceEntry", client.entry))

        def submitted(server: ServicePeer, message: Message, caller: Caller, timeout: float) -> ServiceCall:
            if self._is_inside(server):
                self.send("call", name, (message, timeout), inner=True)
                call = submit(server, message, caller, timeout)
            else:
                call = self.leave("call", name, (message, timeout), submit, server, message, caller, timeout)
            self.expect(call.future)
            return call

        return submitted

    def sending_goals(self, node: Caller, entry: ActionEntry, ways: SentGoals) -> SentGoals:
        if node.fqn not in self.members:
            return ways
        self.uses(entry)

        def submit(server: ActionPeer, goal_id: bytes, message: Message, client: GoalFollower) -> OpenCall:
            if self._is_inside(server):
                self.send("goal", entry.name, (goal_id, message), inner=True)
                request = ways.submit(server, goal_id, message, client)
            else:
                self._followed += 1
                self.followers[self._followed] = client
                inward = InwardFollower(self, self._followed, client)
                sent = (goal_id, message)
                request = self.leave("goal", entry.name, sent, ways.submit, server, goal_id, message, inward)
            self.expect(request.future)
            return request

        def cancel(server: ActionPeer, goal_id: bytes, reason: str) -> Awaitable[bool]:
            if not self._is_inside(server):
                return self.leave("cancel", entry.name, (goal_id, reason), ways.cancel, server, goal_id, reason)
            self.send("cancel", entry.name, (goal_id, reason), inner=True)
            answer = ways.cancel(server, goal_id, reason)
            self.expect(asyncio.ensure_future(answer))
            return answer

        return ways._replace(submit=submit, cancel=cancel)

    def drawing(self, node: Caller, draw: Callable[[], bytes]) -> Callable[[], bytes]:
        if node.fqn not in self.members:
            return draw

        def drawn() -> bytes:
            number = draw()
            self.send("id", node.fqn, number)
            return number

        return drawn

    def _is_inside(self, server: Answering) -> bool:
        return server.node is not None and server.node.fqn in self.members

    def expect_if_future(self, answer: object) -> None:
        """Expect what others have returned to a member, if it is to be awaited."""
        if asyncio.isfuture(answer):
            self.expect(answer)

    def expect(self, future: asyncio.Future[T]) -> None:
        """Give a number to a future that is completed, or may be, by others."""
        self._awaited += 1
        self.futures[future] = self._awaited
        self.expected(future, self._awaited)
        future.add_done_callback(nothing)  # so that its end is always noticed as a callback of the node


class Answer(asyncio.Future[object]):
    """The answer that a member owes to a request or to the request for a goal."""

    def __init__(self, boundary: JournalBoundary, number: int) -> None:
        super().__init__()
        self._boundary = boundary
        self._number = number

    def set_result(self, result: object, /) -> None:
        self._owed(super().set_result, result, result)

    def set_exception(self, exception: object, /) -> None:
        self._owed(super().set_exception, exception, exception)

    def cancel(self, msg: object = None) -> bool:
        if self.done() or BOUNDARY.get() is self._boundary:
            return super().cancel(msg)
        return self._boundary.enter("given up", (self._number, CANCELED), super().cancel, msg)

    def _owed(self, complete: Callable[[Any], None], value: object, note: object) -> None:
        self._boundary.answers.pop(self._number, None)
        if BOUNDARY.get() is self._boundary:
            told = described(note) if isinstance(note, BaseException) else note
            self._boundary.leave("answer", f"#{self._number}", told, complete, value)
        else:
            self._boundary.enter("given up", (self._number, note), complete, value)


class InwardFollower:
    """What a server of others tells of a goal of a member."""

    def __init__(self, boundary: JournalBoundary, number: int, follower: GoalFollower) -> None:
        self._boundary = boundary
        self._number = number
        self._follower = follower
        self.owner: Final = follower.owner

    def on_status(self, status: object) -> None:
        self._boundary.enter("goal status", (self._number, status), self._follower.on_status, status)

    def on_feedback(self, feedback: object) -> None:
        self._boundary.enter("feedback", (self._number, feedback), self._follower.on_feedback, feedback)

    def on_result(self, outcome: Outcome) -> None:
        told = (self._number, outcome.status, outcome.result, outcome.reason)
        self._boundary.enter("outcome", told, self._follower.on_result, outcome)
        self._boundary.followers.pop(self._number, None)


class OutwardFollower:
    """What a member tells the client of a goal that it serves."""

    def __init__(self, boundary: JournalBoundary, action: str, goal_id: bytes, client: GoalFollower) -> None:
        self._boundary = boundary
        self._name = action
        self._goal_id = goal_id
        self._client = client
        self.owner: Final = client.owner

    def on_status(self, status: Any) -> None:
        self._boundary.leave("status", self._name, (self._goal_id, status.name), self._client.on_status, status)

    def on_feedback(self, feedback: object) -> None:
        self._boundary.leave("feedback", self._name, feedback, self._client.on_feedback, feedback)

    def on_result(self, outcome: Outcome) -> None:
        told = (self._goal_id, outcome.status.name, outcome.result, outcome.reason)
        self._boundary.leave("outcome", self._name, told, self._client.on_result, outcome)


def _outside(started: Callable[[], None]) -> Callable[[], None]:
    """`started`, called as code of the supervisor, which then starts other nodes."""

    def call() -> None:
        with outside():
            started()

    return call


def _forgets(tasks: dict[int, OwnedTask]) -> Callable[[OwnedTask], None]:
    def forget(task: OwnedTask) -> None:
        tasks.pop(task.number, None)

    return forget


def nothing(_: object) -> None:
    """Do nothing."""
