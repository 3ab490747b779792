"""The values of faults: what may go wrong in a run as a `Fault` that can be written as text and read back."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import permutations
from random import Random
from typing import Final, Literal, Protocol, TypeAlias, cast, get_args

from actors.suggest import did_you_mean

Kind: TypeAlias = Literal[
    "lose", "delay", "duplicate", "swap", "freeze", "nan", "crash", "kill", "slow-start", "slow-handler", "slow-step", "clock-jump",
    "cut", "link-loss", "link-delay", "link-duplicate", "link-reorder", "host-crash", "host-pause", "router-stop", "clock-offset",
]  # fmt: skip
"""The kinds of faults, by their names in text. Those from ``cut`` on are faults of the network of a `Lab`."""
ON_LINKS: Final[tuple[Kind, ...]] = ("cut", "link-loss", "link-delay", "link-duplicate", "link-reorder")
"""The kinds of faults of the links between hosts."""
OF_NETWORK: Final[tuple[Kind, ...]] = (*ON_LINKS, "host-crash", "host-pause", "router-stop", "clock-offset")
"""The kinds of faults of a network and its hosts."""
CLOCK = "clock"
ROUTER = "router"
_TEXT = re.compile(
    r"(?P<kind>[a-z-]+):(?P<target>[^#+]+)#(?P<nth>\d+)(?P<by>[+-]\d+(\.\d+)?(e-?\d+)?)?"
    r"(\*(?P<size>\d+(\.\d+)?(e-?\d+)?))?"
)


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault. Its text is ``KIND:TARGET#NTH+SECONDS``, such as ``delay:/scan>/planner#12+0.25``.

    * For faults of messages, the target is ``TOPIC>SUBSCRIBER`` and `nth` counts its messages from 1.
    * For ``slow-step``, and for ``crash`` at a step of work, it is ``NODE>WORK``: a handler, the body of an action or a task of the node.
      `nth` counts the steps from one await to the next.
    * Otherwise it is a node. `nth` counts its awaits (``crash``), handler runs (``slow-handler``), incarnations (``slow-start``), or
      milliseconds since the start (``kill``).
    * ``clock-jump:clock`` moves the time of day by `by` seconds, which may be negative, `nth` milliseconds after the start.
    * Faults of a network begin `nth` milliseconds after the start and last for `by` seconds. The target of ``cut`` and ``link-...`` is a
      link: ``robot=desk``, or in one direction ``robot>desk``. Their `size` is a share of the messages, or seconds (``link-delay``). The
      target of ``host-crash`` is a host, which is rebooted at the end, that of ``host-pause`` one whose processes stand still, and that of
      ``router-stop`` is ``router``. ``clock-offset`` moves the time of day of a host by `by` seconds, for good.
    """

    kind: Kind
    target: str
    nth: int
    by: float = 0.0
    """How long the fault lasts, or by how much it is late, in seconds."""
    size: float = 0.0
    """For faults of links, how bad they are."""

    def __str__(self) -> str:
        size = f"*{self.size:g}" if self.size else ""
        return f"{self.kind}:{self.target}#{self.nth}" + (f"{self.by:+g}" if self.by else "") + size

    def in_words(self) -> str:
        """A sentence that describes the fault."""
        first, _, second = self.target.partition(">")  # TOPIC>NODE or NODE>WORK
        nth, by = self.nth, f"{self.by:g} s"
        message = f"message {nth} of {first} to {second}"
        death = f"at step {nth} of {second}" if second else f"at its await number {nth}"
        if self.kind in OF_NETWORK:
            return f"from {nth / 1000:g} s after the start {self._on_the_network()}"
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

    def _on_the_network(self) -> str:
        one, arrow, other = self.target.partition("=") if "=" in self.target else self.target.partition(">")
        link = f"between {one} and {other}" if arrow == "=" else f"from {one} to {other}"
        lasting, share = f"for {self.by:g} s", f"{self.size:.0%} of the messages {link}"
        return {
            "cut": f"nothing passes {link}, {lasting}",
            "link-loss": f"{share} are lost, {lasting}",
            "link-delay": f"messages {link} are up to {self.size:g} s late, {lasting}",
            "link-duplicate": f"{share} arrive twice, {lasting}",
            "link-reorder": f"{share} are overtaken, {lasting}",
            "host-crash": f"the host {self.target} is without power, {lasting}",
            "host-pause": f"the processes of {self.target} stand still, {lasting}",
            "router-stop": f"there is no {self.target}, {lasting}",
            "clock-offset": f"the time of day of {self.target} is {self.by:+g} s ahead",
        }[self.kind]


