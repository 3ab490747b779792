"""A buffer answers for every time it knows, and for no other; what it does not know it says, with what there is instead."""

from __future__ import annotations

import asyncio
from math import cos, inf, sin, sqrt

import numpy as np
import pytest
import yaml
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import PointStamped, TransformStamped
from actors.interfaces.std_msgs.msg import Header
from actors.tf2 import (
    BackwardExtrapolationException,
    Buffer,
    ConnectivityException,
    ExtrapolationException,
    ForwardExtrapolationException,
    InvalidArgumentException,
    LookupException,
    NoDataForExtrapolationException,
    Transform,
    stamped,
)
from actors.tf2.description import as_dot
from actors.time import Duration
from actors.time import Time as RosTime

lengths = st.floats(-100.0, 100.0)


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


def tell(buffer: Buffer, parent: str, child: str, transform: Transform, seconds: float) -> None:
    buffer.set_transform(stamped(parent, child, transform, at(seconds)))


def look(buffer: Buffer, target: str, source: str, when: Time | None = None) -> Transform:
    return Transform.from_msg(buffer.lookup_transform(target, source, when))


# -- one moving frame -------------------------------------------------------------------------------------------------------------


@settings(deadline=None)
@given(st.floats(1e-6, 9.9))  # 0 asks for the latest
def test_between_two_transforms_the_pose_is_blended(seconds: float) -> None:
    buffer = Buffer()
    for k in range(101):
        tell(buffer, "map", "robot", Transform.planar(k * 0.05, 0.0, k * 0.02), k * 0.1)
    there = look(buffer, "map", "robot", at(seconds))
    assert there.translation == pytest.approx((seconds * 0.5, 0.0, 0.0), abs=1e-8)
    assert there.rotation == pytest.approx((cos(seconds * 0.1), 0.0, 0.0, sin(seconds * 0.1)), abs=1e-8)


def test_what_lies_outside_of_the_span_is_refused_with_the_span() -> None:
    buffer = Buffer()
    tell(buffer, "map", "robot", Transform(), 5.0)
    tell(buffer, "map", "robot", Transform(), 6.0)
    with pytest.raises(
        ForwardExtrapolationException, match=r"0\.500000 s after the last.*known are 5\.000000 to 6\.000000 s"
    ) as late:
        look(buffer, "map", "robot", at(6.5))
    assert not late.value.past
    with pytest.raises(BackwardExtrapolationException, match=r"1\.000000 s before the first") as early:
        look(buffer, "robot", "map", at(4.0))
    assert early.value.past


def test_ten_seconds_are_remembered_and_no_more() -> None:
    buffer = Buffer()
    for k in range(3000):
        tell(buffer, "map", "robot", Transform.planar(k * 0.01, 0.0, 0.0), k * 0.01)
    assert look(buffer, "map", "robot", at(20.0)).translation[0] == pytest.approx(20.0)
    with pytest.raises(ExtrapolationException, match=r"known are 19\.990000 to 29\.990000 s"):
        look(buffer, "map", "robot", at(19.9))
    assert not buffer.set_transform(stamped("map", "robot", Transform(), at(3.0)))
    assert buffer.frames()["robot"].length == 1001


@settings(deadline=None)
@given(st.permutations(list(range(20))))
def test_the_order_in_which_transforms_come_does_not_matter(order: list[int]) -> None:
    buffer = Buffer()
    for k in order:
        tell(buffer, "map", "robot", Transform.planar(float(k), 0.0, 0.0), k * 0.1)
    assert look(buffer, "map", "robot", at(1.23)).translation[0] == pytest.approx(12.3)


def test_a_second_transform_of_one_instant_replaces_the_first() -> None:
    buffer = Buffer()
    tell(buffer, "map", "robot", Transform.planar(1.0, 0.0, 0.0), 1.0)
    tell(buffer, "map", "robot", Transform.planar(2.0, 0.0, 0.0), 1.0)
    assert look(buffer, "map", "robot", at(1.0)).translation[0] == 2.0


# -- the tree ---------------------------------------------------------------------------------------------------------------------


