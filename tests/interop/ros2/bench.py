"""What a check works with: a system of ours, programs of ROS 2, and the command ``ros2``, all on the loopback interface, out of the way of others."""

from __future__ import annotations

import asyncio
import os
import random
import shutil
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, TypeAlias

from actors import Child
from actors.transport import transport_from_environment
from tests.actors.transport.zenoh.wires import free_port
from tests.interop.parties import PATIENCE, Ours, Program, our_system

MIDDLEWARES: Final = {"zenoh": "rmw_zenoh_cpp", "cyclonedds": "rmw_cyclonedds_cpp", "fastrtps": "rmw_fastrtps_cpp"}


class NoRos(Exception):
    """There is no ROS 2 here; the text says what is missing."""


class NotInstalled(Exception):
    """This ROS 2 lacks a package that the check needs."""


@dataclass(frozen=True)
class Ros:
    """An installed ROS 2, whose environment this process has."""

    command: str
    """The path of ``ros2``; empty with the wheels of PyPI, which lack it."""
    python: str
    """The interpreter that has rclpy."""
    middleware: str = "zenoh"
    """One of `MIDDLEWARES`."""
    router: str = ""
    """The path of ``rmw_zenohd``."""

    def need(self, package: str) -> None:
        """Raises NotInstalled."""
        if not any((folder / "share" / package).is_dir() for folder in prefixes()):
            raise NotInstalled(f"{package} is not installed")


def prefixes() -> list[Path]:
    return [Path(folder) for folder in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if folder]


def find_ros(middleware: str = "zenoh") -> Ros:
    """The ROS 2 of AMENT_PREFIX_PATH. ROBACTOR_ROS2_PYTHON names its interpreter, if that of ``ros2`` is not it. Raises NoRos."""
    package = MIDDLEWARES[middleware]
    folders = prefixes()
    if not folders:
        raise NoRos("AMENT_PREFIX_PATH is not set: source /opt/ros/DISTRO/setup.bash first")
    command = shutil.which("ros2")
    if command is None:
        raise NoRos("there is no command ros2 on PATH: install ros2cli")
    homes = [folder for folder in folders if (folder / "share" / package).is_dir()]
    if not homes:
        raise NoRos(f"{package} is not installed: install ros-DISTRO-{package.replace('_', '-')}")
    first = Path(command).read_text(encoding="utf-8", errors="replace").splitlines()[0]
    own = first.removeprefix("#!").split()[-1]
    python = os.environ.get("ROBACTOR_ROS2_PYTHON") or (shutil.which(own) or "/usr/bin/python3")
    return Ros(command, python, middleware, str(homes[0] / "lib" / package / "rmw_zenohd"))


