"""The counters behind QoS events."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.qos_events import DeadlineWatch, LivelinessWatch, LostWatch, MatchedCount


def test_peers_come_and_go_between_two_looks() -> None:
    matched = MatchedCount()
    matched.joined()
    matched.joined()
    matched.left()

    assert matched.take() == (2, 2, 1, 1)
    matched.left()
    assert matched.take() == (2, 0, 0, -1)
    assert matched.take() == (2, 0, 0, 0)


def test_every_period_without_a_message_is_one_miss() -> None:
    watch = DeadlineWatch(100)
    watch.start(0)
    watch.message(99)
    assert watch.take(198) == (0, 0)
    assert watch.due() == 199

    assert watch.take(450) == (3, 3)
    watch.message(460)
    assert watch.take(500) == (3, 0)


def test_nothing_is_missed_before_the_first_message() -> None:
    watch = DeadlineWatch(100)

    assert watch.due() is None
    assert watch.take(10_000) == (0, 0)
    watch.message(10_000)
    assert watch.take(10_100) == (1, 1)


def test_a_publisher_that_is_silent_for_its_lease_is_lost_once() -> None:
    watch = LostWatch(100, 0)
    watch.assert_alive(50)
    assert watch.due() == 150
    assert watch.take(149) == (0, 0)

    assert watch.take(1000) == (1, 1)
    assert watch.due() is None
    assert not watch.alive
    watch.assert_alive(1000)
    assert watch.take(1001) == (1, 0)
    assert watch.take(1100) == (2, 1)


def test_a_subscription_counts_its_publishers_alive_and_lost() -> None:
    seen = LivelinessWatch(100)
    seen.assert_alive("a", 0)
    seen.assert_alive("b", 0)
    assert seen.take(50) == (2, 2, 0, 0)

    seen.assert_alive("a", 60)
    assert seen.take(150) == (1, -1, 1, 1)
    seen.assert_alive("b", 155)
    assert seen.take(155) == (2, 1, 0, -1)
    seen.left("b")
    seen.left("b")
    assert seen.take(155) == (1, -1, 0, 0)


def test_without_a_lease_nobody_is_ever_lost() -> None:
    seen = LivelinessWatch(None)
    seen.assert_alive("a", 0)

    assert seen.take(10**18) == (1, 1, 0, 0)


@pytest.mark.parametrize("wrong", [0, -1])
def test_a_deadline_or_lease_must_be_positive(wrong: int) -> None:
    with pytest.raises(ValueError, match="deadline must be positive"):
        DeadlineWatch(wrong)
    with pytest.raises(ValueError, match="lease must be positive"):
        LostWatch(wrong, 0)


@given(st.integers(1, 50), st.lists(st.tuples(st.booleans(), st.integers(0, 200)), max_size=30))
def test_misses_are_the_full_periods_in_the_gaps_however_often_one_looks(
    period: int, steps: list[tuple[bool, int]]
) -> None:
    watch, now, last, misses, changes = DeadlineWatch(period), 0, 0, 0, 0
    watch.start(0)
    for is_message, wait in steps:
        now += wait
        if is_message:
            misses += (now - last) // period
            last = now
            watch.message(now)
        else:
            changes += watch.take(now).total_count_change

    status = watch.take(now)
    assert status.total_count == misses + (now - last) // period
    assert changes + status.total_count_change == status.total_count
