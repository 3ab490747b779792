"""The parts of a journal: numbered, compressed, one after another in a file or as messages of a topic."""

# pyright: reportUnknownVariableType=false, reportUnknownMemberType=false, reportUnknownArgumentType=false
# What strangers have written has no type before it is checked.

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, Final

from actors.pickle_bounds import Steps
from actors.replay.encoding import frozen, steps_for, thawed
from actors.replay.errors import ReplayError
from actors.replay.recording import Entry, Recording, Unkept

FORMAT: Final = 5
"""Of what `pack` writes."""
PART: Final = 2000
"""How many entries a part holds at most, but for those of one step."""
CHUNK: Final = 50
"""How many entries are made bytes at once, but for those of one step. The event loop waits meanwhile: see `python -m tests.tools.journal_cost`."""
MAGIC: Final = b"robactor journal\n"
SIZE: Final = 8
"""How many bytes the size of a part takes in a file."""
MOST_BYTES: Final = 1 << 26
MOST_TIMES: Final = 100
"""The parts of a journal become no larger than so many bytes together, or so many times what they take compressed."""
LEVEL: Final = 1
"""How hard Zstandard tries: the first level is the fastest."""


class Spool:
    """The journal of one node, or of a subtree, while it is written: the newest entries in memory, all others in a file.

    With `publish` each part that was written is in `fresh` until someone takes it. A file that cannot be written any more ends the journal,
    and `failure` says why.

    Invariants: all entries are, in order, in the file, in `_chunks`, and in `entries`. Code that adds to `entries` calls `settle` between two
    steps.
    """

    def __init__(self, node: str, path: Path, *, publish: bool = False) -> None:
        self.node = node
        self.entries: list[Entry] = []
        self.fresh: list[bytes] = []
        self.failure = ""
        self._publish = publish
        self._written = 0
        self._chunks: list[bytes] = []
        self._held = 0
        """How many entries are in `_chunks`."""
        self._path = path
        path.write_bytes(MAGIC)

    def settle(self) -> int:
        """Make bytes of a whole chunk of entries, and write a whole part of chunks; how many entries left `entries`."""
        count = self._freeze() if len(self.entries) >= CHUNK else 0
        if self._held >= PART:
            self._write()
        return count

    def flush(self) -> int:
        """Write what is in memory; how many entries left `entries`."""
        count = self._freeze()
        self._write()
        return count

    def _freeze(self) -> int:
        count = len(self.entries)
        if count and not self.failure:
            self._chunks.append(_chunk(self.entries))
            self._held += count
        self.entries.clear()
        return count

    def _write(self) -> None:
        if self._chunks and not self.failure:
            part = _part(self._written, self._chunks)
            try:
                with self._path.open("ab") as file:
                    file.write(len(part).to_bytes(SIZE, "little") + part)
            except OSError as error:
                self.failure = f"its journal cannot be written any more: {error}"
            else:
                self._written += 1
                if self._publish:
                    self.fresh.append(part)
        self._chunks.clear()
        self._held = 0

    def take(self) -> list[bytes]:
        """The parts that were written since the last call."""
        fresh, self.fresh = self.fresh, []
        return fresh

    def save(self, path: Path) -> None:
        """Write what has been flushed to another file."""
        path.write_bytes(self._read())

    def recording(self) -> Recording:
        """What has been flushed. Raises `ReplayError` if it could not be written."""
        return whole(self.node, parts_of(self._read()), trust=True)

    def _read(self) -> bytes:
        if self.failure:
            raise ReplayError(f"{self.node}: {self.failure}")
        return self._path.read_bytes()


def parts_of(data: bytes) -> Iterator[bytes]:
    """The parts in the bytes of a file. One that was cut off, with its program, is left out. Raises `ReplayError` for another file."""
    if not data.startswith(MAGIC):
        raise ReplayError("this is no journal of a node")
    at = len(MAGIC)
    while at + SIZE <= len(data):
        begin, at = at + SIZE, at + SIZE + int.from_bytes(data[at : at + SIZE], "little")
        if at <= len(data):
            yield data[begin:at]


