"""What `robactor check` looks at: each check returns what it found, measured here and now."""

from __future__ import annotations

import asyncio
import os
import shutil
import socket
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import Final

import numpy as np

from actors import execute, run
from actors.transport import WireUnavailable, transport_from_environment
from cli.verbs.doctor.observation import Finding
from robot.assembly import Robot
from robot.estimation.patches import patches
from robot.model.footprint import Footprint
from robot.nodes.map_files import InvalidMap, read_map
from robot.sim.physics import BackendMissing

WALK: Final = 6.0
"""Simulated seconds of the robot's walk that are timed."""
ENOUGH, SCARCE = 0.5, 0.8
"""Shares of a core that the robot may take: beyond the first there is little left for anything else, beyond the second it is too slow."""
TICKS, PERIOD = 400, 0.005
"""The control loop's ticks that are watched, and its period, s."""
LATE, TOO_LATE = 0.002, 0.005
"""How late the worst of 100 ticks may be, s."""
MEMINFO: Final = Path("/proc/meminfo")
MEMORY, DISK = 1e9, 1e9
"""Bytes that a robot, and its bags, should find free."""
PORT = 8765
COARSE = 0.1
"""A cell of a map that is larger hides gaps that the robot fits through, m."""
CONNECTED = 0.9
"""The share of a map's free floor that should be one place."""


def engine() -> Iterable[Finding]:
    """Whether the physics can be had."""
    try:
        Robot("empty").close()
    except BackendMissing as error:
        yield Finding("physics", "the robot cannot be simulated", str(error), "or run it with --backend kinematic")


def speed() -> Iterable[Finding]:
    """What the walking robot takes of a core."""
    robot = Robot("warehouse", mission="patrol", seed=1)

    async def walk() -> float:
        async with run(robot.tree, sinks=(), signals=False):
            await asyncio.sleep(WALK)
            begun = time.process_time()
            await asyncio.sleep(WALK)
            return (time.process_time() - begun) / WALK

    try:
        share = execute(walk, clock="virtual")
    finally:
        robot.close()
    if share > ENOUGH:
        slow = share > SCARCE
        yield Finding(
            "speed",
            "this machine is too slow for the robot on the real clock" if slow else "there is little reserve",
            f"the walking robot takes {share:.0%} of a core; {ENOUGH:.0%} leaves room for your own nodes",
            "--clock virtual, --backend kinematic, or a faster machine",
            "problem" if slow else "note",
        )


def punctuality() -> Iterable[Finding]:
    """How late a loop of 200 Hz wakes up on this machine."""

    async def ticks() -> float:
        loop = asyncio.get_running_loop()
        begun = loop.time()
        late: list[float] = []
        for number in range(1, TICKS + 1):
            due = begun + number * PERIOD
            await asyncio.sleep(max(0.0, due - loop.time()))
            late.append(loop.time() - due)
        return float(np.percentile(late, 99))

    worst = asyncio.run(ticks())
    if worst > LATE:
        yield Finding(
            "punctuality",
            "other programs hold up a control loop of 200 Hz",
            f"one tick in 100 is more than {worst * 1e3:.1f} ms late",
            "end other programs, or run --processes with real-time priority (docs/howto/slow-machine.md)",
            "problem" if worst > TOO_LATE else "note",
        )


def _available() -> int | None:
    """The bytes that new programs can have: free memory, and what the system keeps of files and gives back; None where nothing tells."""
    with suppress(OSError, KeyError):
        lines = dict(line.split(":", 1) for line in MEMINFO.read_text(encoding="ascii").splitlines())
        return int(lines["MemAvailable"].split()[0]) * 1024
    return None


def room() -> Iterable[Finding]:
    """Memory, disk and the page's port."""
    available = _available()
    if available is not None and available < MEMORY:
        yield Finding("memory", "little is free", f"{available / 1e9:.1f} GB", "end other programs", "note")
    free = shutil.disk_usage(".").free
    if free < DISK:
        yield Finding("disk", "bags soon fill it", f"{free / 1e9:.1f} GB are free in {os.getcwd()}", level="note")
    with socket.socket() as one:
        try:
            one.bind(("127.0.0.1", PORT))
        except OSError as error:
            remedy = "the page takes the next free port; --web PORT chooses one"
            yield Finding("port", f"port {PORT} is in use", str(error.strerror), remedy, "note")


def network() -> Iterable[Finding]:
    """Whether the environment names a transport that can be had."""
    try:
        transport_from_environment(os.environ)
    except WireUnavailable as error:
        yield Finding("network", "no transport can be opened", str(error))


def map_file(path: Path) -> Callable[[], Iterable[Finding]]:
    """Whether the robot can walk on this map."""

    def examine() -> Iterable[Finding]:
        try:
            grid = read_map(path).grid()
        except (InvalidMap, OSError) as error:
            yield Finding("map", "it cannot be read", str(error), "see docs/reference/robot.md for what is read")
            return
        if grid.resolution > COARSE:
            measured = f"cells of {grid.resolution:g} m"
            yield Finding("map", "gaps are hidden", measured, f"map it with cells of at most {COARSE:g} m", "note")
        walkable = grid.clearance > Footprint().inscribed
        if not walkable.any():
            yield Finding(
                "map", "the robot fits nowhere", f"it is {2 * Footprint().inscribed:g} m wide", "check `resolution`"
            )
            return
        share = max(patch.size for patch in patches(walkable)) / int(walkable.sum())
        if share < CONNECTED:
            yield Finding(
                "map",
                "parts of the floor cannot be reached from each other",
                f"the largest has {share:.0%} of it",
                "a door may be narrower than the robot, or its pixels grey: see `free_thresh`",
                "note",
            )

    return examine
