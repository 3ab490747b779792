"""What it costs to be near things: nav2's inflation for maps that are shown, and the weights that the planner pays per meter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["INSCRIBED", "LETHAL", "Inflation"]

Floats = NDArray[np.float64]

LETHAL, INSCRIBED = 254, 253
"""nav2's costs of an obstacle, and of a place where the middle of the robot would touch one."""


@dataclass(frozen=True, slots=True)
class Inflation:
    """How the clearance of the robot's middle becomes cost. Distances in metres."""

    inscribed: float = 0.30
    """No middle of the robot nearer than this to anything: half its width, and 5 cm for the sway of its legs."""
    comfort: float = 0.85
    """From this clearance on a meter costs a meter: the robot can turn there (0.6 m) with 0.25 m to spare."""
    aversion: float = 10.0
    """A meter at the inscribed distance costs as much as 1 + aversion meters in the open."""

    def costs(self, clearance: Floats, decay: float = 3.0, radius: float = 0.70) -> NDArray[np.uint8]:
        """nav2's costs of cells: 254 in obstacles, 253 within the inscribed radius, then 252 exp(-decay (clearance - inscribed)).

        Zero beyond `radius` from the inscribed distance. `decay` (per metre) and `radius` are nav2's defaults.
        """
        near = np.minimum(clearance, self.inscribed + radius)
        soft = 252.0 * np.exp(-decay * np.maximum(near - self.inscribed, 0.0))
        soft = np.where(clearance > self.inscribed + radius, 0.0, soft)
        cells = np.where(clearance < self.inscribed, float(INSCRIBED), soft)
        return np.where(clearance <= 0.0, LETHAL, cells).astype(np.uint8)

    def weights(self, clearance: Floats) -> Floats:
        """Price of a meter in each cell: 1 with comfort, growing with the square of what is missing, inf where it may not go.

        It is flat in the open on purpose: nav2's exponential never ends, and draws straight walks into the middle of every aisle.
        """
        missing = np.clip((self.comfort - clearance) / (self.comfort - self.inscribed), 0.0, 1.0)
        return np.where(clearance < self.inscribed, np.inf, 1.0 + self.aversion * missing * missing)
