"""How near a body would be to things around the robot, at one instant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot.estimation.movers import Mover
from robot.geometry.planar import Pose2
from robot.geometry.vectors import Floats
from robot.model.footprint import Footprint
from robot.planning.grid import Grid


@dataclass(frozen=True, slots=True)
class LocalField:
    """Distances within a square around the robot, and what moves there; made by `LocalCostmap.local_field`. Its arrays are never written."""

    grid: Grid
    footprint: Footprint
    fine: Floats
    """Distance to the nearest thing that stands, m, at every half cell of the square."""
    top: int
    left: int
    """Row and column of the grid where the square begins."""
    changes: int
    """Of the surroundings when the distances were taken."""
    movers: tuple[Mover, ...]

    def clearance(self, x: Floats, y: Floats) -> Floats:
        """Distance (m) from each point to the nearest thing that stands, mapped or seen. Points outside the square count as its rim."""
        fine = 2.0 / self.grid.resolution
        rows = ((y - self.grid.origin_y) * fine - (2 * self.top + 0.5)).astype(np.intp)
        columns = ((x - self.grid.origin_x) * fine - (2 * self.left + 0.5)).astype(np.intp)
        height, width = self.fine.shape
        return self.fine[_within(rows, height - 1), _within(columns, width - 1)]

    def body_clearance(self, x: Floats, y: Floats, yaw: Floats) -> Floats:
        """Smallest distance (m) from the body's outline to anything that stands, for poses of any shape."""
        px, py = self.footprint.placed(x, y, yaw)
        return np.asarray(self.clearance(px, py).min(axis=-1), dtype=np.float64)

    def clearance_at(self, pose: Pose2) -> float:
        """`body_clearance` of one pose, m."""
        return float(self.body_clearance(np.array([pose.x]), np.array([pose.y]), np.array([pose.yaw]))[0])

    def mover_clearance(self, x: Floats, y: Floats, yaw: Floats, after: Floats) -> Floats:
        """Smallest distance (m) from the body to anything that moves, `after` seconds from the last scan; inf without
        movers.
        """
        c, s = np.cos(yaw), np.sin(yaw)
        least = np.full(np.broadcast_shapes(x.shape, after.shape), np.inf)
        for mover in self.movers:
            dx, dy = mover.x + mover.vx * after - x, mover.y + mover.vy * after - y
            gap = self.footprint.distances(c * dx + s * dy, c * dy - s * dx) - mover.radius
            np.minimum(least, gap, out=least)
        return least


def _within(indices: NDArray[np.intp], last: int) -> NDArray[np.intp]:
    """The indices, brought into 0 to `last`, in place. For few points `np.clip` costs several times as much, to find out about the type."""
    np.maximum(indices, 0, out=indices)
    return np.minimum(indices, last, out=indices)
