"""How a pack is built: the data sheet's figures, and that wiring the same cells otherwise changes no energy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.model.battery import FULL_CELL_VOLTAGE, PackDesign

cells = st.integers(1, 20)
charges = st.floats(0.0, 1.0)
temperatures = st.floats(-20.0, 60.0)


def test_fourteen_cells_are_the_pack_of_the_sheet_and_three_that_of_the_gauge() -> None:
    sheet, gauge = PackDesign(series_cells=14), PackDesign()
    assert sheet.full_voltage == pytest.approx(58.8)
    assert (gauge.full_voltage, gauge.open_voltage(1.0), gauge.open_voltage(0.0)) == pytest.approx((12.6, 12.6, 9.0))
    assert sheet.charger_current == pytest.approx(7.0)
    assert sheet.charger_current * sheet.series_cells == pytest.approx(gauge.charger_current * gauge.series_cells)
    assert FULL_CELL_VOLTAGE == 4.2


@given(series=cells, other=cells, temperature=temperatures)
def test_the_same_energy_wired_otherwise_has_the_same_losses_at_the_same_power(
    series: int, other: int, temperature: float
) -> None:
    """At the power P the current is P / V, so the heat is proportional to R / V^2."""
    one, two = PackDesign(series_cells=series), PackDesign(series_cells=other)
    heat = [pack.resistance(temperature) / pack.full_voltage**2 for pack in (one, two)]
    assert heat[0] == pytest.approx(heat[1])
    energy = [pack.capacity(temperature) * pack.full_voltage for pack in (one, two)]
    assert energy[0] == pytest.approx(energy[1])
    assert one.design_capacity * series * 3.7 == pytest.approx(605.0)


@given(a=charges, b=charges, series=cells)
def test_more_charge_is_more_voltage_and_the_voltage_tells_the_charge(a: float, b: float, series: int) -> None:
    pack = PackDesign(series_cells=series)
    low, high = sorted((a, b))
    assert pack.open_voltage(low) <= pack.open_voltage(high)
    assert pack.charge_at(pack.open_voltage(a)) == pytest.approx(a, abs=1e-9)
    assert pack.open_voltages(np.array([a, b])) == pytest.approx([pack.open_voltage(a), pack.open_voltage(b)])


@pytest.mark.parametrize(
    ("charge", "volts"), [(0.0, 3.0), (0.1, 3.45), (0.5, 3.73), (0.75, 3.955), (0.9, 4.09), (1.0, 4.2)]
)
def test_a_cell_has_the_voltage_of_its_table_and_between_its_knots_the_mean(charge: float, volts: float) -> None:
    assert PackDesign(series_cells=1).open_voltage(charge) == pytest.approx(volts)


def test_beyond_full_and_empty_the_voltage_says_full_and_empty() -> None:
    pack = PackDesign()
    assert (pack.charge_at(20.0), pack.charge_at(1.0)) == (1.0, 0.0)
    assert (pack.open_voltage(1.5), pack.open_voltage(-0.5)) == pytest.approx((12.6, 9.0))


@given(temperature=temperatures)
def test_cold_cells_resist_two_per_cent_more_a_degree_and_hold_six_per_mille_less(temperature: float) -> None:
    pack = PackDesign()
    assert pack.resistance(temperature - 1.0) / pack.resistance(temperature) == pytest.approx(math.exp(0.02))
    assert pack.capacity(temperature) == pytest.approx(
        pack.design_capacity * (1.0 - 0.006 * max(25.0 - temperature, 0.0))
    )
    assert pack.resistance(25.0) == pytest.approx(3 * 0.09083 / pack.design_capacity)


@given(temperature=temperatures)
def test_a_pack_that_relaxes_meets_a_lasting_load_with_half_as_much_again(temperature: float) -> None:
    plain, relaxing = PackDesign(), PackDesign(relaxation=True)
    assert plain.steady_resistance(temperature) == plain.resistance(temperature)
    assert relaxing.steady_resistance(temperature) == pytest.approx(1.5 * relaxing.resistance(temperature))


@pytest.mark.parametrize(("series", "energy"), [(0, 605.0), (3, 0.0), (3, -1.0), (3, math.nan), (3, math.inf)])
def test_a_pack_that_cannot_be_is_refused(series: int, energy: float) -> None:
    with pytest.raises(ValueError, match="needs at least one series cell and a positive energy"):
        PackDesign(series_cells=series, energy_wh=energy)
