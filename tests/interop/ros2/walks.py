"""A robot of ours that a ROS 2 sends about, as RViz does: "2D Goal Pose" and "2D Pose Estimate"."""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from math import hypot
from typing import Any

from actors import Topic
from actors.interfaces.rcl_interfaces.msg import Log
from robot.contracts import GOAL_POSE, INITIAL_POSE, POSE
from tests.interop.parties import until
from tests.interop.ros2.bench import Bench, Check
from tests.interop.ros2.verbs import ROOT

ROBOT = """
import asyncio, os
from actors import run
from actors.transport import transport_from_environment
from robot.assembly import Robot

async def main():
    async with run(Robot("empty", body="kinematic").tree, transport=transport_from_environment(os.environ)) as system:
        await system.wait()

asyncio.run(main())
"""
GOAL = "{header: {frame_id: map}, pose: {position: {x: %s, y: %s}, orientation: {w: 1.0}}}"
ESTIMATE = "{header: {frame_id: map}, pose: {pose: {position: {x: 0.05, y: 0.0}, orientation: {w: 1.0}}}}"
ROSOUT = Topic(Log, "/rosout")


def checks() -> Iterator[tuple[str, Check]]:
    yield "ros2 topic pub /goal_pose: our robot walks there", goal_pose
    yield "ros2 topic pub /initialpose: our robot looks where it is", initial_pose


@asynccontextmanager
async def robot(bench: Bench) -> AsyncIterator[list[Any]]:
    """A robot in a process of its own, which lies and waits; yields the poses that it tells."""
    kept = {name: value for name, value in os.environ.items() if name != "AMENT_PREFIX_PATH"}
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-c", ROBOT, stdout=asyncio.subprocess.DEVNULL, stderr=asyncio.subprocess.DEVNULL,
        env={**kept, **bench.own, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    try:
        poses = bench.ours.listen(POSE)
        await until(lambda: poses, "the robot tells its pose")
        yield poses
    finally:
        process.terminate()
        await process.wait()


async def publish(bench: Bench, topic: Topic[Any], kind: str, values: str) -> None:
    await bench.run(
        "topic", "pub", "--times", "5", "-w", "1", "-r", "2", topic.name, f"geometry_msgs/msg/{kind}", values
    )


async def goal_pose(bench: Bench) -> None:
    async with robot(bench) as poses:
        await publish(bench, GOAL_POSE, "PoseStamped", GOAL % (1.5, 0.5))

        def there() -> bool:
            place = poses[-1]["pose"]["position"]
            return hypot(place["x"] - 1.5, place["y"] - 0.5) < 0.1

        await until(there, "the robot has walked to the goal")


async def initial_pose(bench: Bench) -> None:
    async with robot(bench):
        told = bench.ours.listen(ROSOUT)
        await publish(bench, INITIAL_POSE, "PoseWithCovarianceStamped", ESTIMATE)
        await until(lambda: any("initial pose set" in line["msg"] for line in told), "the localizer takes it")
