"""The faults of a simulated run, as values, and their generation from a seed.

A `Fault` is concrete ("the 12th message from /scan to /planner is lost"). It can be written as text and read back, so that a failing run is
replayed from one line. `Lose`, `Delay`, `Crash` and the others say which faults are possible; each draws faults from a seed and from the
`Profile` of a run without faults.
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
"""The kinds of faults, by their names in text."""
CLOCK = "clock"
SOON = 5.0
"""The period, in seconds, within which drawn crashes follow one another: the default restart window of a supervisor."""
_TEXT = re.compile(r"(?P<kind>[a-z-]+):(?P<target>[^#+]+)#(?P<nth>\d+)(?P<by>[+-]\d+(\.\d+)?(e-?\d+)?)?")


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault. Its text is ``KIND:TARGET#NTH+SECONDS``, such as ``delay:/scan>/planner#12+0.25``.

    * For faults of messages, the target is ``TOPIC>SUBSCRIBER`` and `nth` counts its messages from 1.
    * For ``slow-step``, and for ``crash`` at a step of work, it is ``NODE>WORK``: a handler, the body of an action or a task of the node.
      `nth` counts the steps from one await to the next.
    * Otherwise it is a node. `nth` counts its awaits (``crash``), handler runs (``slow-handler``), incarnations (``slow-start``), or
      milliseconds since the start (``kill``).
    * ``clock-jump:clock`` moves the time of day by `by` seconds, which may be negative, `nth` milliseconds after the start.
    """

    kind: Kind
    target: str
    nth: int
    by: float = 0.0
    """The size of the fault, in seconds."""

    def __str__(self) -> str:
        return f"{self.kind}:{self.target}#{self.nth}" + (f"{self.by:+g}" if self.by else "")

    def in_words(self) -> str:
        """A sentence that describes the fault."""
        first, _, second = self.target.partition(">")  # TOPIC>NODE or NODE>WORK
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


"""The kinds of faults, by their names in text."""


def parse(text: str) -> tuple[Fault, ...]:
    """Parse faults separated by blanks. Raises `ValueError` that names the part that cannot be parsed."""
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
    """The places where faults can occur, counted in a run without faults."""

    links: dict[str, int] = field(default_factory=dict[str, int])
    """``TOPIC>SUBSCRIBER`` -> the number of messages, for subscribers in the tree."""
    watching: dict[str, int] = field(default_factory=dict[str, int])
    """The same for subscribers outside the tree, such as a rig. No faults are drawn for them."""
    numeric: set[str] = field(default_factory=set[str])
    """The links whose messages contain floating-point numbers."""
    awaits: dict[str, int] = field(default_factory=dict[str, int])
    """Node -> how often it resumed from an await while it ran. Contains all nodes of the tree."""
    steps: dict[str, int] = field(default_factory=dict[str, int])
    """``NODE>WORK`` -> the number of steps of a handler, an action body or a task while its node ran."""
    handled: dict[str, int] = field(default_factory=dict[str, int])
    """Node -> the number of topic, timer and service handlers run. Nodes that ran none are left out."""
    seconds: float = 0.0


class Possible(Protocol):
    """A kind of fault that a run may have."""

    def draw(self, rng: Random, profile: Profile) -> list[Fault]:
        """Draw some faults of this kind; often none."""
        ...


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
    """A handler, an action body or a task of a node resumes up to `up_to` seconds late after one of its awaits."""

    at_most: int = 2
    up_to: float = 2.0  # longer than the default timeout of a call

    def draw(self, rng: Random, profile: Profile) -> list[Fault]:
        faults: list[Fault] = []
        for node in self._picked(rng, {work.partition(">")[0] for work in profile.steps}):
            work = rng.choice(_works_of(node, profile))
            faults.append(Fault("slow-step", work, rng.randint(1, profile.steps[work]), _seconds(rng, self.up_to)))
        return faults


@dataclass(frozen=True, slots=True)
class SlowHandler(_OnNodes):
    """A topic, timer or service handler takes up to `up_to` seconds longer. A caller may have given up before it begins."""

    up_to: float = 2.0

    def draw(self, rng: Random, profile: Profile) -> list[Fault]:
        return [
            Fault("slow-handler", node, rng.randint(1, profile.handled[node]), _seconds(rng, self.up_to))
            for node in self._picked(rng, profile.handled)
        ]


@dataclass(frozen=True, slots=True)
class SlowStart(_OnNodes):
    """A node takes up to `up_to` seconds longer to start, at first or after a crash."""

    up_to: float = 2.0

    def draw(self, rng: Random, profile: Profile) -> list[Fault]:
        return [
            Fault("slow-start", node, rng.randint(1, 2), _seconds(rng, self.up_to))
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
"""Every kind of fault, by its name in text."""
ALL: Final[tuple[Possible, ...]] = tuple(KINDS.values())
"""Every kind of fault, anywhere, with at most two crashes."""


def draw(possible: Iterable[Possible], seed: int, profile: Profile) -> tuple[Fault, ...]:
    """Draw the faults of a seed. The same seed and profile give the same faults. Every third seed has none and only changes the order of
    events."""
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
    """Draw a duration in whole milliseconds, so that its text is exact. Very short ones are frequent."""
    share: float = 10.0 ** rng.uniform(-2.0, 0.0) if rng.random() < 0.5 else rng.random()
    return max(0.001, round(up_to * share, 3))