def whole(node: str, parts: Iterable[bytes], *, trust: bool) -> Recording:
    """The journal of a node from its parts, in any order. Raises `ReplayError` if one is missing, or cannot be read."""
    held = list(parts)
    allowance = _Allowance(sum(map(len, held)))
    numbered = dict(unpack(part, trust=trust, allowance=allowance) for part in held)
    for place in range(len(numbered)):
        if place not in numbered:
            raise ReplayError(
                f"part {place} of the journal of {node} is missing, of {max(numbered) + 1}: what was kept for a late recorder did not reach "
                "back to it; record from the start of the program, or let it write its journals into a folder: Journal(folder=...)"
            )
    entries = [entry for _, part in sorted(numbered.items()) for entry in part]
    return Recording(node, entries, trusted=trust)


def pack(number: int, entries: list[Entry]) -> bytes:
    """Some entries of a journal as its part of this number. A value that cannot be kept is replaced by an `Unkept`."""
    return _part(number, [_chunk(entries[begin : begin + CHUNK]) for begin in range(0, len(entries), CHUNK)])


def _part(number: int, chunks: list[bytes]) -> bytes:
    import zstandard

    return zstandard.ZstdCompressor(LEVEL).compress(frozen((FORMAT, number, chunks)))


def _chunk(entries: list[Entry]) -> bytes:
    try:
        return frozen(entries)
    except ReplayError:
        return frozen([_kept(entry) for entry in entries])


class _Allowance:
    """How many bytes and values may be made of the parts of a journal that is not trusted, which take `size` bytes together."""

    def __init__(self, size: int) -> None:
        self._bytes = self._most = max(MOST_BYTES, MOST_TIMES * size)
        self.steps = Steps(steps_for(size))

    def take(self, size: int) -> None:
        """Raise `ReplayError` if so many bytes are more than what is left; a negative number is not known."""
        self._bytes -= size
        if size < 0 or self._bytes < 0:
            raise ReplayError(
                f"a part of the journal claims {size} bytes, and all may take {self._most}: replay it with --trust if you trust its origin"
            )


def unpack(part: bytes, *, trust: bool = False, allowance: _Allowance | None = None) -> tuple[int, list[Entry]]:
    """The number and the entries of a part. Raises `ReplayError` for another format, and for what is more than values without `trust`."""
    import zstandard

    allowance = _Allowance(len(part)) if allowance is None else allowance
    try:
        if not trust:
            allowance.take(zstandard.frame_content_size(part))  # each part begins with its size
        plain = zstandard.ZstdDecompressor().decompress(part)
    except zstandard.ZstdError as error:
        raise ReplayError(f"this is no part of a journal of this version: {error}") from error
    steps = allowance.steps
    found: Any = thawed(plain, trust=trust, steps=steps)
    kind: object = type(found)
    if kind is not tuple or len(found) != 3:
        raise ReplayError("this is no part of a journal")
    if found[0] != FORMAT:
        raise ReplayError(
            f"this journal has format {found[0]}, and this version reads format {FORMAT}: record it again, or replay it with the version that wrote it"
        )
    number, chunks = found[1:]
    if type(number) is not int or type(chunks) is not list or any(type(chunk) is not bytes for chunk in chunks):
        raise ReplayError("this is no part of a journal")
    lists = [thawed(chunk, trust=trust, steps=steps) for chunk in chunks]
    if any(type(one) is not list for one in lists):
        raise ReplayError("this is no part of a journal")
    return number, [entry for one in lists for entry in one]


def _kept(entry: Entry) -> Entry:
    if not isinstance(entry, tuple):
        return entry
    values: list[object] = []
    for value in entry:
        try:
            frozen(value)
        except ReplayError as error:
            value = Unkept(f"{type(value).__name__}: {error}")
        values.append(value)
    return tuple(values)
