"""`Driver`: plays a tape to one node, which lives in a system of its own, in which there is nothing else."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from actors.actions.peers import Outcome
from actors.errors import described
from actors.inbox.border import INSIDE
from actors.inbox.control import Failure
from actors.replay.edge import CANCELED, name_of
from actors.replay.loop_seam import OwnedTask
from actors.replay.recording import started_outside
from actors.replay.replaying import AWAITED, Break, Replaying
from actors.replay.standins import Other, OtherFollower, OtherPublisher, OtherServer, OtherSubscription
from actors.replay.tape import Entry, Tape, Unkept, thawed

if TYPE_CHECKING:
    from actors.inbox.border import Timed
    from actors.replay.standins import Asked
    from actors.replay.tape import Start
    from actors.replay.tape_loop import TapeLoop
    from actors.runtime.incarnation import Incarnation
    from actors.runtime.record import NodeRecord
    from actors.supervision.declarations import Child
    from actors.supervision.seam import Life
    from actors.system import System

__all__ = ["Driver"]


class Driver:
    """Plays one tape. `change(child)` gives the declaration of the node that is played to, for that of each recorded life.

    Invariants:

    - `over` is done when the tape is at its end, when the node has done too much otherwise, or when the tape does not say what came next.
    - While the node lives, `_alive` is true. The next life, if its supervisor has asked for it, waits for `_gate`.
    - `_life` is the present or last life; None before the first.
    """

    def __init__(
        self, system: System, loop: TapeLoop, tape: Tape, change: Callable[[Child], Child], pause: Break | None, limit: int
    ) -> None:
        self.edge = Replaying(tape, self._apply, pause, limit)
        self.over: asyncio.Future[None] = loop.create_future()
        self.lacking = ""
        """What came in next that the journal does not carry; empty if it carries everything."""
        self.failure = ""
        """The error with which the last life of the node ended; empty if it did not fail."""
        self._system, self._loop, self._tape, self._change = system, loop, tape, change
        self._gate: asyncio.Future[Start] | None = None
        self._life: Incarnation | None = None
        self._alive = False
        self._task: OwnedTask | None = None
        self._peers: dict[int, Any] = {}
        self._late: list[tuple[float, Asked]] = []
        """What the node has asked on its own, and when it is to be told that nobody answers; only when it is astray."""
        self._known_timers = {one[4] for one in tape.entries if isinstance(one, tuple) and one[0] == "tick"}
        self._ticking = 0
        """How many of the node's timers are known to tick by the tape, or by themselves."""
        self._names = [entry for entry in tape.outputs() if entry[0] in AWAITED]
        graph: Any = system.graph
        opened = graph.open_standard_service

        def open_standard_service(entry: Any) -> None:
            opened(entry)
            if INSIDE.get() is self.edge:
                self.edge.served(entry)

        graph.open_standard_service = open_standard_service
        graph.borders.append(self.edge)
        graph.watchers.append(_Numbers(self.edge))

    # -- between supervisor and node -----------------------------------------------------------------------------------------

    def life(self, record: NodeRecord, make: Callable[[], Incarnation], /) -> Life:
        return _PlayedLife(self, record)

    async def live(self, record: NodeRecord, started: Callable[[], None]) -> None:
        """One life of the node, from the moment at which the tape begins it."""
        self._gate = self._loop.create_future()
        start = await self._gate
        edge, self._gate, self._alive = self.edge, None, True
        if record.incarnation == 0:
            record.incarnation, record.saved = start.incarnation - 1, thawed(start.saved)
            record.asked_state = start.state
        record.inbox.border = edge
        task = asyncio.current_task()
        assert isinstance(task, OwnedTask)
        self._task = task
        token = INSIDE.set(edge)
        try:
            self._life = self._system.runtime.incarnate(self._change(thawed(start.child)), record)
            edge.begin(task)
            await self._life.run(started_outside(started))
        except BaseException as error:
            self.failure = described(error)
            edge.send("end", type(error).__name__, described(error))
            raise
        else:
            self.failure = ""
            edge.send("end", "", "")
        finally:
            INSIDE.reset(token)
            self._alive = False

    def give_up(self, reason: str) -> None:
        """End the present life, because the replay is over."""
        if self._life is not None:
            self._life.stop(reason)

    # -- the course of the tape ----------------------------------------------------------------------------------------------

    def drive(self) -> None:
        """Play as far as possible without a turn of the loop; then come back, until the tape is over."""
        try:
            self._drive()
        except BaseException as error:
            self.edge.over = True
            self.over.set_exception(error)

    def _drive(self) -> None:
        edge = self.edge
        while not (edge.over or self.lacking or self.over.done()):
            if edge.astray:
                going = self._stray()
            else:
                entry = edge.entry()
                going = None if entry is None else self._follow(entry)
            if going is None:
                break
            if not going:
                self._loop.call_soon(self.drive)
                return
        if not self.over.done():
            if not (edge.over or self.lacking):
                edge.end()
            edge.over = True
            self.over.set_result(None)

    def _follow(self, entry: Entry) -> bool:
        """Play one entry as it was. Returns False if the loop has to turn first, or afterwards."""
        edge = self.edge
        if isinstance(entry, float) or entry[0] == "result":
            edge.stray()  # the recording has read the clock here
            return True
        if entry[0] == "out":
            edge.missed(entry)
            return True
        if entry[0] == "start" and self._gate is None:
            return False
        edge.at += 1
        self._at(entry[1])
        edge.look_ahead()
        if entry[0] != "step":
            self._apply(entry)
            return entry[0] != "start"
        handle = edge.planned.pop(entry[2], None)
        if handle is None:
            edge.stray()
        else:
            self._run(handle)
        return True

    def _stray(self) -> bool | None:
        """Play the next thing to a node that has left the tape: its own callbacks as they are due, and what came in as it came.

        Returns False if the loop has to turn first, or afterwards; None at the end of the tape.
        """
        edge, entries = self.edge, self._tape.entries
        self._own_ticks()
        soon = next((number for number, handle in edge.planned.items() if not isinstance(handle, asyncio.TimerHandle)), None)
        if soon is not None:
            self._run(edge.planned.pop(soon))
            return True
        while edge.at < len(entries) and not _comes_in(entries[edge.at]):
            edge.at += 1
        if edge.at >= len(entries):
            return None
        entry = entries[edge.at]
        assert isinstance(entry, tuple)
        due, number = self._due()
        if due <= entry[1]:
            self._at(due)
            if number is None:
                self._nobody_answers()
            else:
                self._run(edge.planned.pop(number))
            return True
        starts = entry[0] == "start"
        if starts and self._gate is None and not self._alive:
            return False
        edge.at += 1
        self._at(entry[1])
        if not (starts and self._alive):  # else the changed node has not ended here
            self._apply(entry)
        return not starts

    def _due(self) -> tuple[float, int | None]:
        """When the next callback of the node is due, and its number; None for the end of a call that nobody answers."""
        planned = self.edge.planned
        for number in [number for number, handle in planned.items() if handle.cancelled()]:
            del planned[number]
        timers = ((handle.when(), number) for number, handle in planned.items() if isinstance(handle, asyncio.TimerHandle))
        due, number = min(timers, default=(math.inf, 0))
        late = min((when for when, _ in self._late), default=math.inf)
        return (late, None) if late < due else (due, number)

    def _own_ticks(self) -> None:
        """Have the timers tick that the recording does not know, each on its own grid."""
        for timer in self.edge.timers[self._ticking :]:
            if name_of(timer) not in self._known_timers:
                self._later_tick(timer, self.edge.now, 1)
        self._ticking = len(self.edge.timers)

    def _later_tick(self, timer: Timed, start: float, k: int) -> None:
        def tick() -> None:
            if timer.handle is not None:
                self._later_tick(timer, start, k + 1)
                timer.on_tick(k, start + k / timer.hz)

        token = INSIDE.set(self.edge)
        try:
            self._loop.call_at(start + k / timer.hz, tick)
        finally:
            INSIDE.reset(token)

    def _nobody_answers(self) -> None:
        from actors.errors import CallTimeout

        late = min(self._late, key=lambda one: one[0])
        self._late.remove(late)
        if not late[1].future.done():
            late[1].future.set_exception(CallTimeout("nobody answers in a replay: the recording has no such call"))

    def _at(self, time: float) -> None:
        self.edge.now = self._loop.now = time

    def _run(self, handle: asyncio.Handle) -> None:
        """Run one callback of the node, as the event loop does."""
        if not handle.cancelled():
            handle._run()  # noqa: SLF001  # pyright: ignore[reportPrivateUsage]  # the loop's own way, errors included

    # -- what comes in -------------------------------------------------------------------------------------------------------

    def _apply(self, entry: Entry) -> None:
        """Give the node one thing that came in."""
        assert isinstance(entry, tuple)
        kind, details = str(entry[0]), entry[3:]
        unkept = next((str(one) for one in details if isinstance(one, Unkept)), "")
        if kind == "unknown" or unkept:
            if not self.edge.astray:
                self.lacking = unkept or str(details[0])
            return
        _TAKEN[kind](self, *details)

    def _start(self, start: Start) -> None:
        assert self._gate is not None
        self._gate.set_result(start)

    def _stop(self, reason: str, system: str | None) -> None:
        self._system.runtime.tree.stop_reason = system
        if self._life is not None:
            self.edge.enter("stop", (), self._life.stop, reason)

    def _interrupt(self, number: int, killed: float | None) -> None:
        task = self.edge.tasks.get(number)
        child = None if self._life is None else self._system.runtime.child_of(self._life)
        if killed is not None and child is not None:
            child.kill(killed)
        elif task is not None:
            task.cancel()

    def _crash(self, error: BaseException) -> None:
        assert self._life is not None
        self.edge.enter("crash", (), self._life.inbox.put_control, Failure(error, "crash"))

    def _parameters(self, values: dict[str, Any]) -> None:
        assert self._life is not None
        self._life.node.set_parameters(values)

    def _tick(self, number: int, name: str, k: int, due: float) -> None:
        timers = self.edge.timers
        if self.edge.astray:
            timer = next((one for one in reversed(timers) if one.handle is not None and name_of(one) == name), None)
        else:
            timer = timers[number]
        if timer is not None:
            self.edge.enter("tick", (), timer.on_tick, k, due)

    def _deliver(self, number: int, peer: int, message: Any, expires: float | None) -> None:
        publisher = self._peers[peer]
        publisher.sent(message)
        subscription = self._subscription(number, publisher.entry.name)
        if subscription is None:
            return
        if expires is not None:
            from actors.inbox.expiring import ExpiringMessage

            message = ExpiringMessage(message, expires, self._loop.time)
        self.edge.enter("deliver", (), subscription.target(publisher), message)

    def _subscription(self, number: int, topic: str) -> Any:
        """The node's subscription with this number, if it is one of the topic; else its last one of the topic, or None."""
        known = self.edge.subscriptions
        if number < len(known) and known[number].entry.name == topic:
            return known[number]
        return next((one for one in reversed(known) if one.entry.name == topic), None)

    def _publisher(self, number: int, topic: str, node: str, kind: Any, qos: Any) -> None:
        entry = self._system.graph.topic(topic)
        self._peers[number] = publisher = OtherPublisher(number, entry, node, kind, qos, self.edge.catch_up)
        entry.add_publisher(publisher)

    def _subscriber(self, number: int, topic: str, node: str, kind: Any, qos: Any) -> None:
        entry = self._system.graph.topic(topic)
        self._peers[number] = subscription = OtherSubscription(entry, node, kind, qos)
        entry.add_subscription(subscription)

    def _gone(self, number: int) -> None:
        peer = self._peers.pop(number)
        (peer.entry.remove_publisher if isinstance(peer, OtherPublisher) else peer.entry.remove_subscription)(peer)

    def _server(self, kind: str, name: str, state: tuple[Any, ...] | None) -> None:
        graph = self._system.graph
        entry: Any = graph.action(name) if kind == "action" else graph.service(name)
        if state is None:
            entry.withdraw()
        elif state[0] == "here":
            entry.open(OtherServer(*state[1:], asked=self._asked))
        elif state[0] == "restarting" and state[1] != self.edge.node:
            entry.pause(*state[1:])
        elif state[0] == "stopped" and state[1] != self.edge.node:
            entry.close(state[1])

    def _asked(self, call: Asked, timeout: float | None) -> None:
        if self.edge.astray and timeout is not None:
            self._late.append((self.edge.now + timeout, call))

    def _request(self, number: int, name: str, message: Any, caller: str, timeout: float) -> None:
        graph = self._system.graph
        entry = graph.service(name)
        if entry.local is None:
            graph.open_standard_service(entry)
        server: Any = entry.local
        if server is not None:
            server.submit(message, _OtherCaller(caller), timeout).future.add_done_callback(_retrieve)

    def _goal(self, number: int, name: str, goal_id: bytes, message: Any, owner: str | None) -> None:
        server = self._system.graph.action(name).local
        if server is not None:
            follower = None if owner is None else OtherFollower(owner)
            server.submit(goal_id, message, follower).future.add_done_callback(_retrieve)

    def _cancel(self, name: str, goal_id: bytes, reason: str) -> None:
        server = self._system.graph.action(name).local
        if server is not None:
            server.cancel(goal_id, reason)

    def _given_up(self, number: int, how: Any) -> None:
        answer = self.edge.answers.get(number)
        if answer is None or answer.done():
            return
        if how == CANCELED:
            answer.cancel()
        else:
            answer.set_exception(how)

    def _done(self, number: int, how: str, value: Any) -> None:
        future = self._awaited(number)
        if future is None or future.done():
            return
        if how == CANCELED:
            future.cancel()
        elif how == "error":
            future.set_exception(value)
        else:
            future.set_result(value)

    def _awaited(self, number: int) -> asyncio.Future[Any] | None:
        """The future with this number; for a node that is astray, the one of the same kind, name and place."""
        if not self.edge.astray:
            return self.edge.awaited.pop(number, None)
        if number > len(self._names):
            return None
        kind, name, _ = self._names[number - 1]
        place = sum(one[:2] == (kind, name) for one in self._names[: number - 1])
        return self.edge.channels.get((kind, name, place))

    def _goal_status(self, number: int, status: Any) -> None:
        self._follower(number, "on_status", status)

    def _feedback(self, number: int, feedback: Any) -> None:
        self._follower(number, "on_feedback", feedback)

    def _outcome(self, number: int, status: Any, result: Any, reason: str) -> None:
        self._follower(number, "on_result", Outcome(status, result, reason))

    def _follower(self, number: int, method: str, value: Any) -> None:
        follower = self.edge.followers.get(number)
        if follower is not None:
            self.edge.enter(method, (), getattr(follower, method), value)


