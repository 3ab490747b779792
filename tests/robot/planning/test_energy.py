"""Whether the energy for a walk is there: figures by hand, and an order in which more never forbids what less allowed."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.planning.energy import EnergyGuard, walking_energy

SPEED = 0.6
"""m/s: 360 W in all, measured."""
metres = st.floats(0.0, 500.0)
energies = st.floats(-5.0, 605.0)


def guard(percent: float, energy: float) -> EnergyGuard:
    found = EnergyGuard(SPEED)
    found.heard(percent, energy)
    return found


@pytest.mark.parametrize(("speed", "watts"), [(0.3, 330.0), (0.6, 360.0), (1.0, 424.0), (1.6, 561.0)])
def test_a_walk_takes_the_power_of_its_speed_for_as_long_as_it_lasts(speed: float, watts: float) -> None:
    assert walking_energy(100.0, speed) == pytest.approx(watts * 100.0 / speed / 3600.0)


def test_a_walk_is_made_with_one_and_a_half_times_its_energy_and_two_watt_hours() -> None:
    need = 1.5 * 360.0 * (30.0 + 20.0) / 0.6 / 3600.0 + 2.0
    assert guard(80.0, need + 0.01).objection(30.0, 20.0) == ""
    assert guard(80.0, need - 0.01).objection(30.0, 20.0) == (
        "battery too low: 30 m to the goal and 20 m back to the dock need 14.5 Wh, and 14.5 Wh are left before it is critical"
    )


def test_less_than_nothing_is_reported_as_nothing() -> None:
    assert "and 0.0 Wh are left" in guard(50.0, -3.0).objection(30.0, 20.0)


def test_without_a_word_from_a_battery_every_walk_is_possible() -> None:
    assert EnergyGuard(SPEED).objection(1e6, 1e6) == ""


@given(ahead=metres, energy=energies, percent=st.floats(0.0, 100.0))
def test_the_way_to_the_dock_is_always_open(ahead: float, energy: float, percent: float) -> None:
    assert guard(percent, energy).objection(ahead, 1.5) == ""


@given(ahead=metres, home=metres, energy=energies, less=st.floats(0.0, 1.0), more=st.floats(0.0, 100.0))
def test_what_is_allowed_stays_allowed_with_more_energy_or_a_shorter_way(
    ahead: float, home: float, energy: float, less: float, more: float
) -> None:
    if guard(80.0, energy).objection(ahead, home) == "":
        assert guard(80.0, energy + more).objection(ahead, home) == ""
        assert guard(80.0, energy).objection(less * ahead, home) == ""


def test_below_twenty_per_cent_only_the_way_home_is_open_until_three_points_have_been_charged() -> None:
    battery = EnergyGuard(SPEED)
    open_at = []
    for percent in (21.0, 20.0, 19.9, 20.5, 22.9, 23.0, 20.5):
        battery.heard(percent, 500.0)
        open_at.append(battery.objection(5.0, 5.0) == "")
    assert open_at == [True, True, False, False, False, True, True]
    battery.heard(19.0, 500.0)
    assert all(part in battery.objection(5.0, 5.0) for part in ("battery critical", "19 %", "dock"))
