"""A robot of ours that a ROS 2 sends about, as Nav2's clients do, and RViz: "2D Goal Pose" and "2D Pose Estimate"."""

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
from robot.contracts import GOAL_POSE, INITIAL_POSE, NAVIGATE_TO_POSE, POSE
from tests.interop.parties import until
from tests.interop.ros2.bench import Bench, Check
from tests.interop.ros2.services import CANCELED, SUCCEEDED, their
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
    yield "their goal of NavigateToPose: our robot walks there; the next one is canceled", navigate_to_pose


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


def away(poses: list[Any], x: float, y: float) -> float:
    """How far the robot is from a place, m."""
    place = poses[-1]["pose"]["position"]
    return hypot(place["x"] - x, place["y"] - y)


async def goal_pose(bench: Bench) -> None:
    async with robot(bench) as poses:
        await publish(bench, GOAL_POSE, "PoseStamped", GOAL % (1.5, 0.5))

        await until(lambda: away(poses, 1.5, 0.5) < 0.1, "the robot has walked to the goal")


async def initial_pose(bench: Bench) -> None:
    async with robot(bench):
        told = bench.ours.listen(ROSOUT)
        await publish(bench, INITIAL_POSE, "PoseWithCovarianceStamped", ESTIMATE)
        await until(lambda: any("initial pose set" in line["msg"] for line in told), "the localizer takes it")


async def navigate_to_pose(bench: Bench) -> None:
    bench.ros.need("nav2_msgs")
    async with robot(bench) as poses:

        async def go(x: float, y: float, cancel_after: int = 0) -> Any:
            pose = {"header": {"frame_id": "map"}, "pose": {"position": {"x": x, "y": y}, "orientation": {"w": 1.0}}}
            return await their(bench, NAVIGATE_TO_POSE, {"pose": pose}, cancel_after)

        end = await go(1.5, 0.5)
        assert (end["status"], end["result"]) == (SUCCEEDED, {"error_code": 0, "error_msg": ""}), end
        assert away(poses, 1.5, 0.5) < 0.1, poses[-1]
        left = [feedback["distance_remaining"] for feedback in end["feedbacks"]]
        assert left[0] > 1.0 and left[-1] < 0.3, left
        assert {feedback["current_pose"]["header"]["frame_id"] for feedback in end["feedbacks"]} == {"map"}

        end = await go(0.0, 0.0, cancel_after=5)
        assert (end["canceling"], end["status"]) == (0, CANCELED), end
        assert end["result"]["error_msg"] == "Goal canceled", end
        assert away(poses, 0.0, 0.0) > 0.5, poses[-1]
