"""The error of a security file."""

from __future__ import annotations

from actors.transport.protocol import WireUnavailable


class SecurityError(WireUnavailable):
    """A security file, or a file that it names, cannot be used; the text is one line that begins with file and line. No secret is in it."""

    def __init__(self, problem: str, *, file: str, line: int | None = None) -> None:
        super().__init__(f"{file}: {problem}" if line is None else f"{file}:{line}: {problem}")
        self.file = file
        self.line = line