def house() -> Buffer:
    """map -> odom -> base -> (camera, lidar), and an arm that nobody has connected."""
    buffer = Buffer()
    for k in range(11):
        tell(buffer, "map", "odom", Transform.planar(1.0, 2.0, 0.5), k * 0.1)
        tell(buffer, "odom", "base", Transform.planar(k * 0.1, 0.0, 0.0), k * 0.1 + 0.05)
    buffer.set_transform_static(stamped("base", "camera", Transform((0.4, 0.0, 0.1)), Time()))
    buffer.set_transform_static(stamped("base", "lidar", Transform((0.0, 0.0, 0.3)), Time()))
    buffer.set_transform_static(stamped("shoulder", "hand", Transform(), Time()))
    return buffer


@settings(deadline=None)
@given(st.floats(0.05, 1.0), st.permutations(["map", "odom", "base", "camera", "lidar"]))
def test_any_way_through_the_buffer_agrees_with_any_other(seconds: float, names: list[str]) -> None:
    buffer, when = house(), at(seconds)
    a, b, c = names[:3]
    assert close(look(buffer, a, b, when) @ look(buffer, b, c, when), look(buffer, a, c, when))
    assert close(look(buffer, a, b, when), look(buffer, b, a, when).inverse())
    assert look(buffer, a, a, when) == Transform()


def test_without_a_time_it_is_the_latest_that_all_know() -> None:
    buffer = house()
    assert buffer.get_latest_common_time("map", "camera").to_msg() == at(1.0)
    assert look(buffer, "odom", "base").translation[0] == pytest.approx(1.0)
    common = buffer.lookup_transform("odom", "camera", buffer.get_latest_common_time("map", "camera"))
    assert common.transform.translation.x == pytest.approx(1.35)
    assert buffer.get_latest_common_time("camera", "lidar").nanoseconds == 0
    assert look(buffer, "camera", "lidar").translation == pytest.approx((-0.4, 0.0, 0.2))


def test_spans_that_do_not_meet_have_no_latest() -> None:
    buffer = Buffer()
    tell(buffer, "map", "odom", Transform(), 1.0)
    tell(buffer, "odom", "base", Transform(), 3.0)
    with pytest.raises(
        NoDataForExtrapolationException, match=r"no time at which all.*known is that of 3\.000000 s"
    ) as one:
        look(buffer, "map", "base")
    tell(buffer, "odom", "base", Transform(), 4.0)
    with pytest.raises(
        BackwardExtrapolationException, match=r"no time at which all.*known are 3\.000000 to 4\.0"
    ) as two:
        look(buffer, "map", "base")
    assert not one.value.past and not two.value.past  # the next transform of odom may bring one


def test_unknown_frames_name_the_closest() -> None:
    with pytest.raises(LookupException, match="did you mean camera"):
        look(house(), "map", "camer", at(0.5))
    with pytest.raises(LookupException, match="there are: none yet"):
        look(Buffer(), "a", "b")


def test_frames_that_are_not_connected_are_told_by_their_roots() -> None:
    with pytest.raises(ConnectivityException, match="hand hangs from shoulder, camera from map"):
        look(house(), "camera", "hand")


def test_loops_are_refused_and_change_nothing() -> None:
    buffer = house()
    with pytest.raises(InvalidArgumentException, match="loop: map in camera in base in odom in map"):
        tell(buffer, "camera", "map", Transform(), 0.5)
    with pytest.raises(InvalidArgumentException, match="loop"):
        tell(buffer, "ball", "ball", Transform(), 0.5)
    assert buffer.frames()["base"].parent == "odom"
    assert "map" not in buffer.frames()


@pytest.mark.parametrize(("parent", "child"), [("", "a"), ("a", ""), ("/", "a")])
def test_frames_need_plain_names(parent: str, child: str) -> None:
    with pytest.raises(InvalidArgumentException, match="need a name"):
        Buffer().set_transform(stamped(parent, child, Transform(), Time()))


def test_numbers_that_are_none_are_refused() -> None:
    message = TransformStamped(
        header=Header(frame_id="a"), child_frame_id="b", transform=Transform((inf, 0.0, 0.0)).to_msg()
    )
    with pytest.raises(InvalidArgumentException, match="must be finite"):
        Buffer().set_transform(message)


