"""Two nodes of one name on a network: services, parameters and goals by that name reach either of them, so the log says it."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import Final

from actors.inbox.boundary import outside
from actors.names.names import is_hidden
from actors.runtime.joined import JOINED
from actors.runtime.runtime import Runtime
from actors.transport.protocol import RemoteNode

LASTS: Final = 10.0
"""Seconds for which both have to be there: a process that has crashed may seem alive for some time beside the one that takes its place."""


class SameNames:
    """Warns once for each name of this process's tree that a node of another process, one of `nodes`, has too.

    Invariant: `_timers` has a timer for each such node that has not been there for `LASTS` seconds.
    """

    def __init__(self, runtime: Runtime, nodes: Mapping[RemoteNode, None]) -> None:
        self._runtime = runtime
        self._nodes = nodes
        self._timers: dict[RemoteNode, asyncio.TimerHandle] = {}
        self._told: set[str] = set()

    def started(self, fqn: str) -> None:
        """A node of this process has started."""
        for node in self._nodes:
            if node.fqn == fqn:
                self.appeared(node)

    def appeared(self, node: RemoteNode) -> None:
        """A node of another process is there."""
        if self._is_twice(node) and node not in self._timers:
            with outside():
                self._timers[node] = self._runtime.loop.call_later(LASTS, self._look, node)

    def vanished(self, node: RemoteNode) -> None:
        """A node of another process has gone."""
        if (timer := self._timers.pop(node, None)) is not None:
            timer.cancel()

    def close(self) -> None:
        """Look no more."""
        for node in list(self._timers):
            self.vanished(node)

    def _is_twice(self, node: RemoteNode) -> bool:
        if node.fqn in self._told or is_hidden(node.fqn):
            return False
        life = self._runtime.directory.find(node.fqn)
        return life is not None and life.record.path[:1] != JOINED

    def _look(self, node: RemoteNode) -> None:
        del self._timers[node]
        if self._is_twice(node):
            self._told.add(node.fqn)
            self._runtime.log.warning(
                "another process has a node of this name", node_name=node.fqn, session=node.session,
                remedy="rename one: --ros-args -r __node:=NAME, or name= of its Child",
            )  # fmt: skip
