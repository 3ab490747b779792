"""The battery service of the tutorials (Y-02, the part without the command line)."""

from __future__ import annotations

import asyncio

import pytest

from actors import Child, Node, ServiceFailed, every
from actors.testing import Rig
from robot.interfaces.tutorials.my_robot_interfaces.srv import GetBatteryStatus
from robot.tutorials.battery_service import BatteryClient, BatteryServer, tree
from tests.robot.stage import battery_status, said
from tests.robot.tutorials.kit import alone

LINE = "Battery: 12.4V | 92% | Status: good | Charging: False"


async def test_the_battery_as_it_comes(rig: Rig) -> None:
    await rig.start(BatteryServer)
    battery = await battery_status(rig)
    assert battery.voltage == pytest.approx(12.4)
    assert battery.percentage == pytest.approx(92.31, abs=0.01)
    assert battery.estimated_runtime_minutes == pytest.approx(110.77, abs=0.01)
    assert (battery.health_status, battery.is_charging) == ("good", False)
    assert said(rig, "battery_service_server") == [
        "Battery service server ready",
        "Battery status requested for: robot_01",
        "Response: 12.4V (92%)",
    ]


@pytest.mark.parametrize(
    ("voltage", "percentage", "minutes", "health"),
    [
        (12.6, 100.0, 120.0, "good"),
        (12.4, 92.31, 110.77, "good"),
        (11.3, 50.0, 60.0, "low"),
        (10.52, 20.0, 24.0, "critical"),
        (10.5, 19.23, 23.08, "critical"),
        (10.0, 0.0, 0.0, "critical"),
        (9.0, 0.0, 0.0, "critical"),
        (13.2, 100.0, 120.0, "good"),
    ],
)
async def test_percentage_run_time_and_health_follow_the_voltage(
    rig: Rig, voltage: float, percentage: float, minutes: float, health: str
) -> None:
    await rig.start(Child(BatteryServer, parameters={"voltage": voltage}))
    battery = await battery_status(rig)
    assert battery.percentage == pytest.approx(percentage, abs=0.01)
    assert battery.estimated_runtime_minutes == pytest.approx(minutes, abs=0.01)
    assert battery.health_status == health


async def test_an_unknown_robot_is_an_error_that_names_it(rig: Rig) -> None:
    await rig.start(BatteryServer)
    with pytest.raises(ServiceFailed, match="No battery is known for robot 'robot_02'"):
        await battery_status(rig, "robot_02")
    assert (await battery_status(rig)).percentage > 92.0


async def test_a_battery_on_its_charger_says_so_while_the_node_runs(rig: Rig) -> None:
    await rig.start(BatteryServer)
    assert rig.node(BatteryServer).set_parameters({"is_charging": True, "voltage": 12.6}).successful
    battery = await battery_status(rig)
    assert battery.is_charging
    assert battery.estimated_runtime_minutes == pytest.approx(120.0)  # what unplugging now would leave


class Ticking(BatteryClient):
    """A client with something else to do meanwhile."""

    async def on_start(self) -> None:
        self.ticks = 0

    @every(hz=10)
    def tick(self) -> None:
        self.ticks += 1


async def test_a_client_waits_for_its_server_and_goes_on_with_other_things(rig: Rig) -> None:
    await rig.start(alone(Ticking))
    await rig.advance(2.5)
    assert rig.node(Ticking).ticks == 25
    await rig.system.join(Child(BatteryServer))
    await rig.quiet()
    assert said(rig, "battery_service_client") == ["Waiting for battery service..."] * 2 + [LINE]


async def test_and_the_program_ends_with_it(rig: Rig) -> None:
    system = await rig.start(tree())
    await rig.advance(1.0)
    assert not system.running
    assert said(rig, "battery_service_client") == [LINE]


async def test_a_client_without_a_server_gives_up_in_the_end(rig: Rig) -> None:
    await rig.start(alone(BatteryClient, patience=3.0))
    await rig.advance(10.0)
    lines = said(rig, "battery_service_client")
    assert lines[:3] == ["Waiting for battery service..."] * 3
    assert lines[3].startswith("nobody serves /get_battery_status")
    assert len(lines) == 4


async def test_calls_that_overlap_do_not_share_a_request(rig: Rig) -> None:
    await rig.start(BatteryServer, Node)
    known, unknown = await asyncio.gather(battery_status(rig), battery_status(rig, "robot_07"), return_exceptions=True)
    assert isinstance(known, GetBatteryStatus.Response)
    assert isinstance(unknown, ServiceFailed) and "robot_07" in unknown.text