def parse(text: str) -> tuple[Fault, ...]:
    """Parse faults separated by blanks. Raises `ValueError` that names the part that cannot be parsed."""
    return tuple(_parse_one(word) for word in text.split())


def _parse_one(word: str) -> Fault:
    match = _TEXT.fullmatch(word)
    sized = match is not None and match["size"] is not None
    if match is None or match["kind"] not in get_args(Kind) or (sized and match["kind"] not in ON_LINKS):
        raise ValueError(
            f"{word!r} is not a fault: write KIND:TARGET#NTH, KIND:TARGET#NTH+SECONDS or KIND:TARGET#NTH+SECONDS*SIZE, KIND one of {', '.join(get_args(Kind))}"
        )
    by, size = (float(match[name] or 0.0) for name in ("by", "size"))
    return Fault(cast("Kind", match["kind"]), match["target"], int(match["nth"]), by, size)


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
    hosts: dict[str, bool] = field(default_factory=dict[str, bool])
    """Host of a `Lab` -> whether it runs a tree. Without hosts there are no faults of the network."""
    router: bool = False
    """Whether the network has a router."""
    seconds: float = 0.0
    faulty_seconds: float = 0.0
    """How long faults of the network could occur: until the body has called `Lab.recover`."""


class Possible(Protocol):
    """A kind of fault that a run may have."""

    def draw(self, rng: Random, profile: Profile) -> list[Fault]:
        """Draw some faults of this kind; often none."""
        ...


def drawn_seconds(rng: Random, up_to: float) -> float:
    """Draw a duration in whole milliseconds, so that its text is exact. Very short ones are frequent."""
    share: float = 10.0 ** rng.uniform(-2.0, 0.0) if rng.random() < 0.5 else rng.random()
    return max(0.001, round(up_to * share, 3))


MOST = 12
"""The maximum number of names listed."""


def names_nothing(faults: Iterable[Fault], profiles: Sequence[Profile]) -> str:
    """The error text for the first fault whose target is in none of the profiles, with possible targets; empty if there is none."""
    for fault in faults:
        known = {name for profile in profiles for name in _counts(fault, profile)}
        if fault.target in known:
            continue
        shown = ", ".join(sorted(known)[:MOST]) + (", ..." if len(known) > MOST else "")
        guess = did_you_mean(fault.target, sorted(known), " Did", quoted=False)
        return f"{fault} names nothing in this system.{guess} There is: {shown or 'nothing for a fault of this kind'}"
    return ""


def not_come(fault: Fault, profile: Profile) -> str:
    """Why a fault did not occur in the run with this profile; empty if it did."""
    count = _counts(fault, profile).get(fault.target, 0)
    return f"{fault} has not come to pass: the count ended at {count}" if fault.nth > count else ""


def _counts(fault: Fault, profile: Profile) -> dict[str, int]:
    """The possible targets of a fault of this kind, with their counts."""
    milliseconds = int(profile.seconds * 1000)
    if fault.kind in ("lose", "delay", "duplicate", "swap", "freeze", "nan"):
        return profile.links | profile.watching
    if fault.kind in OF_NETWORK:
        return dict.fromkeys(_network(fault, profile), int(profile.faulty_seconds * 1000))
    if fault.kind == "clock-jump":
        return {CLOCK: milliseconds}
    if fault.kind == "slow-step" or (fault.kind == "crash" and ">" in fault.target):
        return profile.steps
    if fault.kind == "slow-handler":
        return profile.handled
    return profile.awaits if fault.kind == "crash" else dict.fromkeys(profile.awaits, milliseconds)


def _network(fault: Fault, profile: Profile) -> list[str]:
    """The possible targets of a fault of the network."""
    if fault.kind in ON_LINKS:
        return [f"{one}{sign}{other}" for one, other in permutations(profile.hosts, 2) for sign in "=>"]
    if fault.kind == "router-stop":
        return [ROUTER] if profile.router else []
    return list(profile.hosts)
