"""Which tokens and which processes are there, from what Zenoh reports of its liveliness tokens."""

from __future__ import annotations

import re
from collections.abc import Callable, Sized
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from actors.transport.format.names import is_ours
from actors.transport.keyed.protocol import Events

_SPACE: Final = "@robactor"
_UNUSUAL: Final = re.compile(r"[^A-Za-z0-9_.-]")
_SESSION: Final = re.compile(r"[1-9a-f][0-9a-f]{0,31}")
_PROCESS: Final = re.compile(r"[0-9]{1,10}")

MOST_TOKENS: Final = 10_000
MOST_ALTOGETHER: Final = 50_000


class Process(NamedTuple):
    """A process of this library, as a token of its own describes it: ``@robactor/<scope>/<session>/<process id>/<host>``."""

    scope: str
    session: str
    process: int
    host: str

    @property
    def token(self) -> str:
        return f"{_SPACE}/{self.scope}/{self.session}/{self.process}/{_UNUSUAL.sub('_', self.host) or '_'}"

    @classmethod
    def parse(cls, token: str) -> Process | None:
        """The process that a token describes; None if it describes none."""
        parts = token.split("/")
        if (
            len(parts) != 5
            or parts[0] != _SPACE
            or not _SESSION.fullmatch(parts[2])
            or not _PROCESS.fullmatch(parts[3])
        ):
            return None
        return cls(parts[1], parts[2], int(parts[3]), parts[4])


def scope_of(tokens: str) -> str:
    """The part of a key expression before its first wildcard, as one chunk: processes that watch the same tokens have the same scope."""
    fixed = tokens.split("*")[0].strip("/")
    return _UNUSUAL.sub("_", fixed) or "_"


def session_of(token: str) -> str:
    """The session that a token of ROS 2 names, ``@ros2_lv/<domain>/<session>/...``; empty if it names none."""
    parts = token.split("/", 3)
    return parts[2] if len(parts) > 3 and _SESSION.fullmatch(parts[2]) else ""


@dataclass(slots=True)
class _Peer:
    tokens: dict[str, None] = field(default_factory=dict[str, None])
    """Those of ROS 2."""
    processes: dict[str, Process] = field(default_factory=dict[str, Process])
    """The processes that tokens name for it, by token: anybody can announce such a token."""
    silent: bool = False
    """Its loop has not been heard of for too long, although its tokens are there."""

    @property
    def process(self) -> Process | None:
        return next(iter(self.processes.values()), None)


