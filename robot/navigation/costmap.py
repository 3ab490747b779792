"""What it costs to be near things: nav2's inflation, and the weights that the planner pays per meter."""

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
    """How clearance becomes cost. The decay is nav2's: exp(-decay (clearance - inscribed)) (inflation layer, cost
    scaling factor 3).
    """

    inscribed: float = 0.30
    """No middle of the robot nearer than this to anything, m: half its width, and 5 cm for the sway of its legs."""
    decay: float = 3.0
    """Per meter."""
    aversion: float = 5.0
    """A meter at the inscribed distance costs as much as 1 + aversion meters in the open."""
    radius: float = 1.5
    """Farther than this from everything, cost is zero, m."""

    def costs(self, clearance: Floats) -> NDArray[np.uint8]:
        """nav2 costs of cells from their clearance (m): 254 in obstacles, 253 within the inscribed radius, then 252
        exp(...).
        """
        soft = 252.0 * np.exp(-self.decay * (np.minimum(clearance, 1e3) - self.inscribed))
        soft = np.where(clearance > self.radius, 0.0, np.minimum(soft, 252.0))
        cells = np.where(clearance < self.inscribed, float(INSCRIBED), soft)
        return np.where(clearance <= 0.0, LETHAL, cells).astype(np.uint8)

    def weights(self, clearance: Floats) -> Floats:
        """Price of a meter in each cell: 1 in the open, up to 1 + aversion near things, inf where the middle may not
        go.
        """
        closeness = np.exp(-self.decay * (np.minimum(clearance, 1e3) - self.inscribed))
        price = 1.0 + self.aversion * np.where(clearance > self.radius, 0.0, closeness)
        return np.asarray(np.where(clearance < self.inscribed, np.inf, price), dtype=np.float64)
