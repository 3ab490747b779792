"""`PlayedNodes`: the lives of replayed nodes, which begin and end when their recording says so."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING

from actors.errors import described
from actors.inbox.boundary import BOUNDARY
from actors.replay.encoding import thawed
from actors.replay.recording import Recording, Start, starts_of
from actors.runtime.interceptor import Interceptor
from actors.supervision.declarations import Supervisor
from actors.supervision.policy import Intensity
from actors.waiting import retrieve

if TYPE_CHECKING:
    from actors.replay.replaying_boundary import ReplayingBoundary
    from actors.runtime.incarnation import Incarnation
    from actors.runtime.runtime import NodeRecord
    from actors.supervision.child import Child
    from actors.supervision.peers import Life
    from actors.system import System

OFTEN = Intensity(1_000_000, within=1.0)


class PlayedNodes(Interceptor):
    """All replayed nodes, by their full names. It stands between them and their supervisors, which restart them at once and for ever.

    `declared(start)` gives the declaration of the node that is played to, for each recorded life.
    """

    def __init__(self, system: System, boundary: ReplayingBoundary, declared: Callable[[Start], Child]) -> None:
        self._system, self._boundary, self._declared = system, boundary, declared
        self._nodes: dict[str, PlayedNode] = {}

    def of(self, start: Start) -> PlayedNode:
        """The node of which a life begins so, made at the first one."""
        node = self._nodes.get(start.node)
        if node is None:
            node = self._nodes[start.node] = PlayedNode(self._system, self._boundary, start, self._declared)
        return node

    def life(self, path: tuple[str, ...], make: Callable[[], Life], /) -> Life:
        record = self._system.runtime.directory.records[path]
        return _PlayedLife(self._nodes[record.identity.fqn], record)

    def present(self, node: str) -> Incarnation | None:
        """The present or last life of a node; None before the first."""
        found = self._nodes.get(node)
        return None if found is None else found.present

    @property
    def failure(self) -> str:
        """The errors with which the last lives of the nodes ended, each behind the name of its node if there are several; empty without."""
        alone = len(self._nodes) == 1
        failures = [(name, node.failure) for name, node in self._nodes.items() if node.failure]
        return "; ".join(failure if alone else f"{name}: {failure}" for name, failure in failures)


class PlayedNode:
    """One replayed node. `start` is how its first life in the recording began.

    Invariants:

    - While the node lives, `alive` is true. Its next life waits for `_gate` from the moment on at which the supervisor asks for it.
    - `present` is its present or last life; None before the first.
    - `_asking` is the task that has its supervisor start it. From the first life that became ready on, the supervisor does that by itself.
    """

    def __init__(
        self, system: System, boundary: ReplayingBoundary, start: Start, declared: Callable[[Start], Child]
    ) -> None:
        self.present: Incarnation | None = None
        self.alive = False
        self.failure = ""
        """The error with which the last life of the node ended; empty if it did not fail."""
        self._system, self._boundary, self._declared = system, boundary, declared
        self._gate: asyncio.Future[Start] | None = None
        self._asking: asyncio.Task[object] | None = None
        self._kept = False
        system.runtime.id_streams[start.node] = start.id_streams

    @property
    def waiting(self) -> bool:
        """Whether the next life can begin."""
        return self._gate is not None

    def ask(self, start: Start) -> None:
        """See to it that the next life is asked for."""
        if self._kept or not (self._asking is None or self._asking.done()):
            return
        child = self._declared(start).replace(restart="permanent", backoff=None, significant=False, stop="kill")
        path, root = replayed_path(start.path[:-1]), self._system.supervisor
        assert root is not None
        supervisor = next(one for one in root.below() if one.path == path)
        self._asking = asyncio.get_running_loop().create_task(supervisor.start_child(child))
        self._asking.add_done_callback(retrieve)

    def begin(self, start: Start) -> None:
        """Let the next life begin."""
        assert self._gate is not None
        self._gate.set_result(start)

    async def live(self, record: NodeRecord, started: Callable[[], None]) -> None:
        """One life of the node, from the moment at which the recording begins it."""
        self._gate = asyncio.get_running_loop().create_future()
        start = await self._gate
        self._gate, self.failure = None, ""
        self._prepare(record, start)
        token = BOUNDARY.set(self._boundary)
        try:
            self.present = self._system.runtime.incarnate(self._declared(start), record)
        except BaseException as error:
            self._fails(error)
            raise
        finally:
            BOUNDARY.reset(token)
        self.alive = True
        try:
            await self._boundary.live(self.present, self.present, lambda: self._is_ready(started))
        except BaseException as error:
            self._fails(error)
            raise
        finally:
            self.alive = False

    def _is_ready(self, started: Callable[[], None]) -> None:
        self._kept = True
        started()

    def _fails(self, error: BaseException) -> None:
        if not self._boundary.over:  # else it is the end of the replay that ends it
            self.failure = described(error)

    def _prepare(self, record: NodeRecord, start: Start) -> None:
        """Let the record be as it was when the life began."""
        runtime = self._system.runtime
        runtime.enter(record.child, record.path)  # it may have given up its name
        if (
            record.incarnation != start.incarnation - 1
        ):  # it had lived before the recording, or was forgotten and added again
            runtime.renew(record)
            record.incarnation, record.saved = (
                start.incarnation - 1,
                thawed(start.saved, trust=self._boundary.recording.trusted),
            )
            record.asked_state = start.state
        self._boundary.members[start.node] = record.inbox


class _PlayedLife:
    """One life of a replayed node, for its supervisor."""

    def __init__(self, played: PlayedNode, record: NodeRecord) -> None:
        self._played = played
        self._record = record

    async def run(self, started: Callable[[], None], /) -> None:
        await self._played.live(self._record, started)

    def stop(self, reason: str, /) -> None:
        """Do nothing: only the recording stops a replayed node, and the end of the replay kills it."""


def replayed_path(path: tuple[str, ...]) -> tuple[str, ...]:
    """The path in a replay of what had this path in the recording."""
    return ("replay", *path[1:])


def tree_of(recording: Recording) -> Supervisor:
    """The supervisors of the nodes of a recording, still without nodes. Its path is that of `recording.root`."""
    depth = len(recording.root)
    return _supervisor(recording.root[-1], {start.path[depth:-1] for start in starts_of(recording)})


def _supervisor(name: str, below: set[tuple[str, ...]]) -> Supervisor:
    """A supervisor that has a supervisor at the end of each of these paths."""
    names = sorted({path[0] for path in below if path})
    children = tuple(_supervisor(each, {path[1:] for path in below if path[:1] == (each,)}) for each in names)
    return Supervisor(name, children=children, intensity=OFTEN)
