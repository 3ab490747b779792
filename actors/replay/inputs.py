"""`Inputs`: gives replayed nodes what comes in by their recording."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final, cast

from actors.actions.peers import Outcome
from actors.checks import create
from actors.inbox.control import Failure
from actors.inbox.expiring import ExpiringMessage
from actors.replay.boundary import CANCELED
from actors.replay.recording import Recording, Start, Unkept
from actors.replay.replaying_boundary import AWAITED, ReplayingBoundary
from actors.replay.stubs import StubCall, StubFollower, StubNode, StubPublisher, StubServer, StubSubscription
from actors.services.peers import caller_id
from actors.waiting import retrieve

if TYPE_CHECKING:
    from actors.actions.goals import GoalStatus
    from actors.interfaces.message import Message
    from actors.qos.policies import QoS
    from actors.replay.lives import PlayedNodes
    from actors.replay.replay_loop import ReplayLoop
    from actors.runtime.incarnation import Incarnation
    from actors.system import System
    from actors.time.deadlines import Deadlines
    from actors.topics.peers import SubscriptionPeer

OF_A_LIFE: Final = frozenset({"crash", "parameters", "stop"})
"""What is done to a life of a node, which is named first, not by way of the graph."""


class Inputs:
    """Takes the entries of a recording that came in, and does to the replayed nodes what they say. The others are played by stubs.

    For nodes that have diverged, numbers of the recording are no more theirs: then what one asked is found by its kind, name and place among those,
    and timers by their name.

    Invariants: `_peers` has the stubs for the ends of topics that have come and not gone.
    """

    def __init__(
        self, system: System, loop: ReplayLoop, recording: Recording, boundary: ReplayingBoundary, played: PlayedNodes
    ) -> None:
        self.lacking = ""
        """What came in that the journal does not carry; empty if it carries everything so far."""
        self._system, self._loop, self._boundary, self._played = system, loop, boundary, played
        self._peers: dict[int, Any] = {}
        self._names = [sent for sent in recording.outputs(inner=True) if sent[0] in AWAITED]
        self._takes: dict[str, Callable[..., None]] = {
            "start": self.start, "stop": self.stop, "dismissed": self.dismissed, "interrupt": self.interrupt, "crash": self.crash,
            "parameters": self.parameters,
            "tick": self.tick, "deliver": self.deliver, "publisher": self.publisher, "subscription": self.subscriber, "gone": self.gone,
            "server": self.server, "request": self.request, "goal": self.goal, "cancel": self.cancel, "given up": self.given_up,
            "done": self.done, "goal status": self.goal_status, "feedback": self.feedback, "outcome": self.outcome,
        }  # fmt: skip

    def apply(self, entry: tuple[Any, ...]) -> None:
        """Give the node one thing that came in."""
        kind, details = entry[0], entry[3:]
        if kind in OF_A_LIFE and self._played.present(details[0]) is None:
            return  # the changed node has never been made
        unkept = next((str(one) for one in details if isinstance(one, Unkept)), "")
        if kind == "unknown" or unkept:
            if not self._boundary.diverged:
                self.lacking = unkept or str(details[0])
            return
        self._takes[kind](*details)

    def start(self, start: Start) -> None:
        self._played.of(start).begin(start)

    def stop(self, node: str, reason: str, system: str | None) -> None:
        """Ask a life for its end, as its supervisor did; `system` is why the whole system was to stop, or None."""
        self._system.runtime.tree.stop_reason = system
        self._boundary.enter("stop", (), self._life_of(node).stop, reason)

    def dismissed(self, node: str) -> None:
        """Close what a node has left that has ended for good."""
        if (life := self._played.present(node)) is not None:
            self._system.runtime.gone(life.identity.path, True)

    def interrupt(self, number: int, killing: tuple[str, float] | None) -> None:
        task = self._boundary.tasks.get(number)
        life = None if killing is None else self._played.present(killing[0])
        child = None if life is None else life.child
        if killing is not None and child is not None:
            child.kill(killing[1])
        elif task is not None:
            task.cancel()

    def crash(self, node: str, error: BaseException) -> None:
        self._boundary.enter("crash", (), self._life_of(node).inbox.put_control, Failure(error, "crash"))

    def parameters(self, node: str, values: dict[str, object]) -> None:
        with suppress(Exception):  # an error of the one that sets what cannot be set
            self._life_of(node).node.set_parameters(values)

    def _life_of(self, node: str) -> Incarnation:
        life = self._played.present(node)
        assert life is not None
        return life

    def tick(self, number: int, name: str, k: int, due: float) -> None:
        timers = self._boundary.timers
        found = [timers[number]] if not self._boundary.diverged else [one for one in timers if one[0] == name]
        timer = found[-1][1] if found else None
        if timer is not None and (handle := timer.handle) is not None:
            handle.k = k  # as the ticker does, which counts here in vain
            self._boundary.enter("tick", (), timer.on_tick, k, due)

    def deliver(self, number: int, peer: int, message: object, expires: float | None) -> None:
        publisher = self._peers[peer]
        publisher.sent(message)
        subscription = self._subscription(number, publisher.entry.name)
        if subscription is None:
            return
        if expires is not None:
            message = ExpiringMessage(message, expires, self._loop.time)
        self._boundary.enter("deliver", (), subscription.target(publisher), message)

    def _subscription(self, number: int, topic: str) -> SubscriptionPeer | None:
        """The node's subscription with this number, if it is one of the topic; else its last one of the topic, or None."""
        known = self._boundary.subscriptions
        if number < len(known) and known[number].entry.name == topic:
            return known[number]
        return next((one for one in reversed(known) if one.entry.name == topic), None)

    def publisher(self, number: int, topic: str, node: str, kind: type[Message], qos: QoS) -> None:
        entry = self._system.graph.topic(topic)
        self._peers[number] = publisher = StubPublisher(number, entry, node, kind, qos, self._boundary.catch_up)
        entry.add_publisher(cast("Any", publisher))

    def subscriber(self, number: int, topic: str, node: str, kind: type[Message], qos: QoS) -> None:
        entry = self._system.graph.topic(topic)
        self._peers[number] = subscription = StubSubscription(entry, node, kind, qos)
        entry.add_subscription(cast("Any", subscription))

    def gone(self, number: int) -> None:
        peer: Any = self._peers.pop(number)
        leave = "remove_publisher" if hasattr(peer, "latched") else "remove_subscription"
        getattr(peer.entry, leave)(peer)

    def server(self, kind: str, name: str, state: tuple[Any, ...] | None) -> None:
        graph = self._system.graph
        entry: Any = graph.action(name) if kind == "action" else graph.service(name)
        if state is None:
            entry.withdraw()
        elif state[0] == "here":
            _, host, served, concurrent = state
            entry.open(StubServer(host, served, concurrent, self._asked))
        elif state[0] == "restarting" and state[1] not in self._boundary.members:
            entry.pause(*state[1:])
        elif state[0] == "stopped" and state[1] not in self._boundary.members:
            entry.close(state[1])

    def _asked(self, call: StubCall, timeout: float | None) -> None:
        if self._boundary.diverged and timeout is not None:
            self._system.runtime.deadlines.watch(call, timeout)

    def request(self, number: int, name: str, message: Message, caller: str, timeout: float) -> None:
        graph = self._system.graph
        entry = graph.service(name)
        if entry.local is None:
            graph.open_standard_service(entry)
        server: Any = entry.local
        if server is not None:
            server.submit(message, _StubCaller(caller, server.deadlines), timeout).future.add_done_callback(retrieve)

    def goal(self, number: int, name: str, goal_id: bytes, message: Message, owner: str | None) -> None:
        server = self._system.graph.action(name).local
        if server is not None:
            follower = None if owner is None else StubFollower(owner)
            server.submit(goal_id, message, follower).future.add_done_callback(retrieve)

    def cancel(self, name: str, goal_id: bytes, reason: str) -> None:
        server = self._system.graph.action(name).local
        if server is not None:
            server.cancel(goal_id, reason)

    def given_up(self, number: int, how: object) -> None:
        answer = self._boundary.answers.get(number)
        if answer is None or answer.done():
            return
        if how == CANCELED:
            answer.cancel()
        else:
            answer.set_exception(how)

    def done(self, number: int, how: str, value: Any) -> None:
        future = self._awaited(number)
        if future is None or future.done():
            return
        if how == CANCELED:
            future.cancel()
        elif how == "error":
            future.set_exception(value)
        else:
            future.set_result(value)

    def _awaited(self, number: int) -> asyncio.Future[object] | None:
        """The future with this number; for a node that is diverged, the one of the same kind, name and place."""
        if not self._boundary.diverged:
            return self._boundary.awaited.pop(number, None)
        kind, name, _ = self._names[number - 1]
        place = sum(one[:2] == (kind, name) for one in self._names[: number - 1])
        return self._boundary.channels.get((kind, name, place))

    def goal_status(self, number: int, status: object) -> None:
        self._follower(number, "on_status", status)

    def feedback(self, number: int, feedback: object) -> None:
        self._follower(number, "on_feedback", feedback)

    def outcome(self, number: int, status: GoalStatus, result: object, reason: str) -> None:
        self._follower(number, "on_result", create(Outcome, status, result, reason))

    def _follower(self, number: int, method: str, value: object) -> None:
        follower = self._boundary.followers.get(number)
        if follower is not None:
            self._boundary.enter(method, (), getattr(follower, method), value)


class _StubCaller(StubNode):
    """A node of the recording that asks the replayed one. The recording says when it gives up."""

    def __init__(self, fqn: str, deadlines: Deadlines) -> None:
        super().__init__(fqn)
        self.deadlines = deadlines

    def call_id(self, service: str, number: int) -> tuple[bytes, int]:
        return caller_id(self.fqn, service), number
