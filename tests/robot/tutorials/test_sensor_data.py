"""Sensor telemetry (Y-01, the part without the command line)."""

from __future__ import annotations

import pytest

from actors.testing import Rig
from robot.tutorials.sensor_data import SENSOR_DATA, tree
from tests.robot.stage import said


async def test_telemetry_comes_twice_a_second_and_within_its_bounds(rig: Rig) -> None:
    await rig.start(tree())
    data = rig.probe(SENSOR_DATA)
    await rig.advance(10.0)
    assert len(data) == 20
    assert said(rig, "sensor_data_publisher") == ["Sensor data publisher started (2 Hz)"]
    for number, reading in enumerate(data, start=1):
        assert 22.0 <= reading.temperature <= 28.0
        assert 50.0 <= reading.humidity <= 70.0
        assert 12.1 <= round(reading.battery_voltage, 5) <= 12.6
        assert (reading.emergency_stop, reading.status_message) == (False, "nominal")
        assert reading.header.frame_id == "base_link"
        stamp = reading.header.stamp
        assert stamp.sec + stamp.nanosec * 1e-9 == pytest.approx(number * 0.5)
    assert len({reading.temperature for reading in data}) == 20
