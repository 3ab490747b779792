"""Transforms obey the laws of their group, and a tree of frames answers for every instant it knows, and for no other."""

from __future__ import annotations

from math import cos, inf, isclose, pi, sin, sqrt

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import Quaternion, TransformStamped
from actors.interfaces.geometry_msgs.msg import Transform as TransformMessage
from actors.interfaces.std_msgs.msg import Header
from robot.frames import (
    Extrapolation,
    FrameTree,
    InvalidTransform,
    NotATree,
    NotConnected,
    Transform,
    UnknownFrame,
    stamped,
)

lengths = st.floats(-100.0, 100.0)
shares = st.floats(0.0, 1.0)


@st.composite
def transforms(draw: st.DrawFn) -> Transform:
    q = draw(st.tuples(*[st.floats(-1.0, 1.0)] * 4))
    norm = sqrt(sum(part * part for part in q))
    assume(norm > 1e-3)
    w, x, y, z = (part / norm for part in q)
    return Transform(draw(st.tuples(lengths, lengths, lengths)), (w, x, y, z))


def close(a: Transform, b: Transform, atol: float = 1e-9) -> bool:
    """Equal as transforms: q and -q are the same rotation."""
    return bool(np.allclose(a.matrix, b.matrix, atol=atol) and np.allclose(a.translation, b.translation, atol=atol))


def at(seconds: float) -> Time:
    nanoseconds = round(seconds * 1e9)
    return Time(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)


def tell(tree: FrameTree, parent: str, child: str, transform: Transform, seconds: float) -> None:
    tree.insert(stamped(parent, child, transform, at(seconds)))


# -- transforms -----------------------------------------------------------------------------------------------------------------


@given(transforms(), transforms(), transforms())
def test_composition_is_associative(a: Transform, b: Transform, c: Transform) -> None:
    assert close((a @ b) @ c, a @ (b @ c), 1e-8)


@given(transforms())
def test_the_inverse_undoes_it_from_both_sides(a: Transform) -> None:
    assert close(a @ a.inverse(), Transform(), 1e-8)
    assert close(a.inverse() @ a, Transform(), 1e-8)


@given(transforms(), transforms(), st.tuples(lengths, lengths, lengths))
def test_a_composition_takes_points_as_its_parts_do(a: Transform, b: Transform, p: tuple[float, float, float]) -> None:
    assert (a @ b).point(p) == pytest.approx(a.point(b.point(p)), abs=1e-8)
    assert a.points([p, p])[1] == pytest.approx(a.point(p), abs=1e-9)


@given(transforms(), transforms(), shares)
def test_blending_ends_where_it_should_and_turns_the_short_way(a: Transform, b: Transform, share: float) -> None:
    assert close(a.towards(b, 0.0), a, 1e-7)
    assert close(a.towards(b, 1.0), b, 1e-7)
    between = a.towards(b, share)
    whole, part = angle(a, b), angle(a, between)
    assert whole <= pi + 1e-9
    assume(whole < pi - 1e-3)  # opposite rotations have no short way
    assert isclose(part, share * whole, abs_tol=1e-6)
    assert isclose(sum(q * q for q in between.rotation), 1.0, abs_tol=1e-12)


def angle(a: Transform, b: Transform) -> float:
    """The angle of the rotation from a to b, rad in [0, pi]."""
    turn = (a.inverse() @ b).rotation
    return 2.0 * float(np.arctan2(sqrt(turn[1] ** 2 + turn[2] ** 2 + turn[3] ** 2), abs(turn[0])))


@given(transforms())
def test_a_transform_survives_its_message(a: Transform) -> None:
    assert close(Transform.from_message(a.to_message()), a)


@pytest.mark.parametrize("rotation", [Quaternion(w=0.0), Quaternion(w=2.0), Quaternion(w=float("nan"))])
def test_a_rotation_that_is_none_is_refused(rotation: Quaternion) -> None:
    with pytest.raises(InvalidTransform, match="of length 1"):
        Transform.from_message(TransformMessage(rotation=rotation))


# -- one moving frame -------------------------------------------------------------------------------------------------------------


@given(st.floats(0.0, 9.9))
def test_between_two_transforms_the_pose_is_blended(seconds: float) -> None:
    tree = FrameTree()
    for k in range(101):
        tell(tree, "map", "robot", Transform.planar(k * 0.05, 0.0, k * 0.02), k * 0.1)
    there = tree.lookup("map", "robot", at(seconds))
    assert there.translation == pytest.approx((seconds * 0.5, 0.0, 0.0), abs=1e-8)
    assert there.rotation == pytest.approx((cos(seconds * 0.1), 0.0, 0.0, sin(seconds * 0.1)), abs=1e-8)


def test_what_lies_outside_of_the_span_is_refused_with_the_span() -> None:
    tree = FrameTree()
    tell(tree, "map", "robot", Transform(), 5.0)
    tell(tree, "map", "robot", Transform(), 6.0)
    with pytest.raises(Extrapolation, match=r"0\.500000 s after the last.*known are 5\.000000 to 6\.000000 s") as late:
        tree.lookup("map", "robot", at(6.5))
    assert not late.value.past
    with pytest.raises(Extrapolation, match=r"1\.000000 s before the first") as early:
        tree.lookup("robot", "map", at(4.0))
    assert early.value.past


