"""`replay`: plays the journal of one node to that node alone, and says whether it does the same."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actors.replay.alone import check_alone, check_parameters, stop_at
from actors.replay.comparison import Difference
from actors.replay.driver import Driver
from actors.replay.encoding import thawed
from actors.replay.errors import ReplayError
from actors.replay.journal import seam_of
from actors.replay.parts import parts_of, whole
from actors.replay.tape import Tape
from actors.replay.tape_loop import TapeLoop
from actors.supervision.declarations import Child, Intensity, Supervisor
from actors.system import System

if TYPE_CHECKING:
    from actors.logs import LogSink
    from actors.node.node import Node
    from actors.replay.debugger import Break

__all__ = ["Verdict", "load", "replay"]


@dataclass(frozen=True, slots=True)
class Verdict:
    """What a replay has shown."""

    node: str
    differences: tuple[Difference, ...]
    """The first difference of each topic, service and so on, in the order in which they were found; empty if there is none."""
    compared: int
    """How many messages, calls, answers, log lines and so on were compared."""
    lacking: str
    """What came in that the journal does not carry, and with which the replay ended; empty if the replay is whole."""
    failure: str
    """The error with which the last life of the node ended; empty if it did not fail."""

    @property
    def equal(self) -> bool:
        """Whether the node did bit for bit the same, to the end of the recording."""
        return not self.differences and not self.lacking


def load(path: str | os.PathLike[str], *, trust: bool = False) -> Tape:
    """The journal in a file that a `Journal` has written.

    Loading imports the modules that the file names, makes values of their classes, and calls no code of theirs. With `trust` it may: that is
    needed for arguments and checkpoints that pickle themselves in their own way. Raises `ReplayError` for another file.
    """
    try:
        tape = whole("", parts_of(Path(path).read_bytes()), trust=trust)
        tape.node = tape.start.node
    except ReplayError as error:
        raise ReplayError(f"{path}: {error}") from error
    return tape


def replay(
    tape: Tape,
    *,
    node: type[Node] | None = None,
    parameters: Mapping[str, Any] | None = None,
    pause: tuple[str, int] | None = None,
    debugger: Callable[[], object] | None = None,
    every: bool = False,
    sinks: tuple[LogSink, ...] = (),
) -> Verdict:
    """Play a journal to its node alone, on a clock that shows what the journal says, and compare what it sends. Runs an event loop.

    `node` is played to in place of the recorded class, and `parameters` replace some with which it started; the replay then goes on behind
    the first difference, as with `every`, and finds the first one of each topic, service and so on. A node that does otherwise is given
    the rest of the recording at its instants. `pause` is a topic and a number: a debugger, that of `breakpoint()` or `debugger`,
    is started before the message with that number (from 0) is sent there.

    Raises `ReplayError` if the node cannot be made here, for a parameter that it does not have, and if Python's debugger was quit.
    """
    start = tape.start
    changed = node is not None or bool(parameters)

    def change(child: Child) -> Child:
        own = dict(child.parameters) | dict(parameters or {})
        return child.replace(process=False, parameters=own, factory=node or child.factory)

    child = change(thawed(start.child, trust=tape.trusted))
    check_alone(child)
    check_parameters(child, parameters or {})
    loop = TapeLoop(start.origin, start.epoch, start.virtual)
    limit = 1 if not (changed or every) else 1_000_000
    stop = None if pause is None else stop_at(*pause, debugger)
    with asyncio.Runner(loop_factory=lambda: loop) as runner:
        driver = runner.run(_play(tape, loop, change, stop, limit, sinks))
    if stop is not None:
        stop.check_over()
    edge = driver.edge
    return Verdict(
        start.node, tuple(edge.differences), sum(edge.sent.values()), driver.inputs.lacking, driver.played.failure
    )


async def _play(
    tape: Tape,
    loop: TapeLoop,
    change: Callable[[Child], Child],
    stop: Break | None,
    limit: int,
    sinks: tuple[LogSink, ...],
) -> Driver:
    start = tape.start
    system = System(seed=start.seed, sinks=sinks, level=start.level, options=thawed(start.options, trust=tape.trusted))
    system.runtime.distinguish(start.process)
    system.runtime.id_streams[start.node] = start.id_streams
    seam_of(loop)
    driver = Driver(system, loop, tape, change, stop, limit)
    child = change(thawed(start.child, trust=tape.trusted)).replace(
        restart="permanent", backoff=None, significant=False, stop="kill"
    )
    tree = Supervisor(start.path[-2], children=(child,), intensity=Intensity(1_000_000, within=1.0))
    starting = asyncio.ensure_future(system.start(tree, ("replay", *start.path[1:-1])))
    starting.add_done_callback(driver.give_up)
    loop.call_soon(driver.drive)
    try:
        await driver.over
    finally:
        loop.release()
        driver.edge.let_go(loop)
        system.kill()
        starting.cancel()
        await asyncio.wait([starting])
    return driver
