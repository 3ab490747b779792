"""`Connection`: an open session of Zenoh, with everything that was declared in it."""

from __future__ import annotations

import os
import socket
from asyncio import AbstractEventLoop
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any, Final

from actors.transport.format.errors import WireFormatError
from actors.transport.format.keys import write_key
from actors.transport.format.names import is_ours
from actors.transport.format.tokens import EndpointKind, EndpointToken, parse_token
from actors.transport.keyed.protocol import BULK, Answer, Delivery, Events, Query, Take
from actors.transport.protocol import Link, NoAnswer
from actors.transport.wakeup import Wakeup
from actors.transport.worker import Worker
from actors.transport.zenoh import objects
from actors.transport.zenoh.contact import Source
from actors.transport.zenoh.heartbeat import Heartbeat
from actors.transport.zenoh.history import ask_history, declare_publishers, declare_subscriber
from actors.transport.zenoh.library import direct, import_zenoh
from actors.transport.zenoh.memory import SharedMemory, give_back
from actors.transport.zenoh.outgoing_queries import Prepared, Question
from actors.transport.zenoh.outlets import Outlet
from actors.transport.zenoh.presence import Presence, Process, scope_of
from actors.transport.zenoh.queryables import Server
from actors.transport.zenoh.subscriptions import Subscription
from actors.transport.zenoh.traffic import Traffic

_SETTLING: Final = 0.01
"""Seconds for which vanished tokens and unanswered questions are collected, because those of one lost process come one by one."""
_LONGEST_SESSION: Final = 32
MANY: Final = 1000
"""After so many tokens have vanished, the memory of what was known of them is given back."""
AFTER: Final = 2.0
"""Seconds from then: Zenoh frees its own part later."""
QUESTIONS: Final = 10
"""So many beats of ours from one question to processes of ROS 2 to the next."""


