"""`Lab`: several hosts on the virtual clock, each with a system of its own, joined by a simulated network and controlled by a test.

::

    async def test_the_robot_stops_when_the_operator_is_gone(lab: Lab) -> None:
        robot = await lab.start("robot", drive())
        await lab.start("desk", Teleop)
        wheels = robot.probe(WHEELS)
        lab.cut("robot", "desk")
        await lab.advance(5.0)
        assert wheels.newest.speed == 0.0

Each host is a `Rig`. When the test ends, all systems are stopped, and what one of them has left over fails the test.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations
from typing import Any, Literal

from actors.running.options import ParameterSources
from actors.running.trees import Runnable
from actors.runtime.node import Node
from actors.suggest import did_you_mean
from actors.supervision.declarations import Spec, Supervisor
from actors.system import System
from actors.testing.failures import UnexpectedFailure
from actors.testing.fault_values import OF_NETWORK, ON_LINKS, Fault
from actors.testing.leaks import Leak
from actors.testing.rig import Rig, quiet, virtual_loop
from actors.transport.simulated.link import LAN, Conditions
from actors.transport.simulated.network import Network


@dataclass(eq=False, slots=True)
class _Machine:
    """What runs on a host, so that a reboot can start it again. `rig` is that of the newest start."""

    trees: tuple[Any, ...]
    parameters: ParameterSources | None
    rig: Rig
    running: bool = False


class Lab:
    """Several hosts on the virtual clock, and the means for a test to act on them and on the network between them.

    Everything random is drawn from `seed`. `conditions` are those of the links between hosts. `excused` is that of `Rig`, and
    `make_system`, too, which is also given the `host`; `faults` are faults of the network, which come at their times until `recover`.

    Invariants:

    * A host has at most one running system; `lab[host]` is its rig, which is another one after a reboot.
    * `rigs` holds the rigs of all systems that were ever started, in order; all are closed at the end.
    * The time of day is the same on all hosts, but for the offsets of their clocks. It begins at 0 with the lab.
    """

    def __init__(
        self,
        *,
        seed: int = 0,
        conditions: Conditions = LAN,
        make_system: Callable[..., System] | None = None,
        excused: Callable[[BaseException], bool] | None = None,
        faults: Sequence[Fault] = (),
    ) -> None:
        self._make_system = make_system
        self._excused = excused
        self.loop = virtual_loop("a Lab", "lab")
        self.seed = seed
        self._network = Network(seed, conditions=conditions)
        self.rigs: list[Rig] = []
        self.recovered_at: float | None = None
        """The time of the first `recover`."""
        self._begun = self.loop.time()
        self._machines: dict[str, _Machine] = {}
        self._router = False
        self._tasks: list[asyncio.Task[None]] = []
        self._faults = _NetworkFaults(self, self._network, faults)

    # -- hosts --------------------------------------------------------------------------------------------------------------

    async def start(
        self,
        host: str,
        *trees: Runnable | Spec | type[Node],
        parameters: ParameterSources | None = None,
        mode: Literal["peer", "client"] = "peer",
        router: bool = False,
        clock_offset: float = 0.0,
    ) -> Rig:
        """Add a host and start a tree on it, or several nodes under a plain supervisor. Returns its rig when all of it is ready.

        Without a tree the host serves the test, for example to publish and to record. In mode ``client`` it reaches others by the router
        only, which runs on the host with `router`. The time of day of the host is `clock_offset` seconds ahead. Others are found within
        the next 0.05 s. Raises ValueError if there is a host of this name, or a router, already.
        """
        self._network.add_host(host, mode, clock_offset=clock_offset, router=router)
        self._router = self._router or router
        machine = self._machines[host] = _Machine(trees, parameters, self._rig(host))
        await self._boot(host, machine)
        return machine.rig

    async def _boot(self, host: str, machine: _Machine) -> None:
        rig = machine.rig
        self.rigs.append(rig)
        trees = machine.trees or (Supervisor(host, children=[]),)
        transport = self._network.transport(host)
        await rig.start(
            *trees,
            seed=self.seed,
            parameters=machine.parameters,
            transport=transport,
            clock_offset=self.now + self._network.host(host).clock_offset,
        )
        machine.running = True

    def _rig(self, host: str) -> Rig:
        make = self._make_system
        return Rig(make and partial(make, host=self._network.host(host)), self._excused)

    def __getitem__(self, host: str) -> Rig:
        """The rig of a host. Raises LookupError if there is none of this name."""
        return self._machine(host).rig

    def _machine(self, host: str) -> _Machine:
        if host not in self._machines:
            raise LookupError(f"there is no host {host!r}{did_you_mean(host, self._machines)}")
        return self._machines[host]

    @property
    def hosts(self) -> dict[str, bool]:
        """All hosts by name, and whether a tree was started on each."""
        return {host: bool(machine.trees) for host, machine in self._machines.items()}

    @property
    def has_router(self) -> bool:
        return self._router

    def is_up(self, host: str) -> bool:
        """Whether a host has started and has not crashed."""
        return host in self._machines and self._machines[host].running

    def crash(self, host: str) -> None:
        """Let a host lose its power: its nodes end without a clean-up, and nobody hears a farewell. Raises LookupError.

        Its rig is no longer of use; `reboot` starts another one.
        """
        machine = self._machine(host)
        self._network.crash(host)
        if machine.running:
            machine.running = False
            machine.rig.kill()
            self._tasks.append(self.loop.create_task(machine.rig.stop()))

    async def reboot(self, host: str) -> Rig:
        """Start a crashed host again with the trees that it was started with, and return its new rig when they are ready."""
        machine = self._machine(host)
        if not self._network.host(host).up:
            self._network.reboot(host)
            machine.rig = self._rig(host)
            await self._boot(host, machine)
        return machine.rig

    def reboot_soon(self, host: str) -> None:
        """Begin `reboot`. `recover` and the end of the test wait for it, and raise its error."""
        self._tasks.append(self.loop.create_task(self._reboot(host), name=f"reboot of {host}"))

    async def _reboot(self, host: str) -> None:
        await self.reboot(host)

    def shift_clock(self, host: str, seconds: float) -> None:
        """Set the time of day of a host forward, or back. Raises LookupError."""
        machine = self._machine(host)
        self._network.host(host).clock_offset += seconds
        if machine.running:
            machine.rig.system.clock.shift_wall(seconds)

    # -- the network --------------------------------------------------------------------------------------------------------

    def cut(self, one: str, other: str, *, one_way: bool = False) -> None:
        """Let nothing pass between two hosts, or only nothing from `one` to `other`. What is on its way arrives."""
        self._network.cut(one, other, one_way=one_way)

    def heal(self, one: str, other: str, *, one_way: bool = False) -> None:
        """Undo `cut` and `impair`. The two find each other within the next 0.05 s."""
        self._network.repair(one, other, one_way=one_way)
        self._network.heal(one, other, one_way=one_way)

    def impair(self, one: str, other: str, *, one_way: bool = False, **changes: float) -> None:
        """Make the link between two hosts worse until `heal`: `loss=0.2`, `delay=0.1`, and the other fields of `Conditions`."""
        for start, end in [(one, other)] if one_way else [(one, other), (other, one)]:
            conditions = replace(self._network.link(start, end).usual, **changes)
            self._network.impair(start, end, conditions, one_way=True)

    def stop_router(self) -> None:
        """End the router."""
        self._network.stop_router()

    def start_router(self) -> None:
        """Start the router again."""
        self._network.start_router()

    async def recover(self) -> None:
        """End every fault of the network: links are healed, the router runs, hosts that are down are rebooted. Drawn faults come no more.

        Clocks keep their offsets. Returns when all hosts have started; they find each other within the next 0.05 s.
        """
        if self.recovered_at is None:
            self.recovered_at = self.now
        self._faults.end()
        for one, other in combinations(self._machines, 2):
            self.heal(one, other)
        await self._see_through()
        for host in self._machines:
            await self.reboot(host)
        self._network.start_router()

    async def _see_through(self) -> None:
        while self._tasks:
            await self._tasks.pop(0)

    # -- time ---------------------------------------------------------------------------------------------------------------

    @property
    def now(self) -> float:
        """Seconds since the lab was made."""
        return self.loop.time() - self._begun

    async def quiet(self) -> None:
        """Let everything happen that can happen without time passing."""
        await quiet(self.loop)

    async def advance(self, seconds: float) -> None:
        """Let `seconds` pass on all hosts, with everything that is due in that time. Raises `UnexpectedFailure` as `Rig.advance` does."""
        await self.loop.sleep_until(self.loop.time() + seconds)
        await self.quiet()
        for rig in self.rigs:
            rig.check()

    async def until(self, condition: Callable[[], bool], *, within: float = 60.0, step: float = 0.005) -> None:
        """Let time pass until `condition()` is true, checking it every `step` seconds. Fails after `within` seconds."""
        end = self.now + within
        while not condition():
            if self.now >= end:
                raise AssertionError(f"not true within {within:g} s (now t={self.now:.3f} s)\n{self.timeline()}")
            await self.advance(min(step, end - self.now))

    # -- the end ------------------------------------------------------------------------------------------------------------

    def forgive_threads(self) -> None:
        """Do not report the threads that run now as left over."""
        for rig in self.rigs:
            rig.forgive_threads()

    async def close(self) -> None:
        """Stop all systems, the newest first. Raises `Leak` and `UnexpectedFailure` as `Rig.close` does, for the first host with one."""
        self._faults.end()
        errors: list[Exception] = []
        try:
            await self._see_through()
        except Exception as error:
            errors.append(error)
        for rig in reversed(self.rigs):
            await rig.stop()
        for rig in self.rigs:
            try:
                await rig.close()
            except (Leak, UnexpectedFailure, AssertionError) as error:
                errors.append(error)
        if errors:
            raise errors[0]

    def timeline(self, last: int = 30) -> str:
        """The newest `last` log lines of all hosts in order; each says its host and that host's time since its start."""
        lines = [
            (time, _at_host(text, host))
            for host, machine in self._machines.items()
            for time, text in machine.rig.lines()
        ]
        lines.sort(key=lambda line: line[0])
        newest = [text for _, text in lines[-last:]]
        return "\n".join([f"lab: seed={self.seed} t={self.now:.6f} s; the last {len(newest)} log lines:", *newest])


