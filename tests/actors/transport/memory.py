"""A transport within one process: what is sent arrives in the next turn of the event loop, and nothing is lost.

It is the plainest implementation of the Protocol. The tests of the bridge use it, because nothing in it but the bridge can go wrong.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from typing import Any

from actors.transport.keyed.protocol import Answer, Delivery, Events, KeyTransport, Replied, Sample, Take
from actors.transport.protocol import Failed, Link, NoAnswer, WireUnavailable


class Network:
    """What joins the ends. Everything passes one queue, so it arrives in the order in which it was sent."""

    def __init__(self) -> None:
        self.ends: dict[str, End] = {}
        self.tokens: dict[str, End] = {}
        self.queue: deque[Callable[[], None]] = deque()
        self.broken = False
        self.made = 0
        self.puts = 0
        """How many samples have been put."""

    def end(self, session: str = "") -> End:
        """One more end, not open yet."""
        self.made += 1
        return End(self, session or f"{self.made:x}")

    def post(self, act: Callable[[], None]) -> None:
        self.queue.append(act)
        asyncio.get_running_loop().call_soon(self._arrive)

    def _arrive(self) -> None:
        self.queue.popleft()()

    def others(self, end: End) -> list[End]:
        return [other for other in self.ends.values() if other is not end]

    def tell_wanted(self) -> None:
        """Let each end know whether its outlets are wanted."""
        for end in self.ends.values():
            for outlet in end.outlets:
                wanted = any(one.key == outlet.key for other in self.others(end) for one in other.subscriptions)
                if wanted != outlet.wanted:
                    outlet.wanted = wanted
                    self.post(lambda end=end, outlet=outlet: end.open_ and end.events.wanted(outlet))  # type: ignore[misc]

    def lose(self, end: End) -> None:
        """The process of `end` ends without a word."""
        del self.ends[end.session]
        gone = [token for token, owner in self.tokens.items() if owner is end]
        for token in gone:
            del self.tokens[token]
        for other in self.others(end):
            self.post(lambda other=other: other.events.link(end.session, False))  # type: ignore[misc]
            for token in gone:
                self.post(lambda other=other, token=token: other.events.vanished(token))  # type: ignore[misc]
            for question in list(other.questions):
                self.post(lambda question=question: question.lose(end))  # type: ignore[misc]
        self.tell_wanted()
        end.open_ = False
        end.outlets.clear()


class End(KeyTransport):
    """The transport of one process."""

    session = ""

    def __init__(self, network: Network, session: str) -> None:
        self.network = network
        self.session = session
        self.open_ = False
        self.outlets: list[Out] = []
        self.subscriptions: list[In] = []
        self.servers: list[Serving] = []
        self.questions: list[Question] = []
        self.events: Events = None  # type: ignore[assignment]

    async def open(self, tokens: str, events: Events) -> None:
        await asyncio.sleep(0)
        if self.network.broken:
            raise WireUnavailable("port 7447 is in use: end the program that uses it")
        self.events = events
        self.open_ = True
        self.prefix = tokens.removesuffix("**")
        self.network.ends[self.session] = self
        for other in self.network.others(self):
            self.network.post(lambda other=other: other.events.link(self.session, True))  # type: ignore[misc]
        for token, owner in self.network.tokens.items():
            if owner is not self and token.startswith(self.prefix):
                self.network.post(lambda token=token: events.appeared(token))  # type: ignore[misc]

    async def close(self) -> None:
        if self.session in self.network.ends:
            self.network.lose(self)
        await asyncio.sleep(0)
        while self.network.queue:
            await asyncio.sleep(0)

    def announce(self, token: str) -> Shown:
        return Shown(self, token)

    def outlet(self, key: str, delivery: Delivery) -> Out:
        return Out(self, key, delivery)

    def subscribe(self, key: str, delivery: Delivery, take: Take) -> In:
        return In(self, key, delivery, take)

    def serve(self, key: str, take: Callable[[Any], None]) -> Serving:
        return Serving(self, key, take)

    def ask(
        self, key: str, payload: bytes, attachment: bytes, timeout: float | None, done: Callable[[Answer], None]
    ) -> Question:
        return Question(self, key, payload, attachment, timeout, done)

    def report(self) -> tuple[Link, ...]:
        return tuple(Link(other.session, "box", int(other.session, 16), 0, 0, 0) for other in self.network.others(self))


class Shown:
    def __init__(self, end: End, token: str) -> None:
        self.end, self.token = end, token
        assert token not in end.network.tokens
        end.network.tokens[token] = end
        self._tell(lambda other: other.events.appeared(token))

    def close(self) -> None:
        if self.end.network.tokens.pop(self.token, None) is not None:
            self._tell(lambda other: other.events.vanished(self.token))

    def _tell(self, tell: Callable[[End], None]) -> None:
        for other in self.end.network.others(self.end):
            if self.token.startswith(other.prefix):
                self.end.network.post(lambda other=other: other.open_ and tell(other))  # type: ignore[misc, func-returns-value]


class Out:
    wanted = False
    drained = None

    def __init__(self, end: End, key: str, delivery: Delivery) -> None:
        self.end, self.key = end, key
        self.delivery = delivery
        self.kept: deque[Sample] = deque(maxlen=delivery.history)
        end.outlets.append(self)
        self.end.network.tell_wanted()

    def put(self, payload: bytes, attachment: bytes) -> None:
        network = self.end.network
        network.puts += 1
        sample = Sample(self.key, payload, attachment)
        self.kept.append(sample)
        for other in network.others(self.end):
            for one in other.subscriptions:
                if one.key == self.key:
                    network.post(lambda one=one: one.take(sample))  # type: ignore[misc]

    def close(self) -> None:
        if self in self.end.outlets:
            self.end.outlets.remove(self)


class In:
    def __init__(self, end: End, key: str, delivery: Delivery, take: Take) -> None:
        self.end, self.key, self.delivery, self._take = end, key, delivery, take
        end.subscriptions.append(self)
        for other in end.network.others(end):
            for outlet in other.outlets:
                if outlet.key == key:
                    for sample in list(outlet.kept)[len(outlet.kept) - min(delivery.history, len(outlet.kept)) :]:
                        end.network.post(lambda sample=sample: self.take(sample))  # type: ignore[misc]
        end.network.tell_wanted()

    def take(self, sample: Sample) -> None:
        if self in self.end.subscriptions and self.end.open_:
            self._take(sample)

    def close(self) -> None:
        if self in self.end.subscriptions:
            self.end.subscriptions.remove(self)
            self.end.network.tell_wanted()


class Serving:
    def __init__(self, end: End, key: str, take: Callable[[Any], None]) -> None:
        self.end, self.key, self.take = end, key, take
        end.servers.append(self)

    def close(self) -> None:
        if self in self.end.servers:
            self.end.servers.remove(self)


class Question:
    """At the side of who asks."""

    def __init__(
        self,
        end: End,
        key: str,
        payload: bytes,
        attachment: bytes,
        timeout: float | None,
        done: Callable[[Answer], None],
    ) -> None:
        self.end, self.key, self.payload, self.attachment, self.done = end, key, payload, attachment, done
        self.over = False
        self.asked: set[End] = set()
        loop = asyncio.get_running_loop()
        end.questions.append(self)
        self.timer = None if timeout is None else loop.call_later(timeout, self.finish, NoAnswer(True))
        end.network.post(self._ask)

    def _ask(self) -> None:
        servers = [one for other in self.end.network.others(self.end) for one in other.servers if one.key == self.key]
        self.asked = {one.end for one in servers}
        if not servers:
            self.end.network.post(lambda: self.finish(NoAnswer(False)))  # after the news that a server is lost
        for one in servers:
            one.take(Asked(self, one.end))

    def lose(self, end: End) -> None:
        """`end` will not answer."""
        self.asked.discard(end)
        if not self.asked:
            self.finish(NoAnswer(False))

    def finish(self, answer: Answer) -> None:
        if not self.over:
            self.close()
            self.done(answer)

    def close(self) -> None:
        if not self.over:
            self.over = True
            self.end.questions.remove(self)
            if self.timer is not None:
                self.timer.cancel()


class Asked:
    """At the side of who is asked."""

    def __init__(self, question: Question, at: End) -> None:
        self.question, self.at, self.over = question, at, False
        self.payload, self.attachment = question.payload, question.attachment

    def reply(self, payload: bytes, attachment: bytes) -> None:
        self._end(lambda: self.question.finish(Replied(payload, attachment)))

    def fail(self, payload: bytes) -> None:
        self._end(lambda: self.question.finish(Failed(payload)))

    def drop(self) -> None:
        self._end(lambda: self.question.lose(self.at))

    def _end(self, act: Callable[[], None]) -> None:
        if not self.over:
            self.over = True
            self.at.network.post(act)
