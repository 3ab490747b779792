"""The battery pack: laws that hold for any use of it, and the figures of the data sheet."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot.hardware.battery import SupplyStatus
from robot.model.battery import PackDesign
from robot.sim.battery import Pack

percents = st.floats(0.0, 100.0)
loads = st.floats(0.0, 1500.0)
cells = st.sampled_from([3, 14])


def minutes_until_10_volts(pack: Pack, load: float) -> float:
    seconds = 0
    while pack.state.gauge_voltage >= 10.0:
        pack.step(1.0, load)
        seconds += 1
    return seconds / 60.0


def minutes_until_full(pack: Pack, load: float) -> float:
    seconds = 0
    while pack.step(1.0, load, charging=True).status is not SupplyStatus.FULL:
        seconds += 1
    return seconds / 60.0


@given(percents, cells, st.lists(st.tuples(st.floats(0.0, 1.0), loads, st.booleans()), max_size=30), st.booleans())
def test_charge_is_conserved(percent: float, series: int, steps: list[tuple[float, float, bool]], rc: bool) -> None:
    """Coulombs in are counted with 0.995, coulombs out with 1, and the charge never leaves 0..capacity."""
    pack = Pack(percent, design=PackDesign(series_cells=series, relaxation=rc), ambient=30.0)
    for dt, load, charging in steps:
        before = pack.state.charge
        state = pack.step(dt, load, charging)
        moved = state.current * dt / 3600.0 * (0.995 if state.current > 0 else 1.0)
        expected = min(state.capacity, max(0.0, before + moved))
        assert state.charge == pytest.approx(expected, abs=1e-9)
        assert 0.0 <= state.soc <= 1.0


@given(st.floats(1.0, 100.0), cells, loads, loads, st.floats(-20.0, 40.0))
def test_voltage_is_monotone_in_the_load(percent: float, series: int, a: float, b: float, ambient: float) -> None:
    light, heavy = sorted((a, b))
    under_light = Pack(percent, series, ambient=ambient).step(0.0, light)
    under_heavy = Pack(percent, series, ambient=ambient).step(0.0, heavy)
    assert under_heavy.voltage <= under_light.voltage + 1e-9
    assert under_heavy.current <= under_light.current + 1e-9


@given(percents, percents, cells, loads)
def test_voltage_is_monotone_in_the_charge(a: float, b: float, series: int, load: float) -> None:
    low, high = sorted((max(a, 1.0), max(b, 1.0)))
    less, more = Pack(low, series).step(0.0, load), Pack(high, series).step(0.0, load)
    assert less.voltage <= more.voltage + 1e-9


@given(st.floats(1.0, 100.0), cells, loads)
def test_a_constant_power_load_gets_its_power(percent: float, series: int, load: float) -> None:
    state = Pack(percent, series).step(0.0, load)
    assert state.supplied
    assert state.voltage * -state.current == pytest.approx(load, rel=1e-9, abs=1e-9)


@settings(deadline=None, max_examples=25)
@given(st.floats(20.0, 100.0), st.floats(20.0, 1200.0), st.booleans())
def test_stored_energy_becomes_work_and_heat(percent: float, load: float, rc: bool) -> None:
    pack = Pack(percent, design=PackDesign(relaxation=rc))
    start, work, lost = pack.state.soc, 0.0, 0.0
    for _ in range(300):
        emf = pack.design.open_voltage(pack.state.soc)
        state = pack.step(0.1, load)
        work += load * 0.1
        lost += (emf - state.voltage) * -state.current * 0.1
    charges = np.linspace(pack.state.soc, start, 400)
    released = float(np.trapezoid(pack.design.open_voltages(charges), charges)) * pack.design.design_capacity * 3600.0
    assert work + lost == pytest.approx(released, rel=2e-3)


@given(st.floats(0.0, 1.0), cells)
def test_charge_at_inverts_the_open_voltage(soc: float, series: int) -> None:
    design = PackDesign(series_cells=series)
    assert design.charge_at(design.open_voltage(soc)) == pytest.approx(soc, abs=1e-9)


@settings(deadline=None, max_examples=25)
@given(st.floats(10.0, 100.0), loads, st.booleans())
def test_one_long_step_is_many_short_ones(percent: float, load: float, charging: bool) -> None:
    once, often = Pack(percent), Pack(percent)
    once.step(60.0, load, charging)
    for _ in range(60):
        often.step(1.0, load, charging)
    assert once.state == often.state


@settings(deadline=None, max_examples=25)
@given(percents, st.floats(0.0, 700.0), st.booleans())
def test_the_wiring_does_not_change_the_battery(percent: float, load: float, charging: bool) -> None:
    """Three cells and fourteen hold the same energy, so charge, heat and the gauge agree."""
    three, fourteen = Pack(percent, 3), Pack(percent, 14)
    for _ in range(20):
        a, b = three.step(30.0, load, charging), fourteen.step(30.0, load, charging)
        assert a.soc == pytest.approx(b.soc, abs=1e-9)
        assert a.gauge_voltage == pytest.approx(b.gauge_voltage, abs=1e-6)
        assert a.temperature == pytest.approx(b.temperature, abs=1e-6)
        assert a.status is b.status


@pytest.mark.parametrize(("load", "minutes"), [(80.0, 433), (200.0, 171), (403.0, 83), (600.0, 55)])
def test_constant_load_runtimes_of_section_7(load: float, minutes: float) -> None:
    assert minutes_until_10_volts(Pack(100.0), load) == pytest.approx(minutes, abs=1.0)


def test_the_default_pack_lies_between_9_and_12_6_volts_and_the_sheet_pack_at_58_8() -> None:
    assert Pack(0.0).state.voltage == pytest.approx(9.0)
    assert Pack(100.0).state.voltage == pytest.approx(12.6)
    assert Pack(100.0, series_cells=14).state.voltage == pytest.approx(58.8)
    assert Pack(100.0).design.resistance(25.0) == pytest.approx(0.005, rel=1e-3)
    assert Pack(100.0).design.design_capacity == pytest.approx(54.5, abs=0.01)


def test_a_charge_takes_about_two_hours() -> None:
    """The sheet says 120 min: alone the pack takes 106, with the robot's hotel load on the dock 137."""
    assert minutes_until_full(Pack(0.0), 0.0) == pytest.approx(120.0, rel=0.15)
    assert minutes_until_full(Pack(0.0), 120.0) == pytest.approx(120.0, rel=0.15)


