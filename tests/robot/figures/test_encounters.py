"""Who caused a contact: situations by hand, one robot and one person."""

from __future__ import annotations

from collections.abc import Callable
from math import pi, sin, tau

import pytest

from robot.geometry.planar import Pose2
from tests.figures.encounters import Contact, Encounters

STEP = 0.0025
"""Of the physics, s."""


def lived(robot: Callable[[float], Pose2], until: float) -> Encounters:
    """Encounters that have seen the robot where `robot` puts it at each instant."""
    encounters = Encounters()
    for tick in range(round(until / STEP) + 1):
        encounters.see(STEP * tick, robot(STEP * tick))
    return encounters


def caused(encounters: Encounters, x: float, y: float) -> bool:
    encounters.touch("walker_0", x, y)
    (contact,) = encounters.contacts
    return contact.caused


def test_who_walks_into_somebody_has_caused_it() -> None:
    encounters = lived(lambda t: Pose2(0.3 * t, 0.0), until=2.0)
    encounters.touch("walker_3", 0.6 + 0.55 + 0.25, 0.0)
    assert encounters.contacts == [Contact("walker_3", 2.0, 0.3)]
    assert encounters.contacts[0].caused


def test_a_robot_that_stands_is_walked_into() -> None:
    assert not caused(lived(lambda t: Pose2(1.0, 1.0, 0.5), until=2.0), 1.6, 1.0)


def test_a_robot_that_steps_back_is_walked_into_from_the_front_and_has_caused_it_behind() -> None:
    assert not caused(lived(lambda t: Pose2(-0.4 * t, 0.0), until=2.0), -0.8 + 0.8, 0.0)
    assert caused(lived(lambda t: Pose2(-0.4 * t, 0.0), until=2.0), -0.8 - 0.8, 0.0)


@pytest.mark.parametrize(("stood_for", "expected"), [(0.3, True), (0.45, True), (0.65, False)])
def test_a_robot_that_stood_still_for_half_a_second_has_not_caused_it(stood_for: float, expected: bool) -> None:
    assert (
        caused(lived(lambda t: Pose2(min(t, 2.0 - stood_for), 0.0), until=2.0), 2.0 - stood_for + 0.8, 0.0) is expected
    )


def test_who_creeps_past_somebody_at_its_side_has_not_caused_it() -> None:
    # The person stands where the robot's middle passes: nearest at the end, coming towards it no faster than 0.05 m/s.
    assert not caused(lived(lambda t: Pose2(0.05 * (t - 2.0), 0.0), until=2.0), 0.0, 0.5)


def test_a_creep_below_the_limit_is_no_cause_and_one_above_it_is() -> None:
    assert not caused(lived(lambda t: Pose2(0.045 * t, 0.0), until=2.0), 1.0, 0.0)
    assert caused(lived(lambda t: Pose2(0.06 * t, 0.0), until=2.0), 1.0, 0.0)


def test_the_sway_of_a_step_on_the_spot_is_no_cause() -> None:
    # 2 mm to and fro, twice a second: its highest speed is 25 mm/s.
    assert not caused(lived(lambda t: Pose2(0.002 * sin(tau * 2.0 * t), 0.0), until=2.0), 0.8, 0.0)


def test_a_tail_that_a_turn_swings_into_somebody_has_caused_it() -> None:
    def turning(t: float) -> Pose2:
        return Pose2(0.0, 0.0, 0.5 * (t - 2.0))

    beside_the_tail = (-0.5, 0.5)
    encounters = lived(turning, until=2.0)
    encounters.touch("walker_0", *beside_the_tail)
    (contact,) = encounters.contacts
    assert not contact.caused, "a turn to the left swings the tail to the right, away"
    encounters = lived(lambda t: Pose2(0.0, 0.0, -0.5 * (t - 2.0)), until=2.0)
    encounters.touch("walker_0", *beside_the_tail)
    (contact,) = encounters.contacts
    assert contact.caused
    assert contact.towards == pytest.approx(0.5 * 0.5, rel=0.2), "0.5 m from the middle at 0.5 rad/s"


def test_a_robot_that_looks_elsewhere_is_judged_by_its_own_outline() -> None:
    # It looks along y and walks along x, sideways: the person at its side is walked into.
    assert caused(lived(lambda t: Pose2(0.2 * t, 0.0, pi / 2), until=2.0), 0.4 + 0.5, 0.3)
    # It turns on the spot: only which part of the outline is near the person says whether that comes nearer.
    assert caused(lived(lambda t: Pose2(0.0, 0.0, pi / 2 + 0.5 * (t - 2.0)), until=2.0), 0.5, -0.5)
    assert not caused(lived(lambda t: Pose2(0.0, 0.0, pi / 2 - 0.5 * (t - 2.0)), until=2.0), 0.5, -0.5)


def test_one_long_touch_is_one_contact_and_another_person_is_another() -> None:
    encounters = Encounters()
    for tick in range(1200):  # 3 s
        encounters.see(STEP * tick, Pose2(0.0, 0.0))
        if tick >= 200:
            encounters.touch("walker_0", 0.8, 0.0)
        if tick in (400, 900):
            encounters.touch("walker_1", -0.8, 0.0)
    assert [(contact.who, contact.at) for contact in encounters.contacts] == [
        ("walker_0", 0.5), ("walker_1", 1.0), ("walker_1", 2.25),
    ]  # fmt: skip


def test_nothing_is_known_of_a_robot_that_has_just_been_seen_first() -> None:
    encounters = Encounters()
    encounters.see(0.0, Pose2(0.0, 0.0))
    assert not caused(encounters, 0.8, 0.0)
