"""The search for a failing seed, and its reduction to the smallest trial that still fails."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from actors.bag import FlightRecorder
from actors.testing.faults import Fault, Possible, aims_at_nothing, draw
from actors.testing.simulation.trial import Outcome, Scenario, Trial

SHRINKING_SECONDS = 120.0
"""How many seconds of real time the reduction may take. A trial of a whole robot can take several seconds."""


class Playable(Protocol):
    """A `Scenario`, or an object that plays one in another process."""

    def play(self, trial: Trial, /) -> Outcome: ...


@dataclass(frozen=True, slots=True)
class Finding:
    """A failure, and the smallest trial found that causes it."""

    outcome: Outcome
    """The outcome of the reduced trial."""
    drawn: int
    """The number of faults of the seed before the reduction."""
    trials: int
    """The number of trials that the search and the reduction took."""

    @property
    def replay(self) -> Trial:
        """The trial that replays the failure."""
        return self.outcome.trial

    def record(self, scenario: Scenario) -> FlightRecorder:
        """Play the trial once more with a flight recorder, and return the recorder."""
        recorder = FlightRecorder()
        replace(scenario, observers=(*scenario.observers, recorder.attach)).play(self.replay)
        return recorder

    def describe(self) -> str:
        """A one-line description of the finding."""
        trial = self.replay
        order = "events in another order" if trial.shuffled else "events in plain order"
        count = len(trial.faults)
        faults = "no fault" if not count else "1 fault" if count == 1 else f"{count} faults"
        shrunk = f" (shrunk from {self.drawn})" if self.drawn > count else ""
        effort = "1 trial" if self.trials == 1 else f"{self.trials} trials"
        what = f"{self.outcome.signature[0]} with {order} and {faults}{shrunk}, seed {trial.seed}"
        return f"{what}, found and shrunk in {effort}"


def search(scenario: Playable, seeds: Iterable[int], possible: Sequence[Possible]) -> Finding | None:
    """Play the trial without faults and then every seed until one fails, and reduce that one. Returns None if all passed.

    Raises `ValueError` for a kind of fault that names a topic, node or host that the trial without faults does not have.
    """
    plain = scenario.play(Trial(0, shuffled=False))
    trials = 1
    if plain.error is not None:
        return Finding(plain, 0, trials)
    if strange := aims_at_nothing(possible, plain.profile):
        raise ValueError(strange)
    for seed in seeds:
        outcome = scenario.play(Trial(seed, faults=draw(possible, seed, plain.profile)))
        trials += 1
        if outcome.error is not None:
            shrunk, more = shrink(scenario, outcome)
            return Finding(shrunk, len(outcome.trial.faults), trials + more)
    return None


def shrink(scenario: Playable, failed: Outcome) -> tuple[Outcome, int]:
    """Return the smallest trial that fails in the same way, and the number of runs it took.

    Faults are removed first (delta debugging), then events are put in plain order. After `SHRINKING_SECONDS` the best result so far is
    returned.
    """
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
