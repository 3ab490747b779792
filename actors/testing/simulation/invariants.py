"""What must hold whenever a simulated system is quiet: nothing can run until time passes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from actors.inbox import awaited_in

if TYPE_CHECKING:
    from actors.channel import Publisher, Queue
    from actors.inbox import Item
    from actors.system import System
    from actors.testing.simulation.lives import SimulatedSystem

__all__ = ["PATIENCE", "Invariant", "InvariantBroken", "Watch"]

Invariant = Callable[["System"], None]
"""Looks at a quiet system and raises `AssertionError` when something is wrong."""

PATIENCE = 10.0
"""Seconds after which a handler that keeps its node from everything else is taken to be stuck, and a canceled goal that goes on, too."""


class InvariantBroken(AssertionError):
    """A simulated system was in a state in which it must never be."""


class Watch:
    """Looks at a system in every quiet moment.

    Endpoints belong to living nodes, no handler holds its node for longer than `patience` seconds, and a goal that was asked to cancel
    ends within as many, and so does a task whose node has ended. Then what the user demands.
    """

    def __init__(self, system: SimulatedSystem, more: Sequence[Invariant] = (), patience: float = PATIENCE) -> None:
        self._system = system
        self._patience = patience
        self._more = tuple(more)
        self._version = -1
        self._next = 0.0
        self._holding: dict[str, tuple[Item, int, float]] = {}
        self._canceling: dict[object, float] = {}

    def __call__(self) -> None:
        system = self._system
        if system.stop_reason is None:
            now = system.loop.time()
            if now >= self._next:
                self._next = now + self._patience / 10.0
                self._look_at_handlers(now)
                self._look_at_goals(now)
                self._look_at_orphans(now)
            for invariant in self._more:
                invariant(system)
        if system.graph.version != self._version:
            self._version = system.graph.version
            self._look_at_graph()

    def _look_at_graph(self) -> None:
        """Nothing is published, heard or served by a node that has ended for good."""
        states = self._system.nodes.values()
        alive = {state.identity.fqn for state in states if state.state != "stopped"}
        gone = {state.identity.fqn for state in states} - alive
        for entry in self._system.graph.topics.values():
            endpoints: list[Publisher[Any] | Queue[Any]] = [*entry.publishers, *entry.subscriptions]
            for endpoint in endpoints:
                if endpoint.node.fqn in gone:
                    raise InvariantBroken(f"{endpoint!r} has outlived its node")

    def _look_at_handlers(self, now: float) -> None:
        for state in self._system.nodes.values():
            inbox, node = state.mailbox.inbox, state.identity.fqn
            item = inbox.current
            if item is None:
                self._holding.pop(node, None)
                continue
            held = self._holding.get(node)
            if held is None or held[0] is not item or held[1] != inbox.handled:
                self._holding[node] = (item, inbox.handled, now)
            elif now - held[2] > self._patience:
                where = f", at {awaited_in(inbox.task)}" if inbox.task is not None else ""
                raise InvariantBroken(
                    f"{item.label} of {node} is stuck: it has been waiting since t={held[2]:.3f} s{where}, "
                    f"and {len(inbox.items)} more items wait behind it"
                )

    def _look_at_goals(self, now: float) -> None:
        canceling: dict[object, float] = {}
        for state in self._system.nodes.values():
            for server in state.mailbox.actions.values():
                for goal in server.running:
                    if goal.canceling is None:
                        continue
                    since = canceling[goal] = self._canceling.get(goal, now)
                    if now - since > self._patience:
                        raise InvariantBroken(f"{goal!r} was asked to cancel at t={since:.3f} s and goes on")
        self._canceling = canceling

    def _look_at_orphans(self, now: float) -> None:
        bereaved = self._system.bereaved
        for core, since in list(bereaved.items()):
            if not core.tasks:
                del bereaved[core]
            elif now - since > self._patience:
                names = ", ".join(task.get_name() for task in core.tasks)
                raise InvariantBroken(f"{core.fqn} ended at t={since:.3f} s, and these tasks of it go on: {names}")