def test_ten_seconds_are_remembered_and_no_more() -> None:
    tree = FrameTree()
    for k in range(3000):
        tell(tree, "map", "robot", Transform.planar(k * 0.01, 0.0, 0.0), k * 0.01)
    assert tree.lookup("map", "robot", at(20.0)).translation[0] == pytest.approx(20.0)
    with pytest.raises(Extrapolation, match=r"known are 19\.990000 to 29\.990000 s"):
        tree.lookup("map", "robot", at(19.9))
    tell(tree, "map", "robot", Transform(), 3.0)
    assert tree.outdated == 1
    assert len(tree._tracks["robot"]._entries) < 1500


@given(st.permutations(list(range(20))))
def test_the_order_in_which_transforms_come_does_not_matter(order: list[int]) -> None:
    tree = FrameTree()
    for k in order:
        tell(tree, "map", "robot", Transform.planar(float(k), 0.0, 0.0), k * 0.1)
    assert tree.lookup("map", "robot", at(1.23)).translation[0] == pytest.approx(12.3)


def test_a_second_transform_of_one_instant_replaces_the_first() -> None:
    tree = FrameTree()
    tell(tree, "map", "robot", Transform.planar(1.0, 0.0, 0.0), 1.0)
    tell(tree, "map", "robot", Transform.planar(2.0, 0.0, 0.0), 1.0)
    assert tree.lookup("map", "robot", at(1.0)).translation[0] == 2.0


# -- the tree ---------------------------------------------------------------------------------------------------------------------


def house() -> FrameTree:
    """map -> odom -> base -> (camera, lidar), and an arm that nobody has connected."""
    tree = FrameTree()
    for k in range(11):
        tell(tree, "map", "odom", Transform.planar(1.0, 2.0, 0.5), k * 0.1)
        tell(tree, "odom", "base", Transform.planar(k * 0.1, 0.0, 0.0), k * 0.1 + 0.05)
    tree.insert(stamped("base", "camera", Transform((0.4, 0.0, 0.1)), Time()), static=True)
    tree.insert(stamped("base", "lidar", Transform((0.0, 0.0, 0.3)), Time()), static=True)
    tree.insert(stamped("shoulder", "hand", Transform(), Time()), static=True)
    return tree


@given(st.floats(0.05, 1.0), st.permutations(["map", "odom", "base", "camera", "lidar"]))
def test_any_way_through_the_tree_agrees_with_any_other(seconds: float, names: list[str]) -> None:
    tree, when = house(), at(seconds)
    a, b, c = names[:3]
    assert close(tree.lookup(a, b, when) @ tree.lookup(b, c, when), tree.lookup(a, c, when))
    assert close(tree.lookup(a, b, when), tree.lookup(b, a, when).inverse())
    assert tree.lookup(a, a, when) == Transform()


def test_without_a_time_it_is_the_latest_that_all_know() -> None:
    tree = house()
    assert tree.latest("map", "camera") == at(1.0)
    assert tree.lookup("odom", "base").translation[0] == pytest.approx(1.0)
    assert tree.lookup("odom", "camera", tree.latest("map", "camera")).translation[0] == pytest.approx(1.35)
    assert tree.latest("camera", "lidar") is None
    assert tree.lookup("camera", "lidar").translation == pytest.approx((-0.4, 0.0, 0.2))


def test_spans_that_do_not_meet_have_no_latest() -> None:
    tree = FrameTree()
    tell(tree, "map", "odom", Transform(), 1.0)
    tell(tree, "odom", "base", Transform(), 3.0)
    with pytest.raises(Extrapolation, match=r"map -> odom ends at 1\.000000 s, odom -> base begins at 3\.000000 s"):
        tree.lookup("map", "base")


def test_unknown_frames_name_the_closest() -> None:
    with pytest.raises(UnknownFrame, match="did you mean camera"):
        house().lookup("map", "camer", at(0.5))
    with pytest.raises(UnknownFrame, match="there are: none yet"):
        FrameTree().lookup("a", "b")


def test_frames_that_are_not_connected_are_told_by_their_roots() -> None:
    with pytest.raises(NotConnected, match="hand hangs from shoulder, camera from map"):
        house().lookup("camera", "hand")


def test_loops_and_second_parents_are_refused_and_change_nothing() -> None:
    tree = house()
    with pytest.raises(NotATree, match="loop: map in camera in base in odom in map"):
        tell(tree, "camera", "map", Transform(), 0.5)
    with pytest.raises(NotATree, match="base is given in odom already"):
        tell(tree, "map", "base", Transform(), 0.5)
    with pytest.raises(NotATree, match="loop"):
        tell(tree, "ball", "ball", Transform(), 0.5)
    assert tree.parent("base") == "odom"
    assert tree.parent("map") is None


@pytest.mark.parametrize(("parent", "child"), [("", "a"), ("a", ""), ("/map", "a")])
def test_frames_need_plain_names(parent: str, child: str) -> None:
    with pytest.raises(InvalidTransform, match="need a name"):
        FrameTree().insert(stamped(parent, child, Transform(), Time()))


def test_numbers_that_are_none_are_refused() -> None:
    message = TransformStamped(
        header=Header(frame_id="a"), child_frame_id="b", transform=Transform((inf, 0.0, 0.0)).to_message()
    )
    with pytest.raises(InvalidTransform, match="must be finite"):
        FrameTree().insert(message)


def test_a_clock_that_was_set_back_forgets_what_moves() -> None:
    tree = house()
    tree.clear()
    assert tree.frames == ("base", "camera", "hand", "lidar", "shoulder")
    tell(tree, "odom", "base", Transform(), 0.2)
    assert tree.lookup("odom", "camera").translation == pytest.approx((0.4, 0.0, 0.1))
