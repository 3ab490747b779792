"""The Protocol of a transport of keys: texts and bytes between the processes of one network.

It knows neither nodes nor messages. It announces texts (the liveliness tokens of `actors.transport.format.tokens`), carries payloads by key, and
asks questions by key: `actors.transport.zenoh` over a network, `actors.transport.simulated` on a virtual loop. What it gives by `join` is all
that ROS 2 needs, in the format of ``rmw_zenoh``; see `actors.transport.protocol`.

**Calls.** All methods and all callbacks run on the event loop's thread. No method but `open` and `close` waits. None raises because of
the network: what cannot be sent is lost, as the `Delivery` permits, and counted in `report`. No callback is called from within a method;
callbacks come from the loop, and must not raise. After the `close` of a handle its callback is not called again.

**Order.** The samples of one outlet reach one subscription in the order of their `put`, each at most once. `Events.appeared` comes before
`Events.vanished` for a token, each once in a life of the token. A sample may arrive before the token of its sender has appeared. What a
process declares becomes known elsewhere in the order in which it is declared: a process to which a token has appeared reaches the subscriptions and
servers that its process declared before it.

**Own traffic.** What this transport announces, puts, serves and asks never comes back to itself.

**Loss of a process.** When a process has ended, has been cut off, or is silent for longer than its lease, `Events.link` is called first,
then `Events.vanished` for each of its tokens, and then its unanswered questions end.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple, Protocol, TypeAlias, runtime_checkable

from actors.transport import protocol
from actors.transport.format.tokens import ALL_GRAPHS, graph_of
from actors.transport.protocol import Failed, Handle, Link, NoAnswer, Wait

NORMAL: Final = 5
"""The priority of what is not said otherwise, questions and answers among it."""

BULK: Final = 6
"""The priority of what may be large."""


@dataclass(frozen=True, slots=True)
class Delivery:
    """What a transport must know of a quality of service."""

    reliable: bool = True
    """Send again what was lost on the link. Without it, a sample may be lost anywhere."""

    keep_all: bool = False
    """A full queue holds the sender back instead of dropping the oldest sample. Only with `reliable`."""

    depth: int = 1
    """How many samples a queue keeps for one subscription, at least 1."""

    history: int = 0
    """How many samples are kept for subscriptions that come later (an outlet), or are wanted of those kept (a subscription); 0: none.
    A subscription that comes back after its process was lost is a later one, too; it gets what it has missed."""

    priority: int = NORMAL
    """1 (real time) to 7 (background), as in Zenoh: a sample of a lower number overtakes those of higher numbers on every link."""

    express: bool = False
    """Send at once, instead of together with what comes within the next moment."""

    patience: float = 0.0
    """For how long the samples of a subscription may wait, seconds, so that the loop is woken for many of them at once. The transport may
    pass them on earlier."""


class Sample(NamedTuple):
    """One message of a topic, as it has arrived."""

    key: str
    payload: bytes
    attachment: bytes
    since: float | None = None
    """When it arrived, in seconds on the loop's clock, if it has waited since then; None: now."""


Take: TypeAlias = Callable[[Sample], Wait | None]
"""What is called with a sample, and returns what the next one should wait for, if it may not be lost."""


@runtime_checkable
class TakesTogether(Protocol):
    """A `Take` that can take many samples in less time than one after the other."""

    def __call__(self, sample: Sample) -> Wait | None: ...

    def together(self, payloads: list[bytes], attachments: list[bytes]) -> bool:
        """Take samples, at least one, of one sender, whose attachments end alike. Whether it has: if not, they are to be given one by one."""
        ...


class Replied(NamedTuple):
    """A question was answered."""

    payload: bytes
    attachment: bytes


Answer: TypeAlias = Replied | Failed | NoAnswer
"""What becomes of a question."""


class Outlet(Handle, Protocol):
    """The sending end of one key."""

    @property
    def wanted(self) -> bool:
        """Whether a subscription of another process is known for the key. Reading it costs nothing."""
        ...

    def put(self, payload: bytes, attachment: bytes) -> None:
        """Send one sample to all subscriptions of the key in other processes. With `Delivery.history`, keep it for later ones."""
        ...

    @property
    def drained(self) -> Wait | None:
        """See `actors.transport.protocol.PublisherHere.drained`."""
        ...


