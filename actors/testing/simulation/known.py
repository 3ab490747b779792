"""Whether a fault that somebody wrote down names anything in a system, and what else there is."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from actors.suggest import did_you_mean
from actors.testing.faults import CLOCK, Fault, Profile

__all__ = ["names_nothing", "not_come"]

MOST = 12
"""The number of names that are listed."""


def names_nothing(faults: Iterable[Fault], profiles: Sequence[Profile]) -> str:
    """The complaint about the first fault whose target is in none of these profiles, with possible targets; empty if there is none."""
    for fault in faults:
        known = {name for profile in profiles for name in _counts(fault, profile)}
        if fault.target in known:
            continue
        shown = ", ".join(sorted(known)[:MOST]) + (", ..." if len(known) > MOST else "")
        guess = did_you_mean(fault.target, sorted(known), " Did", quoted=False)
        return f"{fault} names nothing in this system.{guess} There is: {shown or 'nothing for a fault of this kind'}"
    return ""


def not_come(fault: Fault, profile: Profile) -> str:
    """Why a fault has had nothing to strike in the run with this profile; empty if it had."""
    count = _counts(fault, profile).get(fault.target, 0)
    return f"{fault} has not come to pass: the count ended at {count}" if fault.nth > count else ""


def _counts(fault: Fault, profile: Profile) -> dict[str, int]:
    """The targets that a fault of this kind may name, and how far each was counted."""
    milliseconds = int(profile.seconds * 1000)
    if fault.kind in ("lose", "delay", "duplicate", "swap", "freeze", "nan"):
        return profile.links | profile.watching
    if fault.kind == "clock-jump":
        return {CLOCK: milliseconds}
    if fault.kind == "slow-step" or (fault.kind == "crash" and ">" in fault.target):
        return profile.steps
    if fault.kind == "slow-handler":
        return profile.handled
    return profile.awaits if fault.kind == "crash" else dict.fromkeys(profile.awaits, milliseconds)
