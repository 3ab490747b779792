"""Bags: 60 s of the whole robot recorded on the virtual clock, and what a message costs to write and to read.

The share of a core is the time of the processor that recording adds to the run, for each second of the robot's life.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from actors import Child, Supervisor, execute
from actors import run as run_tree
from actors.bag import BagReader, BagWriter, Recorder, RecordOptions, Selection, WriterOptions, topic_of
from actors.interfaces import encode
from actors.interfaces.sensor_msgs.msg import Imu
from tests.benchmarks import Contestant, Row, contest

SECONDS = 60.0
MESSAGES = 100_000
EVERYTHING = RecordOptions(selection=Selection(all_topics=True, all_actions=True))


def run() -> list[Row]:
    cost = [
        Contestant(f"chunks in {name}", "ours", lambda name=name: _written(name)) for name in ("zstd", "lz4", "none")
    ]
    return [*_robot(), *contest("an Imu of 324 bytes in CDR", ["us a message written", "us a message read"], cost)]


def _robot() -> list[Row]:
    """What recording adds to a run of the robot."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "walk"
        alone = _cpu(lambda: execute(_live, clock="virtual"))
        losses: list[int] = []

        async def recorded() -> None:
            recorder = Child(Recorder, args=(path, EVERYTHING))
            losses.append(await _live(recorder))

        both = _cpu(lambda: execute(recorded, clock="virtual"))
        with BagReader(path) as bag:
            messages, disk = bag.metadata.message_count, bag.size
            size = sum(len(one.data) for one in bag.messages())
    figures = {
        "messages lost": losses[0],
        "messages recorded": messages,
        "MB of messages a second": size / SECONDS / 1e6,
        "MB a second on the disk": disk / SECONDS / 1e6,
        "MB recorded a CPU second": size / 1e6 / max(1e-9, both - alone),
        "% of a core for recording and what is then published": 100 * (both - alone) / SECONDS,
    }
    workload = f"{SECONDS:g} s of the whole robot, everything recorded"
    return [Row(workload, "Recorder", unit, float(value), "ours") for unit, value in figures.items()]


async def _live(*beside: Child) -> int:
    """Run the robot for `SECONDS`, with these nodes before it; how many messages a recorder among them has lost."""
    from robot.assembly import Robot
    from robot.scenes.worlds import get_world

    robot = Robot(get_world("warehouse"), seed=1)
    try:
        async with run_tree(Supervisor("all", children=[*beside, robot.tree]), sinks=()) as system:
            await system.clock.sleep(SECONDS)
            if not beside:
                return 0
            recorder = system.node(Recorder)
            await recorder.finish()
            return recorder.dropped
    finally:
        robot.body.close()


def _cpu(work: Callable[[], object]) -> float:
    begin = time.process_time()
    work()
    return time.process_time() - begin


def _written(compression: str) -> list[float]:
    imu = topic_of("/imu", Imu)
    data = encode(Imu())
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "imu"

        def write() -> None:
            with BagWriter(path, WriterOptions(compression=compression)) as bag:
                for number in range(MESSAGES):
                    bag.write(imu, data, received_ns=number * 2_500_000, published_ns=number * 2_500_000)

        written = _cpu(write)
        with BagReader(path) as bag:
            read = _cpu(lambda: sum(1 for _ in bag.messages()))
    return [1e6 * written / MESSAGES, 1e6 * read / MESSAGES]
