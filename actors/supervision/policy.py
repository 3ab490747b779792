"""The options of supervision: when a child is restarted, which others with it, how often, and after which delay."""

from __future__ import annotations

import math
from random import Random
from typing import Final, Literal, TypeAlias

import msgspec

from actors.checks import is_number, is_whole
from actors.errors import DeclarationError

Restart: TypeAlias = Literal["permanent", "transient", "temporary"]
"""When a child that has ended is started again."""
permanent: Final = "permanent"
"""Restarted whenever it ends by itself, however it ends."""
transient: Final = "transient"
"""Restarted only when it fails; returning, or `raise Stop`, ends it for good."""
temporary: Final = "temporary"
"""Never restarted, and forgotten once it has ended."""

Strategy: TypeAlias = Literal["one_for_one", "one_for_all", "rest_for_one"]
"""Which children are restarted when one has failed."""
one_for_one: Final = "one_for_one"
"""Only the child that failed is restarted."""
one_for_all: Final = "one_for_all"
"""All children are stopped, last first, and started again in order."""
rest_for_one: Final = "rest_for_one"
"""The children declared after the one that failed are stopped, last first, and started again with it, in order."""

AutoShutdown: TypeAlias = Literal["never", "any_significant", "all_significant"]
"""Whether a supervisor shuts down once significant children have ended by themselves."""
never: Final = "never"
"""The supervisor goes on when significant children have ended."""
any_significant: Final = "any_significant"
"""The supervisor shuts down as soon as one significant child has ended by itself, for good."""
all_significant: Final = "all_significant"
"""The supervisor shuts down when its last significant child has ended by itself, for good."""

StopTimeout: TypeAlias = float | Literal["kill"]
"""Seconds that a child has for its clean-up: `math.inf` sets no limit, "kill" leaves no time for a clean-up."""

Kind: TypeAlias = Literal["worker", "supervisor"]
"""The kind of a child: a node ("worker") or a supervisor."""


class Intensity(msgspec.Struct, frozen=True):
    """At most `restarts` restarts are allowed in any `within` seconds (a sliding window); with one more the supervisor gives up.

    Failed attempts count. The default is 3 restarts within 5 s, as in Elixir. (OTP allows 1, but a robot's USB devices
    often come back at the second attempt.)
    """

    restarts: int = 3
    within: float = 5.0

    def __post_init__(self) -> None:
        if not is_whole(self.restarts) or self.restarts < 0:
            raise DeclarationError(f"Intensity: restarts must be a whole number, 0 or more, not {self.restarts!r}")
        if not is_number(self.within) or not 0 < self.within < math.inf:
            raise DeclarationError(f"Intensity: within must be seconds, more than 0 and finite, not {self.within!r}")


class Backoff(msgspec.Struct, frozen=True):
    """The delay before a restart: `first` seconds, then `factor` times longer each time, but at most `most` seconds.

    Each delay is lengthened at random, by up to `jitter` times itself (from the system's seeded generator), so that
    children that failed together do not restart together. After a life of at least `reset_after` seconds the delay is
    `first` again. Source: Apache Pekko, `SupervisorStrategy.restartWithBackoff`.
    """

    first: float
    most: float
    factor: float = 2.0
    jitter: float = 0.2

    def __post_init__(self) -> None:
        for option in ("first", "most", "factor", "jitter"):
            if not is_number(value := getattr(self, option)) or not math.isfinite(value):
                raise DeclarationError(f"Backoff: {option} must be a finite number, not {value!r}")
        if not 0 < self.first <= self.most:
            raise DeclarationError(f"Backoff: needs 0 < first <= most, not first={self.first!r}, most={self.most!r}")
        if self.factor < 1:
            raise DeclarationError(f"Backoff: factor must be 1 or more, not {self.factor!r}")
        if self.jitter < 0:
            raise DeclarationError(f"Backoff: jitter must be 0 or more, not {self.jitter!r}")

    @property
    def reset_after(self) -> float:
        """Seconds of life after which the next delay is `first` again: the mean of `first` and `most`."""
        return (self.first + self.most) / 2

    def delay(self, earlier: int, rng: Random) -> float:
        """Seconds to wait before the next attempt, after `earlier` attempts in a row that did not hold."""
        try:
            plain = min(self.most, self.first * self.factor**earlier)
        except OverflowError:
            plain = self.most
        return plain * (1.0 + rng.random() * self.jitter)
