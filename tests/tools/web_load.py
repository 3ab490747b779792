"""`python -m tests.tools.web_load`: what the web server costs while clients read the whole robot, as a share of one core.

The robot runs in processes, so that the server has one of its own, whose processor time is read from the system. It is printed for a server
that nobody reads, for one that sends what the page's robot pane shows, for one that sends every topic but pictures and clouds of points, and
for one that sends the camera's compressed picture, too. The figure is processor time for each second that has passed: a machine that is busy
with something else makes it no larger, as long as all messages are sent; so their number is printed beside it.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import sys
from asyncio.subprocess import DEVNULL, PIPE, Process, create_subprocess_exec
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any, Final

from websockets.asyncio.client import ClientConnection, connect

from tests.figures.load import processor_seconds

LARGE: Final = frozenset(f"sensor_msgs/msg/{name}" for name in ("Image", "CompressedImage", "PointCloud2"))
PICTURE: Final = "/camera/rgb/compressed"
ROBOT_PANE: Final = frozenset(
    (
        "/robot_description", "/joint_states", "/lidar/scan", "/map", "/plan", "/odom", "/battery_state", "/gait_status", "/drive_status",
        "/safety/state", "/foot_contacts", "/motor_power", "/tf", "/tf_static", "/localization", "/elevation",
    )
)  # fmt: skip

CASES: Final[dict[str, Callable[[Any], bool]]] = {
    "nobody reads": lambda channel: False,
    "the robot pane": lambda channel: channel["topic"] in ROBOT_PANE,
    "IMU, LiDAR and joints": lambda channel: channel["topic"] in ("/imu/data", "/lidar/scan", "/joint_states"),
    "every topic but pictures": lambda channel: channel["schemaName"] not in LARGE,
    "and the camera's picture": lambda channel: channel["schemaName"] not in LARGE or channel["topic"] == PICTURE,
}
"""Which channels a client subscribes to."""
SETTLE: Final = 1.0
"""Seconds after the subscriptions, before anything is counted."""


@dataclass(frozen=True)
class Served:
    """A robot that runs in processes."""

    url: str
    server: int
    """The process of its web server."""


@dataclass(frozen=True)
class Load:
    """What the server has done for one client."""

    case: str
    channels: int
    rate: float
    """Messages a second."""
    kilobytes: float
    """Kilobytes a second."""
    share: float
    """Processor time of the server for each second, both in seconds."""

    def __str__(self) -> str:
        return f"{self.case:26} {self.channels:3} topics {self.rate:7.0f} messages/s {self.kilobytes:7.0f} kB/s  {100 * self.share:5.1f} % of a core"


@asynccontextmanager
async def robot_served(*options: str) -> AsyncIterator[Served]:
    """A robot that walks its rounds in processes, with its web server on any free port."""
    command = ["-m", "robot", "run", "--processes", "--web", "0", "--log-format", "json", *options]
    robot = await create_subprocess_exec(sys.executable, *command, stdout=DEVNULL, stderr=PIPE)
    try:
        async with asyncio.timeout(60.0):
            served = await _served(robot)
        drained = asyncio.ensure_future(_drain(robot))
        yield served
        drained.cancel()
    finally:
        if robot.returncode is None:
            robot.terminate()
        await robot.wait()


async def _served(robot: Process) -> Served:
    assert robot.stderr is not None
    async for line in robot.stderr:
        said = json.loads(line)
        if said.get("event") == "web page":
            return Served(said["url"], said["process"])
    raise RuntimeError("the robot has ended before it served a page")


async def _drain(robot: Process) -> None:
    assert robot.stderr is not None
    async for _ in robot.stderr:
        pass


async def measure(served: Served, case: str, seconds: float) -> Load:
    """Read the topics of a case, and what the server needs for it."""
    async with connect(served.url.replace("http", "ws", 1), subprotocols=["foxglove.sdk.v1"], max_size=None) as socket:  # type: ignore[list-item]
        wanted = [channel for channel in await _channels(socket) if CASES[case](channel)]
        newest = case == "the robot pane"
        subscriptions = [
            {"id": number, "channelId": one["id"], "newest": newest} for number, one in enumerate(wanted, start=1)
        ]
        await socket.send(json.dumps({"op": "subscribe", "subscriptions": subscriptions}))
        await _read(socket, SETTLE)
        loop = asyncio.get_running_loop()
        begun, spent = loop.time(), processor_seconds({served.server})
        messages, size = await _read(socket, seconds)
        passed, spent = loop.time() - begun, processor_seconds({served.server}) - spent
    return Load(case, len(wanted), messages / passed, size / passed / 1e3, spent / passed)


async def _channels(socket: ClientConnection) -> list[Any]:
    """What is advertised, until nothing has come for a second."""
    found: list[Any] = []
    while True:
        try:
            async with asyncio.timeout(1.0):
                frame = await socket.recv()
        except TimeoutError:
            return found
        said = json.loads(frame)
        if said["op"] == "advertise":
            found += said["channels"]


async def _read(socket: ClientConnection, seconds: float) -> tuple[int, int]:
    """The number and size in bytes of the messages that come within a time."""
    messages = size = 0
    try:
        async with asyncio.timeout(seconds):
            async for frame in socket:
                if isinstance(frame, bytes):
                    messages += 1
                    size += len(frame)
    except TimeoutError:
        pass
    return messages, size


async def _main(seconds: float) -> None:
    async with robot_served() as served:
        for case in CASES:
            print(await measure(served, case, seconds), flush=True)


def main(argv: list[str] | None = None) -> None:
    """Print a line for each case."""
    parser = argparse.ArgumentParser(prog="python -m tests.tools.web_load", description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=20.0, help="how long each case is measured (20)")
    asyncio.run(_main(parser.parse_args(argv).seconds))


if __name__ == "__main__":
    main()