class Presence:
    """Turns the appearing and vanishing of tokens into `Events`, in the order that `Transport` promises.

    A process that ends takes all its tokens with it, and Zenoh reports them one by one. Therefore vanished tokens are collected until
    `settle`, which distinguishes a withdrawn token from a lost process: one that has no token left, not even the one that describes it.
    Anybody can announce a token that names the session of another process, and withdraw it: that takes nothing away but this token. Zenoh does
    not report a token as vanished while anybody holds it.

    Tokens are bounded: of one session `MOST_TOKENS` are taken, and `MOST_ALTOGETHER` of all; the tokens beyond are not shown.

    Invariants: a peer is known while it has a token, and is shown by `Events.link` while it is not silent; a token is shown by `Events.appeared` while it is
    there, its peer is shown, and it has not vanished. A token that names no session is shown while it is there.
    """

    def __init__(self, events: Events, found: Callable[[str], None], lost: Callable[[str], None]) -> None:
        """`found` is called with a session before its link is shown, and `lost` before it is hidden."""
        self._events = events
        self._tell_found = found
        self._tell_lost = lost
        self._peers: dict[str, _Peer] = {}
        self._nobody = _Peer()
        self._count = 0
        """How many tokens are held."""
        self._vanishing: dict[str, None] = {}

    @property
    def shown(self) -> dict[str, Process | None]:
        """The sessions of the peers that are shown, and what is known of their processes."""
        return {session: peer.process for session, peer in self._peers.items() if not peer.silent}

    @property
    def beating(self) -> list[str]:
        """The sessions that are shown and are expected to be heard: those of this library, by their names.

        Tokens that name a session do not count: anybody could beat for a process of ROS 2, which never does, and then fall silent for it.
        """
        return [session for session, peer in self._peers.items() if not peer.silent and is_ours(session)]

    def tokens(self, session: str) -> tuple[str, ...]:
        """The tokens that a session holds."""
        return tuple(self._peers[session].tokens) if session in self._peers else ()

    def appear(self, token: str) -> None:
        """A token is there. Told twice, it counts once."""
        self.settle()
        session = session_of(token)
        peer = self._found(session) if session else self._nobody
        if peer is not None and token not in peer.tokens and self._has_room(peer.tokens):
            self._count += 1
            peer.tokens[token] = None
            if not peer.silent:
                self._events.appeared(token)

    def vanish(self, token: str) -> None:
        """A token is gone; it is shown until `settle`."""
        self._vanishing[token] = None

    def arrive(self, process: Process) -> None:
        """A process of this library is there."""
        self.settle()
        peer = self._found(process.session)
        if peer is None:
            return
        if process.token not in peer.processes and self._has_room(peer.processes):
            self._count += 1
            peer.processes[process.token] = process
        self.heard(process.session)

    def heard(self, session: str) -> None:
        """The loop of a process is running: if it was silent, it and its tokens are shown again."""
        peer = self._peers.get(session)
        if peer is not None and peer.silent:
            peer.silent = False
            self._show(session)
            for token in tuple(peer.tokens):
                self._events.appeared(token)

    def silence(self, session: str) -> None:
        """The loop of a process has not been heard of for too long: it counts as lost until it is heard again."""
        peer = self._peers.get(session)
        if peer is not None and not peer.silent:
            peer.silent = True
            self._hide(session, tuple(peer.tokens))

    def settle(self) -> int:
        """Report what has vanished: lost processes first, then the tokens. Returns how many tokens these were."""
        if not self._vanishing:
            return 0
        vanishing, self._vanishing = self._vanishing, {}
        gone: dict[str, list[str]] = {}
        for token in vanishing:
            process = Process.parse(token)
            gone.setdefault(session_of(token) if process is None else process.session, []).append(token)
        nobody = gone.pop("", [])
        left: list[tuple[_Peer, list[str]]] = [(self._nobody, nobody)]
        for session, tokens in gone.items():
            peer = self._peers.get(session)
            if peer is not None and peer.tokens.keys() | peer.processes.keys() <= set(tokens):
                self._lose(session)
            elif peer is not None:
                left.append((peer, tokens))
        for peer, tokens in left:
            self._withdraw(peer, tokens)
        return len(vanishing)

    def _has_room(self, tokens: Sized) -> bool:
        return len(tokens) < MOST_TOKENS and self._count < MOST_ALTOGETHER

    def _lose(self, session: str) -> None:
        peer = self._peers.pop(session)
        self._count -= len(peer.tokens) + len(peer.processes)
        if not peer.silent:
            self._hide(session, tuple(peer.tokens))

    def _withdraw(self, peer: _Peer, tokens: list[str]) -> None:
        for token in tokens:
            if token in peer.tokens:
                del peer.tokens[token]
                self._count -= 1
                if not peer.silent:
                    self._events.vanished(token)
            elif peer.processes.pop(token, None) is not None:
                self._count -= 1

    def _hide(self, session: str, tokens: tuple[str, ...]) -> None:
        self._tell_lost(session)
        self._events.link(session, False)
        for token in tokens:
            self._events.vanished(token)

    def _show(self, session: str) -> None:
        self._tell_found(session)
        self._events.link(session, True)

    def _found(self, session: str) -> _Peer | None:
        """The peer of a session; None for one that is not known while there is no room for a token of it."""
        peer = self._peers.get(session)
        if peer is None and self._has_room(()):
            peer = self._peers[session] = _Peer()
            self._show(session)
        return peer
