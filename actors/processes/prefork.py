"""`PreforkPool`: the interpreters of a tree, started together with the first of them, so that they import while others start."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from typing import TYPE_CHECKING, Final

from msgspec import structs

from actors.processes.channel import framed
from actors.processes.os_process import Started, discard, prepared, still_waiting
from actors.processes.preparation import preparation
from actors.supervision.child import Child
from actors.supervision.declarations import Supervisor

if TYPE_CHECKING:
    from actors.processes.messages import Order
    from actors.supervision.declarations import DynamicSupervisor, Spec

_MODULES: Final = ("actors.transport.zenoh.transport", "zenoh")
"""What every process of a tree needs."""


class PreforkPool:
    """The interpreters of one system that have been started before their turn. A child that starts first makes all others wait for it, but
    not for the start of Python and the imports.

    Invariant: each of `_waiting` has its preparation and no order.
    """

    def __init__(self, tree: Supervisor | DynamicSupervisor, path: tuple[str, ...], first: Order) -> None:
        """Start the interpreters of all children of `tree`, which runs at `path`, that have processes of their own on this machine, except
        for the one whose turn it is, by its order."""
        self._waiting: dict[tuple[str, ...], Started] = {}
        with suppress(OSError):  # the child whose turn it is learns of it
            for below, child in _processes_of(tree, path):
                if below != first.path:
                    self._start(structs.replace(first, spec=child, path=below))

    def take(self, order: Order) -> Started | None:
        """The interpreter that has been started for the child of this order; None if there is none, or if it has died."""
        return still_waiting(self._waiting.pop(order.path, None))

    async def close(self) -> None:
        """End those that wait, whose turn has never come."""
        while self._waiting:
            discard(self._waiting.popitem()[1])

    def _start(self, order: Order) -> None:
        """Start the interpreter for an order like this one."""
        modules = (*_MODULES, *_modules_of(order.spec))
        first = framed(preparation(main=b"__main__" in framed(order), modules=modules))
        self._waiting[order.path] = prepared("/".join(order.path), first, fenced=order.placement.away)


def _processes_of(
    tree: Supervisor | DynamicSupervisor, path: tuple[str, ...]
) -> Iterator[tuple[tuple[str, ...], Spec]]:
    """The children of a tree that have processes of their own on this machine, with their paths."""
    for child in tree.children if isinstance(tree, Supervisor) else ():
        below = (*path, child.name)
        if isinstance(child, (Child, Supervisor)) and child.process:
            if not child.hosts:
                yield below, child
        elif not isinstance(child, Child):
            yield from _processes_of(child, below)


def _modules_of(child: Spec) -> Iterator[str]:
    """The modules of the factories of a child, or of all children of a supervisor."""
    if isinstance(child, Child):
        yield str(getattr(child.factory, "__module__", ""))
    elif isinstance(child, Supervisor):
        for below in child.children:
            yield from _modules_of(below)
