"""The filters let through what those of ROS 2 do: the cases in `vectors`."""

from __future__ import annotations

from typing import Any

import pytest

from actors.interfaces.geometry_msgs.msg import PointStamped
from actors.interfaces.std_msgs.msg import Header
from actors.message_filters import (
    ApproximateTime,
    ApproximateTimeSynchronizer,
    Cache,
    InputAligner,
    SimpleFilter,
    Synchronizer,
    TimeSynchronizer,
)
from actors.time import stamp_of
from tests.actors.message_filters.vectors import (
    ADAPTIVE,
    ALIGNED,
    EXACT,
    INTERVALS,
    SLOP,
    Case,
    Interval,
    arrivals,
    sets,
)


def message(seconds: float) -> PointStamped:
    return PointStamped(header=Header(stamp=stamp_of(round(seconds * 1e9))))


def seconds_of(given: Any) -> float:
    stamp = given.header.stamp
    return float(stamp.sec + 1e-9 * stamp.nanosec)


@pytest.mark.parametrize(
    ("kind", "case"),
    [
        *((ApproximateTime, case) for case in ADAPTIVE),
        *((TimeSynchronizer, case) for case in EXACT),
        *((ApproximateTimeSynchronizer, case) for case in SLOP),
    ],
    ids=lambda value: value.name if isinstance(value, Case) else value.__name__,
)
def test_the_sets_are_those_of_ros_2(kind: type[Any], case: Case) -> None:
    given = [each for each in arrivals(case.messages) if each is not None]
    inputs = [SimpleFilter[PointStamped]() for _ in range(1 + max(index for index, _ in given))]
    sync: Synchronizer = kind(inputs, **case.options)
    came: list[tuple[float, ...]] = []
    sync.register_callback(lambda *messages: came.append(tuple(map(seconds_of, messages))))
    for index, stamp in given:
        inputs[index].signal_message(message(stamp))
    assert came == [pytest.approx(expected) for expected in sets(case.out)]


@pytest.mark.parametrize("case", ALIGNED, ids=lambda case: case.name)
def test_the_aligner_passes_on_in_the_order_of_ros_2(case: Case) -> None:
    options = dict(case.options)
    inputs = [SimpleFilter[PointStamped]() for _ in range(options.pop("inputs"))]
    aligner = InputAligner(inputs, **options)
    came: list[float] = []
    for output in aligner.outputs:
        output.register_callback(lambda given: came.append(seconds_of(given) * 1e3))
    for arrival in arrivals(case.messages):
        if arrival is None:
            aligner.dispatch_messages()
        else:
            index, milliseconds = arrival
            inputs[index].signal_message(message(milliseconds * 1e-3))
    assert came == pytest.approx([float(word) for word in case.out.split()])


@pytest.mark.parametrize("case", INTERVALS, ids=lambda case: f"{case.question}: {case.name}")
def test_the_cache_answers_as_that_of_ros_2(case: Interval) -> None:
    cache = Cache[PointStamped](cache_size=case.size)
    for stamp in case.stamps:
        cache.add(message(stamp))
    times = [stamp_of(round(time * 1e9)) for time in case.times]
    answer = getattr(cache, case.question)(*times)
    found = answer if isinstance(answer, list) else [] if answer is None else [answer]
    assert tuple(map(seconds_of, found)) == case.answer
