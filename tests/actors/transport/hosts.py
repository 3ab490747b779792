"""Several systems on one virtual loop, each a process of its own as far as the others can tell."""

from __future__ import annotations

from typing import Any

from actors.testing import Rig
from tests.actors.transport.memory import End, Network


class Hosts:
    """Rigs that are joined by one network."""

    def __init__(self) -> None:
        self.network = Network()
        self.rigs: list[Rig] = []
        self.ends: dict[Rig, End] = {}

    async def start(self, *nodes: Any, session: str = "", **options: Any) -> Rig:
        """One more system, with these nodes. Without a `session` its identity has no mark, as that of a transport of the user's own."""
        rig = Rig()
        self.rigs.append(rig)
        self.ends[rig] = end = self.network.end(session)
        await rig.start(*nodes, transport=end, **options)
        await rig.quiet()
        return rig

    def lose(self, rig: Rig) -> None:
        """The process of a system ends without a word, as far as the others can tell."""
        self.network.lose(self.ends[rig])

    async def close(self) -> None:
        for rig in reversed(self.rigs):
            await rig.system.stop("the test is over")
        for rig in self.rigs:
            await rig.close()
        assert not self.network.tokens