def test_a_clock_that_was_set_back_forgets_what_moves() -> None:
    buffer = house()
    buffer.clear()
    assert set(buffer.frames()) == {"camera", "hand", "lidar"}
    with pytest.raises(ConnectivityException, match="lidar hangs from base, map from map"):
        look(buffer, "map", "lidar")
    with pytest.raises(
        NoDataForExtrapolationException, match="base has no transforms any more: the buffer was cleared"
    ):
        look(buffer, "map", "lidar", at(0.5))
    tell(buffer, "odom", "base", Transform(), 0.2)
    assert look(buffer, "odom", "camera").translation == pytest.approx((0.4, 0.0, 0.1))


# -- as tf2 has it ----------------------------------------------------------------------------------------------------------------


def test_a_frame_may_change_its_parent_and_between_two_parents_the_earlier_holds() -> None:
    buffer = Buffer()
    tell(buffer, "table", "ball", Transform((1.0, 0.0, 0.0)), 1.0)
    tell(buffer, "table", "ball", Transform((2.0, 0.0, 0.0)), 2.0)
    tell(buffer, "hand", "ball", Transform((9.0, 0.0, 0.0)), 3.0)
    assert look(buffer, "table", "ball", at(1.5)).translation[0] == pytest.approx(1.5)
    assert look(buffer, "table", "ball", at(2.9)).translation == (2.0, 0.0, 0.0)
    assert look(buffer, "hand", "ball", at(3.0)).translation == (9.0, 0.0, 0.0)
    assert look(buffer, "hand", "ball").translation == (9.0, 0.0, 0.0)
    with pytest.raises(ConnectivityException):
        look(buffer, "hand", "ball", at(2.5))


def test_parents_of_different_times_that_make_a_loop_are_said_to() -> None:
    buffer = Buffer()
    for seconds in (1.0, 2.0):
        tell(buffer, "b", "a", Transform(), seconds)
    tell(buffer, "c", "a", Transform(), 9.0)
    for seconds in (1.0, 2.0):
        tell(buffer, "a", "b", Transform(), seconds)  # no loop by now: a is in c
    with pytest.raises(LookupException, match=r"known at 1\.500000 s make a loop: a in b in a"):
        look(buffer, "c", "a", at(1.5))
    with pytest.raises(LookupException, match="make a loop: b in a in b"):
        look(buffer, "c", "b")  # the latest that all know is 2 s


def test_transforms_of_one_instant_are_all_kept_and_approached_from_their_sides() -> None:
    """Coming from before, the first of them is approached; from their instant on, the last holds."""
    buffer = Buffer()
    for seconds, x in ((0.5, 0.0), (1.0, 10.0), (1.0, 20.0), (1.0, 20.0), (2.0, 30.0)):
        tell(buffer, "map", "robot", Transform((x, 0.0, 0.0)), seconds)
    assert buffer.frames()["robot"].length == 4  # the same one twice counts once
    two = Buffer()
    for x in (1.0, 2.0):
        tell(two, "map", "robot", Transform((x, 0.0, 0.0)), 1.0)
    with pytest.raises(ForwardExtrapolationException):  # as tf2: there is more than one
        look(two, "map", "robot", at(1.5))
    assert look(buffer, "map", "robot", at(0.75)).translation[0] == pytest.approx(5.0)
    assert look(buffer, "map", "robot", at(1.0)).translation[0] == pytest.approx(20.0)
    assert look(buffer, "map", "robot", at(1.5)).translation[0] == pytest.approx(25.0)


def test_a_leading_slash_of_what_comes_in_is_removed_and_one_of_a_question_refused() -> None:
    buffer = Buffer()
    tell(buffer, "/map", "/robot", Transform(), 1.0)
    assert buffer.all_frame_names() == ("map", "robot")
    with pytest.raises(InvalidArgumentException, match="not begin with a slash; ask for 'map'"):
        look(buffer, "/map", "robot")
    with pytest.raises(
        InvalidArgumentException, match=r"names of frames are not empty, and do not begin with a slash$"
    ):
        look(buffer, "map", "")