class Connection:
    """An open session, and everything that was declared with it. All methods are called on the loop's thread.

    Invariants: an own token is in `_own` while Zenoh may report it; what has not been closed is in `_handles`, because Zenoh withdraws what
    nobody refers to; after `close` no callback is called. Vanished tokens, and the calls of `_afterwards`, wait for the timer `_settling`.
    """

    def __init__(
        self,
        session: objects.Session,
        tokens: str,
        events: Events,
        loop: AbstractEventLoop,
        worker: Worker,
        thin_links: bool = False,
        shared_memory: int = 0,
    ) -> None:
        """See `ZenohConfig`; calls that may wait are made by `worker`."""
        self._memory = SharedMemory(shared_memory * 2**20) if shared_memory else None
        self._thin_links = thin_links
        self.wakeup = Wakeup(loop)
        self._session = session
        self._events = events
        self._loop = loop
        self._worker = worker
        self._answers = Worker("zenoh answers")
        # On thin links images wait for room, and nothing else may wait behind them.
        self._bulk = Worker("zenoh bulk") if thin_links else worker
        self._others = {self._answers, self._bulk} - {worker}
        self._own_session = str(session.zid())
        self._handles: set[object] = set()
        self._own: Counter[str] = Counter()
        self._traffic = Traffic()
        self._presence = Presence(events, self._traffic.begin, self._traffic.end)
        self._questions: dict[Question, None] = {}
        self._lingering: list[Question] = []
        """Those that have their answer. With the next beat they are cancelled, if Zenoh has not ended them by then."""
        self._afterwards: list[Callable[[], None]] = []
        self._settling: Any = None
        self._beats = 0
        self._gone = 0
        self._giving: Any = None
        own = Process(scope_of(tokens), self._own_session, os.getpid(), socket.gethostname())
        self._process = self._declare_token(own.token)
        alive = f"@robactor/{own.scope}/alive"
        library = import_zenoh()
        self._beat = session.declare_publisher(
            alive,
            priority=library.Priority.INTERACTIVE_HIGH,
            congestion_control=library.CongestionControl.DROP,
            express=True,
            allowed_destination=library.Locality.REMOTE,
        )
        self._heartbeat = Heartbeat(
            loop, self._send_beat, lambda: self._presence.beating, self._silence, lambda: Subscription.held_back
        )
        # Beats of others wake nobody: they count from when they arrived, and wait for the next beat of our own at most.
        beaten = direct(lambda sample: self.wakeup.post_patiently(self._heard, (sample.payload, loop.time())))
        # The references keep what they declare.
        self._watching: list[object] = [
            session.declare_subscriber(
                alive,
                beaten,
                allowed_origin=library.Locality.REMOTE,
            ),
            self._watch(f"@robactor/{own.scope}/*/*/*"),
            self._watch(tokens),
        ]

    # What a transport offers -------------------------------------------------------------------------------------------------

    def announce(self, token: str) -> Announcement:
        """Show `token` to the others."""
        announcement = Announcement(token, self._declare_token(token), self._withdrawn)
        self._handles.add(announcement)
        return announcement

    def outlet(self, key: str, delivery: Delivery) -> Outlet:
        """Open the sending end of `key`."""
        publishers = declare_publishers(self._session, key, delivery, self._thin_links)
        forget = self._handles.discard
        outlet = Outlet(
            delivery,
            publishers,
            self.wakeup,
            self._bulk if delivery.priority >= BULK else self._worker,
            self._traffic,
            self._events.wanted,
            self._settle_soon,
            forget,
            None if self._memory is None else self._memory.shared,
        )
        self._handles.add(outlet)
        return outlet

    def subscribe(self, key: str, delivery: Delivery, take: Take) -> Subscription:
        """Open the receiving end of `key`."""

        def declare(subscription: Subscription) -> objects.Declared:
            return declare_subscriber(self._session, key, delivery, subscription.arrived)

        def ask(subscription: Subscription, source: Source) -> None:
            answered = partial(self.wakeup.post, partial(subscription.answered, source))
            complete = partial(self.wakeup.post, subscription.complete, source)
            self._answers.do(lambda: ask_history(self._session, key, delivery.history, source, answered, complete))

        subscription = Subscription(
            self._own_session, key, delivery, take, self.wakeup, self._traffic, declare, ask, self._handles.discard
        )
        self._handles.add(subscription)
        return subscription

    def serve(self, key: str, take: Callable[[Query], None]) -> Server:
        """Take the questions of others."""
        server = Server(self._session, key, take, self.wakeup, self._answers, self._handles.discard)
        self._handles.add(server)
        return server

    def ask(
        self, key: str, payload: bytes, attachment: bytes, timeout: float | None, done: Callable[[Answer], None]
    ) -> Question:
        """Ask the others."""
        question = Question(key, timeout, done, self._over)
        self._questions[question] = None
        question.ask(self._session, payload, attachment, self.wakeup, self._answers, self._unanswered)
        return question

    def prepare(self, key: str) -> Prepared:
        """Let routers say what they know of servers of `key`."""
        return Prepared(self._session, key)

    def report(self) -> tuple[Link, ...]:
        """The links with the processes that are there."""
        return self._traffic.report(self._presence.shown)

    def is_linked_with(self, endpoint: str) -> bool:
        """Whether a link to `endpoint` is open."""
        return any(link.dst == endpoint for link in self._session.info.links())

    def close(self) -> None:
        """Have the workers send what waits, withdraw the tokens, and close the session. No callback is called any more."""
        self.wakeup.close()
        self._heartbeat.close()
        if self._settling is not None:
            self._settling.cancel()
        if self._giving is not None:
            self._giving.cancel()
        for question in tuple(self._questions):
            question.close()
        for handle in tuple(self._handles):
            if isinstance(handle, Subscription):  # it may have a task, or hold back a thread of Zenoh
                handle.close()
        for worker in self._others:
            worker.close()
        self._worker.do(self._close_session)

    def _close_session(self) -> None:
        for worker in self._others:
            worker.join()
        if self._memory is not None:
            self._memory.close()
        with suppress(import_zenoh().ZError):  # it could not say farewell to everybody in time
            self._process.undeclare()  # the others know at once that this process ends
            self._session.close()

    # Tokens ------------------------------------------------------------------------------------------------------------------

    def _declare_token(self, token: str) -> objects.Declared:
        self._own[token] += 1
        declared: objects.Declared = self._session.liveliness().declare_token(token)
        return declared

    def _withdrawn(self, announcement: Announcement) -> None:
        self._handles.discard(announcement)
        self._own[announcement.token] -= 1
        if not self._own[announcement.token]:
            del self._own[announcement.token]

    def _watch(self, tokens: str) -> object:
        handler = direct(self._reported)
        return self._session.liveliness().declare_subscriber(tokens, handler, history=True)

    def _reported(self, sample: objects.Sample) -> None:
        """A token of anybody has appeared or vanished. On a thread of Zenoh, or on the loop's for tokens of our own."""
        token = str(sample.key_expr)
        self.wakeup.post(self._take_report, (token, sample.kind, token in self._own))

    def _take_report(self, report: tuple[str, object, bool]) -> None:
        token, kind, own = report
        if own:
            return
        process = Process.parse(token)
        if kind != import_zenoh().SampleKind.PUT:
            self._vanished(token)
        elif process is not None:
            self._presence.arrive(process)
        else:
            self._presence.appear(token)

    def _vanished(self, token: str) -> None:
        self._presence.vanish(token)
        self._settle_soon(lambda: None)

    # Lost processes, and the questions that they leave ---------------------------------------------------------------------------

    def _settle_soon(self, afterwards: Callable[[], None]) -> None:
        """Report soon what has vanished, and then call `afterwards`."""
        self._afterwards.append(afterwards)
        if self._settling is None:
            self._settling = self._loop.call_later(_SETTLING, self._settle)

    def _settle(self) -> None:
        self._settling = None
        self._gone += self._presence.settle()
        if self._gone >= MANY and self._giving is None:
            self._giving = self._loop.call_later(AFTER, self._give_back)
        afterwards, self._afterwards = self._afterwards, []
        for call in afterwards:
            call()

    def _over(self, question: Question) -> None:
        del self._questions[question]
        if question.lingers:
            self._lingering.append(question)

    def _give_back(self) -> None:
        self._giving, self._gone = None, 0
        self._answers.do(give_back)

    def _unanswered(self, question: Question) -> None:
        self._settle_soon(lambda: question.end(NoAnswer(timed_out=False)))

    def _send_beat(self) -> None:
        self.wakeup.look()
        lingering, self._lingering = self._lingering, []
        for question in [one for one in lingering if one.lingers]:
            question.cancel()
        with suppress(import_zenoh().ZError):
            self._beat.put(self._own_session.encode())
        self._beats += 1
        if self._beats % QUESTIONS == 0:
            self._answers.do(self._ask_others)

    def _ask_others(self) -> None:
        """Ask the processes of ROS 2 for nothing, which their Zenoh answers: else nothing comes from them for half a lease on a link that is not used.

        One that stands still for the other half would be given up here, while its router, which may have heard it later, keeps it. Then nobody
        opens the link again.
        """
        with suppress(import_zenoh().ZError):
            for zid in map(str, self._session.info.peers_zid()):
                if not is_ours(zid):
                    self._session.get(f"@/{zid}/peer/robactor", direct(_ignore))

    def _heard(self, beat: tuple[objects.Text, float]) -> None:
        session = beat[0].to_bytes()[:_LONGEST_SESSION].decode("ascii", "replace")
        self._heartbeat.heard(session, beat[1])
        self._presence.heard(session)

    def _silence(self, session: str) -> None:
        """A process is lost whose links are open. Its questions end unless somebody else serves them, too."""
        tokens = self._presence.tokens(session)
        self._presence.silence(session)
        lost = {_served_key(token) for token in tokens} - {""}
        asked = [question for question in self._questions if question.key in lost]
        others = [token for other in self._presence.shown for token in self._presence.tokens(other)] if asked else []
        served = {_served_key(token) for token in others}
        for question in asked:
            if question.key not in served:
                self._unanswered(question)


class Announcement:
    """A token of our own, until it is closed."""

    def __init__(self, token: str, declared: objects.Declared, withdrawn: Callable[[Announcement], None]) -> None:
        self.token = token
        self._declared: objects.Declared | None = declared
        self._withdrawn = withdrawn

    def close(self) -> None:
        """Withdraw it."""
        declared, self._declared = self._declared, None
        if declared is not None:
            declared.undeclare()
            self._withdrawn(self)


def _ignore(reply: object) -> None:
    """Do nothing: something has come."""


def _served_key(token: str) -> str:
    """The key that the token of a server is about; empty for all other tokens."""
    with suppress(WireFormatError):
        parsed = parse_token(token)
        if isinstance(parsed, EndpointToken) and parsed.kind is EndpointKind.SERVER:
            return write_key(parsed.key)
    return ""
