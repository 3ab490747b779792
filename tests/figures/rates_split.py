"""The runs of `tests.figures rates` with the robot in processes: body, control and the other concerns each in one, listeners in this one."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Generator
from contextlib import ExitStack, contextmanager
from functools import partial
from time import perf_counter
from typing import Final

from actors import Child, System, execute, run
from robot.assembly import Robot
from robot.link.priority import SWITCH
from robot.link.process import BodyProcess
from robot.link.records import Order, read_command
from tests.figures.load import busy, family, processor_seconds
from tests.figures.rates_run import (
    CAMERA,
    TOPICS,
    WARM_UP,
    Clockwork,
    Punctuality,
    Run,
    at_rate,
    clockwork_rates,
    listen,
    listener_in,
    punctuality,
    restarts_in,
)

LOOK: Final = 0.05
"""Seconds between two looks at the commands that have reached the drives; they wait for more than 2 s."""
SETTLE: Final = 0.5


class Commands:
    """Notes when targets were sent to the drives, from where they arrive, so that nobody is kept from sending."""

    def __init__(self, process: BodyProcess) -> None:
        self._ring = process.body.segment.commands
        self._read = self._ring.written
        self.times: list[float] = []

    async def note(self) -> None:
        """Go on until canceled."""
        while True:
            for number, record in self._ring.after(self._read):
                self._read = number
                command = read_command(record)
                if command.order is Order.TARGETS:
                    self.times.append(command.at)
            await asyncio.sleep(LOOK)


def run_split(seed: int, duration: float, loops: int = 0, rate: float = 200.0, *, fifo: bool = True) -> Run:
    """The whole robot in processes, on its patrol, in physics: for `duration` seconds alone, as long with listeners on all sensors but the camera, and
    on all. What they hear goes over the network, which nobody of the robot needs: of its 200 Hz streams none leaves its process otherwise.

    Its control loop runs `rate` times a second. Without `fifo` no process asks for real-time scheduling.

    Meanwhile so many endless loops run on the only processor that all of them may use; without any, nothing holds them to one.
    """
    found: list[Run] = []

    async def main(strangers: frozenset[int]) -> None:
        robot = Robot("warehouse", mission="patrol", seed=seed, processes=True)
        assert robot.process is not None
        robot.process.body.real_time = True  # what is measured is how punctual its control is
        try:
            robot.process.ready()
            async with run(at_rate(robot.tree, rate), seed=seed, sinks=()) as system:
                found.append(await _measure(system, robot.process, duration, rate, strangers))
        finally:
            robot.close()

    with busy(loops) as strangers, _scheduled(fifo):
        execute(partial(main, strangers))
    return found[0]


@contextmanager
def _scheduled(fifo: bool) -> Generator[None]:
    """Have the processes that are started meanwhile ask for real-time scheduling, or not."""
    before = os.environ.get(SWITCH)
    os.environ[SWITCH] = str(int(fifo))
    try:
        yield
    finally:
        if before is None:
            del os.environ[SWITCH]
        else:
            os.environ[SWITCH] = before


async def _measure(
    system: System, process: BodyProcess, duration: float, rate: float, strangers: frozenset[int]
) -> Run:
    await system.clock.sleep(WARM_UP)
    shares, _ = await _shares(system, process, duration, strangers)
    await system.join(Child(Clockwork))
    node = await listener_in(system, "none")
    commands = Commands(process)
    noting = asyncio.ensure_future(commands.note())
    try:
        with ExitStack() as stack:
            streams = listen(stack, node, [name for name in TOPICS if name not in CAMERA])
            await system.clock.sleep(SETTLE)
            quiet_shares, _ = await _shares(system, process, duration, strangers)
            streams |= listen(stack, node, CAMERA)
            await system.clock.sleep(SETTLE)
            commands.times.clear()
            before = {name: stream.received for name, stream in streams.items()}
            busy_shares, wall = await _shares(system, process, duration, strangers)
            rates = {name: (stream.received - before[name]) / wall for name, stream in streams.items()}
    finally:
        noting.cancel()
    control: Punctuality = punctuality(commands.times, rate)
    rates |= {"control loop": control.rate} | clockwork_rates(system)
    quiet, share, alone = (sum(one.values()) for one in (quiet_shares, busy_shares, shares))
    return Run(rates, control, quiet, share, alone, int(process.body.truth().fallen), shares, restarts_in(system))


async def _shares(
    system: System, process: BodyProcess, duration: float, strangers: frozenset[int]
) -> tuple[dict[str, float], float]:
    """Processor time of each process but `strangers` by wall time while `duration` seconds pass, per cent; and how long they were."""
    names = {record.process: record.path[1] for record in system.nodes.values() if record.process}
    names |= {process.pid: "body", os.getpid(): "this one"}
    processes = family(os.getpid()) - strangers
    wall, before = perf_counter(), {one: processor_seconds({one}) for one in processes}
    await system.clock.sleep(duration)
    wall = perf_counter() - wall
    shares: dict[str, float] = {}
    for one in processes:
        name = names.get(one, "others")
        shares[name] = shares.get(name, 0.0) + 100.0 * max(0.0, processor_seconds({one}) - before[one]) / wall
    return shares, wall
