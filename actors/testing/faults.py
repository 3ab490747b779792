"""The faults of a simulated run, as values, and how a seed draws them.

A `Fault` is concrete ("the 12th message from /scan to /planner is lost") and can be written down and read back, so that a failing
run is replayed from one line. What may go wrong at all is said with `Lose`, `Delay`, `Crash`, ...: each draws faults from a seed and
from the `Profile` of a run without faults.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from random import Random
from types import MappingProxyType
from typing import Any, Final, Literal, Protocol, TypeAlias, cast, get_args

from actors.checks import default_name
from actors.contracts.contracts import Topic
from actors.node.node import Node

__all__ = [
    "ALL", "KINDS", "ClockJump", "Crash", "Delay", "Duplicate", "Fault", "Freeze", "Kind", "Lose", "NotANumber", "Possible", "Profile", "Reorder",
    "SlowHandler", "SlowStart", "SlowStep", "draw", "parse",
]  # fmt: skip

Kind: TypeAlias = Literal[
    "lose", "delay", "duplicate", "swap", "freeze", "nan", "crash", "kill", "slow-start", "slow-handler", "slow-step", "clock-jump"
]  # fmt: skip
"""The kinds of faults, by the names that they have in text."""
CLOCK = "clock"
SOON = 5.0
"""Seconds within which crashes come that come soon after one another: the window of restarts of a supervisor that says nothing else."""
_TEXT = re.compile(r"(?P<kind>[a-z-]+):(?P<target>[^#+]+)#(?P<nth>\d+)(?P<by>[+-]\d+(\.\d+)?(e-?\d+)?)?")


@dataclass(frozen=True, slots=True)
class Fault:
    """One thing that goes wrong. As text: ``KIND:TARGET#NTH+SECONDS``, such as ``delay:/scan>/planner#12+0.25``.

    The target of a message fault is ``TOPIC>SUBSCRIBER``, and `nth` counts the messages on that way from 1. ``NODE>WORK`` is a handler,
    the body of an action, or a task of a node; `nth` counts its steps, from one await to the next (``slow-step``, ``crash``). The target
    of other faults is a node; `nth` counts its awaits (``crash``), handler runs (``slow-handler``) or lives (``slow-start``), or
    milliseconds since the start (``kill``). ``clock-jump:clock`` sets the time of day `by` seconds forth or back, `nth` milliseconds after
    the start.
    """

    kind: Kind
    target: str
    nth: int
    by: float = 0.0
    """Seconds."""

    def __str__(self) -> str:
        return f"{self.kind}:{self.target}#{self.nth}" + (f"{self.by:+g}" if self.by else "")

    def in_words(self) -> str:
        """The fault as a sentence."""
        first, _, second = self.target.partition(">")  # TOPIC>NODE, or NODE>WORK
        nth, by = self.nth, f"{self.by:g} s"
        message = f"message {nth} of {first} to {second}"
        death = f"at step {nth} of {second}" if second else f"at its await number {nth}"
        return {
            "lose": f"{message} is lost",
            "delay": f"{message} is {by} late",
            "duplicate": f"{message} arrives twice",
            "swap": f"{message} arrives after the next one",
            "freeze": f"for {by} the message before {message} arrives again in the place of each",
            "nan": f"all numbers of {message} are NaN",
            "crash": f"{first} dies {death}",
            "kill": f"{self.target} dies {nth / 1000:g} s after the start",
            "slow-start": f"{self.target} takes {by} longer to start, in its life number {nth}",
            "slow-handler": f"the handler run number {nth} of {self.target} takes {by} longer",
            "slow-step": f"step {nth} of {second} in {first} is {by} late",
            "clock-jump": f"the time of day jumps by {by}, {nth / 1000:g} s after the start",
        }[self.kind]


"""The kinds of faults, by the names that they have in text."""


def parse(text: str) -> tuple[Fault, ...]:
    """Read faults back, separated by blanks. Raises `ValueError` naming what cannot be read."""
    return tuple(_parse_one(word) for word in text.split())


def _parse_one(word: str) -> Fault:
    match = _TEXT.fullmatch(word)
    if match is None or match["kind"] not in get_args(Kind):
        raise ValueError(
            f"{word!r} is not a fault: write KIND:TARGET#NTH or KIND:TARGET#NTH+SECONDS, KIND one of {', '.join(get_args(Kind))}"
        )
    return Fault(cast("Kind", match["kind"]), match["target"], int(match["nth"]), float(match["by"] or 0.0))


@dataclass(slots=True)
class Profile:
    """The places where faults can strike, counted in a run without faults."""

    links: dict[str, int] = field(default_factory=dict[str, int])
    """``TOPIC>SUBSCRIBER`` -> messages, to nodes of the tree."""
    watching: dict[str, int] = field(default_factory=dict[str, int])
    """The same to nodes beside the tree, such as a rig; faults are drawn for none of them."""
    numeric: set[str] = field(default_factory=set[str])
    """The links whose messages hold floating-point numbers."""
    awaits: dict[str, int] = field(default_factory=dict[str, int])
    """Node -> how often it resumed from an await while it ran; all nodes of the tree are here."""
    steps: dict[str, int] = field(default_factory=dict[str, int])
    """``NODE>WORK`` -> how many steps a handler, an action's body or a task has made while its node ran."""
    handled: dict[str, int] = field(default_factory=dict[str, int])
    """Node -> how many topic, timer and service handlers it has run; those that ran none are left out."""
    seconds: float = 0.0


