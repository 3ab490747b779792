"""`robot.Robot`: the whole robot in one line, and what each of its words does."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import robot
from actors.errors import DeclarationError
from actors.testing import Rig
from robot import Robot
from robot.contracts import BATTERY_STATE, GAIT_STATUS, GOAL_REPORT
from robot.geometry.planar import Pose2
from robot.nodes.carrier import Delivery
from robot.run.tree_nodes import nodes_of
from robot.scenes.worlds import UnknownWorld, get_world
from tests.figures.load import family


def names(robot: Robot) -> set[str]:
    return {child.name for child in nodes_of(robot.tree)}


def command_of(process: int) -> str:
    return Path(f"/proc/{process}/cmdline").read_text(encoding="utf-8")


def test_without_a_mission_nobody_asks_it_to_walk() -> None:
    waiting = Robot(body="kinematic")
    assert not names(waiting) & {"patrol", "carrier", "arm"}
    assert (waiting.scene.name, waiting.body.backend, waiting.body.arm) == ("empty", "kinematic", None)
    assert repr(waiting) == "Robot(world='empty', body='kinematic')"


def test_each_mission_brings_its_node_and_a_delivery_brings_the_arm() -> None:
    assert "patrol" in names(Robot("warehouse", body="kinematic", mission="patrol"))
    carrying = Robot("kitchen", body="kinematic", mission=Delivery("cup", (2.0, 1.0, 0.45)))
    assert {"carrier", "arm", "fetch"} <= names(carrying)
    assert "patrol" not in names(carrying)
    assert carrying.body.arm is not None


def test_the_clock_publisher_comes_first() -> None:
    assert Robot(body="kinematic", publish_clock=40.0).tree.children[0].name == "clock_publisher"


def test_a_world_is_a_name_or_a_scene() -> None:
    assert Robot(get_world("corridor"), body="kinematic").scene.name == "corridor"
    with pytest.raises(UnknownWorld, match="did you mean 'kitchen'"):
        Robot("kitchn")


async def test_it_walks_to_each_place_once_and_sits_down(rig: Rig) -> None:
    walker = Robot("empty", body="kinematic", mission=[Pose2(1.0, 0.0), Pose2(1.0, 1.0)], seed=1)
    await rig.start(walker.tree)
    reports = rig.probe(GOAL_REPORT)
    await rig.until(lambda: any(record.event == "mission over: sitting down" for record in rig.logs))
    assert [(report.name, report.outcome) for report in reports] == [("goal_1", "succeeded"), ("goal_2", "succeeded")]
    assert walker.body.truth().position[:2] == pytest.approx([1.0, 1.0], abs=0.1)


async def test_it_says_that_it_stands_when_it_does(rig: Rig) -> None:
    await rig.start(Robot("empty", body="kinematic", mission="patrol", seed=1).tree)
    statuses = rig.probe(GAIT_STATUS)
    await rig.advance(4.0)
    stood = next(
        time for time, status in zip(statuses.times, statuses, strict=True) if status.mode in ("stand", "walk")
    )
    said = {record.event: record.time for record in rig.logs if record.node == "/patrol"}
    assert said["Robot is now standing"] == pytest.approx(stood, abs=0.01)
    assert said["Robot is now standing"] > said["standing up"] + 0.5


async def test_the_battery_starts_as_it_is_said(rig: Rig) -> None:
    await rig.start(Robot(body="kinematic", battery=42.0).tree)
    states = rig.probe(BATTERY_STATE)
    await rig.advance(1.5)
    assert states[-1].percentage == pytest.approx(0.42, abs=0.01)


def test_importing_the_package_waits_for_nothing_heavy() -> None:
    code = "import sys, robot; print('numpy' in sys.modules, 'actors' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout == "False False\n"


def test_a_name_that_the_package_does_not_have_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="module 'robot' has no attribute 'Robt'"):
        _ = robot.Robt


def test_a_body_without_forces_has_no_process() -> None:
    with pytest.raises(ValueError, match="only the physics body has a process of its own; leave one of them out"):
        Robot(body="kinematic", processes=True)


def test_what_cannot_cross_to_a_process_is_refused_and_the_body_is_not_left_behind() -> None:
    unpicklable = (Pose2(1.0, 0.0), lambda: None)
    with pytest.raises(DeclarationError, match="cannot be copied to another process"):
        Robot("empty", mission=unpicklable, processes=True)  # type: ignore[arg-type]
    assert not any("spawn_main" in command_of(one) for one in family(os.getpid()))
