"""A recording as its clients see it: what it shows at its present time, and how it is played."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol

from actors.topics.lazy_message import LazyMessage
from cli.web.clients.errors import Refused
from cli.web.graph.feeds import Outgoing, Taker

if TYPE_CHECKING:
    from actors import System
    from actors.bag import Player
    from actors.interfaces import Message
    from actors.topics.peers import PublisherPeer

LOOK_EVERY: Final = 0.1
"""Seconds between two looks at the time of a recording, which is sent to clients."""


PLAYING, PAUSED, ENDED = 0, 1, 3
"""The states of playback, as Foxglove numbers them; 2, that it waits for data, does not occur."""


class PlaybackRequest(NamedTuple):
    """How a client wants a recording to be played."""

    play: bool
    rate: float
    seek_ns: int | None
    """Where to go on, in nanoseconds since 1970; None: where it is."""
    id: str
    """What the answer is known by."""


class PlaybackState(NamedTuple):
    """How a recording is played."""

    status: int
    """`PLAYING`, `PAUSED` or `ENDED`."""
    at_ns: int
    rate: float


class Viewer(Protocol):
    """A client that follows how the recording is played."""

    def tell_playback(self, state: PlaybackState, *, sought: bool, request: str) -> None:
        """Take the state. With `sought` what waits to be sent belongs to another time; with `request` it answers that request of this viewer."""
        ...

    def time(self, at_ns: int) -> None:
        """Take the time of the recording, of which only the newest counts."""
        ...


class Playback:
    """How one recording is played, for all its clients together: each of them may pause it, change its rate and its time.

    Invariant: `viewers` have been told of the state in `_told`, and of the seeks up to `_seeks`.
    """

    def __init__(self, player: Player) -> None:
        self.player = player
        self.viewers: set[Viewer] = set()
        self._seeks = player.seeks
        self._told = self._kind
        self._told_ns = 0
        """The time that was told last."""

    @property
    def name(self) -> str:
        """The name of the bag or file."""
        return self.player.bag.path.name

    @property
    def range(self) -> dict[str, Any]:
        """The times between which it plays, for the greeting of a viewer."""
        return {"dataStartTime": _time(self.player.start_ns), "dataEndTime": _time(self.player.end_ns)}

    def control(self, request: PlaybackRequest, viewer: Viewer) -> None:
        """Play as a viewer wants it, and tell everyone. Playing on from the end starts over. Raises `Refused` for a rate that is not offered."""
        player = self.player
        seek_ns = request.seek_ns
        if seek_ns is None and request.play and self.state.status == ENDED:
            seek_ns = player.start_ns
        try:
            player.rate = request.rate
        except ValueError as error:
            raise Refused(str(error)) from None
        if request.play:
            player.unpause()
        else:
            player.pause()
        if seek_ns is not None:
            player.seek(min(max(seek_ns, player.start_ns), player.end_ns))
        self._tell(answering=viewer, request=request.id)

    def look(self) -> None:
        """Tell of what has changed otherwise: by the services of the player, or at its end."""
        if self._seeks != self.player.seeks or self._told != self._kind:
            self._tell()

    async def follow(self) -> None:
        """Look again and again, and tell the time when it has changed."""
        while True:
            self.look()
            if (at_ns := self.player.position_ns) != self._told_ns:
                self._told_ns = at_ns
                for viewer in self.viewers:
                    viewer.time(at_ns)
            await asyncio.sleep(LOOK_EVERY)

    @property
    def state(self) -> PlaybackState:
        """How it is played now."""
        player = self.player
        at_ns = player.position_ns
        paused = ENDED if at_ns >= player.end_ns else PAUSED
        return PlaybackState(paused if player.paused else PLAYING, at_ns, player.rate)

    @property
    def _kind(self) -> tuple[int, float]:
        """The part of the state of which changes are sent."""
        state = self.state
        return state.status, state.rate

    def _tell(self, answering: Viewer | None = None, request: str = "") -> None:
        sought = self._seeks != self.player.seeks
        self._seeks, self._told = self.player.seeks, self._kind
        state = self.state
        for viewer in self.viewers:
            viewer.tell_playback(state, sought=sought, request=request if viewer is answering else "")


class RecordedFeeds:
    """The topics of a recording, as clients read them: like `Feeds`, but with the times of the recording.

    Invariant: `_kept` holds what each topic shows at the present time, as many messages as the player counts for it. A new taker gets that at
    once, so that a pane that is opened while the player stands still is not empty.
    """

    def __init__(self, system: System, playback: Playback) -> None:
        self._playback = playback
        self._player = playback.player
        self._seeks = self._player.seeks
        self._takers: dict[tuple[str, str], dict[Taker, None]] = {}
        self._kept: dict[tuple[str, str], deque[Outgoing]] = {}
        system.graph.tap(self._tap)

    @property
    def dropped(self) -> int:
        """Nothing is lost on the way here."""
        return 0

    def refit(self) -> None:
        """Nothing has to fit: what the player publishes is taken as it is."""

    def open(self, topic: str, kind: type[Message], take: Taker) -> Callable[[], None]:
        """Call `take` with what a topic shows now, and every message from now on. The returned function ends that; calling it twice is harmless."""
        key = (topic, kind.__ros_type__)
        self._forget_after_seek()
        for shown in self._kept.get(key, ()):
            take(shown)
        takers = self._takers.setdefault(key, {})
        takers[take] = None
        return lambda: takers.pop(take, None)

    def _tap(self, publisher: PublisherPeer) -> Callable[[Any], None]:
        name = publisher.entry.name
        key = (name, publisher.type.__ros_type__)
        player, takers = self._player, self._takers.setdefault(key, {})

        def deliver(message: Message) -> None:
            if player.message_ns is None:
                return  # what the nodes here say themselves is no part of the recording
            self._playback.look()  # so that a seek is sent before what it shows
            self._forget_after_seek()
            shown = Outgoing(LazyMessage(message), player.message_ns)
            kept = self._kept.get(key)
            if kept is None:
                kept = self._kept[key] = deque(maxlen=player.counts[name])
            kept.append(shown)
            for take in tuple(takers):
                take(shown)

        return deliver

    def _forget_after_seek(self) -> None:
        if self._seeks != self._player.seeks:
            self._seeks = self._player.seeks
            self._kept.clear()


def _time(at_ns: int) -> dict[str, int]:
    return {"sec": at_ns // 10**9, "nsec": at_ns % 10**9}
