"""Axes with round numbers: from values to pixels, and where to write which number."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, floor, log10

__all__ = ["Axis", "spanning"]


@dataclass(frozen=True, slots=True)
class Axis:
    """Values from `low` to `high` lie on pixels from `start` to `end`; numbers stand at multiples of `step`."""

    low: float
    high: float
    start: float
    end: float
    step: float

    def pixel(self, value: float) -> float:
        return self.start + (value - self.low) / (self.high - self.low) * (self.end - self.start)

    def ticks(self) -> list[tuple[float, str]]:
        """Pixel and number of every tick."""
        digits = max(0, -floor(log10(self.step) + 1e-9))
        first, last = ceil(self.low / self.step - 1e-9), floor(self.high / self.step + 1e-9)
        return [(self.pixel(k * self.step), f"{k * self.step:.{digits}f}") for k in range(first, last + 1)]


def spanning(low: float, high: float, start: float, end: float, ticks: int) -> Axis:
    """An axis over at least [low, high] with at most about so many ticks at steps of 1, 2 or 5; it begins and ends on a tick."""
    high = max(high, low + 1e-3)
    step = _round_step((high - low) / ticks)
    return Axis(floor(low / step + 1e-9) * step, ceil(high / step - 1e-9) * step, start, end, step)


def _round_step(raw: float) -> float:
    magnitude = 10.0 ** floor(log10(raw))
    return next(m * magnitude for m in (1.0, 2.0, 5.0, 10.0) if m * magnitude >= raw - 1e-12)