class Possible(Protocol):
    """A kind of fault that may occur."""

    def draw(self, rng: Random, profile: Profile) -> list[Fault]:
        """Some faults of this kind, often none."""
        ...


@dataclass(frozen=True, slots=True)
class _OnLinks:
    """Faults of messages: at most `at_most` in a run, on the way to the subscriptions of `topic` (a contract, a name, or a pattern)."""

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
    """A message does not arrive."""


@dataclass(frozen=True, slots=True)
class Duplicate(_OnLinks):
    """A message arrives twice."""

    kind: Kind = field(default="duplicate", init=False, repr=False)


@dataclass(frozen=True, slots=True)
class Reorder(_OnLinks):
    """A message arrives just after its successor."""

    kind: Kind = field(default="swap", init=False, repr=False)


@dataclass(frozen=True, slots=True)
class NotANumber(_OnLinks):
    """All floating-point numbers of a message are NaN."""

    at_most: int = 1
    kind: Kind = field(default="nan", init=False, repr=False)


@dataclass(frozen=True, slots=True)
class Delay(_OnLinks):
    """A message arrives up to `up_to` seconds late; those behind it may overtake it."""

    up_to: float = 0.5
    kind: Kind = field(default="delay", init=False, repr=False)

    def _by(self, rng: Random) -> float:
        return _seconds(rng, self.up_to)


@dataclass(frozen=True, slots=True)
class Freeze(_OnLinks):
    """A sensor repeats its last message for up to `up_to` seconds."""

    at_most: int = 1
    up_to: float = 2.0
    kind: Kind = field(default="freeze", init=False, repr=False)

    def _by(self, rng: Random) -> float:
        return _seconds(rng, self.up_to)


@dataclass(frozen=True, slots=True)
class _OnNodes:
    """Faults of nodes: `node` is a class name, a name, a full name or a pattern."""

    node: type[Node] | str = "*"
    at_most: int = 1

    def _picked(self, rng: Random, counts: Iterable[str]) -> list[str]:
        """The nodes that it hits, out of those that are meant."""
        name = self.node if isinstance(self.node, str) else default_name(self.node)
        nodes = [node for node in sorted(counts) if _is_meant(node, name)]
        return [rng.choice(nodes) for _ in range(rng.randint(1, self.at_most) if nodes else 0)]


