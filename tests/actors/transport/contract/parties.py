"""What the contract of transports is tested with: transports that write down all that they tell."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from itertools import count
from typing import NamedTuple, Protocol

import pytest

from actors.transport.keyed.protocol import Answer, Delivery, KeyTransport, Outlet, Query, Sample
from actors.transport.protocol import Handle

DOMAIN = 7
TOKENS = f"@ros2_lv/{DOMAIN}/**"
ALL_OF_IT = Delivery(reliable=True, keep_all=True, depth=1000)
PATIENCE = 30.0
"""Seconds after which a test gives up waiting. No test that passes waits so long."""


def kept(history: int) -> Delivery:
    """Reliable, with history."""
    return Delivery(reliable=True, keep_all=True, depth=1000, history=history)


def token(name: str) -> str:
    """A token that `Party` watches for."""
    return f"@ros2_lv/{DOMAIN}/{name}"


class Wire(Protocol):
    """Where the transports under test meet."""

    def transport(self) -> KeyTransport:
        """A further transport, not open yet, as of a process of its own. Once open, it and all the others find each other."""
        ...


class Mortal(Wire, Protocol):
    """A wire whose processes can end without a farewell."""

    def kill(self, transport: KeyTransport) -> None:
        """End the process of a transport of this wire, or whatever makes it silent for ever. The others lose it in a few seconds."""
        ...


class Breakable(Wire, Protocol):
    """A wire that can be cut between two of its transports."""

    def cut(self, one: KeyTransport, other: KeyTransport) -> None:
        """Let nothing pass between the two any more, so that they lose each other in a few seconds."""
        ...

    def heal(self, one: KeyTransport, other: KeyTransport) -> None:
        """Let everything pass again, so that they find each other in a few seconds."""
        ...


class Happened(NamedTuple):
    """One call of `Events`, or the end of a question."""

    kind: str
    of: object


class Changes:
    """Waiting until a condition is met: it is looked at again after each callback."""

    def __init__(self) -> None:
        self._changed = asyncio.Event()

    def note(self) -> None:
        self._changed.set()

    async def until(self, condition: Callable[[], object], what: str) -> None:
        try:
            async with asyncio.timeout(PATIENCE):
                while not condition():
                    self._changed.clear()
                    await self._changed.wait()
        except TimeoutError:
            pytest.fail(f"waited {PATIENCE:g} s in vain until {what}")


@dataclass
class Heard:
    """A subscription, and what it has got."""

    samples: list[Sample] = field(default_factory=list[Sample])

    @property
    def payloads(self) -> list[bytes]:
        return [sample.payload for sample in self.samples]

    @property
    def numbers(self) -> list[int]:
        return [int(sample.payload) for sample in self.samples]


class Party:
    """A transport under test. It is the `Events` of that transport, and writes down everything in the order in which it comes."""

    def __init__(self, transport: KeyTransport, changes: Changes) -> None:
        self.transport = transport
        self.session = transport.session
        self.log: list[Happened] = []
        self.until = changes.until
        self._changes = changes
        self._numbers = count(1)

    # Events ------------------------------------------------------------------------------------------------------------

    def appeared(self, token: str) -> None:
        self._write("appeared", token)

    def vanished(self, token: str) -> None:
        self._write("vanished", token)

    def wanted(self, outlet: Outlet) -> None:
        self._write("wanted" if outlet.wanted else "unwanted", outlet)

    def link(self, session: str, up: bool) -> None:
        self._write("up" if up else "down", session)

    def _write(self, kind: str, of: object) -> None:
        self.log.append(Happened(kind, of))
        self._changes.note()

    # What the tests look at ----------------------------------------------------------------------------------------------

    def told(self, *kinds: str) -> list[Happened]:
        return [one for one in self.log if one.kind in kinds]

    def has(self, kind: str, of: object) -> bool:
        return Happened(kind, of) in self.log

    def is_linked(self, session: str) -> bool:
        links = [one.kind for one in self.told("up", "down") if one.of == session]
        return links[-1:] == ["up"]

    # What they do --------------------------------------------------------------------------------------------------------

    async def open(self) -> None:
        await self.transport.open(TOKENS, self)

    def listen(self, key: str, delivery: Delivery = ALL_OF_IT) -> tuple[Heard, Handle]:
        """A subscription, and what it hears."""
        heard = Heard()

        def take(sample: Sample) -> None:
            heard.samples.append(sample)
            self._changes.note()

        return heard, self.transport.subscribe(key, delivery, take)

    async def outlet(self, key: str, delivery: Delivery = ALL_OF_IT) -> Outlet:
        """The sending end of a key to which another party listens; by now it is known here."""
        outlet = self.transport.outlet(key, delivery)
        await self.until(lambda: outlet.wanted, f"an outlet of {key} is wanted")
        return outlet

    def serve(self, key: str, answer: Callable[[Query], None] | None = None) -> list[Query]:
        """The questions that have come. Each is answered with `answer`, or kept open."""
        queries: list[Query] = []

        def take(query: Query) -> None:
            queries.append(query)
            if answer is not None:
                answer(query)
            self._changes.note()

        self.transport.serve(key, take)
        return queries

    def ask(self, key: str, payload: bytes = b"?", timeout: float | None = None) -> tuple[list[Answer], Handle]:
        """What `done` was called with so far, and the handle."""
        answers: list[Answer] = []

        def done(answer: Answer) -> None:
            answers.append(answer)
            self._write("answered", answer)

        return answers, self.transport.ask(key, payload, b"asked", timeout, done)

    async def answer(self, key: str, payload: bytes = b"?", timeout: float | None = None) -> Answer:
        """Ask, and wait for the one answer."""
        answers, _ = self.ask(key, payload, timeout)
        await self.until(lambda: answers, f"a question about {key} ends")
        return answers[0]

    async def told_to(self, *others: Party) -> None:
        """Wait until the others know everything that this one has declared so far: declarations arrive in order."""
        text = token(f"{self.session}/so_far/{next(self._numbers)}")
        self.transport.announce(text)
        for other in others:
            await self.until(lambda other=other: other.has("appeared", text), "a declaration has arrived")  # type: ignore[misc]


@asynccontextmanager
async def parties(wire: Wire, number: int) -> AsyncIterator[list[Party]]:
    """So many transports that have found each other. They are closed in the end."""
    changes = Changes()
    members = [Party(wire.transport(), changes) for _ in range(number)]
    try:
        for one in members:
            await one.open()
        for one in members:
            for other in members:
                if one is not other:
                    await changes.until(lambda one=one, other=other: one.is_linked(other.session), "all are linked")  # type: ignore[misc]
        yield members
    finally:
        for one in members:
            await one.transport.close()
