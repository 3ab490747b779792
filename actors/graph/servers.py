"""The names of services and actions in the graph: who serves each, and who waits for a server."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, Final, Generic, TypeVar

from actors.errors import ActionUnavailable, NodeRestarting, NotRunning, ServiceUnavailable
from actors.inbox.boundary import asked
from actors.suggest import near_name
from actors.waiting import Waiters

if TYPE_CHECKING:
    from actors.actions.peers import ActionPeer  # in a quoted base class
    from actors.graph.graph import Graph
    from actors.services.peers import ServicePeer  # in a quoted base class

S = TypeVar("S", bound="ServicePeer | ActionPeer")


class ServerEntry(Generic[S]):
    """One service or action name of the graph: its server, and the tasks that wait for one.

    A process has at most one server of a name; further ones may be in other processes. Callers use the one of this process, and without it
    the first of the others.

    Invariants:

    * `server` is `local`, or the first of `remotes`, or None. While the server of this process is being restarted, it is None.
    * At most one of `server`, `restarting` and `stopped` is set. For a name that is new, none is.
    * While `server` is set, `waiters` is empty.
    * `graph` holds this entry by its name until it is dropped. A dropped entry serves only to find its successor (`current`).
    """

    __slots__ = ("clients", "graph", "local", "name", "remotes", "restarting", "server", "stopped", "waiters")

    kind: ClassVar[str]
    """"service" or "action"."""
    missing: ClassVar[type[ServiceUnavailable] | type[ActionUnavailable]]
    """The error for a caller that has found no server in time."""

    def __init__(self, graph: Graph, name: str) -> None:
        self.graph: Final = graph
        self.name: Final = name
        self.server: S | None = None
        """The server that callers use."""
        self.local: S | None = None
        """The present server of this process, or None."""
        self.remotes: dict[S, None] = {}
        """The servers of other processes, in the order in which they were found."""
        self.restarting: tuple[str, int] | None = None
        """(node, incarnation) of a server of this process whose node has ended and may be started again."""
        self.stopped: str | None = None
        """The node that served this name and has stopped for good."""
        self.clients: dict[str, int] = {}
        """The nodes that are clients of this name; for an action, with the number of goals that each has started."""
        self.waiters: Waiters | None = None
        """The tasks that wait for a server; None until the first one does."""

    def open(self, server: S) -> None:
        """Register `server` as the server of this process, and wake the tasks that wait for one."""
        self.local = server
        self.restarting = None
        self._choose()
        self._changed()

    def pause(self, node: str, incarnation: int) -> None:
        """Record that the server's node has ended. It may be started again."""
        self.local = self.server = None
        self.restarting = (node, incarnation)
        self._changed()

    def close(self, node: str) -> None:
        """Record that the server's node has ended for good."""
        self.local = self.restarting = None
        self.stopped = node
        self._choose()
        self._changed()

    def withdraw(self) -> None:
        """Remove the server, which may be opened again on demand."""
        self.local = None
        self._choose()

    def add_remote(self, server: S) -> None:
        """Add a server of another process, and wake the tasks that wait for one."""
        self.remotes[server] = None
        self._choose()
        self.graph.changed()

    def remove_remote(self, server: S, node: str) -> None:
        """Undo `add_remote`, because `node`, which served this name there, has stopped or is lost."""
        del self.remotes[server]
        if self.server is server:
            self.stopped = node
            self._choose()
        self.graph.changed()

    def _choose(self) -> None:
        """Decide which server callers use."""
        self.server = None
        if self.restarting is None:
            self.server = self.local if self.local is not None else next(iter(self.remotes), None)
        if self.server is not None:
            self.stopped = None
            if self.waiters:
                self.waiters.wake_all()

    def _changed(self) -> None:
        self.graph.changed()
        for watcher in self.graph.watchers:
            watcher.server_changed(self)

    def forget(self, node: str) -> None:
        """Forget `node`, which has ended for good.

        A name without a server and without waiting tasks then leaves the graph, if `node` served it or no client is left.
        """
        self.clients.pop(node, None)
        served = self.stopped == node or self.name.startswith(f"{node}/")
        absent = self.server is None and self.restarting is None and not self.waiters
        if absent and (served or not self.clients):
            self.graph.drop(self)

    async def available(self) -> S:
        """Return the server, waiting until there is one."""
        while self.server is None:
            if self.waiters is None:
                self.waiters = Waiters()
            await self.waiters.wait()
        return self.server

    async def require(self) -> S:
        """Return the server. Waits for the first server of the name, but not for one that has ended.

        Raises `NodeRestarting` between two incarnations of its node, and `NotRunning` if its node has stopped for good.
        """
        if self.server is None and (self.restarting is not None or self.stopped is not None):
            # One that catches the error and asks again at once must not keep all others, and the signals, from their turn.
            await asyncio.sleep(0)
        if self.server is None:
            if self.restarting is not None:
                raise NodeRestarting(*self.restarting)
            if self.stopped is not None:
                raise NotRunning(
                    f"{self.stopped}, which served {self.name}, has stopped: start it again, or ask another {self.kind}"
                )
        return await self.available()

    def unavailable(self, seconds: float, type: str = "") -> ServiceUnavailable | ActionUnavailable:
        """The error for a caller that has found no server, of the named type if given, within `seconds`."""
        asked = f"{self.name} [{type}]" if type else self.name
        return self.missing(
            f"nobody serves {asked} after {seconds:g} s: start its node, or check the name and namespace{self.meant()}"
        )

    def meant(self) -> str:
        """``; did you mean '/add'?`` if something of nearly this name is served; else empty."""
        return asked(self._meant)

    def _meant(self) -> str:
        entries: Mapping[str, ServiceEntry] | Mapping[str, ActionEntry] = (
            self.graph.services if self.kind == "service" else self.graph.actions
        )
        return near_name(self.name, [name for name, entry in entries.items() if entry.server is not None])


class ServiceEntry(ServerEntry["ServicePeer"]):
    """One service name of the graph."""

    __slots__ = ()
    kind = "service"
    missing = ServiceUnavailable

    @property
    def current(self) -> ServiceEntry:
        """This entry, or the entry that has replaced it if its name has left the graph and been added again."""
        return self.graph.services.get(self.name, self)

    async def available(self) -> ServicePeer:
        self.graph.seek(self)
        return await super().available()

    async def require(self) -> ServicePeer:
        self.graph.seek(self)
        return await super().require()


class ActionEntry(ServerEntry["ActionPeer"]):
    """One action name of the graph."""

    __slots__ = ()
    kind = "action"
    missing = ActionUnavailable
