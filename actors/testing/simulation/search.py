"""Looking for a seed that fails, and for the least that makes it fail."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from actors.testing.faults import Fault, Possible, draw, parse
from actors.testing.simulation.trial import Outcome, Scenario

__all__ = ["Finding", "Replay", "search", "shrink"]


@dataclass(frozen=True, slots=True)
class Replay:
    """All that is needed to run one trial again. As text: the seed, ``fifo`` unless events were shuffled, the faults."""

    seed: int
    shuffled: bool
    faults: tuple[Fault, ...]

    def __str__(self) -> str:
        return " ".join([str(self.seed), *([] if self.shuffled else ["fifo"]), *map(str, self.faults)])

    @classmethod
    def parse(cls, text: str) -> Replay:
        """Read it back. Raises `ValueError`."""
        seed, *rest = text.split() or [""]
        if not seed.isdigit():
            raise ValueError(
                f"{text!r} is no trial: write its seed, then `fifo` if it was not shuffled, then its faults"
            )
        shuffled = rest[:1] != ["fifo"]
        return cls(int(seed), shuffled, parse(" ".join(rest if shuffled else rest[1:])))

    def run(self, scenario: Scenario) -> Outcome:
        return scenario.run(self.seed, shuffled=self.shuffled, faults=self.faults)


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
    def replay(self) -> Replay:
        return Replay(self.outcome.seed, self.outcome.shuffled, self.outcome.faults)

    def describe(self) -> str:
        """What was found, in one line."""
        error = self.outcome.error
        assert error is not None
        order = "events in another order" if self.outcome.shuffled else "events in plain order"
        count = len(self.outcome.faults)
        faults = "no fault" if not count else "1 fault" if count == 1 else f"{count} faults"
        shrunk = f" (shrunk from {self.drawn})" if self.drawn > count else ""
        return f"{type(error).__name__} with {order} and {faults}{shrunk}, seed {self.outcome.seed}"


def search(
    scenario: Scenario,
    seeds: Iterable[int],
    possible: Sequence[Possible],
    *,
    progress: Callable[[int], None] | None = None,
) -> Finding | None:
    """Try the plain run, then every seed, until one fails; shrink that. None when all passed."""
    plain = scenario.run(0, shuffled=False)
    trials = 1
    if plain.error is not None:
        return Finding(plain, 0, trials)
    for seed in seeds:
        outcome = scenario.run(seed, faults=draw(possible, seed, plain.profile))
        trials += 1
        if progress is not None:
            progress(seed)
        if outcome.error is not None:
            shrunk, more = shrink(scenario, outcome)
            return Finding(shrunk, len(outcome.faults), trials + more)
    return None


def shrink(scenario: Scenario, failed: Outcome) -> tuple[Outcome, int]:
    """The least trial that fails in the same way: fewer faults (delta debugging), then events in plain order. And how many runs it took."""
    best, runs = failed, 0

    def fails(faults: tuple[Fault, ...], shuffled: bool) -> bool:
        nonlocal best, runs
        runs += 1
        outcome = scenario.run(failed.seed, shuffled=shuffled, faults=faults)
        if outcome.error is None or outcome.signature != failed.signature:
            return False
        best = outcome
        return True

    size = max(1, len(failed.faults) // 2)
    while best.faults:
        faults = best.faults
        without = (faults[:at] + faults[at + size :] for at in range(0, len(faults), size))
        if any(fails(fewer, best.shuffled) for fewer in without):
            size = max(1, min(size, len(best.faults) // 2))
        elif size == 1:
            break
        else:
            size //= 2
    fails(best.faults, False)
    return best, runs