def test_charging_is_limited_by_current_then_power_then_voltage_and_ends_below_a_twentieth_of_the_capacity() -> None:
    pack = Pack(0.0)
    currents, powers, voltages = [], [], []
    while True:
        state = pack.step(1.0, 0.0, charging=True)
        if state.status is SupplyStatus.FULL:
            break
        assert state.status is SupplyStatus.CHARGING
        currents.append(state.current)
        powers.append(state.current * state.voltage)
        voltages.append(state.voltage)
    assert currents[0] == pytest.approx(7.0 * 14 / 3)
    assert max(powers) == pytest.approx(400.0, rel=1e-3)
    assert max(voltages) == pytest.approx(12.6, abs=5e-3)
    assert currents[-1] == pytest.approx(54.5 / 20, rel=0.02)
    assert state.current == 0.0
    assert state.soc > 0.995


def test_a_full_pack_rests_on_the_dock_and_charges_again_after_a_walk() -> None:
    pack = Pack(99.0)
    minutes_until_full(pack, 120.0)
    charge = pack.state.charge
    assert pack.step(600.0, 120.0, charging=True).status is SupplyStatus.FULL
    assert pack.state.charge == charge
    assert pack.step(300.0, 400.0).status is SupplyStatus.DISCHARGING
    assert pack.step(1.0, 120.0, charging=True).status is SupplyStatus.CHARGING


