"""A tree over three simulated hosts, whose links are cut, slowed down and healed at random, and whose machines lose their power.

Part of the tree belongs on the base, or else on the spare; it commands a drive on the robot, which is no part of the tree. The process of the tree
is killed, too, and begins anew. What must hold, for each of its nodes:

- never do two incarnations act at the same time: once a newer one has acted, an older one of the same run never does again, and none of an
  earlier run does when the newer run is a lease old;
- while nothing changes on the network and one of the two machines can be reached, the node acts again within the lease and a second, counted
  from when the tree heard the machine last: what was under way when a link broke may arrive later, by as much as the link was slow;
- the drive follows no command of an older incarnation after one of a newer one, and none of an earlier run after one of a later.

A planted violation takes something away that is needed for that; the same checks find it.
"""

from __future__ import annotations

import asyncio
from array import array
from bisect import bisect_right
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import pairwise
from random import Random
from types import MappingProxyType
from typing import Any
from unittest.mock import patch

from actors import Child, Intensity, Node, StartFailed, Supervisor, Topic, every, publishes, rest_for_one
from actors.checks import create
from actors.errors import NotRunning
from actors.hosts.agent import Session
from actors.hosts.lease import LEASE_SECONDS, Granting, Holding
from actors.hosts.messages import Wire
from actors.hosts.placing import elsewhere
from actors.hosts.simulated import SimulatedHosts
from actors.interfaces.std_msgs.msg import UInt64MultiArray
from actors.processes.child_processes import ChildProcesses
from actors.runtime.placement import Placement
from actors.system import System
from actors.time.virtual_loop import VirtualLoop
from actors.transport.bridge import connect
from actors.transport.simulated.link import Conditions
from actors.transport.simulated.network import Network
from robot.link.fence import Fence

SECONDS = 60.0
"""Of faults in each run; afterwards everything is healed."""
TAKEN_OVER = LEASE_SECONDS + 1.0
"""The longest time without an act, seconds."""
RESENT = 1.0
"""For what is lost on a slow link and sent again, seconds."""
KILLS = 0.3
"""The share of the faults in which the process of the tree is killed, in every third seed."""
MACHINES = ("base", "spare")
COMMAND = Topic(UInt64MultiArray, "command")
"""The token and, for the judge, the run: what the drive may not look at."""
ACTORS = ("near", "far")


@dataclass(slots=True)
class Journal:
    """What was done, with the true time, the run of the tree and the token of who did it."""

    acts: dict[str, list[tuple[float, int, int]]] = field(default_factory=lambda: {name: [] for name in ACTORS})
    followed: list[tuple[int, int]] = field(default_factory=lambda: [])
    begun: list[float] = field(default_factory=lambda: [])
    """When the runs of the tree began; the first one is number 0."""
    refused: int = 0


_journal = Journal()
"""That of the present run: simulated processes share the memory, but not what they are given."""


class Actor(Node):
    """Acts 20 times a second in one run of the tree, and commands the drive."""

    out = publishes(COMMAND)

    def __init__(self, run: int) -> None:
        super().__init__()
        self._run = run

    @every(hz=20)
    def act(self) -> None:
        _journal.acts[self.name].append((asyncio.get_running_loop().time(), self._run, self.fencing_token))
        if self.name == "near":
            self.out(UInt64MultiArray(data=array("Q", (self.fencing_token, self._run))))


class Drive(Node):
    """Follows the commands that its fence admits."""

    async def on_start(self) -> None:
        self._fence = Fence()

    @COMMAND.on()
    def follow(self, message: UInt64MultiArray) -> None:
        token, run = message.data
        if self._fence.admits(token):
            _journal.followed.append((run, token))
        _journal.refused = self._fence.refused


def tree(run: int) -> Supervisor:
    away = Supervisor(
        "away",
        hosts=MACHINES,
        strategy=rest_for_one,
        children=[Child(Actor, name="near", args=(run,)), Child(Actor, name="far", args=(run,), process=True)],
    )
    return Supervisor("robot", intensity=Intensity(1000, within=1.0), children=[away])


