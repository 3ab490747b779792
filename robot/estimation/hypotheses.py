"""Places that one scan could not tell from each other: weighed by one scan after the other, while odometry carries them along."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from robot.estimation.relocalize import Relocalizer
from robot.geometry.planar import Pose2, compose, inverse
from robot.geometry.vectors import Floats

_FEWEST = 10
"""Scans that are weighed at least: a second, in which noise and drop-outs even out."""
_SHARE = 0.1
"""Of the newest scan in the mean of the last ones: what was seen a second ago counts for a third."""
_LEAD = 0.02
"""By which the mean score of the right place is higher, where it fits as well as can be: two of a hundred beams; chosen."""
_DOUBT = 0.2
"""Of what the best place does not explain, so much is added to the lead that is asked for: a hall that has changed misleads; chosen."""


class PoseHypotheses:
    """At least one place, each carried along by odometry and fitted to every scan.

    `moved` is where odometry had the robot when a scan was taken.
    """

    def __init__(self, relocalizer: Relocalizer, places: Sequence[Pose2], moved: Pose2) -> None:
        self._relocalizer = relocalizer
        self._offsets = [compose(place, inverse(moved)) for place in places]
        self._means = [0.0] * len(places)
        self.scans = 0
        """So many have been weighed."""

    def __repr__(self) -> str:
        return f"<PoseHypotheses: mean scores {[round(mean, 3) for mean in self._means]} after {self.scans} scans>"

    def __len__(self) -> int:
        return len(self._offsets)

    def weighing(self, ranges: Floats, moved: Pose2) -> Iterator[Pose2]:
        """Judge all places by a level scan of `ranges` (m), in pieces of about half a millisecond: each gives where the robot would be.

        Weigh one scan to its end before the next one, and before odometry starts over.
        """
        self.scans += 1
        share = max(_SHARE, 1.0 / self.scans)
        for number, offset in enumerate(self._offsets):
            pose = self._relocalizer.track(compose(offset, moved), ranges)
            self._offsets[number] = compose(pose, inverse(moved))
            self._means[number] += share * (self._relocalizer.score(pose, ranges) - self._means[number])
            yield pose

    def start_over(self, before: Pose2, after: Pose2) -> None:
        """Odometry has gone from `before` to `after` while the robot stood: each place stays where it is on the map."""
        self._offsets = [compose(compose(offset, before), inverse(after)) for offset in self._offsets]

    @property
    def best(self) -> float:
        """The highest mean score."""
        return max(self._means)

    def offset(self) -> Pose2 | None:
        """From odom to map by the place that is known to be the right one; None while two are alike."""
        if self.scans < _FEWEST:
            return None
        order = sorted(range(len(self)), key=lambda number: -self._means[number])
        first = self._means[order[0]]
        lead = first - self._means[order[1]] if len(order) > 1 else 1.0
        return self._offsets[order[0]] if lead >= _LEAD + _DOUBT * max(0.0, 1.0 - first) else None
