"""Charge levels: their borders, no chatter; and the power that drains the pack."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.estimation.battery_levels import LevelMonitor
from robot.hardware.battery import PackState
from robot.model.charge import ChargeLevel
from robot.model.power import electrical_power, motor_power, typical_motor_power
from robot.sim.battery import Pack

GOOD, LOW, CRITICAL = ChargeLevel.GOOD, ChargeLevel.LOW, ChargeLevel.CRITICAL


def state(percent: float, voltage: float = 11.0) -> PackState:
    return replace(Pack(percent).state, voltage=voltage)


@pytest.mark.parametrize(
    ("percent", "level"), [(100, GOOD), (30, GOOD), (29.9, LOW), (10, LOW), (9.9, CRITICAL), (0, CRITICAL)]
)
def test_borders_of_a_first_look(percent: float, level: ChargeLevel) -> None:
    assert LevelMonitor().update(1.0, state(percent)) is level


def test_better_levels_need_three_points_more() -> None:
    monitor = LevelMonitor()
    walk = [29, 30, 32.9, 33, 31, 29, 9, 10, 12.9, 13, 32, 33]
    expected = [LOW, LOW, LOW, GOOD, GOOD, LOW, CRITICAL, CRITICAL, CRITICAL, LOW, LOW, GOOD]
    assert [monitor.update(1.0, state(percent)) for percent in walk] == expected


def test_a_voltage_below_10_for_two_seconds_is_critical_and_a_dip_is_not() -> None:
    monitor = LevelMonitor()
    assert monitor.update(1.5, state(40, 9.9)) is GOOD
    assert monitor.update(0.1, state(40, 10.0)) is GOOD
    assert monitor.update(1.5, state(40, 9.9)) is GOOD
    assert monitor.update(0.5, state(40, 9.9)) is CRITICAL


def test_a_voltage_that_recovers_without_charging_does_not_let_the_robot_walk_again() -> None:
    monitor = LevelMonitor()
    monitor.update(2.0, state(40, 9.9))
    assert monitor.update(60.0, state(40, 11.0)) is CRITICAL
    assert monitor.update(60.0, state(42.9, 11.0)) is CRITICAL
    assert monitor.update(60.0, state(43.1, 11.0)) is GOOD


def test_the_voltage_limit_is_scaled_to_the_cells() -> None:
    monitor = LevelMonitor()
    fourteen = replace(Pack(40.0, series_cells=14).state, voltage=46.6)
    assert monitor.update(2.0, fourteen) is CRITICAL


@given(st.lists(st.floats(0.0, 100.0), min_size=1, max_size=50))
def test_levels_never_flatter_the_charge(percents: list[float]) -> None:
    monitor = LevelMonitor()
    for percent in percents:
        level = monitor.update(1.0, state(percent))
        if level is GOOD:
            assert percent >= 30.0
        if percent < 10.0:
            assert level is CRITICAL


@given(st.floats(5.0, 95.0), st.lists(st.floats(-1.4, 1.4), min_size=2, max_size=50))
def test_noise_below_the_hysteresis_changes_the_level_at_most_once(centre: float, noise: list[float]) -> None:
    monitor = LevelMonitor()
    levels = [monitor.update(1.0, state(centre + n)) for n in noise]
    changes = sum(a is not b for a, b in pairwise(levels))
    assert changes <= 1


def test_a_discharge_passes_every_level_once() -> None:
    pack, monitor = Pack(35.0), LevelMonitor()
    seen: list[ChargeLevel] = []
    while pack.state.soc > 0.02:
        level = monitor.update(10.0, pack.step(10.0, 403.0))
        if level not in seen[-1:]:
            seen.append(level)
    assert seen == [GOOD, LOW, CRITICAL]


def test_motor_power_counts_work_and_copper_but_no_braking() -> None:
    torque, speed = np.array([10.0, -10.0, 20.0]), np.array([2.0, 2.0, 0.0])
    assert motor_power(torque, speed) == pytest.approx(20.0 + 0.053 * 600.0)
    assert electrical_power(82.0) == 202.0
    assert electrical_power(82.0, arm=30.0, payload=10.0) == 242.0


@pytest.mark.parametrize(("speed", "total"), [(0.3, 330), (0.6, 360), (1.0, 424), (1.3, 486), (1.6, 561)])
def test_typical_power_is_the_table_of_section_7(speed: float, total: float) -> None:
    assert electrical_power(typical_motor_power(speed, 0.0, 0.0, walking=True)) == pytest.approx(total)


def test_typical_power_of_standing_and_of_turning() -> None:
    assert electrical_power(typical_motor_power(0.0, 0.0, 0.0, walking=False)) == 202.0
    in_place = typical_motor_power(0.0, 0.0, 0.0, walking=True)
    turning = typical_motor_power(0.0, 0.0, 1.0, walking=True)
    assert typical_motor_power(0.0, 0.0, 0.0, walking=False) < in_place < turning