class Mortal:
    """The hosts and the wires to them, as one process of the tree has them (`Hosts`): from its death on nothing passes any more."""

    def __init__(self, hosts: SimulatedHosts) -> None:
        self._hosts = hosts
        self.names, self.lease, self.count_run = hosts.names, hosts.lease, hosts.count_run
        self.alive = True
        self._wires: list[Wire] = []

    async def dial(self, host: str, take: Callable[[Any], None], lost: Callable[[], None]) -> Wire:
        if not self.alive:
            raise ConnectionAbortedError
        wire = await self._hosts.dial(host, self._living(take), self._living(lost))
        self._wires.append(wire)
        if not self.alive:
            wire.close()
        return MortalWire(self, wire)

    def die(self) -> None:
        """The kernel closes the connections."""
        self.alive = False
        for wire in self._wires:
            wire.close()

    def _living(self, act: Callable[..., None]) -> Callable[..., None]:
        return lambda *values: act(*values) if self.alive else None


class MortalWire:
    """A wire of such a process."""

    unsent = 0

    def __init__(self, process: Mortal, wire: Wire) -> None:
        self._process, self._wire = process, wire

    def send(self, value: object) -> None:
        if self._process.alive:
            self._wire.send(value)

    def close(self) -> None:
        self._wire.close()


class Owner:
    """The process of the tree: it is killed, and begins anew then, as it does when the tree cannot start because a machine is lost meanwhile."""

    def __init__(self, network: Network, hosts: SimulatedHosts, seed: int) -> None:
        self._network, self._hosts, self._seed = network, hosts, seed
        self._dead: list[asyncio.Task[None]] = []
        self._begin()

    def kill(self) -> None:
        """As kill -9 does: nothing is cleaned up, and the others hear of it by their connections only."""
        self._transport.crash()
        self._mortal.die()
        self._dead.append(asyncio.ensure_future(self._bury(self._system, self._starting)))
        self._begin()

    async def stop(self) -> None:
        await self._system.stop()
        await asyncio.gather(self._starting, *self._dead)

    def _begin(self) -> None:
        self._transport = transport = self._network.transport("robot")
        self._mortal = hosts = Mortal(self._hosts)
        self._system = system = create(
            System,
            seed=self._seed,
            sinks=(),
            processes=lambda runtime: ChildProcesses(runtime, transport, elsewhere=elsewhere(hosts, runtime)),
            placement=Placement(hosts.count_run()),
        )
        connect(system.runtime, transport)
        _journal.begun.append(asyncio.get_running_loop().time())
        self._starting = asyncio.ensure_future(self._start(system, len(_journal.begun) - 1))

    async def _start(self, system: System, run: int) -> None:
        try:
            await system.start(tree(run))
        except NotRunning:  # it was stopped meanwhile
            return
        except StartFailed:
            if system is self._system:
                self._begin()

    async def _bury(self, system: System, starting: asyncio.Task[None]) -> None:
        """Free what a dead process has in this one, when it has taken its machines for lost."""
        await asyncio.sleep(2 * LEASE_SECONDS)
        await system.stop()
        await starting


# What goes wrong ---------------------------------------------------------------------------------------------------------


