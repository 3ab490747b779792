"""When the robot counts as lost or blind, and when the whole map is searched."""

from __future__ import annotations

import pytest

from robot.estimation.fit_watch import FitWatch


def watch(until: float, quality: float, *, accepted: bool, begun: float = 0.0, old: FitWatch | None = None) -> FitWatch:
    """A watch after scans of this quality, ten a second."""
    watched = FitWatch() if old is None else old
    for tenth in range(round(begun * 10), round(until * 10) + 1):
        watched.fit(tenth / 10, quality, accepted=accepted)
    return watched


def test_scans_that_fit_are_no_reason_to_search() -> None:
    watched = watch(60.0, 0.9, accepted=True)
    assert (watched.state, watched.wants_search(60.0)) == ("tracking", False)


def test_after_a_second_of_refused_scans_the_robot_is_lost_until_scans_fit_again() -> None:
    watched = watch(1.0, 0.9, accepted=True)
    assert watch(2.0, 0.3, accepted=False, begun=1.1, old=watched).state == "tracking"
    assert watch(2.2, 0.3, accepted=False, begun=2.1, old=watched).state == "lost"
    watched.fit(2.3, 0.5, accepted=True)
    assert watched.state == "lost"  # one that is taken, and does not fit, proves nothing
    watched.fit(2.4, 0.8, accepted=True)
    assert watched.state == "tracking"


def test_scans_that_are_taken_and_do_not_fit_well_have_the_map_searched_after_two_seconds() -> None:
    watched = watch(1.0, 0.9, accepted=True)
    watch(2.9, 0.6, accepted=True, begun=1.1, old=watched)
    assert not watched.wants_search(2.9)
    watch(3.1, 0.6, accepted=True, begun=3.0, old=watched)
    assert (watched.state, watched.wants_search(3.1)) == ("tracking", True)


def test_searches_in_vain_become_rarer_and_one_that_finds_ends_the_search() -> None:
    watched = watch(5.0, 0.9, accepted=True)
    watch(10.0, 0.6, accepted=True, begun=5.1, old=watched)
    waits: list[float] = []
    for _ in range(7):
        begun = watched_at = 10.0 + sum(waits)
        watched.searched(begun, found=False)
        while not watched.wants_search(watched_at):
            watched_at += 0.5
        waits.append(watched_at - begun)
    assert waits == [4.0, 8.0, 16.0, 32.0, 60.0, 60.0, 60.0]
    now = 10.0 + sum(waits)
    watched.searched(now, found=True)
    assert (watched.state, watched.wants_search(now + 1.0)) == ("tracking", False)


def test_a_search_that_confirms_the_place_blames_the_hall() -> None:
    watched = watch(1.0, 0.9, accepted=True)
    watch(4.0, 0.3, accepted=False, begun=1.1, old=watched)
    assert watched.state == "lost"
    watched.confirmed(4.0)
    assert (watched.state, watched.wants_search(5.9)) == ("tracking", False)


@pytest.mark.parametrize(("expected", "state"), [(True, "blind"), (False, "tracking")])
def test_a_lidar_without_returns_is_blind_where_the_map_has_walls(expected: bool, state: str) -> None:
    watched = watch(1.0, 0.9, accepted=True)
    for tenth in range(11, 22):
        watched.nothing(tenth / 10, expected=expected)
    assert watched.state == state
    watched.fit(2.2, 0.5, accepted=True)
    assert watched.state == "tracking"


def test_a_watch_that_goes_on_for_a_lost_one_is_lost_and_searches_at_once() -> None:
    watched = watch(0.1, 0.3, accepted=False, old=FitWatch("lost"))
    assert (watched.state, watched.wants_search(0.1)) == ("lost", True)
