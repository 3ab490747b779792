"""`PreforkPool`: the processes of a tree, started together with the first of them, so that they are there when their turn comes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress

from msgspec import structs

from actors.processes.channel import framed
from actors.processes.forked import MODULES, Forked, Zygote, can_fork, here
from actors.processes.forked import started as zygotes
from actors.processes.messages import Order
from actors.processes.os_process import Started, discard, prepared, still_waiting
from actors.processes.preparation import preparation
from actors.supervision.child import Child
from actors.supervision.declarations import DynamicSupervisor, Spec, Supervisor


class PreforkPool:
    """The processes of one system that have been started before their turn. A child that starts first makes all others wait for it, but
    not for the start of Python and the imports.

    Where the system can fork safely, a zygote imports for all of them and forks them, now and for each restart; elsewhere, or when the zygote
    has ended, each is an interpreter of its own.

    Invariant: each of `_waiting` has its preparation and no order.
    """

    def __init__(self, tree: Supervisor | DynamicSupervisor, path: tuple[str, ...], first: Order) -> None:
        """Start the processes of all children of `tree`, which runs at `path`, that have one of their own on this machine. `first` is the order
        of one of them."""
        self._waiting: dict[tuple[str, ...], Started] = {}
        orders = [structs.replace(first, spec=child, path=below) for below, child in _processes_of(tree, path)]
        self._own = None if here() is not None else _zygote(orders)
        self._zygote = self._own or here()
        with suppress(OSError):  # the child whose turn it is learns of it
            for order in orders:
                self._waiting[order.path] = self._start(order)

    async def take(self, order: Order) -> Started | None:
        """The process that waits for this order, or is forked for it now; None if there is none, or if it has died."""
        started = still_waiting(self._waiting.pop(order.path, None))
        if started is None and self._zygote is not None:
            with suppress(OSError):
                started = self._start(order)
        if started is not None and isinstance(started.popen, Forked):
            try:
                begun = await started.popen.begun()
            except BaseException:
                discard(started)
                raise
            if not begun:
                discard(started)
                return None
        return started

    async def close(self) -> None:
        """End those that wait, whose turn has never come, and the zygote."""
        while self._waiting:
            discard(self._waiting.popitem()[1])
        if self._own is not None:
            self._own.close()

    def _start(self, order: Order) -> Started:
        """Start the process for an order like this one. Raises OSError."""
        frame = framed(preparation(main=_needs_main(order), modules=_modules([order])))
        return prepared("/".join(order.path), frame, fenced=order.placement.away, zygote=self._zygote)


def _zygote(orders: Sequence[Order]) -> Zygote | None:
    """A zygote for these orders; None where there can be none. Processes that end with this one are not forked by another."""
    if orders and can_fork() and not orders[0].placement.away:
        with suppress(OSError):
            main = any(map(_needs_main, orders))
            return zygotes(orders[0].path[0], preparation(main=main, modules=_modules(orders)))
    return None


def _needs_main(order: Order) -> bool:
    return b"__main__" in framed(order)


def _modules(orders: Sequence[Order]) -> tuple[str, ...]:
    return tuple(dict.fromkeys((*MODULES, *(name for order in orders for name in _modules_of(order.spec)))))


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
    else:
        for below in child.children if isinstance(child, Supervisor) else (child.template,):
            yield from _modules_of(below)
