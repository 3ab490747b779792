"""Which nodes a robot has follows from its devices, not from whether it is simulated."""

from __future__ import annotations

from dataclasses import replace

import pytest

from actors.testing import Rig
from robot.contracts import CONTACTS, JOINT_STATES
from robot.geometry.planar import Pose2
from robot.hardware.body import Capabilities
from robot.hardware.devices import Equipment
from robot.run.tree_nodes import nodes_of
from robot.scenes.worlds import get_world
from robot.sim.battery import Pack
from robot.sim.devices import simulated
from robot.sim.kinematic import KinematicBody
from robot.tree import Site, tree_of

HERE = Pose2(0.0, 0.0)


class Numb(KinematicBody):
    """It does not feel its feet."""

    @property
    def capabilities(self) -> Capabilities:
        return Capabilities(steps=True, contacts=False)


def equipment(kind: type[KinematicBody] = KinematicBody) -> Equipment:
    return simulated(kind(get_world("empty"), seed=1), Pack(90.0))


def test_a_robot_without_devices_has_the_nodes_that_walk_and_watch_and_none_that_look_or_find_the_way() -> None:
    bare = Equipment(equipment().hardware, Pack(90.0))
    names = {child.name for child in nodes_of(tree_of(bare, Site.of(get_world("empty"))))}
    assert {"motors", "gait", "battery", "safety_monitor"} <= names
    assert names.isdisjoint({"lidar", "localizer", "map_server", "navigation", "camera", "detector", "arm"})


def test_a_robot_with_a_lidar_and_no_map_measures_and_does_not_navigate() -> None:
    names = {child.name for child in nodes_of(tree_of(equipment()))}
    assert {"lidar", "camera"} <= names
    assert names.isdisjoint({"localizer", "navigation", "docking"})


def test_waypoints_of_a_robot_that_cannot_find_its_way_are_refused() -> None:
    with pytest.raises(ValueError, match="give it a site and a LiDAR"):
        tree_of(replace(equipment(), lidar=None), Site.of(get_world("empty")), [("there", HERE)])


async def test_a_robot_that_does_not_feel_its_feet_reports_no_contacts_and_all_else(rig: Rig) -> None:
    await rig.start(tree_of(equipment(Numb)))
    contacts, joints = rig.probe(CONTACTS), rig.probe(JOINT_STATES)
    await rig.advance(1.0)
    assert len(joints) > 150
    assert len(contacts) == 0