@dataclass(frozen=True, slots=True)
class Crash(_OnNodes):
    """A node dies: at one of its awaits or at a step of its work, without time for a clean-up, or between two handlers (``kill``), as
    after an error.

    When there are several, they often come soon after one another: within what supervisors take for one window of restarts.
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
            at += int(1000 * _seconds(rng, SOON))
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
    """A handler, the body of an action or a task of a node goes on up to `up_to` seconds late after one of its awaits."""

    at_most: int = 2
    up_to: float = 2.0  # beyond the timeout of a call, unless it says another

    def draw(self, rng: Random, profile: Profile) -> list[Fault]:
        faults: list[Fault] = []
        for node in self._picked(rng, {work.partition(">")[0] for work in profile.steps}):
            work = rng.choice(_works_of(node, profile))
            faults.append(Fault("slow-step", work, rng.randint(1, profile.steps[work]), _seconds(rng, self.up_to)))
        return faults


@dataclass(frozen=True, slots=True)
class SlowHandler(_OnNodes):
    """A topic, timer or service handler takes up to `up_to` seconds longer; a caller may have given up before it begins."""

    up_to: float = 2.0

    def draw(self, rng: Random, profile: Profile) -> list[Fault]:
        return [
            Fault("slow-handler", node, rng.randint(1, profile.handled[node]), _seconds(rng, self.up_to))
            for node in self._picked(rng, profile.handled)
        ]


@dataclass(frozen=True, slots=True)
class SlowStart(_OnNodes):
    """A node takes up to `up_to` seconds to start, the first time or after a crash."""

    up_to: float = 2.0

    def draw(self, rng: Random, profile: Profile) -> list[Fault]:
        return [
            Fault("slow-start", node, rng.randint(1, 2), _seconds(rng, self.up_to))
            for node in self._picked(rng, profile.awaits)
        ]


@dataclass(frozen=True, slots=True)
class ClockJump:
    """Somebody sets the time of day, up to `up_to` seconds forth or back. What measures durations must not notice."""

    up_to: float = 60.0
    at_most: int = 1

    def draw(self, rng: Random, profile: Profile) -> list[Fault]:
        count = rng.randint(1, self.at_most) if profile.seconds > 0.0 else 0
        return [
            Fault(
                "clock-jump",
                CLOCK,
                rng.randint(0, int(profile.seconds * 1000)),
                rng.choice((-1.0, 1.0)) * _seconds(rng, self.up_to),
            )
            for _ in range(count)
        ]


KINDS: Final[Mapping[Kind, Possible]] = MappingProxyType(
    {
        "lose": Lose(), "delay": Delay(), "duplicate": Duplicate(), "swap": Reorder(), "freeze": Freeze(), "nan": NotANumber(),
        "crash": Crash(at_most=2), "slow-handler": SlowHandler(), "slow-step": SlowStep(), "slow-start": SlowStart(),
        "clock-jump": ClockJump(),
    }
)  # fmt: skip
"""Every kind of fault by the name that it has in text."""
ALL: Final[tuple[Possible, ...]] = tuple(KINDS.values())
"""Every kind of fault, anywhere; of crashes, two at most."""


def draw(possible: Iterable[Possible], seed: int, profile: Profile) -> tuple[Fault, ...]:
    """The faults of one seed: the same for the same seed and profile. Every third seed has none, only its order of events."""
    if seed % 3 == 0:
        return ()
    rng = Random(f"faults/{seed}")
    kinds = list(possible)
    chosen = rng.sample(kinds, rng.randint(1, min(5, len(kinds)))) if kinds else []
    return tuple(dict.fromkeys(fault for kind in chosen for fault in kind.draw(rng, profile)))


def _works_of(node: str, profile: Profile) -> list[str]:
    return [work for work in sorted(profile.steps) if work.startswith(f"{node}>")]


def _is_meant(name: str, pattern: str) -> bool:
    return any(fnmatchcase(name, form) for form in (pattern, f"/{pattern}", f"*/{pattern}"))


def _seconds(rng: Random, up_to: float) -> float:
    """A duration, often a very short one, in whole milliseconds, so that its text is exact."""
    share: float = 10.0 ** rng.uniform(-2.0, 0.0) if rng.random() < 0.5 else rng.random()
    return max(0.001, round(up_to * share, 3))
