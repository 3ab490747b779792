"""Recordings that are looked at: each has a player in a system of its own, apart from the robot, which hears nothing of it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final

from actors import ActorError, Child, Intensity, Node, Supervisor, run
from actors.bag import BagError, Player, PlayOptions
from cli.web.clients.errors import Refused
from cli.web.graph.overview import Here
from cli.web.hub import make_hub
from cli.web.recordings.playback import Playback, RecordedFeeds
from cli.web.server.audience import Audience

if TYPE_CHECKING:
    from cli.web.clients.client import Client
    from cli.web.recordings.bags import Bags

MOST: Final = 8
"""The recordings that are open at the same time."""
LINGER: Final = 30.0
"""Seconds that a recording waits where it is after its last client has left: a page that is reloaded finds it there."""
FAILED: Final = 1011


class _Shown:
    """A recording that is open, or about to be. `audience` fails if it cannot be played."""

    def __init__(self) -> None:
        self.audience: asyncio.Future[Audience] = asyncio.get_running_loop().create_future()
        self.watchers = 0
        self.changed = asyncio.Event()
        """Set when `watchers` has changed."""


class Recordings:
    """The recordings that clients look at, by path. All clients of one look at it together.

    Invariant: `_shown` holds every recording that can be looked at, or is being started.
    """

    def __init__(self, node: Node, bags: Bags, clients: dict[int, Client]) -> None:
        self._node = node
        self._bags = bags
        self._clients = clients
        self._shown: dict[Path, _Shown] = {}

    @asynccontextmanager
    async def watching(self, path: Path) -> AsyncGenerator[Audience]:
        """The audience of a recording, which plays from its start if nobody looks at it yet. Raises `Refused` if it cannot be played."""
        shown = self._shown.get(path)
        if shown is None:
            if len(self._shown) >= MOST:
                raise Refused(f"{MOST} recordings are open: close one of them, and wait half a minute")
            shown = self._shown[path] = _Shown()
            self._node.create_task(self._play(path, shown), name=f"recording {path.name}")
        shown.watchers += 1
        shown.changed.set()
        try:
            yield await asyncio.shield(shown.audience)
        finally:
            shown.watchers -= 1
            shown.changed.set()

    async def _play(self, path: Path, shown: _Shown) -> None:
        """Play a recording until nobody looks at it any more."""
        player = Child(Player, args=(path, PlayOptions(scrub=True)))
        tree = Supervisor(
            "recording", children=[player, Child(Node, name="_robactor_web")], intensity=Intensity(0, within=1.0)
        )
        try:
            async with run(tree, signals=False, sinks=()) as system:
                node, playback = system.node("_robactor_web"), Playback(system.node(Player))
                feeds = RecordedFeeds(system, playback)
                audience = Audience(make_hub(node, system, feeds, self._clients, self._bags, Here(system), playback))
                await audience.begin()
                shown.audience.set_result(audience)
                await self._until_left(shown, system.node(Player))
                del self._shown[path]  # who comes from now on reopens it
        except (ActorError, BagError) as error:
            self._fail(shown, f"{path.name} cannot be played: {error}")
        finally:
            if self._shown.get(path) is shown:
                del self._shown[path]

    def _fail(self, shown: _Shown, why: str) -> None:
        if not shown.audience.done():
            shown.audience.set_exception(Refused(why))
            shown.audience.exception()  # it counts as seen, also if the client has left meanwhile
        else:
            shown.audience.result().end(FAILED, why)

    async def _until_left(self, shown: _Shown, player: Player) -> None:
        """Wait until there has been nobody for a while. Meanwhile the recording stands still."""
        while True:
            shown.changed.clear()
            if shown.watchers:
                await shown.changed.wait()
                continue
            player.pause()
            try:
                async with asyncio.timeout(LINGER):
                    await shown.changed.wait()
            except TimeoutError:
                return
