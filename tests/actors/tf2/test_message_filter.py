"""A message filter lets each message through when it can be transformed, and tells of those that never can."""

from __future__ import annotations

import pytest

from actors.interfaces.geometry_msgs.msg import PointStamped
from actors.interfaces.std_msgs.msg import Header, String
from actors.message_filters import PassThrough
from actors.tf2 import Buffer, FilterFailureReason, InvalidArgumentException, MessageFilter, Transform, stamped
from actors.time import stamp_of


def point(seconds: float, frame: str = "camera") -> PointStamped:
    return PointStamped(header=Header(stamp=stamp_of(round(seconds * 1e9)), frame_id=frame))


def tell(buffer: Buffer, seconds: float, parent: str = "map", child: str = "camera") -> None:
    buffer.set_transform(stamped(parent, child, Transform(), stamp_of(round(seconds * 1e9))))


class Bench:
    """A filter, what came out of it, and what was dropped."""

    def __init__(self, *targets: str, queue_size: int = 100, tolerance: float = 0.0) -> None:
        self.buffer = Buffer()
        self.source = PassThrough[PointStamped]()
        self.filter = MessageFilter(
            self.buffer, targets or "map", self.source, queue_size=queue_size, tolerance=tolerance
        )
        self.out: list[float] = []
        self.dropped: list[tuple[float, FilterFailureReason]] = []
        self.filter.register_callback(lambda message: self.out.append(self._seconds(message)))
        self.filter.register_failure_callback(
            lambda message, reason: self.dropped.append((self._seconds(message), reason))
        )

    @staticmethod
    def _seconds(message: PointStamped) -> float:
        return message.header.stamp.sec + message.header.stamp.nanosec * 1e-9


def test_what_can_be_transformed_already_comes_at_once() -> None:
    bench = Bench()
    tell(bench.buffer, 1.0)
    bench.source.add(point(1.0))
    assert bench.out == [1.0]


def test_what_cannot_yet_comes_with_the_transform_that_makes_it_possible() -> None:
    bench = Bench()
    for seconds in (1.0, 1.2, 2.5):
        bench.source.add(point(seconds))
    assert bench.out == []  # nobody has told of the frame
    tell(bench.buffer, 1.0)
    assert bench.out == [1.0]
    tell(bench.buffer, 2.0)
    assert bench.out == [1.0, 1.2]
    tell(bench.buffer, 3.0)
    assert bench.out == [1.0, 1.2, 2.5]
    assert repr(bench.filter) == "<MessageFilter to map: 0 wait>"


def test_all_targets_are_waited_for() -> None:
    bench = Bench("map", "gripper")
    tell(bench.buffer, 1.0)
    bench.source.add(point(1.0))
    assert bench.out == []
    tell(bench.buffer, 1.0, "map", "gripper")
    assert bench.out == [1.0]


def test_with_a_tolerance_the_time_after_the_stamp_must_be_known_too() -> None:
    bench = Bench(tolerance=0.5)
    tell(bench.buffer, 1.0)
    bench.source.add(point(1.0))
    tell(bench.buffer, 1.4)
    assert bench.out == []
    tell(bench.buffer, 1.6)
    assert bench.out == [1.0]


def test_the_oldest_leaves_a_full_queue() -> None:
    bench = Bench(queue_size=2)
    for seconds in (1.0, 2.0, 3.0):
        bench.source.add(point(seconds))
    assert bench.dropped == [(1.0, FilterFailureReason.QUEUE_FULL)]
    assert bench.filter.dropped[FilterFailureReason.QUEUE_FULL] == 1
    unbounded = Bench(queue_size=0)
    for number in range(100):
        unbounded.source.add(point(1.0 + number))
    assert unbounded.dropped == []


def test_what_is_too_old_to_be_transformed_ever_is_dropped_at_once() -> None:
    bench = Bench()
    tell(bench.buffer, 5.0)
    tell(bench.buffer, 6.0)
    bench.source.add(point(4.0))
    assert bench.dropped == [(4.0, FilterFailureReason.OUT_THE_BACK)]


def test_a_message_that_grows_too_old_while_it_waits_is_dropped() -> None:
    bench = Bench("map", "moon")
    tell(bench.buffer, 1.0)
    bench.source.add(point(1.0))
    assert bench.dropped == []  # nobody has told of the moon
    tell(bench.buffer, 20.0)
    assert bench.dropped == [(1.0, FilterFailureReason.OUT_THE_BACK)]


def test_a_message_without_a_frame_is_dropped_and_a_slash_before_it_removed() -> None:
    bench = Bench()
    tell(bench.buffer, 1.0)
    bench.source.add(point(1.0, ""))
    assert bench.dropped == [(1.0, FilterFailureReason.EMPTY_FRAME_ID)]
    bench.source.add(point(1.0, "/camera"))
    assert bench.out == [1.0]


def test_a_cleared_filter_and_one_at_rest_do_not_watch_the_buffer() -> None:
    bench = Bench()
    bench.source.add(point(1.0))
    bench.filter.clear()
    tell(bench.buffer, 1.0)
    assert bench.out == []
    assert bench.buffer._listeners == []


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(ValueError, match="one target frame or more"):
        MessageFilter(Buffer(), ())
    with pytest.raises(TypeError, match="String has no header"):
        MessageFilter[String](Buffer(), "map").add(String())
    with pytest.raises(InvalidArgumentException, match="do not begin with a slash"):
        MessageFilter[PointStamped](Buffer(), "/map").add(point(1.0))
