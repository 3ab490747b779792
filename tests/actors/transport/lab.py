"""A simulated network with parties on it, for tests that know the virtual time at which everything happens."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from actors.transport.keyed.protocol import Delivery, Sample
from actors.transport.protocol import Handle
from actors.transport.simulated.network import Network
from tests.actors.transport.contract.parties import ALL_OF_IT, Changes, Party

KEY = "7/chatter/T/H"
BEST_EFFORT = Delivery(reliable=False, depth=100)


class Timed(Party):
    """A party that also writes down when it is told something."""

    def __init__(self, transport: Any, changes: Changes) -> None:
        super().__init__(transport, changes)
        self.times: list[tuple[float, str, object]] = []

    def _write(self, kind: str, of: object) -> None:
        self.times.append((asyncio.get_running_loop().time(), kind, of))
        super()._write(kind, of)

    def when(self, kind: str, of: object) -> float:
        """The last time it was told so."""
        return [time for time, told, what in self.times if (told, what) == (kind, of)][-1]

    def kinds(self, *told: str) -> list[str]:
        """What it was told, of these kinds; without any, of links."""
        return [one.kind for one in self.told(*told or ("up", "down"))]

    def dropped(self, other: Party) -> int:
        return next(link.dropped for link in self.transport.report() if link.session == other.session)


class Lab:
    """Parties by the names of their hosts; each is linked with all the others, unless its host is a client without router."""

    def __init__(self, **options: Any) -> None:
        self.network = Network(**options)
        self.loop = asyncio.get_running_loop()
        self.changes = Changes()
        self.until: Callable[[Callable[[], object], str], Any] = self.changes.until

    async def party(self, host: str) -> Timed:
        """A party on a host that is there, open."""
        party = Timed(self.network.transport(host), self.changes)
        await party.open()
        return party

    async def parties(self, *hosts: str) -> list[Timed]:
        """A peer on each of new hosts; all are linked."""
        for host in hosts:
            self.network.add_host(host)
        members = [await self.party(host) for host in hosts]
        await self.linked(*members)
        return members

    async def linked(self, *members: Party) -> None:
        for one in members:
            for other in members:
                if one is not other:
                    await self.until(lambda one=one, other=other: one.is_linked(other.session), "all are linked")  # type: ignore[misc]

    async def unlinked(self, one: Party, other: Party) -> None:
        await self.until(lambda: not one.is_linked(other.session), "a link is lost")

    def hear(
        self, party: Party, key: str = KEY, delivery: Delivery = ALL_OF_IT
    ) -> tuple[list[tuple[float, int]], Handle]:
        """When which number was heard."""
        heard: list[tuple[float, int]] = []

        def take(sample: Sample) -> None:
            heard.append((self.loop.time(), int(sample.payload[:4])))
            self.changes.note()

        return heard, party.transport.subscribe(key, delivery, take)


def numbered(number: int, size: int = 4) -> bytes:
    """A payload that says its number."""
    return b"%04d" % number + bytes(size - 4)