class Weather:
    """The faults of one run. Invariant: `_cut` and `_slow` have the directions of links, and `_down` the machines, that do not work."""

    def __init__(self, network: Network, hosts: SimulatedHosts, owner: Owner, seed: int) -> None:
        self._network, self._hosts, self._owner = network, hosts, owner
        self._seed, self._rng, self._kills = seed, Random(f"weather/{seed}"), Random(f"kills/{seed}")
        self._cut: set[tuple[str, str]] = set()
        self._slow: dict[tuple[str, str], float] = {}
        """With the longest delay of a message, seconds."""
        self._down: set[str] = set()
        self._since = self._drained = 0.0
        """When it changed last, and when all has arrived that was on its way then."""
        self.calm: list[tuple[float, float, bool]] = []
        """Times between two changes, from when all has arrived that was on its way, and whether a machine could be reached all the time."""

    async def blow(self) -> None:
        loop = asyncio.get_running_loop()
        end = loop.time() + SECONDS
        while loop.time() < end:
            await asyncio.sleep(
                self._rng.uniform(0.1, 1.0) if self._rng.random() < 0.4 else self._rng.uniform(1.0, 9.0)
            )
            self._note(loop.time())
            if self._seed % 3 == 2 and self._kills.random() < KILLS:
                self._owner.kill()
            else:
                self._rng.choice(
                    (self._cut_link, self._slow_link, self._slow_link, self._mend, self._mend, self._power)
                )()
        self._note(loop.time())
        for machine in MACHINES:
            self._clear(machine)
        await asyncio.sleep(max(self._drained - loop.time(), 0.0) + 2 * TAKEN_OVER)
        self._note(loop.time())

    def _note(self, now: float) -> None:
        """It is about to change."""
        begun = max(self._since, self._drained)
        if begun < now:
            self.calm.append((begun, now, self._reachable()))
        self._since = now
        self._drained = max(self._drained, now + max(self._slow.values(), default=0.0))

    def _reachable(self) -> bool:
        return any(
            machine not in self._down and not {("robot", machine), (machine, "robot")} & (self._cut | self._slow.keys())
            for machine in MACHINES
        )

    def _direction(self) -> tuple[str, str]:
        machine = self._rng.choice(MACHINES)
        return self._rng.choice((("robot", machine), (machine, "robot")))

    def _cut_link(self) -> None:
        one, other = self._direction()
        both = self._rng.random() < 0.7
        self._network.cut(one, other, one_way=not both)
        self._cut |= {(one, other), (other, one)} if both else {(one, other)}

    def _slow_link(self) -> None:
        one, other = self._direction()
        delay = self._rng.choice(
            (self._rng.uniform(0.01, 1.0), self._rng.uniform(1.0, 2.0), self._rng.uniform(2.0, 6.0))
        )
        self._network.impair(one, other, Conditions(delay=delay, jitter=delay / 4, loss=0.1), one_way=True)
        self._slow[one, other] = 1.25 * delay + RESENT

    def _mend(self) -> None:
        self._clear(self._rng.choice(MACHINES))

    def _power(self) -> None:
        machine = self._rng.choice(MACHINES)
        if machine in self._down:
            self._clear(machine)
        else:
            self._hosts.crash(machine)
            self._down.add(machine)

    def _clear(self, machine: str) -> None:
        self._network.heal("robot", machine)
        self._network.repair("robot", machine)
        for link in (("robot", machine), (machine, "robot")):
            self._cut.discard(link)
            self._slow.pop(link, None)
        if machine in self._down:
            self._down.discard(machine)
            self._hosts.reboot(machine)


# What must hold ----------------------------------------------------------------------------------------------------------


@dataclass(slots=True)
class Outcome:
    """What came of one run."""

    faults: list[str]
    incarnations: int
    runs: int
    refused: int
    longest: float
    """The longest time without an act while a machine could be reached and nothing changed, seconds."""


def judge(journal: Journal, calm: list[tuple[float, float, bool]]) -> Outcome:
    """Read the journal as an outsider: by true time, without a word of the tree or the agents."""
    faults: list[str] = []
    longest = 0.0
    for name, acts in journal.acts.items():
        faults += _two_at_once(name, acts, journal.begun)
        for begun, ended, reachable in calm:
            if reachable:
                run = bisect_right(journal.begun, begun) - 1
                inside = [begun, *(at for at, of, _ in acts if begun <= at <= ended and of >= run), ended]
                gap = max(later - at for at, later in pairwise(inside))
                longest = max(longest, gap)
                if gap > TAKEN_OVER:
                    faults.append(f"{name}: nobody acted for {gap:.2f} s between {begun:.2f} and {ended:.2f} s")
    for (run, token), (later_run, other) in pairwise(journal.followed):
        if (later_run, other) < (run, token):
            faults.append(f"the drive followed life {other:x} of run {later_run} after life {token:x} of run {run}")
            break
    lives = {(run, token) for _, run, token in journal.acts["near"]}
    return Outcome(faults, len(lives), len(journal.begun), journal.refused, longest)


