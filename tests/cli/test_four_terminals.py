"""The fourth tutorial as its reader types it: a line for `.bashrc`, and four terminals, which then meet by DDS."""

from __future__ import annotations

import asyncio
import contextlib
import os
import re
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from tests.wires import meeting_place

pytest.importorskip("cyclonedds")
pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(sys.platform == "win32", reason="bash and its terminal are those of Linux and macOS"),
]

LINE = "export RMW_IMPLEMENTATION=rmw_cyclonedds_cpp"
ON_A_TERMINAL = "import pty; pty.spawn('bash')"


class Terminal:
    """An interactive bash on a terminal of its own."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self.text = ""
        self._process = process
        self._reading = asyncio.create_task(self._read())

    async def _read(self) -> None:
        assert self._process.stdout is not None
        while data := await self._process.stdout.read(65536):
            self.text += data.decode(errors="replace")

    def type(self, line: str, end: str = "\n") -> None:
        self.text = ""
        assert self._process.stdin is not None
        self._process.stdin.write((line + end).encode())

    async def shows(self, pattern: str) -> None:
        """Wait for it, after what was typed last."""
        try:
            async with asyncio.timeout(60):
                while not re.search(pattern, self.text) and not self._reading.done():
                    await asyncio.sleep(0.02)
        except TimeoutError:
            pass
        assert re.search(pattern, self.text), f"{pattern} was not shown:\n{self.text}"

    async def ends(self, code: int) -> None:
        """Press Ctrl-C, and wait until the command has ended with this code."""
        self.type("\x03", end="")
        self.type("echo ended with $?")
        await self.shows(rf"ended with {code}\b")

    async def close(self) -> None:
        self.type("exit")
        try:
            async with asyncio.timeout(20):
                await self._reading
        finally:
            with contextlib.suppress(ProcessLookupError):
                self._process.kill()
            await self._process.wait()


@asynccontextmanager
async def terminals(home: Path, port: int, count: int) -> AsyncIterator[list[Terminal]]:
    environment = {**os.environ, **meeting_place("dds", port), "ROS_DOMAIN_ID": "7", "HOME": str(home)}
    environment |= {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}", "TERM": "dumb"}
    del environment["RMW_IMPLEMENTATION"]
    opened: list[Terminal] = []
    try:
        for _ in range(count):
            pipe = asyncio.subprocess.PIPE
            opened.append(
                Terminal(
                    await asyncio.create_subprocess_exec(
                        sys.executable, "-c", ON_A_TERMINAL, env=environment, cwd=home, stdin=pipe, stdout=pipe
                    )
                )
            )
        yield opened
    finally:
        for one in opened:
            await one.close()


async def test_the_line_for_bashrc_and_the_four_terminals_of_the_tutorial_meet_by_dds(
    tmp_path: Path, port: int
) -> None:
    async with terminals(tmp_path, port, 1) as (first,):
        first.type("echo _${RMW_IMPLEMENTATION}_")
        await first.shows(r"\n__")
        first.type(f'echo "{LINE}" >> ~/.bashrc; echo written')
        await first.shows(r"\nwritten")
    assert (tmp_path / ".bashrc").read_text() == f"{LINE}\n"

    async with terminals(tmp_path, port, 4) as (imu, controller, voice, eyes):
        imu.type("robactor run my_robot_controller imu_publisher")
        await imu.shows("IMU Publisher started @ 200 Hz")
        controller.type("robactor run my_robot_controller robot_controller")
        await controller.shows("Robot Controller initialized")
        voice.type('robactor service call /robot/enable std_srvs/srv/SetBool "{data: true}"')
        await voice.shows("success=True, message='Robot enabled successfully'")
        voice.type("robactor topic pub /voice_command std_msgs/msg/String \"{data: 'forward'}\"")
        await voice.shows(r"publishing #1: std_msgs.msg.String\(data='forward'\)")
        eyes.type("echo $RMW_IMPLEMENTATION; robactor topic echo /cmd_vel")
        await eyes.shows(r"rmw_cyclonedds_cpp\s+linear:\s+x: [\s\S]*linear:\s+x: 1.0\s")
        await controller.shows("Executing: forward")
        await eyes.ends(130)
        eyes.type("robactor node list")
        await eyes.shows(r"/imu_publisher\s+/robot_controller\s")
        eyes.type("robactor topic info /cmd_vel")
        await eyes.shows(r"Type: geometry_msgs/msg/Twist\s+Publisher count: 1\s+Subscription count: 0")
        eyes.type("robactor topic hz /imu/data")
        await eyes.shows(r"average rate: \d+")
        await eyes.ends(130)
        await voice.ends(130)
        await imu.ends(130)
        await controller.ends(130)
