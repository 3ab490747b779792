"""The picture of a graph: boxes in columns that do not overlap, arrows from box to box, and text that XML can carry."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from itertools import combinations, pairwise

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from actors import Child, Node, Topic, publishes
from actors.graph.layered import Drawing, Point, layered
from actors.graph.svg import drawn
from actors.interfaces.std_msgs.msg import String
from actors.testing import Rig

SIZE = Point(40.0, 10.0)
SVG = "{http://www.w3.org/2000/svg}"


def placed(edges: list[tuple[str, str]], *alone: str) -> Drawing:
    return layered(dict.fromkeys([*alone, *(name for edge in edges for name in edge)], SIZE), edges)


def crossings(drawing: Drawing) -> int:
    """How often two straight pieces of lines cross, each pair of pieces looked at."""

    def side(a: Point, b: Point, c: Point) -> float:
        return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)

    pieces = [piece for line in drawing.lines for piece in pairwise(line.points)]
    return sum(
        side(*one, other[0]) * side(*one, other[1]) < 0 and side(*other, one[0]) * side(*other, one[1]) < 0
        for one, other in combinations(pieces, 2)
    )


def test_a_chain_stands_in_one_row_from_left_to_right() -> None:
    drawing = placed([("camera", "picture"), ("picture", "detector"), ("detector", "objects")])
    order = sorted(drawing.corners, key=lambda name: drawing.corners[name].x)
    assert order == ["camera", "picture", "detector", "objects"]
    assert len({corner.y for corner in drawing.corners.values()}) == 1
    assert drawing.size == Point(4 * 40.0 + 3 * 60.0, 10.0)


def test_a_circle_has_one_arrow_that_points_back() -> None:
    drawing = placed([("a", "b"), ("b", "c"), ("c", "a")])
    back = [(line.begin, line.end) for line in drawing.lines if line.points[0].x > line.points[-1].x]
    assert back == [("c", "a")]
    assert drawing.lines[2].points[-1] == Point(40.0, drawing.corners["a"].y + 5.0)


def test_boxes_are_ordered_so_that_arrows_need_not_cross() -> None:
    """Given in the worst order; a drawing without crossings exists."""
    drawing = placed(
        [("a", "z"), ("b", "y"), ("c", "x"), ("z", "1"), ("y", "2"), ("x", "3"), ("a", "2")], "3", "1", "2"
    )
    assert crossings(drawing) == 0


def test_what_nothing_points_to_stands_beside_what_it_points_to() -> None:
    drawing = placed([("a", "b"), ("b", "c"), ("c", "d"), ("late", "d")])
    assert drawing.corners["late"].x == drawing.corners["c"].x


LOADED = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
NAMES = st.sampled_from("abcdefgh")


@LOADED
@given(st.lists(st.tuples(NAMES, NAMES).filter(lambda edge: edge[0] != edge[1]), max_size=20))
def test_whatever_the_graph_boxes_do_not_overlap_and_arrows_join_their_borders(edges: list[tuple[str, str]]) -> None:
    drawing = placed(edges, "alone")
    assert len(drawing.corners) == len({"alone", *(name for edge in edges for name in edge)})
    for one, other in combinations(drawing.corners.values(), 2):
        assert abs(one.x - other.x) >= SIZE.x or abs(one.y - other.y) >= SIZE.y
    for corner in drawing.corners.values():
        assert 0 <= corner.x <= drawing.size.x - SIZE.x
        assert 0 <= corner.y <= drawing.size.y - SIZE.y
    assert [(line.begin, line.end) for line in drawing.lines] == edges
    for line in drawing.lines:
        for name, point in ((line.begin, line.points[0]), (line.end, line.points[-1])):
            x, y = drawing.corners[name]
            assert point.y == y + SIZE.y / 2
            assert point.x in (x, x + SIZE.x)


@LOADED
@given(st.lists(st.tuples(NAMES, NAMES).filter(lambda edge: edge[0] < edge[1]), max_size=20))
def test_in_a_graph_without_circles_every_arrow_points_to_the_right(edges: list[tuple[str, str]]) -> None:
    drawing = placed(edges)
    assert all(before.x <= after.x for line in drawing.lines for before, after in pairwise(line.points))
    assert all(line.points[0].x < line.points[-1].x for line in drawing.lines)


def test_the_picture_has_a_shape_for_each_thing_and_an_arrow_for_each_edge() -> None:
    things = [("node /a", "/a"), ("topic /t", "/t<&>"), ("service /s", "/s")]
    text = drawn(
        things, [("node /a", "topic /t", False), ("node /a", "service /s", True), ("node /b", "topic /t", False)]
    )
    picture = ElementTree.fromstring(text)
    assert [each.text for each in picture.iter(f"{SVG}text")] == ["/a", "/t<&>", "/s"]
    assert [each.get("class") for each in picture if each.get("class")] == [
        "plain",
        "dashed",
        "node",
        "topic",
        "service",
    ]
    assert [each.text for each in picture.iter(f"{SVG}title")] == ["/a -> /t<&>", "/a -> /s"]
    hexagon = picture.find(f"{SVG}polygon")
    assert hexagon is not None and len(hexagon.attrib["points"].split()) == 6


def test_an_empty_graph_is_an_empty_picture() -> None:
    assert ElementTree.fromstring(drawn([], [])).get("width") == "32"


class Talker(Node):
    words = publishes(Topic(String, "words", 10))


async def test_a_snapshot_draws_itself(rig: Rig) -> None:
    await rig.start(Child(Talker, name="talker"))
    picture = ElementTree.fromstring(rig.system.snapshot().to_svg())
    assert {"/talker", "/words"} <= {each.text for each in picture.iter(f"{SVG}text")}
    assert "/talker -> /words" in [each.text for each in picture.iter(f"{SVG}title")]
