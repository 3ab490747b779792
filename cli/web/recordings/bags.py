"""The bags of one folder: which there are, and the one that is being recorded. Clients know them by name; paths do not come from them."""

from __future__ import annotations

import asyncio
import re
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from actors import ActorError, Child, System, temporary
from actors.bag import BagError, BagReader, Recorder, RecordOptions, Selection
from cli.web.clients.errors import Refused

if TYPE_CHECKING:
    from actors.runtime.joined import JoinedNode

PIECE: Final = 1024 * 1024
"""The most bytes of a file that are given out at once."""
MOST_LISTED: Final = 200
SUFFIXES: Final = (".mcap", ".db3", ".zstd")
"""The ends of what is a bag without a folder, or a file of one."""

_NAME: Final = re.compile(r"[A-Za-z0-9][\w.-]{0,99}", re.ASCII)


class _Running(NamedTuple):
    name: str
    node: JoinedNode
    begun: float


class Bags:
    """The bags of one folder.

    Invariants: at most one bag is recorded, which is `_running`. No name leads out of the folder: it is that of an entry of it, and no link.
    """

    def __init__(self, system: System, folder: Path | None) -> None:
        self._system = system
        self._folder = folder
        self._running: _Running | None = None
        self._known: dict[Path, tuple[int, dict[str, Any]]] = {}
        """What the page shows of a bag, with the time of its last change."""
        self._lock = asyncio.Lock()

    def path(self, name: str) -> Path:
        """The bag of this name. Raises `Refused` if there is none, or it is still recorded."""
        path = self._entry(name)
        if not path.exists() or path.is_symlink():
            raise Refused(f"there is no bag {name!r:.100}")
        if self._running is not None and self._running.name == name:
            raise Refused(f"{name} is still recorded")
        return path

    async def report(self) -> dict[str, Any]:
        """All of them, the newest first, and what is recorded now; without a folder `folder` is None."""
        running, recording = self._running, None
        if running is not None:
            recorder = running.node.node
            assert isinstance(recorder, Recorder)
            recording = {
                "name": running.name, "seconds": self._system.clock.now() - running.begun, "messages": recorder.recorded,
                "dropped": recorder.dropped, "bytes": recorder.size, "topics": len(recorder.topics),
                "failure": None if recorder.failure is None else recorder.failure.strerror,
            }  # fmt: skip
        bags = await asyncio.to_thread(self._list, None if running is None else running.name)
        return {"folder": None if self._folder is None else str(self._folder), "recording": recording, "bags": bags}

    async def record(self, name: str, topics: list[str] | None) -> str:
        """Begin to record these topics, or all, and return the name of the bag. Raises `Refused`."""
        name = name or time.strftime("rosbag2_%Y_%m_%d-%H_%M_%S")
        path = self._entry(name)
        async with self._lock:
            if self._running is not None:
                raise Refused(f"{self._running.name} is recorded already: end that first")
            if path.exists():
                raise Refused(f"there is a bag {name} already: choose another name")
            selection = Selection(all_topics=True) if topics is None else Selection(topics=topics)
            recorder = Child(Recorder, args=(path, RecordOptions(selection=selection)), restart=temporary)
            try:
                path.parent.mkdir(parents=True, exist_ok=True)
                node = await self._system.join(recorder)
            except (ActorError, BagError, OSError) as error:
                raise Refused(f"{name} cannot be recorded: {error}") from None
            self._running = _Running(name, node, self._system.clock.now())
        return name

    async def stop(self) -> None:
        """End the recording, if there is one."""
        async with self._lock:
            if self._running is not None:
                recorder = self._running.node.node
                assert isinstance(recorder, Recorder)
                await recorder.finish()
                await self._system.leave(self._running.node, "recording was ended")
                self._running = None

    async def read(self, name: str, file: str, offset: int) -> bytes:
        """A piece of a file of a bag; empty at its end. Raises `Refused`."""
        path = self.path(name)
        if path.is_dir():
            path = path / _checked(file)
        if path.suffix not in SUFFIXES or not path.is_file() or path.is_symlink():
            raise Refused(f"{name} has no file {file!r:.100}")
        return await asyncio.to_thread(_piece, path, offset)

    def _entry(self, name: str) -> Path:
        if self._folder is None:
            raise Refused("no bags are kept here: start the server with --bags DIR")
        return self._folder / _checked(name)

    def _list(self, running: str | None) -> list[dict[str, Any]]:
        if self._folder is None or not self._folder.is_dir():
            return []
        found = [one for one in self._folder.iterdir() if _is_bag(one) and one.name != running]
        found.sort(key=lambda one: one.stat().st_mtime_ns, reverse=True)
        return [told for path in found[:MOST_LISTED] if (told := self._told(path)) is not None]

    def _told(self, path: Path) -> dict[str, Any] | None:
        """What there is to know of a bag; None for one that cannot be read."""
        changed = path.stat().st_mtime_ns
        known = self._known.get(path)
        if known is None or known[0] != changed:
            try:
                known = self._known[path] = (changed, _described(path))
            except (BagError, OSError):
                return None
        return known[1]


def _checked(name: str) -> str:
    if not _NAME.fullmatch(name):
        raise Refused(f"{name!r:.100} is no name of a bag: it has letters, digits, dots, dashes and underscores")
    return name


def _is_bag(path: Path) -> bool:
    if path.is_symlink() or not _NAME.fullmatch(path.name):
        return False
    return path.is_dir() or path.suffix in SUFFIXES


def _described(path: Path) -> dict[str, Any]:
    with BagReader(path) as bag:
        told = bag.metadata
        files = [(bag.folder / file.path) for file in told.files]
        return {
            "name": path.name, "start": told.start_ns / 1e9, "seconds": told.duration_ns / 1e9, "messages": told.message_count,
            "topics": len(bag.topics), "bytes": bag.size, "cut": bag.cut,
            "files": [{"name": file.name, "bytes": file.stat().st_size} for file in files],
        }  # fmt: skip


def _piece(path: Path, offset: int) -> bytes:
    try:
        with path.open("rb") as stream:
            stream.seek(offset)
            return stream.read(PIECE)
    except OSError as error:
        raise Refused(f"{path.name}: {error.strerror}") from None
