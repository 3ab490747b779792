"""How far a verb of `bag` is, on a terminal."""

from __future__ import annotations

import sys

from cli.output import control


def progress(text: str) -> None:
    """Show how far a command is, on a terminal only."""
    if sys.stderr.isatty():
        control("\r", sys.stderr)
        print(text, end="", file=sys.stderr)
        control("\x1b[K", sys.stderr)
        sys.stderr.flush()


def progress_over() -> None:
    """Leave the line of `progress`."""
    if sys.stderr.isatty():
        control("\r\x1b[K", sys.stderr)