def test_a_frame_that_was_static_may_begin_to_move_and_the_other_way_round() -> None:
    buffer = Buffer()
    buffer.set_transform_static(stamped("map", "door", Transform((1.0, 0.0, 0.0)), Time()))
    tell(buffer, "map", "door", Transform((2.0, 0.0, 0.0)), 5.0)
    with pytest.raises(NoDataForExtrapolationException, match=r"known is that of 5\.000000 s alone"):
        look(buffer, "map", "door", at(6.0))
    buffer.set_transform_static(stamped("map", "door", Transform((3.0, 0.0, 0.0)), Time()))
    assert look(buffer, "map", "door", at(99.0)).translation[0] == 3.0


def test_a_gap_above_the_common_frame_does_not_matter() -> None:
    buffer = Buffer()
    tell(buffer, "map", "odom", Transform(), 1.0)
    for frame in ("left", "right"):
        tell(buffer, "odom", frame, Transform((1.0, 0.0, 0.0)), 5.0)
    assert look(buffer, "left", "right", at(5.0)) == Transform()
    with pytest.raises(NoDataForExtrapolationException, match="map -> odom at 5"):
        look(buffer, "map", "right", at(5.0))
    with pytest.raises(NoDataForExtrapolationException, match="map -> odom at 5"):
        look(buffer, "right", "map", at(5.0))


def test_a_fixed_frame_joins_two_times() -> None:
    """The robot has driven from 1 m to 3 m; what was 1 m ahead of it then is 1 m behind it now."""
    buffer = Buffer()
    for seconds, x in ((1.0, 1.0), (2.0, 3.0)):
        tell(buffer, "odom", "base", Transform((x, 0.0, 0.0)), seconds)
    answer = buffer.lookup_transform_full("base", at(2.0), "base", at(1.0), "odom")
    assert Transform.from_msg(answer).point((1.0, 0.0, 0.0)) == pytest.approx((-1.0, 0.0, 0.0))
    assert (answer.header.stamp, answer.header.frame_id, answer.child_frame_id) == (at(2.0), "base", "base")
    assert buffer.can_transform_full("base", None, "base", at(1.5), "odom")
    assert not buffer.can_transform_full("base", at(2.0), "base", at(0.5), "odom")
    assert not buffer.can_transform_full("base", at(2.0), "base", at(1.5), "map")


def test_times_are_given_as_stamps_or_as_times_and_zero_is_the_latest() -> None:
    buffer = house()
    stamp = buffer.lookup_transform("map", "odom", RosTime(seconds=0.5)).header.stamp
    assert stamp == at(0.5)
    for latest in (None, RosTime(), Time()):
        assert buffer.lookup_transform("map", "odom", latest).header.stamp == at(1.0)
    assert buffer.lookup_transform("odom", "odom").header.stamp == at(1.0)
    assert buffer.lookup_transform("nowhere", "nowhere").header.stamp == Time()
    assert buffer.lookup_transform("camera", "lidar").header.stamp == Time()


def test_can_transform_says_whether_a_lookup_has_an_answer() -> None:
    buffer = house()
    assert buffer.can_transform("map", "camera", at(0.5)) and buffer.can_transform("map", "camera")
    assert not buffer.can_transform("map", "camera", at(7.0))
    assert not buffer.can_transform("map", "hand") and not buffer.can_transform("map", "moon")


def test_the_cache_time_is_seconds_or_a_duration_above_zero() -> None:
    for short in (Buffer(0.5), Buffer(cache_time=Duration(seconds=0.5))):
        for seconds in (1.0, 1.6):
            tell(short, "a", "b", Transform(), seconds)
        assert short.frames()["b"].length == 1
    with pytest.raises(ValueError, match="for a time above 0"):
        Buffer(0.0)


def test_a_wrong_transform_is_refused_with_its_frames_and_who_told_it() -> None:
    wrong = stamped("map", "odom", Transform(rotation=(0.0, 0.0, 0.0, 0.0)), Time())
    with pytest.raises(InvalidArgumentException, match=r"map -> odom \(by slam\).*rotation not of length 0"):
        Buffer().set_transform(wrong, "slam")


def test_listeners_hear_of_every_change_until_they_have_enough() -> None:
    buffer, heard = Buffer(), list[int]()
    enough = buffer.on_change(lambda: heard.append(1))
    tell(buffer, "a", "b", Transform(), 20.0)
    tell(buffer, "a", "b", Transform(), 5.0)  # too old: no change
    buffer.clear()
    enough()
    tell(buffer, "a", "b", Transform(), 1.0)
    assert len(heard) == 2


