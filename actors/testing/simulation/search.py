"""Looking for a seed that fails, and for the least that makes it fail."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from actors.bag import FlightRecorder
from actors.testing.faults import Fault, Possible, draw
from actors.testing.simulation.trial import Outcome, Scenario, Trial

__all__ = ["Finding", "Playable", "search", "shrink"]


SHRINKING_SECONDS = 120.0
"""Real seconds after which what has been shrunk so far is small enough: each trial of a whole robot takes some."""


class Playable(Protocol):
    """A `Scenario`, or what runs one elsewhere."""

    def play(self, trial: Trial, /) -> Outcome: ...


@dataclass(frozen=True, slots=True)
class Finding:
    """A failure, and the shortest way to it that was found."""

    outcome: Outcome
    """Of the shrunk trial."""
    drawn: int
    """How many faults the seed had before they were shrunk."""
    trials: int
    """How many trials it took to find it, and to shrink it."""

    @property
    def replay(self) -> Trial:
        """The line that replays the failure."""
        return self.outcome.trial

    def record(self, scenario: Scenario) -> FlightRecorder:
        """Run it once more, with a flight recorder."""
        recorder = FlightRecorder()
        replace(scenario, observers=(*scenario.observers, recorder.attach)).play(self.replay)
        return recorder

    def describe(self) -> str:
        """The finding in one line."""
        trial = self.replay
        order = "events in another order" if trial.shuffled else "events in plain order"
        count = len(trial.faults)
        faults = "no fault" if not count else "1 fault" if count == 1 else f"{count} faults"
        shrunk = f" (shrunk from {self.drawn})" if self.drawn > count else ""
        effort = "1 trial" if self.trials == 1 else f"{self.trials} trials"
        what = f"{self.outcome.signature[0]} with {order} and {faults}{shrunk}, seed {trial.seed}"
        return f"{what}, found and shrunk in {effort}"


def search(scenario: Playable, seeds: Iterable[int], possible: Sequence[Possible]) -> Finding | None:
    """Try the plain run, then every seed, until one fails; shrink that. None when all passed."""
    plain = scenario.play(Trial(0, shuffled=False))
    trials = 1
    if plain.error is not None:
        return Finding(plain, 0, trials)
    for seed in seeds:
        outcome = scenario.play(Trial(seed, faults=draw(possible, seed, plain.profile)))
        trials += 1
        if outcome.error is not None:
            shrunk, more = shrink(scenario, outcome)
            return Finding(shrunk, len(outcome.trial.faults), trials + more)
    return None


def shrink(scenario: Playable, failed: Outcome) -> tuple[Outcome, int]:
    """The least trial that fails in the same way: fewer faults (delta debugging), then events in plain order. And how many
    runs it took. After `SHRINKING_SECONDS` it makes do with what it has."""
    best, runs = failed, 0
    end = time.monotonic() + SHRINKING_SECONDS

    def fails(faults: tuple[Fault, ...], shuffled: bool) -> bool:
        nonlocal best, runs
        if time.monotonic() > end:
            return False
        runs += 1
        outcome = scenario.play(Trial(failed.trial.seed, shuffled, faults))
        if outcome.error is None or outcome.signature != failed.signature:
            return False
        best = outcome
        return True

    size = max(1, len(failed.trial.faults) // 2)
    while best.trial.faults:
        faults = best.trial.faults
        without = (faults[:at] + faults[at + size :] for at in range(0, len(faults), size))
        if any(fails(fewer, best.trial.shuffled) for fewer in without):
            size = max(1, min(size, len(best.trial.faults) // 2))
        elif size == 1:
            break
        else:
            size //= 2
    fails(best.trial.faults, False)
    return best, runs