def _two_at_once(name: str, acts: list[tuple[float, int, int]], begun: list[float]) -> list[str]:
    """The first older life that acts after a newer one, and the first of an earlier run that acts when the next run is a lease old."""
    faults: list[str] = []
    last: dict[int, tuple[float, int]] = {}
    for at, run, token in acts:
        before, newest = last.get(run, (0.0, 0))
        if token < newest:
            faults.append(f"{name}: life {token:x} acts at {at:.3f} s, after life {newest:x} at {before:.3f} s")
            break
        last[run] = at, token
        if run + 1 < len(begun) and at > begun[run + 1] + LEASE_SECONDS:
            faults.append(f"{name}: run {run} acts at {at:.3f} s, run {run + 1} has begun at {begun[run + 1]:.3f} s")
            break
    return faults


# Planted violations ------------------------------------------------------------------------------------------------------


def _never(self: Session, why: str) -> None: ...


_grant = Granting.grant


def _early(self: Granting, now: float, left: float) -> None:
    _grant(self, now - 0.4 * self.seconds, left)


def _from_the_answer(self: Holding, number: int) -> None:
    self.until = asyncio.get_running_loop().time() + 0.75 * self.seconds


def _anything(self: Fence, token: int) -> bool:
    return True


def _always_the_first(self: SimulatedHosts) -> int:
    return 1


PLANTED: Mapping[str, tuple[type, str, Callable[..., object]]] = MappingProxyType(
    {
        "no-lease": (Session, "step_down", _never),
        "early-spare": (Granting, "grant", _early),
        "lease-from-answer": (Holding, "granted", _from_the_answer),
        "no-fence": (Fence, "admits", _anything),
        "runs-not-counted": (SimulatedHosts, "count_run", _always_the_first),
    }
)
"""An agent that never steps down; a tree that gives up its hosts early; an agent that counts its lease from the answer; a drive without fence; a
tree whose tokens begin anew in each run."""


@contextmanager
def planted(name: str | None) -> Generator[None]:
    """With this violation in place, or none."""
    if name is None:
        yield
    else:
        kind, method, instead = PLANTED[name]
        with patch.object(kind, method, instead):
            yield


# Running -----------------------------------------------------------------------------------------------------------------


async def _run(seed: int) -> Outcome:
    global _journal
    _journal = Journal()
    network = Network(seed)
    for name in ("robot", *MACHINES):
        network.add_host(name)
    hosts = create(SimulatedHosts, network, "robot", MACHINES)
    drive = create(System, seed=seed, sinks=())
    connect(drive.runtime, network.transport("robot"))
    await drive.start(Supervisor("drives", children=[Child(Drive)]))
    owner = Owner(network, hosts, seed)
    weather = Weather(network, hosts, owner, seed)
    await weather.blow()
    await owner.stop()
    await drive.stop()
    return judge(_journal, weather.calm)


def run_seed(seed: int, plant: str | None = None) -> Outcome:
    """One run, which is the same each time."""
    with planted(plant), asyncio.Runner(loop_factory=VirtualLoop) as runner:
        return runner.run(_run(seed))


def run_hosts(seeds: int, first: int = 0, plant: str | None = None) -> int:
    """So many runs; 0 if everything held. With a planted violation: 0 if it was found."""
    found, longest, incarnations, runs, refused = 0, 0.0, 0, 0, 0
    for seed in range(first, first + seeds):
        outcome = run_seed(seed, plant)
        longest = max(longest, outcome.longest)
        incarnations += outcome.incarnations
        runs += outcome.runs
        refused += outcome.refused
        for fault in outcome.faults:
            print(f"seed {seed}: DID NOT HOLD: {fault}", flush=True)
        found += bool(outcome.faults)
        if found and plant is not None:
            print(f"{plant}: found after {seed - first + 1} seeds")
            return 0
    print(
        f"{seeds} seeds, {runs} runs of the tree, {incarnations} incarnations, {refused} late commands refused, longest time without an act {longest:.2f} s: "
        + (f"{found} seeds did not hold" if found else "everything held")
    )
    return 1 if found or plant is not None else 0