_TAKEN: dict[str, Callable[..., None]] = {
    "start": Driver._start, "stop": Driver._stop, "interrupt": Driver._interrupt, "crash": Driver._crash,
    "parameters": Driver._parameters, "tick": Driver._tick, "deliver": Driver._deliver, "publisher": Driver._publisher,
    "subscription": Driver._subscriber, "gone": Driver._gone, "server": Driver._server, "request": Driver._request,
    "goal": Driver._goal, "cancel": Driver._cancel, "given up": Driver._given_up, "done": Driver._done,
    "goal status": Driver._goal_status, "feedback": Driver._feedback, "outcome": Driver._outcome,
}  # fmt: skip


class _PlayedLife:
    """One life of the replayed node, for its supervisor."""

    def __init__(self, driver: Driver, record: NodeRecord) -> None:
        self._driver = driver
        self._record = record

    async def run(self, started: Callable[[], None], /) -> None:
        await self._driver.live(self._record, started)

    def stop(self, reason: str, /) -> None:
        self._driver.give_up(reason)


class _OtherCaller(Other):
    """A node of the recording that asks the replayed one. The tape says when it gives up."""

    @property
    def deadlines(self) -> Any:
        raise NotImplementedError

    def call_id(self, service: str, number: int) -> tuple[bytes, int]:
        from actors.services.introspection import caller_id

        return caller_id(self.fqn, service), number


class _Numbers:
    """Gives the replayed node's subscriptions their numbers, as a recording does."""

    def __init__(self, edge: Replaying) -> None:
        self._edge = edge

    def publisher_joined(self, publisher: Any) -> None:
        if self._edge.owns(publisher):
            publisher.attach(_nothing)

    def publisher_left(self, publisher: Any) -> None:
        """Do nothing."""

    def subscription_joined(self, subscription: Any) -> None:
        if self._edge.owns(subscription):
            self._edge.number_of(subscription)

    def subscription_left(self, subscription: Any) -> None:
        """Do nothing."""

    def server_changed(self, entry: Any) -> None:
        """Do nothing."""


def _comes_in(entry: Entry) -> bool:
    return isinstance(entry, tuple) and entry[0] not in ("step", "out", "result")


def _retrieve(answer: asyncio.Future[Any]) -> None:
    """Take an answer that nobody waits for, so that its error is not reported as lost."""
    if not answer.cancelled():
        answer.exception()


def _nothing(_: object) -> None:
    """Do nothing."""