def test_a_load_beyond_the_charger_discharges_on_the_dock() -> None:
    state = Pack(50.0).step(1.0, 700.0, charging=True)
    assert state.status is SupplyStatus.DISCHARGING
    assert state.current * state.voltage == pytest.approx(-300.0, rel=1e-3)


def test_a_load_of_exactly_the_charger_leaves_the_pack_alone() -> None:
    assert Pack(50.0).step(1.0, 400.0, charging=True).status is SupplyStatus.NOT_CHARGING


def test_an_empty_pack_delivers_nothing_and_says_so() -> None:
    pack = Pack(0.01)
    state = pack.step(60.0, 400.0)
    assert state.soc == 0.0
    assert not state.supplied
    assert state.current == 0.0
    assert pack.step(1.0, 0.0).supplied
    assert pack.step(1.0, 120.0, charging=True).supplied


def test_an_overload_gets_the_most_the_pack_can_give() -> None:
    pack = Pack(100.0)
    state = pack.step(0.0, 1e6)
    assert not state.supplied
    assert state.voltage == pytest.approx(12.6 / 2)


def test_relaxation_sags_on_and_recovers() -> None:
    pack = Pack(80.0, design=PackDesign(relaxation=True))
    at_once = pack.step(0.0, 400.0).voltage
    later = pack.step(120.0, 400.0).voltage
    resting = pack.step(0.0, 0.0).voltage
    recovered = pack.step(120.0, 0.0).voltage
    stiff = Pack(80.0)
    stiff_drop = stiff.step(0.0, 400.0).voltage - stiff.step(120.0, 400.0).voltage
    assert at_once - later > stiff_drop + 0.05
    assert recovered - resting == pytest.approx(36.0 * 0.0025, rel=0.1)


def test_cold_raises_resistance_and_lowers_capacity_and_work_warms() -> None:
    design = PackDesign()
    assert design.resistance(0.0) == pytest.approx(design.resistance(25.0) * math.exp(0.5))
    assert design.capacity(0.0) == pytest.approx(design.design_capacity * 0.85)
    assert design.capacity(40.0) == design.design_capacity
    pack = Pack(100.0, ambient=0.0)
    pack.step(1800.0, 600.0)
    assert 3.0 < pack.state.temperature < 30.0
    assert Pack(100.0, ambient=0.0).step(1.0, 400.0).voltage < Pack(100.0).step(1.0, 400.0).voltage


def test_repr_reads_like_an_instrument() -> None:
    pack = Pack(50.0)
    pack.step(1.0, 400.0)
    assert repr(pack) == "<Pack of 3 cells: 50.0 %, 11.01 V, -36.3 A, 25.0 C>"


@pytest.mark.parametrize("bad", [(-1.0, 100.0), (math.nan, 100.0), (1.0, -5.0), (1.0, math.inf)])
def test_impossible_steps_are_refused(bad: tuple[float, float]) -> None:
    with pytest.raises(ValueError, match="finite load of at least zero"):
        Pack().step(*bad)


def test_impossible_packs_are_refused() -> None:
    with pytest.raises(ValueError, match="0 to 100 percent"):
        Pack(101.0)
    with pytest.raises(ValueError, match="at least one series cell"):
        PackDesign(series_cells=0)


def test_a_pack_that_is_made_anew_goes_on_where_the_old_one_was_and_an_older_one_is_not_set_back() -> None:
    old, new = Pack(50.0), Pack(90.0)
    old.step(600.0, 300.0)
    kept = old.kept
    new.restore(kept)
    assert new.kept == kept
    assert new.state.percent == pytest.approx(old.state.percent)
    assert new.step(60.0, 300.0) == old.step(60.0, 300.0)
    old.restore(kept)  # it is a minute older by now
    assert old.kept == new.kept
