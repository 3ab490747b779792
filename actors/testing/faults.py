"""The faults of a simulated run, as values, and their generation from a seed.

A `Fault` is concrete ("the 12th message from /scan to /planner is lost"). It can be written as text and read back, so that a failing run is
replayed from one line. `Lose`, `Delay`, `Crash` and the others say which faults are possible; each draws faults from a seed and from the
`Profile` of a run without faults.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from random import Random
from types import MappingProxyType
from typing import Any, Final

from actors.checks import default_name
from actors.contracts.contracts import Topic
from actors.runtime.node import Node
from actors.suggest import near_name
from actors.testing.fault_values import CLOCK, Fault, Kind, Possible, Profile, drawn_seconds, parse
from actors.testing.network_faults import (
    NETWORK_KINDS,
    ClockOffset,
    Cut,
    HostCrash,
    HostPause,
    LinkDelay,
    LinkDuplicate,
    LinkLoss,
    LinkReorder,
    OfNetwork,
    RouterStop,
)

__all__ = [
    "ALL", "KINDS", "NETWORK", "ClockJump", "ClockOffset", "Crash", "Cut", "Delay", "Duplicate", "Fault", "Freeze", "HostCrash", "HostPause", "Kind",
    "LinkDelay", "LinkDuplicate", "LinkLoss", "LinkReorder", "Lose", "NotANumber", "Possible", "Profile", "Reorder", "RouterStop",
    "SlowHandler", "SlowStart", "SlowStep", "draw", "parse",
]  # fmt: skip

SOON = 5.0
"""The period, in seconds, within which drawn crashes follow one another: the default restart window of a supervisor."""


@dataclass(frozen=True, slots=True)
class _OnLinks:
    """Faults of messages to the subscriptions of `topic` (a contract, a name or a pattern), at most `at_most` in a run."""

    topic: Topic[Any] | str = "*"
    at_most: int = 3

    kind: Kind = field(default="lose", init=False, repr=False)

    def draw(self, rng: Random, profile: Profile) -> list[Fault]:
        name = self.topic if isinstance(self.topic, str) else self.topic.name
        links = [link for link in sorted(profile.links) if profile.links[link] and _is_meant(link.split(">")[0], name)]
        if self.kind == "nan":
            links = [link for link in links if link in profile.numeric]
        faults: list[Fault] = []
        for _ in range(rng.randint(1, self.at_most) if links else 0):
            link = rng.choice(links)
            faults.append(Fault(self.kind, link, rng.randint(1, profile.links[link]), self._by(rng)))
        return faults

    def _by(self, rng: Random) -> float:
        return 0.0


@dataclass(frozen=True, slots=True)
class Lose(_OnLinks):
    """A message is lost."""


@dataclass(frozen=True, slots=True)
class Duplicate(_OnLinks):
    """A message is delivered twice."""

    kind: Kind = field(default="duplicate", init=False, repr=False)


@dataclass(frozen=True, slots=True)
class Reorder(_OnLinks):
    """A message is delivered just after its successor."""

    kind: Kind = field(default="swap", init=False, repr=False)


@dataclass(frozen=True, slots=True)
class NotANumber(_OnLinks):
    """All floating-point numbers of a message become NaN."""

    at_most: int = 1
    kind: Kind = field(default="nan", init=False, repr=False)


@dataclass(frozen=True, slots=True)
class Delay(_OnLinks):
    """A message is delivered up to `up_to` seconds late. Later messages may overtake it."""

    up_to: float = 0.5
    kind: Kind = field(default="delay", init=False, repr=False)

    def _by(self, rng: Random) -> float:
        return drawn_seconds(rng, self.up_to)


@dataclass(frozen=True, slots=True)
class Freeze(_OnLinks):
    """A sensor repeats its last message for up to `up_to` seconds."""

    at_most: int = 1
    up_to: float = 2.0
    kind: Kind = field(default="freeze", init=False, repr=False)

    def _by(self, rng: Random) -> float:
        return drawn_seconds(rng, self.up_to)


@dataclass(frozen=True, slots=True)
class _OnNodes:
    """Faults of nodes. `node` is a class name, a name, a fully qualified name or a pattern."""

    node: type[Node] | str = "*"
    at_most: int = 1

    def _picked(self, rng: Random, counts: Iterable[str]) -> list[str]:
        """Choose the nodes to affect among those that `node` matches."""
        name = self.node if isinstance(self.node, str) else default_name(self.node)
        nodes = [node for node in sorted(counts) if _is_meant(node, name)]
        return [rng.choice(nodes) for _ in range(rng.randint(1, self.at_most) if nodes else 0)]


@dataclass(frozen=True, slots=True)
class Crash(_OnNodes):
    """A node ends as after an error: at one of its awaits or at a step of its work, without clean-up, or between two handlers (``kill``).

    Several crashes often follow one another within the restart window of a supervisor.
    """

    def draw(self, rng: Random, profile: Profile) -> list[Fault]:
        nodes = self._picked(rng, profile.awaits)
        end = int(profile.seconds * 1000)
        if len(nodes) == 1 or rng.random() < 0.4:
            return [self._death(rng, node, profile) for node in nodes]
        at = rng.randint(0, end)
        deaths: list[Fault] = []
        for node in nodes:
            deaths.append(Fault("kill", node, min(at, end)))
            at += int(1000 * drawn_seconds(rng, SOON))
        return deaths

    def _death(self, rng: Random, node: str, profile: Profile) -> Fault:
        awaits, how = profile.awaits[node], rng.random()
        works = _works_of(node, profile)
        if works and how < 0.4:
            work = rng.choice(works)
            return Fault("crash", work, rng.randint(1, profile.steps[work]))
        if awaits and how < 0.6:
            return Fault("crash", node, rng.randint(1, awaits))
        return Fault("kill", node, rng.randint(0, int(profile.seconds * 1000)))


@dataclass(frozen=True, slots=True)
class SlowStep(_OnNodes):
    """A handler, an action body or a task of a node resumes up to `up_to` seconds late after one of its awaits."""

    at_most: int = 2
    up_to: float = 2.0  # longer than the default timeout of a call

    def draw(self, rng: Random, profile: Profile) -> list[Fault]:
        faults: list[Fault] = []
        for node in self._picked(rng, {work.partition(">")[0] for work in profile.steps}):
            work = rng.choice(_works_of(node, profile))
            faults.append(Fault("slow-step", work, rng.randint(1, profile.steps[work]), drawn_seconds(rng, self.up_to)))
        return faults


@dataclass(frozen=True, slots=True)
class SlowHandler(_OnNodes):
    """A topic, timer or service handler takes up to `up_to` seconds longer. A caller may have given up before it begins."""

    up_to: float = 2.0

    def draw(self, rng: Random, profile: Profile) -> list[Fault]:
        return [
            Fault("slow-handler", node, rng.randint(1, profile.handled[node]), drawn_seconds(rng, self.up_to))
            for node in self._picked(rng, profile.handled)
        ]


@dataclass(frozen=True, slots=True)
class SlowStart(_OnNodes):
    """A node takes up to `up_to` seconds longer to start, at first or after a crash."""

    up_to: float = 2.0

    def draw(self, rng: Random, profile: Profile) -> list[Fault]:
        return [
            Fault("slow-start", node, rng.randint(1, 2), drawn_seconds(rng, self.up_to))
            for node in self._picked(rng, profile.awaits)
        ]


@dataclass(frozen=True, slots=True)
class ClockJump:
    """The time of day is changed by up to `up_to` seconds in either direction. Measured durations must not be affected."""

    up_to: float = 60.0
    at_most: int = 1

    def draw(self, rng: Random, profile: Profile) -> list[Fault]:
        count = rng.randint(1, self.at_most) if profile.seconds > 0.0 else 0
        return [
            Fault(
                "clock-jump",
                CLOCK,
                rng.randint(0, int(profile.seconds * 1000)),
                rng.choice((-1.0, 1.0)) * drawn_seconds(rng, self.up_to),
            )
            for _ in range(count)
        ]


KINDS: Final[Mapping[Kind, Possible]] = MappingProxyType(
    {
        "lose": Lose(), "delay": Delay(), "duplicate": Duplicate(), "swap": Reorder(), "freeze": Freeze(), "nan": NotANumber(),
        "crash": Crash(at_most=2), "slow-handler": SlowHandler(), "slow-step": SlowStep(), "slow-start": SlowStart(),
        "clock-jump": ClockJump(), **NETWORK_KINDS,
    }
)  # fmt: skip
"""Every kind of fault, by its name in text."""
ALL: Final[tuple[Possible, ...]] = tuple(KINDS.values())
"""Every kind of fault, anywhere, with at most two crashes."""
NETWORK: Final[tuple[Possible, ...]] = tuple(NETWORK_KINDS.values())
"""Every kind of fault of a network and its hosts, for tests with a `Lab`."""


def draw(possible: Iterable[Possible], seed: int, profile: Profile) -> tuple[Fault, ...]:
    """Draw the faults of a seed. The same seed and profile give the same faults. Every third seed has none and only changes the order of
    events."""
    if seed % 3 == 0:
        return ()
    rng = Random(f"faults/{seed}")
    kinds = [kind for kind in possible if profile.hosts or not isinstance(kind, OfNetwork)]
    chosen = rng.sample(kinds, rng.randint(1, min(5, len(kinds)))) if kinds else []
    return tuple(dict.fromkeys(fault for kind in chosen for fault in kind.draw(rng, profile)))


def aims_at_nothing(possible: Iterable[Possible], profile: Profile) -> str:
    """The error text for the first kind of fault whose topic, node or host, given by name, was not in the run without faults; empty if there is none."""
    target: Topic[Any] | type[Node] | str
    for kind in possible:
        if isinstance(kind, _OnLinks):
            what, target = "receives no message of a topic", kind.topic
            known = {link.split(">")[0] for link in (*profile.links, *profile.watching)}
        elif isinstance(kind, _OnNodes):
            what, target, known = "has no node", kind.node, set(profile.awaits)
        elif isinstance(kind, OfNetwork) and profile.hosts:
            what, target, known = "has no host", kind.host, set(profile.hosts)
        else:
            continue
        name = target if isinstance(target, str) else target.name if isinstance(target, Topic) else default_name(target)
        if not set("*?[") & set(name) and not any(_is_meant(one, name) for one in known):
            guess = near_name(name, sorted(known))
            return f"{type(kind).__name__}({name!r}) can hit nothing: the run without faults {what} of this name{guess}"
    return ""


def _works_of(node: str, profile: Profile) -> list[str]:
    return [work for work in sorted(profile.steps) if work.startswith(f"{node}>")]


def _is_meant(name: str, pattern: str) -> bool:
    return any(fnmatchcase(name, form) for form in (pattern, f"/{pattern}", f"*/{pattern}"))
