"""What a pack reports: the numbers of sensor_msgs, and its two ways to count."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.interfaces.sensor_msgs.msg import BatteryState
from robot.hardware.battery import PackState, SupplyStatus


def state(voltage: float, soc: float, cells: int) -> PackState:
    return PackState(voltage, -10.0, 20.0, 54.5, 25.0, soc, SupplyStatus.DISCHARGING, True, cells)


@pytest.mark.parametrize("status", list(SupplyStatus))
def test_a_status_has_the_number_that_sensor_msgs_gives_to_its_name(status: SupplyStatus) -> None:
    assert getattr(BatteryState, f"POWER_SUPPLY_STATUS_{status.name}") == status.value


@given(st.floats(0.0, 1.0), st.floats(2.5, 4.2), st.integers(1, 20))
def test_the_gauge_sees_three_of_any_number_of_cells_and_per_cent_are_counted(
    soc: float, cell: float, cells: int
) -> None:
    pack = state(cell * cells, soc, cells)
    assert pack.gauge_voltage == pytest.approx(3 * cell)
    assert pack.percent == pytest.approx(100.0 * soc)


def test_three_cells_show_their_own_voltage() -> None:
    assert state(11.3, 0.5, 3).gauge_voltage == pytest.approx(11.3)
    assert state(46.2, 0.5, 14).gauge_voltage == pytest.approx(9.9)
