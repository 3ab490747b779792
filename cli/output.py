"""How commands print: JSON, tables, and the screen cleared between two of them."""

from __future__ import annotations

import io
import re
import sys
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from typing import IO, Any


def print_json(value: Any) -> None:
    """One JSON value on one line. Numbers that JSON does not know (nan, inf) are null, bytes are lists of numbers."""
    import msgspec

    from actors.logs.terminal import CONTROLS

    print(re.sub(f"[{CONTROLS}]", lambda found: f"\\u{ord(found[0]):04x}", msgspec.json.encode(value).decode()))


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table as `topic hz` prints several topics: titles in the middle, a line of ``=``, cells from the left."""
    widths = [max(len(cell) for cell in column) for column in zip(header, *rows, strict=True)]
    lines = ["   ".join(title.center(width) for title, width in zip(header, widths, strict=True))]
    lines.append("=" * (sum(widths) + 3 * (len(header) - 1)))
    lines += ["   ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in rows]
    return "\n".join(lines) + "\n"


def clear_screen() -> None:
    """Begin at the top of an empty screen, if the output is one."""
    if sys.stdout.isatty():
        control("\x1b[H\x1b[2J")


class _Shown(io.TextIOBase):
    """A stream whose text is shown: names, errors and log lines of others are in it."""

    def __init__(self, stream: Any) -> None:
        self.stream = stream

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stream, name)

    @property
    def encoding(self) -> str:  # type: ignore[override]  # a property there, too, whatever the stubs say
        return str(self.stream.encoding)

    def write(self, text: str) -> int:
        if not text.replace("\n", "").isprintable():
            from actors.logs.terminal import shown  # late: it brings the whole framework, and help needs none of it

            self.stream.write(shown(text))
        else:
            self.stream.write(text)
        return len(text)

    def flush(self) -> None:
        self.stream.flush()

    def isatty(self) -> bool:
        return bool(self.stream.isatty())

    def fileno(self) -> int:
        return int(self.stream.fileno())


@contextmanager
def safe_output() -> Generator[None]:
    """Within the block, what is printed cannot control the terminal; `control` can."""
    before = sys.stdout, sys.stderr
    ours: Any = _Shown(sys.stdout), _Shown(sys.stderr)
    sys.stdout, sys.stderr = ours
    try:
        yield
    finally:
        if (sys.stdout, sys.stderr) == ours:
            sys.stdout, sys.stderr = before


def control(sequence: str, stream: IO[str] | None = None) -> None:
    """Control the terminal that is stdout, or this stream."""
    out: Any = stream or sys.stdout
    (out.stream if isinstance(out, _Shown) else out).write(sequence)