class Query(Protocol):
    """A question that has arrived. It must be ended by exactly one of its methods; ending it again does nothing."""

    @property
    def payload(self) -> bytes: ...

    @property
    def attachment(self) -> bytes: ...

    def reply(self, payload: bytes, attachment: bytes) -> None:
        """Answer it."""
        ...

    def fail(self, payload: bytes) -> None:
        """Answer it with an error."""
        ...

    def drop(self) -> None:
        """Leave it without an answer: the process that asked gets `NoAnswer` if nobody else answers."""
        ...


class Events(Protocol):
    """What a transport tells its owner."""

    def appeared(self, token: str) -> None:
        """A token has been announced by another process, now or before the transport was opened."""
        ...

    def vanished(self, token: str) -> None:
        """A token that had appeared has been withdrawn, or its process is lost."""
        ...

    def wanted(self, outlet: Outlet) -> None:
        """`Outlet.wanted` has changed."""
        ...

    def link(self, session: str, up: bool) -> None:
        """Another process has been found, or is lost."""
        ...


class _Prepared:
    """Of a transport that has nothing to prepare."""

    def close(self) -> None:
        """Do nothing."""


class KeyTransport(Protocol):
    """The connection with the other processes of a network. It is a `actors.transport.protocol.Transport`, too, by `join`."""

    @property
    def session(self) -> str:
        """The identity of this process on the network: lower-case hexadecimal digits, without leading zeros. Known before `open`."""
        ...

    async def join(self, domain_id: int, events: protocol.Events, *, beyond: bool = False) -> protocol.Participant:
        """See `actors.transport.protocol.Transport.join`."""
        from actors.transport.keyed.participant import KeyedParticipant

        participant = KeyedParticipant(self, domain_id, events)
        await self.open(ALL_GRAPHS if beyond else graph_of(domain_id), participant)
        participant.begin()
        return participant

    async def open(self, tokens: str, events: Events) -> None:
        """Connect, and watch for all tokens that match the key expression `tokens`, beginning with those that are there already.

        Returns when declarations can be made; other processes may be found later, in any order. Raises `WireUnavailable` if it cannot
        be opened at all. A router or peer that is lost or not there is no error: it is looked for until `close`.
        """
        ...

    async def close(self) -> None:
        """Withdraw everything and disconnect; other processes learn of it at once. No callback is called afterwards. Never raises."""
        ...

    def announce(self, token: str) -> Handle:
        """Show `token` to all other processes for as long as the handle is open and this process lives."""
        ...

    def outlet(self, key: str, delivery: Delivery) -> Outlet:
        """Open the sending end of `key`."""
        ...

    def subscribe(self, key: str, delivery: Delivery, take: Take) -> Handle:
        """Call `take` with each sample that other processes put on `key`, those kept for later subscriptions first.

        With `Delivery.keep_all` the next sample should wait for what `take` returns.
        """
        ...

    def serve(self, key: str, take: Callable[[Query], None]) -> Handle:
        """Call `take` with each question that other processes ask on `key`."""
        ...

    def ask(
        self, key: str, payload: bytes, attachment: bytes, timeout: float | None, done: Callable[[Answer], None]
    ) -> Handle:
        """Ask the other processes a question; the first answer counts. `done` is called exactly once, unless the handle is closed first.

        `timeout` is in seconds of the transport's clock; None: until it is answered or nobody is left who could. A transport may keep a little
        of each question until then, also if it has been answered.
        """
        ...

    def prepare(self, key: str) -> Handle:
        """Expect questions on `key` until the handle is closed: asking them may cost less then."""
        return _Prepared()

    def report(self) -> tuple[Link, ...]:
        """What has been exchanged with each process that is connected now."""
        ...

    def sibling(self) -> Callable[[], protocol.Transport]:
        """A function that makes a transport for another process of this machine, which finds this one and whom this one reaches.

        If this transport connects real processes, `pickle` can copy the function to them.
        """
        ...
