"""The tutorial's battery service, word for word (S-10 to S-15)."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.estimation.battery_gauge import BatteryGauge, UnknownRobot, health, percentage, runtime_minutes
from robot.model.power import electrical_power, typical_motor_power
from robot.sim.battery import Pack


@pytest.mark.parametrize(
    ("voltage", "percent", "minutes"),
    [
        (12.6, 100.0, 120.0),
        (12.4, 92.31, 110.77),
        (11.3, 50.0, 60.0),
        (10.52, 20.0, 24.0),
        (10.5, 19.23, 23.08),
        (10.0, 0.0, 0.0),
        (9.0, 0.0, 0.0),
    ],
)
def test_s_10_formula(voltage: float, percent: float, minutes: float) -> None:
    reading = BatteryGauge().read("robot_01", voltage)
    assert reading.percentage == pytest.approx(percent, abs=5e-3)
    assert reading.estimated_runtime_minutes == pytest.approx(minutes, abs=5e-3)
    assert reading.voltage == voltage


@pytest.mark.parametrize(
    ("voltage", "word"),
    [(12.6, "good"), (11.31, "good"), (11.3, "low"), (10.53, "low"), (10.52, "critical"), (10.0, "critical")],
)
def test_s_11_health_is_strict_at_50_and_20(voltage: float, word: str) -> None:
    assert BatteryGauge().read("robot_01", voltage).health_status == word


def test_s_11_health_is_compared_after_rounding() -> None:
    assert percentage(11.3) > 50.0
    assert health(percentage(11.3)) == "low"
    assert health(50.000002) == "good"
    assert health(20.000002) == "low"


def test_s_12_more_than_full_is_full() -> None:
    assert percentage(13.2) == 100.0


@given(st.floats(-1e6, 1e6))
def test_s_12_percentage_is_always_between_0_and_100(voltage: float) -> None:
    percent = percentage(voltage)
    assert 0.0 <= percent <= 100.0
    assert 0.0 <= runtime_minutes(percent) <= 120.0


def test_s_13_an_unknown_robot_is_refused_by_name() -> None:
    with pytest.raises(UnknownRobot, match=r"'robot_77'.*watches 'robot_01'"):
        BatteryGauge().read("robot_77", 12.4)


@pytest.mark.parametrize("charging", [True, False])
def test_s_14_the_charging_flag_is_passed_on_and_the_runtime_is_that_of_unplugging_now(charging: bool) -> None:
    reading = BatteryGauge().read("robot_01", 12.4, is_charging=charging)
    assert reading.is_charging is charging
    assert reading.estimated_runtime_minutes == pytest.approx(110.77, abs=5e-3)


def test_s_15_voltage_falls_while_walking_and_rises_on_the_charger() -> None:
    pack = Pack(80.0)
    at_rest = pack.step(1.0, electrical_power(0.0)).gauge_voltage
    walking = pack.step(10.0, electrical_power(typical_motor_power(0.6, 0.0, 0.0, walking=True))).gauge_voltage
    rested = pack.step(1.0, electrical_power(0.0)).gauge_voltage
    charging = pack.step(10.0, electrical_power(0.0), charging=True).gauge_voltage
    assert walking < rested < at_rest < charging


@pytest.mark.parametrize("voltage", [math.nan, math.inf])
def test_a_broken_voltmeter_gives_an_error_not_a_percentage(voltage: float) -> None:
    with pytest.raises(ValueError, match="check the sensor"):
        BatteryGauge().read("robot_01", voltage)
