"""UnsupervisedNodes: nodes beside the tree, such as a script's own or a test's. Nobody restarts them; they end when they leave, or with the system."""

from __future__ import annotations

import asyncio
from itertools import count
from typing import TYPE_CHECKING

from actors.errors import DeclarationError, NotRunning, described
from actors.logs import ERROR
from actors.places import place_of
from actors.shield import see_through
from actors.supervision.child_task import GRACE, ChildTask
from actors.supervision.entry import Entry
from actors.supervision.reasons import ExitReason, Leaked, Stop
from actors.supervision.refs import ChildRef

if TYPE_CHECKING:
    from actors.names.identity import Identity
    from actors.runtime.life import NodeLife
    from actors.supervision.declarations import Child
    from actors.supervision.seam import Life
    from actors.system import System

__all__ = ["UnsupervisedNodes"]


class Guest:
    """One node beside the tree: its life, the task that runs it, and what happens to both.

    `ready` and `over` are done once; `leaving` is set when its end was asked for, and then it goes out of the books when it is over.
    """

    __slots__ = ("leaving", "life", "over", "ready", "run")

    def __init__(self, life: NodeLife, run: ChildTask) -> None:
        self.life = life
        self.run = run
        self.ready: asyncio.Future[None] = run.owner.loop.create_future()
        self.over: asyncio.Future[None] = run.owner.loop.create_future()
        self.leaving = False

    def leave(self, reason: str) -> None:
        """Ask for its orderly end, within the stop timeout of its declaration."""
        self.leaving = True
        if not self.run.over:
            self.run.stop(reason, self.life.child.stop)

    @property
    def error(self) -> BaseException | None:
        """What ended it by itself."""
        task = self.run.task
        return task.exception() if task.done() and not task.cancelled() else None


class UnsupervisedNodes:
    """The nodes beside the tree of one system, in the order in which they joined.

    Their ends are events: asking for one twice, or by several tasks, is one end, and no canceled task can leave it half done.
    """

    def __init__(self, system: System) -> None:
        self.loop = system.loop
        self._system = system
        self._guests: dict[NodeLife, Guest] = {}
        self._places: dict[tuple[str, ...], Guest] = {}
        """The same by path; of two at one path, of which the first has ended and not left, the second."""
        self._serials = count(1)

    def __len__(self) -> int:
        return len(self._guests)

    async def join(self, child: Child) -> NodeLife:
        """See `System.join`."""
        system = self._system
        if system.stop_reason is not None:
            raise NotRunning(f"{system!r} has been stopped ({system.stop_reason}): no node can join it any more")
        name = child.name if not child.namespace else f"{child.namespace.strip('/')}/{child.name}"
        path = ("guests", name)
        if (other := self._places.get(path)) is not None and not other.run.over:
            raise DeclarationError(
                f"a node named {other.life.identity.fqn} is open already: give the second one another name= or namespace="
            )
        try:
            life = system.life(child, path, 1)
        except Exception:
            system.close_if_empty()
            raise
        entry = Entry(child, 0)
        guest = Guest(life, ChildTask(self, entry, ChildRef(path, 1, next(self._serials))))
        self._guests[life] = self._places[path] = guest
        try:
            await asyncio.wait([guest.ready, guest.over], return_when=asyncio.FIRST_COMPLETED)
        except asyncio.CancelledError:
            await self.leave(life, "the start was canceled")
            raise
        if not guest.run.ready:
            await self.leave(life, "left")
            raise NotRunning(f"{life.identity.fqn} ended before it was ready")
        return life

    async def leave(self, life: NodeLife, reason: str) -> None:
        """See `System.leave`."""
        guest = self._guests.get(life)
        if guest is None:
            return
        guest.leave(reason)
        if guest.run.over:
            self._forget(guest)
            self._system.guest_left()
        await see_through(guest.over)
        if (error := guest.error) is not None:
            raise error

    def end_last(self, reason: str) -> bool:
        """Ask the last one that joined for its end, unless that has been done; False when there is none."""
        while self._guests:
            guest = self._guests[next(reversed(self._guests))]
            guest.leave(reason)
            if not guest.run.over:
                return True
            self._forget(guest)
        return False

    def kill(self) -> None:
        """End them all at once."""
        for guest in reversed(list(self._guests.values())):
            guest.leaving = True
            guest.run.kill()

    def failed(self) -> list[tuple[Identity, BaseException]]:
        """See `System.failed_beside`."""
        return [
            (life.identity, error)
            for life, guest in self._guests.items()
            if (error := guest.error) is not None and not isinstance(error, Stop)
        ]

    def incarnation(self, path: tuple[str, ...]) -> ChildTask | None:
        """The node at this path as it is seen from here."""
        guest = self._places.get(path)
        return guest.run if guest is not None else None

    @property
    def tasks(self) -> list[asyncio.Task[None]]:
        """The tasks that run them."""
        return [guest.run.task for guest in self._guests.values()]

    def _forget(self, guest: Guest) -> None:
        del self._guests[guest.life]
        if self._places.get(guest.life.identity.path) is guest:
            del self._places[guest.life.identity.path]
            self._system.gone(guest.life.identity.path, kept=False)

    def _of(self, run: ChildTask) -> Guest:
        return self._places[run.ref.path]

    # -- what their incarnations ask and tell --------------------------------------------------------------------------------

    def make_life(self, incarnation: ChildTask, /) -> Life:
        return self._of(incarnation).life

    def grace_of(self, life: Life | None, /) -> float:
        return GRACE

    def ready(self, incarnation: ChildTask, /) -> None:
        incarnation.ready = True
        self._of(incarnation).ready.set_result(None)

    def ended(self, incarnation: ChildTask, reason: ExitReason, /) -> None:
        """It is over, asked to or by itself; nobody will start it again."""
        guest = self._of(incarnation)
        guest.over.set_result(None)
        fqn = guest.life.identity.fqn
        if isinstance(reason, Leaked):
            self._system.log.error("a node beside the tree refused to die and was abandoned", node_name=fqn)
        elif (error := guest.error) is not None and not isinstance(error, Stop):
            fields = {"node_name": fqn, "error": described(error), "at": place_of(error)}
            self._system.log.write(ERROR, "a node beside the tree failed", fields, *self._system.new_error(error))
        if guest.leaving:
            self._forget(guest)
            self._system.guest_left()
        else:
            self._system.gone(guest.life.identity.path, kept=True)

    def abandoned(self, incarnation: ChildTask, /) -> None:
        """`ended` says so; its task is its own from here on."""
