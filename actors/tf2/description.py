"""The frames of a buffer for people: as values, YAML, text, and a graph in the DOT language."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from actors.tf2.time_cache import TimeCache

SHORTEST = 1e-4
"""The rate of transforms is counted over at least this interval, seconds."""


class Frame(NamedTuple):
    """A frame that has a parent. Times in seconds; those of a static one are 0."""

    parent: str
    static: bool
    authority: str
    """Who told the last transform."""
    length: int
    """Transforms that are kept."""
    oldest: float
    newest: float

    @property
    def rate(self) -> float:
        """Transforms per second; that of a static frame, or of one transform, is 10000, as in tf2."""
        return self.length / max(self.newest - self.oldest, SHORTEST)


def frames(tracks: Mapping[str, TimeCache]) -> dict[str, Frame]:
    """Each frame that has a parent now."""
    found: dict[str, Frame] = {}
    for name, track in tracks.items():
        parent = track.parent
        if parent is not None:
            oldest, newest = track.span
            found[name] = Frame(parent, track.static, track.authority, len(track), oldest * 1e-9, newest * 1e-9)
    return found


def as_yaml(known: Mapping[str, Frame]) -> str:
    """A YAML document with the fields that tf2 gives; ``[]`` without frames."""
    if not known:
        return "[]"
    lines: list[str] = []
    for name, frame in known.items():
        lines += [
            f"{_quoted(name)}:",
            f"  parent: {_quoted(frame.parent)}",
            f"  broadcaster: {_quoted(frame.authority)}",
            f"  rate: {frame.rate:.3f}",
            f"  most_recent_transform: {frame.newest:.6f}",
            f"  oldest_transform: {frame.oldest:.6f}",
            f"  buffer_length: {frame.newest - frame.oldest:.3f}",
        ]
    return "\n".join(lines) + "\n"


def as_text(known: Mapping[str, Frame]) -> str:
    """A line for each frame."""
    return "".join(f"Frame {name} exists with parent {frame.parent}.\n" for name, frame in known.items())


def as_dot(known: Mapping[str, Frame], now: float) -> str:
    """A graph in the DOT language, an edge for each frame, with the instant `now`, seconds, at which it was recorded."""
    if not known:
        return 'digraph G { "No tf data received" }\n'
    lines = ["digraph G {"]
    for name, frame in known.items():
        told = (
            f"Broadcaster: {frame.authority}",
            f"Average rate: {frame.rate:.3f}",
            f"Buffer length: {frame.newest - frame.oldest:.3f}",
            f"Most recent transform: {frame.newest:.6f}",
            f"Oldest transform: {frame.oldest:.6f}",
        )
        label = "".join(f"{_escaped(line)}\\n" for line in told)
        lines.append(f'"{_escaped(frame.parent)}" -> "{_escaped(name)}"[label=" {label}"];')
    roots = dict.fromkeys(frame.parent for frame in known.values() if frame.parent not in known)
    lines += [
        "edge [style=invis];",
        ' subgraph cluster_legend { style=bold; color=black; label="view_frames Result";',
        f'"Recorded at time: {now:.6f}"[shape=plaintext];',
        "}" + "".join(f'->"{_escaped(root)}"' for root in list(roots)[:1]) + ";",
        "}",
    ]
    return "\n".join(lines) + "\n"


def _quoted(text: str) -> str:
    return "'" + text.replace("'", "''") + "'"


def _escaped(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"')
