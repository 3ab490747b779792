"""QoS events: the changes between two statuses, and the watches over deadlines and leases."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.qos.events import (
    DeadlineMissed,
    IncompatibleQoS,
    IncompatibleType,
    LivelinessChanged,
    LivelinessLost,
    Matched,
    MessageLost,
    PublisherStatus,
    SubscriptionStatus,
)
from actors.qos.watches import DeadlineWatch, LeaseWatch


def test_between_two_equal_statuses_nothing_has_happened() -> None:
    assert list(PublisherStatus(matched=1, matched_total=2).since(PublisherStatus(matched=1, matched_total=2))) == []
    assert (
        list(SubscriptionStatus(matched=0, matched_total=0).since(SubscriptionStatus(matched=0, matched_total=0))) == []
    )


def test_what_happened_to_a_publisher_comes_as_one_event_of_each_kind() -> None:
    before = PublisherStatus(matched=2, matched_total=2, deadline_missed=1)
    after = PublisherStatus(
        matched=1,
        matched_total=3,
        deadline_missed=4,
        liveliness_lost=1,
        incompatible_qos=2,
        last_policy_kind="DURABILITY",
        incompatible_type=1,
    )
    assert list(after.since(before)) == [
        Matched(total_count=3, total_count_change=1, current_count=1, current_count_change=-1),
        DeadlineMissed(total_count=4, total_count_change=3),
        IncompatibleQoS(total_count=2, total_count_change=2, last_policy_kind="DURABILITY"),
        IncompatibleType(total_count=1, total_count_change=1),
        LivelinessLost(total_count=1, total_count_change=1),
    ]


def test_what_happened_to_a_subscription_comes_as_one_event_of_each_kind() -> None:
    before = SubscriptionStatus(matched=2, matched_total=2, alive=2)
    after = SubscriptionStatus(matched=2, matched_total=2, alive=1, not_alive=1, message_lost=7)
    assert list(after.since(before)) == [
        LivelinessChanged(alive_count=1, alive_count_change=-1, not_alive_count=1, not_alive_count_change=1),
        MessageLost(total_count=7, total_count_change=7),
    ]


def test_a_peer_that_came_and_went_between_two_looks_is_counted() -> None:
    before, after = PublisherStatus(matched=1, matched_total=1), PublisherStatus(matched=1, matched_total=2)
    assert list(after.since(before)) == [Matched(2, 1, 1, 0)]


# -- deadlines --------------------------------------------------------------------------------------------------------------


def test_every_whole_period_without_a_message_is_one_miss() -> None:
    watch = DeadlineWatch(100)
    watch.start(0)
    watch.message(99)
    assert watch.due() == 200
    assert (watch.advance(199), watch.advance(200)) == (0, 1)
    assert watch.advance(450) == 3
    watch.message(460)
    assert watch.advance(500) == watch.missed == 3


def test_a_message_at_the_very_end_of_its_period_is_in_time() -> None:
    watch = DeadlineWatch(100)
    for now in range(0, 10_000, 100):
        watch.message(now)
    assert watch.missed == 0


def test_nothing_is_missed_before_the_start_and_a_second_start_changes_nothing() -> None:
    watch = DeadlineWatch(100)
    assert watch.due() is None
    assert watch.advance(10_000) == 0
    watch.start(10_000)
    watch.start(10_050)
    assert watch.advance(10_101) == 1


@pytest.mark.parametrize("wrong", [0, -1])
def test_a_deadline_or_lease_must_be_positive(wrong: int) -> None:
    with pytest.raises(ValueError, match="deadline must be positive"):
        DeadlineWatch(wrong)
    with pytest.raises(ValueError, match="lease must be positive"):
        LeaseWatch(wrong, 0)


@given(st.integers(1, 50), st.lists(st.tuples(st.booleans(), st.integers(0, 200)), max_size=30))
def test_misses_are_the_whole_periods_in_the_gaps_however_often_one_looks(
    period: int, steps: list[tuple[bool, int]]
) -> None:
    watch, now, last, misses = DeadlineWatch(period), 0, 0, 0
    watch.start(0)
    for is_message, wait in steps:
        now += wait
        due = watch.due()
        before = watch.missed
        assert (watch.advance(now) > before) is (due is not None and due <= now)
        if is_message:
            misses += max(0, now - last - 1) // period
            last = now
            watch.message(now)
    assert watch.advance(now) == misses + max(0, now - last - 1) // period


# -- leases -----------------------------------------------------------------------------------------------------------------


def test_a_publisher_that_is_silent_for_longer_than_its_lease_is_lost_once() -> None:
    watch = LeaseWatch(100, 0)
    assert watch.assert_alive(50) is False
    assert watch.due() == 151
    assert watch.advance(150) is True
    assert watch.advance(151) is False
    assert watch.advance(1000) is False
    assert (watch.lost, watch.due()) == (1, None)
    assert watch.assert_alive(1000) is True
    assert watch.advance(1100) is True
    assert watch.advance(1101) is False
    assert watch.lost == 2


def test_a_lease_that_nobody_looked_at_is_counted_when_it_is_renewed() -> None:
    watch = LeaseWatch(100, 0)
    assert watch.assert_alive(500) is True
    assert (watch.lost, watch.alive) == (1, True)
