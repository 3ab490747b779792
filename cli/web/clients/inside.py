"""Files that a client asks for by a path of its own choice."""

from __future__ import annotations

from pathlib import Path


def file_inside(folder: Path, path: str) -> Path | None:
    """The file at a path below a folder, resolved; None if there is none, or if it lies elsewhere, be it by ``..`` or by a link."""
    root = folder.resolve()
    try:
        found = (root / path).resolve()
        return found if found.is_relative_to(root) and found.is_file() else None
    except (OSError, ValueError):  # a name that is too long, or that holds a zero byte
        return None
