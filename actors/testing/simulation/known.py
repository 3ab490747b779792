"""Checks that a fault given as text names something in a system, with suggestions if it does not."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import permutations

from actors.suggest import did_you_mean
from actors.testing.fault_values import CLOCK, OF_NETWORK, ON_LINKS, ROUTER, Fault, Profile

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
