"""`replay`: plays the journal of a node, or of a subtree, to that alone, and says whether it does the same."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from actors.checks import create
from actors.replay.alone import check_alone, check_parameters, stop_at
from actors.replay.comparison import Difference
from actors.replay.driver import Driver
from actors.replay.encoding import thawed
from actors.replay.errors import ReplayError
from actors.replay.journaled_loop import journaled
from actors.replay.lives import replayed_path, tree_of
from actors.replay.parts import parts_of, whole
from actors.replay.recording import Recording, Start, named, starts_of, unlike_versions
from actors.replay.replay_loop import ReplayDeadlines, ReplayLoop
from actors.replay.replaying_boundary import ReplayingBoundary
from actors.runtime.runtime import Runtime
from actors.system import System

if TYPE_CHECKING:
    from actors.logs import LogSink
    from actors.replay.debugger import Break
    from actors.runtime.node import Node
    from actors.supervision.child import Child


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
    inner: tuple[Difference, ...] = ()
    """In a subtree, the first difference of each topic and so on between its nodes; they do not count for `equal`."""
    other_versions: tuple[str, ...] = ()
    """Which versions, of Python and of libraries that compute, are not those of the recording."""

    @property
    def equal(self) -> bool:
        """Whether the node, or the subtree as seen from outside, did bit for bit the same, to the end of the recording."""
        return not self.differences and not self.lacking


def load(path: str | os.PathLike[str], *, trust: bool = False) -> Recording:
    """The journal in a file that a `Journal` has written.

    Loading makes values of the classes that the file names, of modules that are imported, and calls no code of theirs but their checks. With
    `trust` it may: that is needed for arguments and checkpoints that pickle themselves in their own way. Raises `ReplayError` for another file.
    """
    try:
        recording = whole("", parts_of(Path(path).read_bytes()), trust=trust)
        recording.node = recording.start.journal
    except ReplayError as error:
        raise ReplayError(f"{path}: {error}") from error
    return recording


def replay(
    recording: Recording,
    *,
    changed: str | None = None,
    node: type[Node] | None = None,
    parameters: Mapping[str, object] | None = None,
    pause: tuple[str, int] | None = None,
    debugger: Callable[[], object] | None = None,
    every: bool = False,
    sinks: tuple[LogSink, ...] = (),
) -> Verdict:
    """Play the journal of a node to that node alone, or of a subtree to its nodes together and alone, on a clock that shows what the journal
    says, and compare what they send. Runs an event loop.

    `node` is played to in place of the recorded class, and `parameters` replace some with which it started; the replay then goes on behind
    the first difference, as with `every`, and finds the first one of each topic, service and so on. `changed` names the node that is meant,
    which a subtree with several needs. Nodes that do otherwise are given the rest of the recording at its instants. `pause` is a topic and
    a number: a debugger, that of `breakpoint()` or `debugger`, is started before the message with that number (from 0) is sent there.

    Raises `ReplayError` if a node cannot be made here, for a parameter that it does not have, and if Python's debugger was quit.
    """
    change = Change(recording, changed, node, parameters or {})
    for start in change.members.values():
        check_alone(change.declared(start))
    start = recording.start
    loop = ReplayLoop(start.origin, start.epoch, start.virtual)
    limit = 1_000_000 if change.made or every else 1
    stop = None if pause is None else stop_at(*pause, debugger)
    with asyncio.Runner(loop_factory=lambda: loop) as runner:
        driver = runner.run(_play(recording, loop, change.declared, stop, limit, sinks))
    if stop is not None:
        stop.check_over()
    boundary = driver.boundary
    return Verdict(
        recording.node, tuple(boundary.differences), sum(boundary.sent.values()), driver.inputs.lacking, driver.played.failure,
        tuple(boundary.inner), unlike_versions(start),
    )  # fmt: skip


class Change:
    """What a replay changes: the class, or parameters, of one node of the recording; or nothing.

    Raises `ReplayError` for a node that is not in the recording, or is not said although there are several, and for wrong parameters.
    """

    def __init__(
        self, recording: Recording, name: str | None, factory: type[Node] | None, parameters: Mapping[str, object]
    ) -> None:
        self.made = factory is not None or bool(parameters)
        self._recording, self._factory, self._parameters = recording, factory, parameters
        self.members = members = {start.node: start for start in reversed(starts_of(recording))}
        """How the first life of each node began."""
        self._node = next(iter(members)) if name is None and len(members) == 1 else named(members, name or "")
        if self._node is None and (self.made or name is not None):
            what = f"no node {name}" if name is not None else "several nodes: say which one is changed"
            raise ReplayError(f"the journal of {recording.node} has {what}; it has {', '.join(sorted(members))}")
        if self._node is not None:
            check_parameters(self.declared(members[self._node]), parameters)

    def declared(self, start: Start) -> Child:
        """The declaration of the node for a life that began so, with its arguments as they were."""
        child: Child = thawed(start.child, trust=self._recording.trusted)
        if start.node == self._node:
            own = dict(child.parameters) | dict(self._parameters)
            child = child.replace(parameters=own, factory=self._factory or child.factory)
        return child.replace(process=False)


async def _play(
    recording: Recording,
    loop: ReplayLoop,
    declared: Callable[[Start], Child],
    stop: Break | None,
    limit: int,
    sinks: tuple[LogSink, ...],
) -> Driver:
    start = recording.start
    journaled(loop)
    boundary = ReplayingBoundary(recording, stop, limit)
    deadlines = ReplayDeadlines(lambda: boundary.now)
    system = create(
        System, seed=start.seed, sinks=sinks, level=start.level, options=thawed(start.options, trust=recording.trusted),
        make_runtime=partial(Runtime, make_deadlines=lambda loop: deadlines),
    )  # fmt: skip
    system.runtime.distinguish(start.process)
    driver = Driver(system, loop, recording, declared, boundary, deadlines)
    await system.start(tree_of(recording), replayed_path(recording.root))
    loop.call_soon(driver.drive)
    try:
        await driver.over
    finally:
        loop.release()
        driver.boundary.let_go(loop)
        system.kill()
    return driver
