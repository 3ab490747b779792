"""What stands around the robot now: the map, and what LiDAR and elevation map see that the map does not know."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from robot.estimation.elevation import Relief
from robot.estimation.footing import Footing
from robot.estimation.movers import Mover, Movers
from robot.geometry.planar import Pose2, seen_from
from robot.geometry.vectors import Floats
from robot.hardware.beams import MAX_RANGE, beam_angles, returns
from robot.model.footprint import Footprint
from robot.navigation.local_field import LocalField
from robot.planning.grid import Grid, distance_to

MEMORY = 30.0
"""How long a mark out of sight is kept, s; chosen: most ways round a thing take less."""
_YOUNG, _BESIDE, _GONE = 1.5, 0.3, 1.0
"""Marks no older than this, s, and so near to what moves, m, came with it: out of sight they are kept for so long, s. Chosen: what moves is
known to after 0.3 to 0.6 s."""
_EXPLAINED, _PER_METRE = 0.10, 0.02
"""A hit this near to a mapped face is that face, m, and so much more per metre of the beam; chosen: five sigma of the LiDAR, and a heading that
is wrong by a degree."""
_MARGIN = 0.01
"""What distances to marks are less than to the middles of their cells, m; chosen."""
_REACH = 3.0
"""Half side of the square around the robot in which motion is checked, m."""
_NEAR = 1.0
"""Distances to marks beyond this do not matter, m."""
_SLACK = 0.1
"""A beam must pass a mark by this much to clear it, m: five sigma of the LiDAR."""
_SETTLED = 0.4
"""A place marked for longer than this holds something that stands, s."""
_SILENT = 0.5
"""A LiDAR from which nothing has come for longer shows nothing, s: five scans."""
_PLACE = 0.6
"""Half side of the square that a body at a place takes up, m; chosen: about half its length."""
_FAR = 10.0
"""Stands for 'nothing near', m."""


class LocalCostmap:
    """A map plus the obstacles that scans reveal. Marks what no mapped thing explains, forgets what a beam later passes
    through.

    A mark that can no longer be seen is kept for `memory` seconds.
    """

    def __init__(
        self, grid: Grid, footprint: Footprint | None = None, max_range: float = MAX_RANGE, memory: float = MEMORY
    ) -> None:
        self.grid = grid
        self.footprint = footprint or Footprint()
        self.max_range = max_range
        self.memory = memory
        self.movers = Movers()
        self._scanned = -math.inf
        self.footing = Footing(grid)
        self.crossing = False
        """Whether steps that can be crossed count as floor now: there is no way round them."""
        shape = (grid.height, grid.width)
        self._seen: Floats = np.full(shape, -np.inf)
        self._since: Floats = np.full(shape, np.inf)
        self._marked = np.zeros(shape, dtype=np.bool_)
        self._fleeting = np.zeros(shape, dtype=np.bool_)
        """Marks of what moves: a person who walks towards the robot hides them, and has left them."""
        self._blocked: list[tuple[float, float]] = []
        self.changes = 0
        """How often marks were added or removed."""

    def __repr__(self) -> str:
        return f"LocalCostmap({self.grid!r}, {int(self._marked.sum())} cells marked by the LiDAR)"

    @property
    def marked(self) -> NDArray[np.bool_]:
        """Cells that hold something the map does not know, shape of the map."""
        return self._marked

    def forget(self) -> None:
        """Drop every mark: the first recovery, for ghosts that no beam can clear."""
        self._seen.fill(-np.inf)
        self._since.fill(np.inf)
        self._marked, self._fleeting = np.zeros_like(self._marked), np.zeros_like(self._fleeting)
        self.movers.forget()
        self.footing.forget()
        self.changes += 1

    def advance(self, now: float) -> None:
        """Time passes, with or without a scan: what moved and has not been seen for a while is forgotten."""
        self.movers.age(now)

    def cross(self, crossing: bool) -> None:
        """Let steps that can be crossed count as floor, or as walls."""
        if crossing != self.crossing:
            self.crossing = crossing
            self.changes += 1

    def integrate_relief(self, now: float, pose: Pose2, relief: Relief) -> None:
        """Take in where an elevation map shows steps, holes and things that hang low, as seen from `pose`."""
        scanned = now - self._scanned <= _SILENT
        if self.footing.integrate(relief, pose, self.footprint, self.movers.moving, scanned=scanned):
            self.changes += 1

    def _standing(self) -> NDArray[np.bool_]:
        """Cells that hold something the map does not know: not to be walked into, or trodden on."""
        if not self.footing.known:
            return self._marked
        walls = self._marked | self.footing.walls
        return walls if self.crossing else walls | self.footing.steps

    # --- scans ----------------------------------------------------------------------------------------------------------

    def integrate_scan(self, now: float, pose: Pose2, ranges: Floats) -> None:
        """Take in one scan from `pose`: beam i looks along yaw - pi + i 2 pi / n; ranges at or over the maximum are no
        return.
        """
        self._scanned = now
        angles = beam_angles(len(ranges)) + pose.yaw
        valid = returns(ranges, self.max_range, nearest=0.0)
        self._clear_seen_through(pose, np.where(np.isfinite(ranges), ranges, self.max_range))
        r, a = ranges[valid], angles[valid]
        self._mark(now, pose, pose.x + r * np.cos(a), pose.y + r * np.sin(a), r)
        left = self._fleeting & (self._seen <= now - _GONE)
        self._seen[left], self._since[left], self._fleeting[left] = -np.inf, np.inf, False
        marked = self._seen > now - self.memory
        if (marked != self._marked).any():
            self._marked = marked
            self.changes += 1

    def _mark(self, now: float, pose: Pose2, x: Floats, y: Floats, ranges: Floats) -> None:
        grid = self.grid
        columns = np.floor((x - grid.origin_x) / grid.resolution).astype(np.intp)
        rows = np.floor((y - grid.origin_y) / grid.resolution).astype(np.intp)
        own = self.footprint.distances(*seen_from(pose, x, y)) <= 0.0
        inside = (rows >= 0) & (rows < grid.height) & (columns >= 0) & (columns < grid.width) & ~own
        rows, columns = rows[inside], columns[inside]
        # Near a mapped face a hit is that face, seen from a pose that is a little wrong: the more so the farther the beam.
        # So is a ramp that rises into the LiDAR's plane.
        unexplained = grid.clearance[rows, columns] > _EXPLAINED + _PER_METRE * ranges[inside]
        unexplained &= ~grid.is_ground(pose.x, pose.y, rows, columns)
        rows, columns = rows[unexplained], columns[unexplained]
        known = self._known(now, rows, columns)
        self.movers.update(now, x[inside][unexplained], y[inside][unexplained], known)
        self._since[rows, columns] = np.minimum(self._since[rows, columns], now)
        self._seen[rows, columns] = now
        for mover in self.movers.moving:
            self._mark_fleeting(now, mover)

    def _about(self, x: float, y: float, reach: float) -> tuple[slice, slice]:
        """The cells of the square whose sides are `reach` m away from a place."""
        grid = self.grid
        left, right = ((x + side * reach - grid.origin_x) / grid.resolution for side in (-1, 1))
        low, high = ((y + side * reach - grid.origin_y) / grid.resolution for side in (-1, 1))
        return slice(max(int(low), 0), max(int(high) + 1, 0)), slice(max(int(left), 0), max(int(right) + 1, 0))

    def _mark_fleeting(self, now: float, mover: Mover) -> None:
        part = self._about(mover.x, mover.y, mover.radius + _BESIDE)
        since = self._since[part]
        self._fleeting[part] |= (since > now - _YOUNG) & (since <= now)

    def _known(self, now: float, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Which cells were marked, or touch one that was marked, a while ago."""
        height, width = self.grid.height, self.grid.width
        known = np.zeros(len(rows), dtype=np.bool_)
        for up in (-1, 0, 1):
            for right in (-1, 0, 1):
                beside = np.clip(rows + up, 0, height - 1), np.clip(columns + right, 0, width - 1)
                known |= self._since[beside] < now - _SETTLED
        return known

    def _clear_seen_through(self, pose: Pose2, ranges: Floats) -> None:
        rows, columns = np.nonzero(np.isfinite(self._seen))
        if not len(rows):
            return
        grid = self.grid
        dx = grid.origin_x + (columns + 0.5) * grid.resolution - pose.x
        dy = grid.origin_y + (rows + 0.5) * grid.resolution - pose.y
        far = np.hypot(dx, dy)
        turn = (np.arctan2(dy, dx) - pose.yaw + math.pi) * len(ranges) / (2 * math.pi)
        beam = np.rint(turn).astype(np.intp)
        # The beams beside it must agree, or the edge of a box would be wiped by the beam that just misses it.
        behind = np.minimum.reduce([ranges[(beam + k) % len(ranges)] for k in (-1, 0, 1)])
        gone = (far < self.max_range) & (behind > far + _SLACK)
        self._seen[rows[gone], columns[gone]] = -np.inf
        self._since[rows[gone], columns[gone]] = np.inf
        self._fleeting[rows[gone], columns[gone]] = False

    # --- distances --------------------------------------------------------------------------------------------------

    def clearance_to_unmapped(self, but: Pose2 | None = None) -> Floats | None:
        """Clearance (m) from the marks and blocked places, per cell of the map, 1 m at most; None when there are none.

        Marks about the place `but` do not count: who stands there may have gone before the robot comes there.
        """
        marked = self._standing().copy()
        if but is not None:
            marked[self._about(but.x, but.y, _PLACE)] = False
        for x, y in self._blocked:
            cell = self.grid.cell(x, y)
            if cell is not None:
                marked[cell] = True
        return self._distance(marked) if marked.any() else None

    def block(self, x: float, y: float) -> None:
        """Plan no path through this place: the body turned out not to fit. It stays blocked until `unblock_all`."""
        self._blocked.append((x, y))

    def unblock_all(self) -> bool:
        """Unblock all places; True if there were any."""
        had, self._blocked = bool(self._blocked), []
        return had

    def _distance(self, marked: NDArray[np.bool_]) -> Floats:
        """Distance (m) to the marks. A hit lies anywhere in its cell, so on average in its middle: count from there, less 1 cm."""
        return distance_to(marked, self.grid.resolution, _NEAR) + (0.5 * self.grid.resolution - _MARGIN)

    def local_field(self, pose: Pose2, last: LocalField | None = None) -> LocalField:
        """The distances around `pose`. Those of `last`, an earlier answer, serve on while no mark changed and the robot is still near its middle."""
        grid, reach, movers = self.grid, math.ceil(_REACH / self.grid.resolution), self.movers.moving
        row = math.floor((pose.y - grid.origin_y) / grid.resolution)
        column = math.floor((pose.x - grid.origin_x) / grid.resolution)
        if last is not None and last.grid is grid and last.changes == self.changes:
            drift = max(abs(row - last.top - reach), abs(column - last.left - reach))
            if drift * grid.resolution < _REACH / 3:
                return replace(last, movers=movers)
        top, left = min(max(row - reach, 0), grid.height - 1), min(max(column - reach, 0), grid.width - 1)
        part = slice(top, max(row + reach, top + 1)), slice(left, max(column + reach, left + 1))
        window = np.minimum(grid.clearance[part], _FAR)
        standing = self._standing()[part]
        if standing.any():
            window = np.minimum(window, self._distance(standing))
        return LocalField(grid, self.footprint, _twice_as_fine(window), top, left, self.changes, movers)


def _twice_as_fine(field: Floats) -> Floats:
    """The field with its linear values halfway between cells: middles at every half cell, shape (2 rows - 1, 2 columns - 1)."""
    rows, columns = field.shape
    fine = np.empty((2 * rows - 1, 2 * columns - 1))
    fine[::2, ::2] = field
    fine[1::2, ::2] = (field[:-1] + field[1:]) / 2
    fine[:, 1::2] = (fine[:, :-1:2] + fine[:, 2::2]) / 2
    return fine
