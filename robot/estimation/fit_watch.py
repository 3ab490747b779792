"""Whether the scans of the last seconds fit where the robot is believed to be, and when it is time to look on the whole map."""

from __future__ import annotations

from typing import Final

TRACKING: Final = "tracking"
BLIND: Final = "blind"
LOST: Final = "lost"
AMBIGUOUS: Final = "ambiguous"

GOOD: Final = 0.8
"""Scans of at least this quality fit: in a hall as it is on the map all but some per cent of the beams do."""
DOUBTFUL_FOR: Final = 2.0
"""Seconds of scans that do not fit after which the whole map is searched; more than a passer-by takes."""
LOST_AFTER: Final = 1.0
"""Seconds in which every scan has been refused, after which the robot is lost."""
BLIND_AFTER: Final = 1.0
"""Seconds without a return, where the map has walls in reach, after which the LiDAR is blind."""
SOONEST, LATEST = 2.0, 60.0
"""Seconds between two searches: twice as long after each that found the robot where it was believed to be, or nothing that is certain; while
the robot is lost they stay as they are."""


class FitWatch:
    """Judges scan by scan. Times are of the scans, s; they never go back.

    `state` is one of `TRACKING`, `BLIND`, `LOST` and `AMBIGUOUS`. Only a search that finds the robot ends a state of being lost, or scans that fit
    again; scans do not end that several places are alike: `searched` with a find, `confirmed` or `given_up` does.
    """

    def __init__(self, state: str = TRACKING) -> None:
        """`state` is what an earlier watch has found."""
        self.state = state
        self._fitted: float | None = None
        """When a scan last fitted well."""
        self._taken: float | None = None
        """When a scan was last taken for the pose."""
        self._seen: float | None = None
        """When a scan last had returns."""
        self._pause = SOONEST
        self._searched = float("-inf")

    def nothing(self, now: float, *, expected: bool) -> None:
        """A scan had too few returns to tell anything; `expected` says that the map has walls in reach."""
        if self._seen is None or not expected:
            self._seen = now
        if now - self._seen > BLIND_AFTER and self.state == TRACKING:
            self.state = BLIND

    def fit(self, now: float, quality: float, *, accepted: bool) -> None:
        """A scan fitted the map with this quality, and was taken for the pose, or not."""
        self._seen = now
        if accepted or self._taken is None:
            self._taken = now
        if quality >= GOOD or self._fitted is None:
            self._fitted = now
        if quality >= GOOD:
            self._pause = SOONEST
        if self.state == AMBIGUOUS:
            return
        if now - self._taken > LOST_AFTER:
            self.state = LOST
        elif accepted and (self.state == BLIND or quality >= GOOD):
            self.state = TRACKING

    def wants_search(self, now: float) -> bool:
        """Whether scans have not fitted for so long that the whole map is to be searched now."""
        doubtful = self._fitted is not None and now - self._fitted > DOUBTFUL_FOR
        return (doubtful or self.state == LOST) and now - self._searched >= self._pause

    def searched(self, now: float, *, found: bool) -> None:
        """A search has ended; `found` says that it has told, with certainty, another place than the one that was believed."""
        self._searched = now
        if found:
            self.state, self._fitted, self._taken, self._pause = TRACKING, now, now, SOONEST
        elif self.state != LOST:
            self._pause = min(2.0 * self._pause, LATEST)

    def ambiguous(self, now: float) -> None:
        """A search has told several places that are alike, and not the one that was believed."""
        self.state, self._searched = AMBIGUOUS, now

    def given_up(self) -> None:
        """None of the places that were alike fits any more, or somebody has said that the robot is at none of them, and it is not there either."""
        self.state, self._pause = LOST, SOONEST

    def confirmed(self, now: float) -> None:
        """A search has told that the robot is where it was believed to be: it is the hall that has changed."""
        self.state = TRACKING
        self._taken = self._fitted = now
