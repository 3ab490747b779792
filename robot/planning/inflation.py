"""What it costs to be near things: the weights that the planner pays per metre."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from robot.geometry.vectors import Floats
from robot.model.footprint import Footprint

TURNING_ROOM = 0.25
"""What a body that turns on the spot should have to spare, m; chosen: the sway of its legs, and half as much again for the estimate."""
_LETHAL, _INSCRIBED, _FREE = 100, 99, 98
"""Costs of a cell in a message, as Nav2 publishes them: in an obstacle, nearer to one than half the body's width, and the most below."""
AVERSION = 10.0
"""Chosen: a metre along a wall costs as much as eleven in the open, so a way round of some metres is worth it."""


@dataclass(frozen=True, slots=True)
class Inflation:
    """How the clearance of the robot's middle becomes cost. Distances in metres."""

    inscribed: float
    """No middle of the robot nearer than this to anything."""
    comfort: float
    """From this clearance on a metre costs a metre."""
    aversion: float = AVERSION
    """A metre at the inscribed distance costs as much as 1 + aversion metres in the open."""

    @classmethod
    def for_footprint(cls, footprint: Footprint, margin: float) -> Self:
        """For a body of this outline that keeps `margin` metres to each side of it when it walks straight on.

        Comfort is where the body can turn on the spot with room to spare, to the centimetre.
        """
        return cls(footprint.inscribed + margin, round(footprint.circumscribed + TURNING_ROOM, 2))

    def weights(self, clearance: Floats) -> Floats:
        """Price of a metre in each cell: 1 with comfort, growing with the square of what is missing, inf where it may not go.

        It is flat in the open on purpose: the exponential that is usual for cost maps never ends, and draws straight walks into the
        middle of every aisle.
        """
        missing = np.clip((self.comfort - clearance) / (self.comfort - self.inscribed), 0.0, 1.0)
        return np.where(clearance < self.inscribed, np.inf, 1.0 + self.aversion * missing * missing)

    def occupancy(self, clearance: Floats) -> NDArray[np.int8]:
        """The same on the scale of Nav2's costmaps: 100 in an obstacle, 99 where the middle may not go, below that 98 shares of the aversion."""
        missing = np.clip((self.comfort - clearance) / (self.comfort - self.inscribed), 0.0, 1.0)
        free = np.rint(_FREE * missing * missing)
        return np.where(clearance <= 0.0, _LETHAL, np.where(clearance < self.inscribed, _INSCRIBED, free)).astype(
            np.int8
        )
