"""The executables of the tutorials, by the names under which their documents start them: each is the node that the document describes."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import pytest

from actors import Node
from actors.launch import Packages
from actors.launch.packages import NodeTarget
from actors.running.target import find, grown
from actors.testing import Rig
from robot.tutorials import communication_demo, sensor_data
from tests.robot.stage import robot, said

PACKAGES = Packages(environment={})


def target(package: str, executable: str) -> NodeTarget:
    found = PACKAGES.find(package, executable)
    assert isinstance(found, NodeTarget)
    return found


async def started(rig: Rig, package: str, executable: str) -> list[str]:
    """Start an executable; the nodes that then run."""
    await rig.start(*await grown(find(target(package, executable).target)))
    return sorted(one.identity.name for one in rig.system.nodes.values() if one.running and one.identity.name != "rig")


@pytest.mark.parametrize(
    ("package", "executable", "node", "line"),
    [
        ("communication_demo", "sensor_simulator", "sensor_simulator", "Sensor simulator started"),
        ("communication_demo", "processor", "data_processor", "Data processor initialized"),
        ("my_robot_controller", "robot_controller", "robot_controller", "Robot Controller initialized"),
        ("my_robot_controller", "imu_publisher", "imu_publisher", ""),
    ],
)
async def test_the_console_scripts_of_both_setup_files_start_their_nodes(
    rig: Rig, package: str, executable: str, node: str, line: str
) -> None:
    assert await started(rig, package, executable) == [node]
    await rig.advance(0.5)
    assert any(line in text for text in said(rig, node))


@pytest.mark.parametrize("executable", ["battery_server", "battery_service_server"])
async def test_both_names_of_the_battery_server_start_it(rig: Rig, executable: str) -> None:
    assert await started(rig, "my_first_robot", executable) == ["battery_service_server"]


@pytest.mark.parametrize("executable", ["fibonacci_action_server", "minimal_service", "distance_service"])
async def test_nodes_that_their_package_never_listed_start_by_name(rig: Rig, executable: str) -> None:
    """Without `__main__`: what such a node needs is imported at the top of its module."""
    assert await started(rig, "my_robot_pkg", executable) == [executable]


@pytest.mark.parametrize(
    ("executable", "packages"),
    [
        ("sensor_publisher", ("my_package", "physical_ai")),
        ("sensor_simulator", ("communication_demo", "humanoid_control")),
    ],
)
def test_what_two_tutorials_call_the_same_is_told_apart_by_its_package(
    executable: str, packages: tuple[str, ...]
) -> None:
    places = [target(package, executable).target.partition(":") for package in packages]
    nodes = [getattr(import_module(module), name) for module, _, name in places]
    assert all(issubclass(node, Node) for node in nodes)
    assert nodes[0] is not nodes[1]


# -- one of each --------------------------------------------------------------------------------------------------------------


async def heard(rig: Rig, topic: Any, seconds: float) -> list[Any]:
    probe = rig.probe(topic)
    await rig.advance(seconds)
    return list(probe.messages)


async def test_each_tutorial_keeps_its_own_temperature(rig: Rig) -> None:
    await rig.start(sensor_data.tree())
    around_25 = [one.temperature for one in await heard(rig, sensor_data.SENSOR_DATA, 600.0)]
    assert 24.0 < sum(around_25) / len(around_25) < 26.0
    assert 2.0 < max(abs(one - 25.0) for one in around_25) <= 3.0


async def test_the_other_ones_lies_between_20_and_30(rig: Rig) -> None:
    await rig.start(communication_demo.tree())
    between = [one.data for one in await heard(rig, communication_demo.TEMPERATURE, 600.0)]
    assert 20.0 <= min(between) < 21.0 and 29.0 < max(between) <= 30.0


async def test_the_robot_has_one_battery_and_one_owner_of_its_joint_states(rig: Rig) -> None:
    await rig.start(robot())
    topics = {one.name: [edge.node for edge in one.publishers] for one in rig.system.snapshot().topics}
    assert topics["/battery_state"] == topics["/battery_status"] == ["/battery"]
    assert topics["/joint_states"] == ["/proprioception"]  # measured
    assert topics["/motor_targets"] == ["/gait"]  # commanded
    servers = {one.name: one.server for one in rig.system.snapshot().services}
    assert servers["/get_battery_status"] == "/battery"
