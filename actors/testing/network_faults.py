"""The faults of a network that a run with a `Lab` may have, and how they are drawn."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from random import Random
from types import MappingProxyType
from typing import Final

from actors.testing.fault_values import ROUTER, Fault, Kind, Possible, Profile, drawn_seconds

ONE_WAY = 0.3
"""How many of the faults of links are in one direction only."""


@dataclass(frozen=True, slots=True)
class OfNetwork(ABC):
    """A kind of fault of the network. `host` is a name or a pattern; at most `at_most` faults of this kind occur in a run, each for up to
    `up_to` seconds.

    Hosts without a tree serve the test itself, so no faults are drawn for them and their links.
    """

    host: str = "*"
    at_most: int = 2
    up_to: float = 8.0

    def draw(self, rng: Random, profile: Profile) -> list[Fault]:
        """Draw some faults of this kind; often none."""
        hosts = sorted(host for host, has_tree in profile.hosts.items() if has_tree)
        count = rng.randint(1, self.at_most) if profile.faulty_seconds > 0.0 else 0
        drawn = [self._draw_one(rng, hosts, profile) for _ in range(count)]
        return [fault for fault in drawn if fault is not None]

    @abstractmethod
    def _draw_one(self, rng: Random, hosts: list[str], profile: Profile) -> Fault | None:
        """Draw a fault for one of these hosts, or None if there is none that it can hit."""

    def _picked(self, hosts: list[str]) -> list[str]:
        return [host for host in hosts if fnmatchcase(host, self.host)]

    def _start(self, rng: Random, profile: Profile) -> int:
        return rng.randint(0, int(profile.faulty_seconds * 1000))


@dataclass(frozen=True, slots=True)
class Cut(OfNetwork):
    """Nothing passes between two hosts, or in one direction: a partition. Connections end when it lasts longer than the lease."""

    kind: Kind = field(default="cut", init=False, repr=False)
    most: float = field(default=0.0, init=False, repr=False)
    """The greatest size of the fault."""

    def _draw_one(self, rng: Random, hosts: list[str], profile: Profile) -> Fault | None:
        picked = self._picked(hosts)
        if not picked or len(hosts) < 2:
            return None
        one = rng.choice(picked)
        other = rng.choice([host for host in hosts if host != one])
        target = f"{one}>{other}" if rng.random() < ONE_WAY else f"{one}={other}"
        size = max(0.001, round(self.most * rng.random(), 3)) if self.most else 0.0
        return Fault(self.kind, target, self._start(rng, profile), drawn_seconds(rng, self.up_to), size)


@dataclass(frozen=True, slots=True)
class LinkLoss(Cut):
    """A share of the messages of a link is lost. Reliable ones are sent again, and are late."""

    kind: Kind = field(default="link-loss", init=False, repr=False)
    most: float = 0.6


@dataclass(frozen=True, slots=True)
class LinkDelay(Cut):
    """The messages of a link are late, each by another time up to `most` seconds."""

    kind: Kind = field(default="link-delay", init=False, repr=False)
    most: float = 1.0


@dataclass(frozen=True, slots=True)
class LinkDuplicate(Cut):
    """A share of the messages of a link arrives twice."""

    kind: Kind = field(default="link-duplicate", init=False, repr=False)
    most: float = 0.6


@dataclass(frozen=True, slots=True)
class LinkReorder(Cut):
    """A share of the messages of a link is overtaken by later ones."""

    kind: Kind = field(default="link-reorder", init=False, repr=False)
    most: float = 0.6


@dataclass(frozen=True, slots=True)
class HostCrash(OfNetwork):
    """A host loses its power, all of its nodes end without a clean-up, and after up to `up_to` seconds it starts again as it did at first."""

    at_most: int = 1

    def _draw_one(self, rng: Random, hosts: list[str], profile: Profile) -> Fault | None:
        picked = self._picked(hosts)
        seconds = drawn_seconds(rng, self.up_to)
        return Fault("host-crash", rng.choice(picked), self._start(rng, profile), seconds) if picked else None


@dataclass(frozen=True, slots=True)
class HostPause(OfNetwork):
    """The processes of a host stand still for up to `up_to` seconds, as with SIGSTOP, and go on: no step of a node runs, nothing is sent, and
    reliable messages wait. Others lose them after the lease of 2 s; they learn of it only when they go on.
    """

    at_most: int = 1
    up_to: float = 5.0

    def _draw_one(self, rng: Random, hosts: list[str], profile: Profile) -> Fault | None:
        picked = self._picked(hosts)
        seconds = drawn_seconds(rng, self.up_to)
        return Fault("host-pause", rng.choice(picked), self._start(rng, profile), seconds) if picked else None


@dataclass(frozen=True, slots=True)
class RouterStop(OfNetwork):
    """The router of the network ends, and starts again after up to `up_to` seconds. Nothing happens in a network without one."""

    at_most: int = 1

    def _draw_one(self, rng: Random, hosts: list[str], profile: Profile) -> Fault | None:
        seconds = drawn_seconds(rng, self.up_to)
        return Fault("router-stop", ROUTER, self._start(rng, profile), seconds) if profile.router else None


@dataclass(frozen=True, slots=True)
class ClockOffset(OfNetwork):
    """The time of day of a host is set forward or back by up to `up_to` seconds, for good."""

    at_most: int = 1
    up_to: float = 60.0

    def _draw_one(self, rng: Random, hosts: list[str], profile: Profile) -> Fault | None:
        picked = self._picked(hosts)
        seconds = rng.choice((-1.0, 1.0)) * drawn_seconds(rng, self.up_to)
        return Fault("clock-offset", rng.choice(picked), self._start(rng, profile), seconds) if picked else None


NETWORK_KINDS: Final[Mapping[Kind, Possible]] = MappingProxyType(
    {
        "cut": Cut(), "link-loss": LinkLoss(), "link-delay": LinkDelay(), "link-duplicate": LinkDuplicate(), "link-reorder": LinkReorder(),
        "host-crash": HostCrash(), "host-pause": HostPause(), "router-stop": RouterStop(), "clock-offset": ClockOffset(),
    }
)  # fmt: skip
"""Every kind of fault of a network, by its name in text."""