@dataclass
class Bench:
    ros: Ros
    ours: Ours
    environment: dict[str, str]
    """What programs of ROS 2 need to meet our system."""
    own: dict[str, str]
    """What our own programs need."""
    unclosed: int = 0
    """How often ``ros2`` could not close its session."""
    _programs: dict[str, Program] = field(default_factory=dict[str, Program])

    async def peer(self, name: str = "peer", *more: str) -> Program:
        """A node ``/ros/NAME`` of rclpy in a process of its own; the same one for the same name."""
        if name not in self._programs:
            start = Program.start(self.ros.python, "with_rclpy", name, *more, **self.environment)
            self._programs[name] = await start
        return self._programs[name]

    async def run(self, *arguments: str, seconds: float = PATIENCE, enough: str = "") -> str:
        """What ``ros2 ARGUMENTS`` writes. With `enough`, it is ended as soon as it has written that. Raises AssertionError if it fails."""
        process = await asyncio.create_subprocess_exec(
            self.ros.python, self.ros.command, *arguments,
            stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.STDOUT, env={**os.environ, **self.environment},
        )  # fmt: skip
        assert process.stdout is not None
        text = ""
        try:
            async with asyncio.timeout(seconds):
                async for line in process.stdout:
                    text += line.decode()
                    if enough and enough in text:
                        return text
                code = await process.wait()
        except TimeoutError:
            raise AssertionError(f"ros2 {' '.join(arguments)}: still running after {seconds:g} s\n{text}") from None
        finally:
            if process.returncode is None:
                process.kill()
                await process.wait()
        if code == 1 and "Failed to close the session" in text and not enough:
            self.unclosed += 1  # it has done what it should; its Zenoh session gave up closing after 10 s
            return text
        assert code == 0 and not enough, f"ros2 {' '.join(arguments)}: exit code {code}\n{text}"
        return text

    async def shows(self, *arguments: str, parts: tuple[str, ...]) -> str:
        """What ``ros2 ARGUMENTS`` writes, as soon as it contains all of `parts`; it is asked several times, as discovery takes a moment."""
        why = ""
        for _ in range(5):
            try:
                text = await self.run(*arguments)
            except AssertionError as error:  # some commands end with 1 for what is not known yet
                why = str(error)
                continue
            missing = [part for part in parts if part not in text]
            if not missing:
                return text
            why = f"ros2 {' '.join(arguments)} does not show {missing}:\n{text}"
        raise AssertionError(why)

    async def with_daemon(self, *arguments: str, parts: tuple[str, ...]) -> str:
        """As `shows`, for a command that cannot look for nodes itself long enough, but asks the daemon of ROS 2."""
        await self.run("daemon", "stop")
        await self.run("daemon", "start")
        try:
            return await self.shows(*arguments, parts=parts)
        finally:
            await self.run("daemon", "stop")

    async def end(self) -> None:
        for program in self._programs.values():
            await program.end()


Check: TypeAlias = Callable[[Bench], Awaitable[None]]


@asynccontextmanager
async def bench(ros: Ros, *nodes: Child, with_router: bool = False) -> AsyncIterator[Bench]:
    """A bench with a system of ours that has these nodes, besides ``/ours/robot``. Nothing of the user's own network is touched.

    With Zenoh all meet at our gossip point, or, `with_router`, at the router of ROS 2; with DDS in a domain of their own.
    """
    port = free_port()
    shared = {"RMW_IMPLEMENTATION": MIDDLEWARES[ros.middleware], "ROS_DOMAIN_ID": "0"}
    theirs, transport = {"RUST_LOG": "off", "PYTHONUNBUFFERED": "1"}, None
    if ros.middleware == "zenoh":
        theirs["ZENOH_CONFIG_OVERRIDE"] = (
            f'connect/endpoints=["tcp/127.0.0.1:{port}"];listen/endpoints=["tcp/127.0.0.1:0"]'
        )
        own = {**shared, "ROBACTOR_GOSSIP_PORT": str(port)}
    else:
        shared |= {"ROS_DOMAIN_ID": str(random.randrange(1, 100)), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        own = shared
        transport = transport_from_environment(own)
    os.environ["ROS_DOMAIN_ID"] = shared["ROS_DOMAIN_ID"]  # of our own system, too
    async with AsyncExitStack() as stack:
        if with_router:
            await stack.enter_async_context(_router(ros, port))
        ours = await stack.enter_async_context(our_system(port, *nodes, transport=transport))
        one = Bench(ros, ours, {**shared, **theirs}, own)
        stack.push_async_callback(one.end)
        yield one


@asynccontextmanager
async def _router(ros: Ros, port: int) -> AsyncIterator[None]:
    own = {"ZENOH_CONFIG_OVERRIDE": f'listen/endpoints=["tcp/127.0.0.1:{port}"]', "RUST_LOG": "off"}
    process = await asyncio.create_subprocess_exec(
        ros.router, stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.DEVNULL, env={**os.environ, **own}
    )
    try:
        while not await _listens(port):
            assert process.returncode is None, "rmw_zenohd has ended"
        yield
    finally:
        process.kill()
        await process.wait()


async def _listens(port: int) -> bool:
    try:
        _, writer = await asyncio.open_connection("127.0.0.1", port)
    except OSError:
        await asyncio.sleep(0.1)
        return False
    writer.close()
    return True
