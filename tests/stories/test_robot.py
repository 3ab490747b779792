"""The whole robot in one process, seen from another one."""

from __future__ import annotations

import pytest

from actors import System, Topic
from actors.interfaces.sensor_msgs.msg import BatteryState
from tests.stories.conftest import Start, nodes, until

pytestmark = pytest.mark.realtime

NODES = {
    "/motors", "/proprioception", "/gait", "/battery", "/safety_monitor", "/robot_controller", "/lidar", "/map_server",
    "/localizer", "/frames", "/navigation", "/docking", "/robot_status", "/patrol", "/camera", "/detector", "/calibration",
}  # fmt: skip


async def test_a_second_process_sees_every_node_of_the_whole_robot_and_hears_its_topics(
    start: Start, observer: System
) -> None:
    await start("robot", "run", "--backend", "kinematic")

    await until(observer, lambda: nodes(observer) >= NODES)
    async with observer.node("observer").subscribe(Topic(BatteryState, "/battery_state")) as states:
        heard = await states.next(timeout=20.0)
    assert 0.85 < heard.percentage <= 0.9


async def test_the_command_line_lists_the_nodes_of_a_robot_that_runs_in_another_process(start: Start) -> None:
    robot = await start("robot", "run", "--backend", "kinematic")
    await robot.says("robot running")

    listing = await start("robot", "node", "list")

    assert await listing.ended() == 0
    assert set(listing.lines) >= NODES
