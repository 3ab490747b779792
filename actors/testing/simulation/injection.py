"""The faults of the network of a `Lab`: each begins and ends at its time."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Protocol

from actors.testing.fault_values import OF_NETWORK, ON_LINKS, Fault

if TYPE_CHECKING:
    from actors.transport.simulated.conditions import Conditions
    from actors.transport.simulated.network import Network


class FaultyLab(Protocol):
    """What faults need of a lab."""

    @property
    def loop(self) -> asyncio.AbstractEventLoop: ...

    @property
    def hosts(self) -> dict[str, bool]: ...

    def is_up(self, host: str) -> bool: ...

    def crash(self, host: str) -> None: ...

    def reboot_soon(self, host: str) -> None: ...

    def shift_clock(self, host: str, seconds: float) -> None: ...


class NetworkFaults:
    """The faults of one run. A fault that names a host which is not there yet, or is down, does nothing.

    Invariants: a link is as the faults that are now `_active` on it make it, and as usual without any; so where faults overlap, none of
    them ends early. After `end` nothing happens any more.
    """

    def __init__(self, lab: FaultyLab, network: Network, faults: Sequence[Fault]) -> None:
        self._lab = lab
        self._network = network
        self._active: list[Fault] = []
        now = lab.loop.time()
        self._timers: list[asyncio.TimerHandle] = [
            lab.loop.call_at(now + fault.nth / 1000, self._begin, fault) for fault in faults if fault.kind in OF_NETWORK
        ]

    def end(self) -> None:
        """End all faults. Hosts that are down stay down."""
        for timer in self._timers:
            timer.cancel()
        self._timers.clear()
        for fault in tuple(self._active):
            self._lift(fault)

    def _begin(self, fault: Fault) -> None:
        lab, kind, target = self._lab, fault.kind, fault.target
        if kind in ON_LINKS:
            if all(host in lab.hosts for host in ends_of(target)):
                self._active.append(fault)
                self._set_links(target)
                self._later(fault, self._lift, fault)
        elif kind == "router-stop":
            self._active.append(fault)
            self._network.stop_router()
            self._later(fault, self._lift, fault)
        elif not lab.is_up(target):
            pass
        elif kind == "host-pause":
            self._active.append(fault)
            self._network.pause(target)
            self._later(fault, self._lift, fault)
        elif kind == "host-crash":
            lab.crash(target)
            self._later(fault, lab.reboot_soon, target)
        else:
            lab.shift_clock(target, fault.by)

    def _later(self, fault: Fault, act: Any, *arguments: object) -> None:
        self._timers.append(self._lab.loop.call_later(fault.by, act, *arguments))

    def _lift(self, fault: Fault) -> None:
        self._active.remove(fault)
        if fault.kind in ON_LINKS:
            self._set_links(fault.target)
        elif any((other.kind, other.target) == (fault.kind, fault.target) for other in self._active):
            pass
        elif fault.kind == "host-pause":
            self._network.resume(fault.target)
        else:
            self._network.start_router()

    def _set_links(self, target: str) -> None:
        network = self._network
        for source, end in directions_of(target):
            here = [fault for fault in self._active if (source, end) in directions_of(fault.target)]
            link = network.link(source, end)
            network.impair(source, end, _worse(link.usual, here), one_way=True)
            cut = any(fault.kind == "cut" for fault in here)
            (network.cut if cut else network.heal)(source, end, one_way=True)


def ends_of(target: str) -> tuple[str, str]:
    """The hosts that a link as ``robot=desk`` or ``robot>desk`` joins."""
    one, _, other = target.partition("=" if "=" in target else ">")
    return one, other


def directions_of(target: str) -> Iterator[tuple[str, str]]:
    """The directions of a link that a fault of it concerns."""
    if any(sign in target for sign in "=>"):
        one, other = ends_of(target)
        yield one, other
        if "=" in target:
            yield other, one


def _worse(conditions: Conditions, faults: Sequence[Fault]) -> Conditions:
    """The conditions of a link with these faults of it."""
    for fault in faults:
        if fault.kind == "link-loss":
            conditions = replace(conditions, loss=max(conditions.loss, fault.size))
        elif fault.kind == "link-delay":
            conditions = replace(conditions, jitter=conditions.jitter + fault.size)
        elif fault.kind == "link-duplicate":
            conditions = replace(conditions, duplication=max(conditions.duplication, fault.size))
        elif fault.kind == "link-reorder":
            conditions = replace(conditions, reordering=max(conditions.reordering, fault.size))
    return conditions
