"""A simulated process: the `Transport` of one system on a simulated network."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, TypeVar

from actors.transport import protocol
from actors.transport.keyed import protocol as keyed
from actors.transport.keyed.protocol import Answer, Delivery, Events, KeyTransport, Query, Replied, Take
from actors.transport.protocol import Failed, Handle
from actors.transport.simulated.endpoints import Announcement, Declared, Outlet, Server, Subscription
from actors.transport.simulated.link import Call, Stream
from actors.transport.simulated.queries import IncomingQuestion, Question

if TYPE_CHECKING:
    from actors.transport.simulated.connections import Connections

_CONTROL, _DATA, _FAREWELL = 0, 5, 8
"""Priorities: of declarations, of questions and answers, and of the farewell of a process, before which all else leaves."""
_DECLARATION = 128
"""Bytes that a declaration takes."""


class _Nobody:
    """The `Events` of a transport that is not open."""

    def appeared(self, token: str) -> None:
        """Nothing."""

    def vanished(self, token: str) -> None:
        """Nothing."""

    def wanted(self, outlet: keyed.Outlet) -> None:
        """Nothing."""

    def link(self, session: str, up: bool) -> None:
        """Nothing."""


class _Peer:
    """What a process knows of another one to which it is connected."""

    def __init__(self, transport: SimulatedTransport, incoming: Stream, outgoing: Stream) -> None:
        self.transport = transport
        self.incoming = incoming
        self.outgoing = outgoing
        self.announcements: dict[Announcement, None] = {}
        self.subscriptions: dict[str, list[Subscription]] = {}
        self.servers: dict[str, list[Server]] = {}


class SimulatedTransport(KeyTransport):
    """One process on a simulated network (`keyed.KeyTransport`). `Network.transport` makes it; it is opened once.

    Invariants: the peers are those to which it is connected, by their incoming stream; what it knows of a peer came on that stream. Only
    messages and timers call back. Once `closed`, there are no peers, no open questions and no callbacks. What is declared, put or asked
    before it is open or after it is closed reaches nobody.
    """

    def __init__(
        self,
        surroundings: Connections,
        session: str,
        host: str,
        process: int,
        sibling: Callable[[], SimulatedTransport],
        crash: Callable[[SimulatedTransport], None],
    ) -> None:
        self.host = host
        self.process = process
        self._sibling = sibling
        self._crash = crash
        self.closed = False
        self._session = session
        self._surroundings = surroundings
        self._events: Events = _Nobody()
        self._matches = matcher("**").fullmatch
        self._seen: Counter[str] = Counter()
        """How many announcements there are of each token that is watched for."""
        self._declared: dict[Declared, None] = {}
        self._outlets: dict[str, list[Outlet]] = {}
        self._questions: dict[Question, None] = {}
        self._peers: dict[Stream, _Peer] = {}

    def __repr__(self) -> str:
        return f"<SimulatedTransport {self._session} on {self.host}{' closed' * self.closed}>"

    # The Protocol --------------------------------------------------------------------------------------------------------

    @property
    def session(self) -> str:
        return self._session

    async def open(self, tokens: str, events: Events) -> None:
        self._surroundings.enter(self)
        self._matches, self._events = matcher(tokens).fullmatch, events

    async def close(self) -> None:
        if not self.closed:
            for peer in self._peers.values():
                peer.outgoing.send(Call(peer.outgoing, 0, _FAREWELL, partial(peer.transport.lose, peer.outgoing)))
            self.kill()

    def announce(self, token: str) -> Handle:
        return self._declare(Announcement(token, self._withdraw))

    def subscribe(self, key: str, delivery: Delivery, take: Take) -> Handle:
        return self._declare(Subscription(key, delivery.history, take, self._withdraw))

    def serve(self, key: str, take: Callable[[Query], None]) -> Handle:
        return self._declare(Server(key, take, self._withdraw))

    def outlet(self, key: str, delivery: Delivery) -> Outlet:
        known = [(peer.outgoing, peer.subscriptions[key]) for peer in self._peers.values() if key in peer.subscriptions]
        outlet = Outlet(key, delivery, known, self._tell_wanted, self._forget_outlet)
        self._outlets.setdefault(key, []).append(outlet)
        return outlet

    def ask(
        self, key: str, payload: bytes, attachment: bytes, timeout: float | None, done: Callable[[Answer], None]
    ) -> Handle:
        servers = [(peer, server) for peer in self._peers.values() for server in peer.servers.get(key, ())]
        asked = Counter(peer.incoming for peer, _ in servers)
        question = Question(self._surroundings.loop, asked, timeout, done, self._forget_question)
        if self.closed:
            question.close()
            return question
        self._questions[question] = None
        for peer, server in servers:
            act = partial(peer.transport.be_asked, peer.outgoing, server, question, payload, attachment)
            peer.outgoing.send(Call(peer.outgoing, len(payload) + len(attachment), _DATA, act))
        return question

    def sibling(self) -> Callable[[], SimulatedTransport]:
        return self._sibling

    def crash(self) -> None:
        """End the process without a farewell, as `Network.kill` does."""
        self._crash(self)

    def report(self) -> tuple[protocol.Link, ...]:
        return tuple(
            protocol.Link(
                session=peer.transport.session,
                host=peer.transport.host,
                process=peer.transport.process,
                sent_bytes=peer.outgoing.sent,
                received_bytes=peer.incoming.received,
                dropped=peer.outgoing.displaced + peer.incoming.late,
            )
            for peer in self._peers.values()
        )

    # Declarations of this process ----------------------------------------------------------------------------------------

    def _declare(self, declared: Declared) -> Declared:
        self._declared[declared] = None
        for peer in self._peers.values():
            self._show(peer, (declared,))
        return declared

    def _withdraw(self, declared: Declared) -> None:
        del self._declared[declared]
        for peer in self._peers.values():
            act = partial(peer.transport.unlearn, peer.outgoing, declared)
            peer.outgoing.send(Call(peer.outgoing, _DECLARATION, _CONTROL, act))

    def _show(self, peer: _Peer, declared: tuple[Declared, ...]) -> None:
        act = partial(peer.transport.learn, peer.outgoing, declared)
        peer.outgoing.send(Call(peer.outgoing, _DECLARATION * len(declared), _CONTROL, act))

    def _forget_outlet(self, outlet: Outlet) -> None:
        outlets = self._outlets.get(outlet.key, [])
        if outlet in outlets:
            outlets.remove(outlet)

    def _forget_question(self, question: Question) -> None:
        self._questions.pop(question, None)

    def _tell_wanted(self, outlet: Outlet) -> None:
        self._events.wanted(outlet)

    # What the network does with it ---------------------------------------------------------------------------------------

    def connect(self, other: SimulatedTransport, incoming: Stream, outgoing: Stream) -> None:
        """From now on the two are connected, and everything that is declared is shown to the other. `greet` tells of it."""
        self._peers[incoming] = peer = _Peer(other, incoming, outgoing)
        if self._declared:
            self._show(peer, tuple(self._declared))

    def greet(self, incoming: Stream) -> None:
        """Tell that the process at the beginning of this stream has been found."""
        if incoming in self._peers:
            self._events.link(self._peers[incoming].transport.session, True)

    def lose(self, incoming: Stream) -> None:
        """The process at the beginning of this stream is gone, or cut off. Nothing happens if that is known."""
        if (peer := self._peers.pop(incoming, None)) is None:
            return
        self._part(peer)
        self._events.link(peer.transport.session, False)
        for announcement in peer.announcements:
            self._vanish(announcement.token)
        for key, subscriptions in peer.subscriptions.items():
            for outlet in tuple(self._outlets.get(key, ())):
                outlet.leave(peer.outgoing, subscriptions)
        for question in tuple(self._questions):
            question.lose(incoming)

    def kill(self) -> None:
        """End at once, without a farewell."""
        self.closed = True
        self._events = _Nobody()
        for declared in self._declared:
            declared.closed = True
        self._declared.clear()
        for outlet in [outlet for outlets in self._outlets.values() for outlet in outlets]:
            outlet.close()
        for question in tuple(self._questions):
            question.close()
        peers, self._peers = self._peers, {}
        for peer in peers.values():
            self._part(peer)
        self._surroundings.leave(self)

    def _part(self, peer: _Peer) -> None:
        peer.incoming.open = False
        self._surroundings.parted(peer.incoming)

    # What comes from others ----------------------------------------------------------------------------------------------

    def learn(self, incoming: Stream, declared: tuple[Declared, ...]) -> None:
        """A peer shows what it has declared."""
        peer = self._peers[incoming]
        for one in declared:
            if isinstance(one, Announcement):
                peer.announcements[one] = None
                self._appear(one.token)
            elif isinstance(one, Subscription):
                peer.subscriptions.setdefault(one.key, []).append(one)
                for outlet in tuple(self._outlets.get(one.key, ())):
                    outlet.join(peer.outgoing, one)
            else:
                peer.servers.setdefault(one.key, []).append(one)

    def unlearn(self, incoming: Stream, declared: Declared) -> None:
        """A peer has withdrawn something."""
        peer = self._peers[incoming]
        if isinstance(declared, Announcement):
            del peer.announcements[declared]
            self._vanish(declared.token)
            return
        if isinstance(declared, Server):
            _drop(peer.servers, declared)
            return
        _drop(peer.subscriptions, declared)
        for outlet in tuple(self._outlets.get(declared.key, ())):
            outlet.leave(peer.outgoing, (declared,))

    def be_asked(self, incoming: Stream, server: Server, question: Question, payload: bytes, attachment: bytes) -> None:
        """A peer asks a question."""
        query = IncomingQuestion(payload, attachment, partial(self._respond, incoming, question))
        if server.closed:
            query.drop()
        else:
            server.take(query)

    def _respond(self, incoming: Stream, question: Question, answer: Replied | Failed | None) -> None:
        if (peer := self._peers.get(incoming)) is not None:
            size = 0 if answer is None else len(answer.payload)
            act = partial(question.receive, peer.outgoing, answer)
            peer.outgoing.send(Call(peer.outgoing, size, _DATA, act))

    def _appear(self, token: str) -> None:
        if self._matches("/" + token):
            self._seen[token] += 1
            if self._seen[token] == 1:
                self._events.appeared(token)

    def _vanish(self, token: str) -> None:
        if token in self._seen:
            self._seen[token] -= 1
            if not self._seen[token]:
                del self._seen[token]
                self._events.vanished(token)


_Keyed = TypeVar("_Keyed", Subscription, Server)


def _drop(known: dict[str, list[_Keyed]], one: _Keyed) -> None:
    """Take it out, and its key with the last one."""
    if left := [other for other in known.pop(one.key) if other is not one]:
        known[one.key] = left


_CHUNK = "/[^/@][^/]*"
"""What a wildcard stands for: a chunk that begins with ``@`` is matched by its own text only."""


def matcher(expression: str) -> re.Pattern[str]:
    """A pattern whose `fullmatch` is true for ``/`` and a key that the expression matches.

    ``*`` is one chunk, ``**`` any number of them, none too; neither includes chunks that begin with ``@``.
    """
    wildcards = {"*": _CHUNK, "**": f"(?:{_CHUNK})*"}
    return re.compile("".join(wildcards.get(chunk) or "/" + re.escape(chunk) for chunk in expression.split("/")))