def _at_host(line: str, host: str) -> str:
    """A log line, perhaps with a traceback below, with the name of a host."""
    first, newline, rest = line.partition("\n")
    return f"{first} host={host}{newline}{rest}"


class _NetworkFaults:
    """The faults of one run. A fault that names a host which is not there yet, or is down, does nothing.

    Invariants: a link is as the faults that are now `_active` on it make it, and as usual without any; so where faults overlap, none of
    them ends early. After `end` nothing happens any more.
    """

    def __init__(self, lab: Lab, network: Network, faults: Sequence[Fault]) -> None:
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
            if all(host in lab.hosts for host in _ends_of(target)):
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

    def _later(self, fault: Fault, act: Callable[..., object], *arguments: object) -> None:
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
        for source, end in _directions_of(target):
            here = [fault for fault in self._active if (source, end) in _directions_of(fault.target)]
            link = network.link(source, end)
            network.impair(source, end, _worse(link.usual, here), one_way=True)
            cut = any(fault.kind == "cut" for fault in here)
            (network.cut if cut else network.heal)(source, end, one_way=True)


def _ends_of(target: str) -> tuple[str, str]:
    """The hosts that a link as ``robot=desk`` or ``robot>desk`` joins."""
    one, _, other = target.partition("=" if "=" in target else ">")
    return one, other


def _directions_of(target: str) -> Iterator[tuple[str, str]]:
    """The directions of a link that a fault of it concerns."""
    if any(sign in target for sign in "=>"):
        one, other = _ends_of(target)
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
