"""Places for the boxes of a directed graph, in columns from left to right, so that most arrows point to the right and few of them cross.

The method is Sugiyama's: turn round the edges that close circles, give each box a column, order the boxes of each column by those that they
are connected with, and stack them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Final, NamedTuple

__all__ = ["Drawing", "Line", "Point", "layered"]

COLUMN_GAP: Final = 60.0
ROW_GAP: Final = 14.0
SWEEPS: Final = 8
"""How often the columns are ordered anew, forwards and backwards in turn."""


class Point(NamedTuple):
    """A place in the drawing, with y downwards."""

    x: float
    y: float


class Line(NamedTuple):
    """An edge: the places that it goes through, from the box where it begins to the one where it ends."""

    begin: str
    end: str
    points: tuple[Point, ...]


class Drawing(NamedTuple):
    """The upper left corner of each box, the edges in the order in which they were given, and the size of the whole."""

    corners: dict[str, Point]
    lines: list[Line]
    size: Point


Passage = tuple[str, str, int]
"""Where an edge goes through a column that it does not end in: its two boxes, and the column."""

Place = str | Passage


def layered(boxes: Mapping[str, Point], edges: Sequence[tuple[str, str]]) -> Drawing:
    """Place the boxes, given by their sizes. The edges join boxes; none joins a box with itself."""
    forward = _forward(boxes, edges)
    columns = _columns(boxes, forward)
    routes = {edge: _route(edge, columns) for edge in forward}
    rows = _ordered(columns, routes.values())
    widths = [max(boxes[place].x if isinstance(place, str) else 0.0 for place in row) for row in rows]
    heights = [sum(_height(boxes, place) + ROW_GAP for place in row) - ROW_GAP for row in rows]
    highest, x = max(heights, default=0.0), 0.0
    corners: dict[Place, Point] = {}
    for row, width, height in zip(rows, widths, heights, strict=True):
        y = (highest - height) / 2
        for place in row:
            own = boxes[place].x if isinstance(place, str) else width
            corners[place] = Point(x + (width - own) / 2, y)
            y += _height(boxes, place) + ROW_GAP
        x += width + COLUMN_GAP
    lines = [Line(begin, end, _through((begin, end), routes, corners, boxes)) for begin, end in edges]
    size = Point(max(0.0, x - COLUMN_GAP), highest)
    return Drawing({name: corners[name] for name in boxes}, lines, size)


def _forward(boxes: Iterable[str], edges: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
    """The edges without those that close a circle, which are turned round; each pair of boxes once."""
    after: dict[str, list[str]] = {name: [] for name in boxes}
    for begin, end in edges:
        after[begin].append(end)
    found: dict[tuple[str, str], None] = {}
    seen, above = set[str](), set[str]()
    for root in after:
        if root in seen:
            continue
        stack = [(root, iter(after[root]))]
        seen.add(root)
        above.add(root)
        while stack:
            begin, rest = stack[-1]
            for end in rest:
                found[(end, begin) if end in above else (begin, end)] = None
                if end not in seen:
                    seen.add(end)
                    above.add(end)
                    stack.append((end, iter(after[end])))
                    break
            else:
                above.discard(begin)
                stack.pop()
    return list(found)


def _columns(boxes: Iterable[str], forward: Sequence[tuple[str, str]]) -> dict[str, int]:
    """The column of each box: one more than the last of those before it; what nothing points to stands just before what it points to."""
    before: dict[str, list[str]] = {name: [] for name in boxes}
    after: dict[str, list[str]] = {name: [] for name in before}
    for begin, end in forward:
        before[end].append(begin)
        after[begin].append(end)
    missing = {name: len(each) for name, each in before.items()}
    ready = [name for name, number in missing.items() if not number]
    columns: dict[str, int] = {}
    for name in ready:  # which grows while it is read
        columns[name] = max((columns[each] + 1 for each in before[name]), default=0)
        for end in after[name]:
            missing[end] -= 1
            if not missing[end]:
                ready.append(end)
    for name in columns:
        if not before[name] and after[name]:
            columns[name] = min(columns[end] for end in after[name]) - 1
    return columns


def _route(edge: tuple[str, str], columns: Mapping[str, int]) -> list[Place]:
    begin, end = edge
    return [begin, *((begin, end, column) for column in range(columns[begin] + 1, columns[end])), end]


def _ordered(columns: Mapping[str, int], routes: Iterable[Sequence[Place]]) -> list[list[Place]]:
    """The places of each column from top to bottom."""
    rows: list[list[Place]] = [[] for _ in range(max(columns.values(), default=-1) + 1)]
    for name, column in columns.items():
        rows[column].append(name)
    near: tuple[dict[Place, list[Place]], dict[Place, list[Place]]] = ({}, {})
    for route in routes:
        for place in route:
            if isinstance(place, tuple):
                rows[place[2]].append(place)
        for left, right in pairwise(route):
            near[0].setdefault(right, []).append(left)
            near[1].setdefault(left, []).append(right)
    for sweep in range(SWEEPS):
        backwards = sweep % 2
        for column in range(len(rows) - 2, -1, -1) if backwards else range(1, len(rows)):
            other = rows[column + 1 if backwards else column - 1]
            height = {place: index / len(other) for index, place in enumerate(other)}
            own = {place: index / len(rows[column]) for index, place in enumerate(rows[column])}
            wanted = {place: _middle(near[backwards].get(place, ()), height, own[place]) for place in own}
            rows[column].sort(key=wanted.__getitem__)
    return rows


def _middle(near: Sequence[Place], height: Mapping[Place, float], own: float) -> float:
    """The mean height of the places that one is connected with; its own if there are none."""
    return sum(height[each] for each in near) / len(near) if near else own


def _height(boxes: Mapping[str, Point], place: Place) -> float:
    return boxes[place].y if isinstance(place, str) else 0.0


def _through(
    edge: tuple[str, str],
    routes: Mapping[tuple[str, str], Sequence[Place]],
    corners: Mapping[Place, Point],
    boxes: Mapping[str, Point],
) -> tuple[Point, ...]:
    begin, end = edge
    turned = edge not in routes
    route = routes[(end, begin) if turned else edge]
    first, *between, last = (corners[place] for place in route)
    left, right = (boxes[name] for name in ((end, begin) if turned else edge))
    points = (
        Point(first.x + left.x, first.y + left.y / 2),
        *between,
        Point(last.x, last.y + right.y / 2),
    )
    return points[::-1] if turned else points