# -- waiting ----------------------------------------------------------------------------------------------------------------------


async def test_a_lookup_waits_for_the_frames_the_connection_and_the_time() -> None:
    buffer = Buffer()
    waiting = asyncio.create_task(buffer.lookup_transform_async("map", "base", at(1.5), timeout=None))
    for step in (
        lambda: tell(buffer, "odom", "base", Transform(), 1.0),
        lambda: tell(buffer, "map", "odom", Transform(), 1.0),
        lambda: tell(buffer, "map", "odom", Transform(), 2.0),
    ):
        await asyncio.sleep(0)
        step()
        await asyncio.sleep(0)
        assert not waiting.done()
    tell(buffer, "odom", "base", Transform((2.0, 0.0, 0.0)), 2.0)
    assert (await waiting).transform.translation.x == pytest.approx(1.0)


async def test_what_has_been_forgotten_does_not_come_back_so_nobody_waits_for_it() -> None:
    buffer = house()
    with pytest.raises(BackwardExtrapolationException):
        await buffer.lookup_transform_async("odom", "base", RosTime(nanoseconds=1), timeout=None)
    tell(buffer, "map", "new", Transform(), 5.0)
    with pytest.raises(NoDataForExtrapolationException) as early:
        await buffer.lookup_transform_async("map", "new", at(4.0), timeout=None)
    assert early.value.past


async def test_after_the_timeout_the_reason_is_told() -> None:
    buffer = house()
    with pytest.raises(ForwardExtrapolationException, match="after the last known"):
        await buffer.lookup_transform_async("map", "odom", at(3.0), timeout=0.01)
    with pytest.raises(LookupException, match="no frame 'moon'"):
        await buffer.lookup_transform_full_async("moon", at(1.0), "map", at(1.0), "odom", timeout=0.01)
    with pytest.raises(ValueError, match="a lookup of a transform"):
        await buffer.lookup_transform_async("map", "odom", timeout="soon")


async def test_the_waiting_forms_answer_at_once_what_is_known() -> None:
    buffer = house()
    assert await buffer.lookup_transform_async("map", "odom") == buffer.lookup_transform("map", "odom")
    seen = PointStamped(header=Header(frame_id="odom", stamp=at(0.5)))
    assert await buffer.transform_async(seen, "map") == buffer.transform(seen, "map")
    full = ("map", at(0.5), "base", at(0.7), "odom")
    assert await buffer.lookup_transform_full_async(*full) == buffer.lookup_transform_full(*full)


# -- what is there ----------------------------------------------------------------------------------------------------------------


def moving() -> Buffer:
    """`base` in `odom`, at 1 m/s along x, from 5 s to 7 s."""
    buffer = Buffer()
    for seconds in (5.0, 6.0, 7.0):
        tell(buffer, "odom", "base", Transform((seconds, 0.0, 0.0)), seconds)
    return buffer


def seen(seconds: float) -> PointStamped:
    return PointStamped(header=Header(frame_id="base", stamp=at(seconds)))


async def test_a_message_is_seen_from_where_the_target_is_at_another_time() -> None:
    buffer = moving()
    assert buffer.transform_full(seen(5.5), "base", at(6.5), "odom").point.x == pytest.approx(-1.0)
    asked = asyncio.create_task(buffer.transform_full_async(seen(5.5), "base", at(8.0), "odom", timeout=None))
    await asyncio.sleep(0)
    tell(buffer, "odom", "base", Transform((8.0, 0.0, 0.0)), 8.0)
    assert (await asked).point.x == pytest.approx(-2.5)


async def test_whether_a_lookup_comes_in_time_can_be_asked() -> None:
    buffer = moving()
    assert await buffer.can_transform_async("odom", "base", at(6.5))
    assert not await buffer.can_transform_async("odom", "base", at(7.5), timeout=0)
    assert await buffer.can_transform_full_async("base", at(5.0), "base", at(7.0), "odom", timeout=Duration(seconds=1))
    assert not await buffer.can_transform_full_async("base", at(5.0), "base", at(7.5), "odom", timeout=Duration())
    asked = asyncio.create_task(buffer.can_transform_async("odom", "base", at(7.5), timeout=None))
    await asyncio.sleep(0)
    tell(buffer, "odom", "base", Transform(), 8.0)
    assert await asked


