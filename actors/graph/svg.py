"""A graph of nodes, topics, services and actions as a picture (SVG) that any browser shows."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from html import escape
from itertools import pairwise
from typing import Final

from actors.graph.layered import Point, layered

__all__ = ["drawn"]

FONT: Final = 12.0
LETTER: Final = 7.3
"""How wide a letter of the font is; the font has letters of one width."""
PAD: Final = Point(12.0, 7.0)
BORDER: Final = 16.0
STYLE: Final = (
    f"text {{ font: {FONT:g}px monospace; text-anchor: middle; dominant-baseline: central; fill: #1a1a1a }} "
    ".node { fill: #dbe9f6; stroke: #2a6496 } .topic { fill: #fff; stroke: #777 } .service { fill: #fdf0d5; stroke: #b9770e } "
    "path { fill: none; stroke: #555; marker-end: url(#tip) } path.dashed { stroke-dasharray: 5 3 }"
)
TIP: Final = (
    '<marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
    '<path d="M0 0L8 4L0 8z" style="fill: #555; stroke: none; marker-end: none"/></marker>'
)


def drawn(things: Iterable[tuple[str, str]], edges: Iterable[tuple[str, str, bool]]) -> str:
    """The picture. A thing is a key, whose first word is `node`, `topic` or `service`, and a label; an edge joins two keys, dashed or not."""
    labels = dict(things)
    joined = [edge for edge in edges if edge[0] in labels and edge[1] in labels]
    boxes = {key: Point(LETTER * len(label) + 2 * PAD.x, FONT + 2 * PAD.y) for key, label in labels.items()}
    drawing = layered(boxes, [(begin, end) for begin, end, _ in joined])
    width, height = drawing.size.x + 2 * BORDER, drawing.size.y + 2 * BORDER
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}" height="{height:g}" '
        f'viewBox="{-BORDER:g} {-BORDER:g} {width:g} {height:g}">',
        f"<style>{STYLE}</style><defs>{TIP}</defs>",
    ]
    for line, (begin, end, dashed) in zip(drawing.lines, joined, strict=True):
        title = f"<title>{escape(labels[begin])} -&gt; {escape(labels[end])}</title>"
        kind = "dashed" if dashed else "plain"
        lines.append(f'<path class="{kind}" d="{_curve(line.points)}">{title}</path>')
    for key, corner in drawing.corners.items():
        lines += _box(key.split(" ")[0], labels[key], corner, boxes[key])
    return "\n".join([*lines, "</svg>"]) + "\n"


def _box(kind: str, label: str, corner: Point, size: Point) -> Iterator[str]:
    x, y = corner
    if kind == "service":
        slant, middle = size.y / 2, y + size.y / 2
        outline = ((x, middle), (x + slant, y), (x + size.x - slant, y), (x + size.x, middle))
        below = ((x + size.x - slant, y + size.y), (x + slant, y + size.y))
        points = " ".join(f"{px:g},{py:g}" for px, py in (*outline, *below))
        yield f'<polygon class="{kind}" points="{points}"/>'
    else:
        round_ = size.y / 2 if kind == "topic" else 2.0
        yield f'<rect class="{kind}" x="{x:g}" y="{y:g}" width="{size.x:g}" height="{size.y:g}" rx="{round_:g}"/>'
    yield f'<text x="{x + size.x / 2:g}" y="{y + size.y / 2:g}">{escape(label)}</text>'


def _curve(points: Sequence[Point]) -> str:
    """A line that leaves and reaches each of its points horizontally."""
    begin = points[0]
    text = f"M{begin.x:g} {begin.y:g}"
    for before, point in pairwise(points):
        middle = (before.x + point.x) / 2
        text += f"C{middle:g} {before.y:g} {middle:g} {point.y:g} {point.x:g} {point.y:g}"
    return text