async def test_the_names_of_tf2_ros_for_waiting_do_the_same() -> None:
    buffer = moving()
    there = await buffer.wait_for_transform_async("odom", "base", RosTime(seconds=6))
    assert there == await buffer.lookup_transform_async("odom", "base", at(6.0))
    full = "base", at(5.0), "base", at(7.0), "odom"
    assert await buffer.wait_for_transform_full_async(*full) == buffer.lookup_transform_full(*full)


@pytest.mark.parametrize(
    ("method", "arguments"),
    [
        ("lookup_transform", ("odom", "base", at(6.0))),
        ("can_transform", ("odom", "base", at(6.0))),
        ("lookup_transform_full", ("base", at(5.0), "base", at(6.0), "odom")),
        ("can_transform_full", ("base", at(5.0), "base", at(6.0), "odom")),
        ("transform", (seen(6.0), "odom")),
        ("transform_full", (seen(6.0), "base", at(5.0), "odom")),
    ],
)
def test_a_timeout_of_what_does_not_wait_is_refused_with_the_remedy(method: str, arguments: tuple[object, ...]) -> None:
    ask = getattr(moving(), method)
    assert ask(*arguments)
    for timeout in (Duration(seconds=1), 0.5):
        with pytest.raises(TypeError, match=rf"{method} answers.*await buffer.{method}_async\(\.\.\., timeout=1.0\)"):
            ask(*arguments, timeout)
    with pytest.raises(TypeError, match="_async"):
        ask(*arguments, timeout=Duration())


@pytest.mark.parametrize("time", [6.0, 6, "6"])
def test_a_number_is_no_time(time: object) -> None:
    with pytest.raises(TypeError, match=r"6.* is no time: give the stamp of a message, self.clock.stamp\(\)"):
        moving().lookup_transform("odom", "base", time)  # type: ignore[arg-type]


def test_a_buffer_says_what_it_knows() -> None:
    buffer = Buffer()
    assert buffer.all_frames_as_yaml() == "[]" and buffer.all_frames_as_string() == ""
    assert repr(buffer) == "<Buffer of no frames>"
    for k in range(11):
        buffer.set_transform(stamped("map", "it's", Transform(), at(1.0 + 0.1 * k)), "slam")
    buffer.set_transform_static(stamped("it's", "lamp", Transform(), at(3.0)))
    assert repr(buffer) == "<Buffer of it's, lamp, map>"
    assert buffer.all_frames_as_string() == (
        "Frame it's exists with parent map.\nFrame lamp exists with parent it's.\n"
    )
    known = yaml.safe_load(buffer.all_frames_as_yaml())
    assert known["it's"] == {
        "parent": "map",
        "broadcaster": "slam",
        "rate": 11.0,
        "most_recent_transform": 2.0,
        "oldest_transform": 1.0,
        "buffer_length": 1.0,
    }
    assert known["lamp"] == {
        "parent": "it's",
        "broadcaster": "default_authority",
        "rate": 10000.0,
        "most_recent_transform": 0.0,
        "oldest_transform": 0.0,
        "buffer_length": 0.0,
    }


def test_the_graph_of_frames_is_a_dot_with_a_legend_at_its_root() -> None:
    buffer = Buffer()
    assert as_dot(buffer.frames(), 0.0) == 'digraph G { "No tf data received" }\n'
    buffer.set_transform(stamped("map", 'the "robot"', Transform(), at(1.0)), "slam")
    lines = as_dot(buffer.frames(), 2.5).splitlines()
    assert lines[0] == "digraph G {" and lines[-1] == "}"
    assert lines[1] == (
        '"map" -> "the \\"robot\\""[label=" Broadcaster: slam\\nAverage rate: 10000.000\\nBuffer length: 0.000\\n'
        'Most recent transform: 1.000000\\nOldest transform: 1.000000\\n"];'
    )
    assert '"Recorded at time: 2.500000"[shape=plaintext];' in lines and '}->"map";' in lines
