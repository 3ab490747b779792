"""How high the floor is around the robot, from depth cameras and LiDAR: cell by cell, with how sure that is and when it was seen last.

In each picture a cell is as high as the highest points in it: a thing's top counts, not its foot; what hangs over the robot does not count.
A picture that contradicts what is known must be confirmed by the next ones: things come, go, and a wrong pixel is seen once. Behind the edge of
a hole nothing is seen of the floor, but the rays that end deeper pass over it: no floor is higher than they are. Equations: docs/concepts/control.md#elevation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from robot.geometry.vectors import Floats

FREE: Final = 0
"""Floor, as far as is known."""
LOW: Final = 50
"""A step that can be crossed slowly."""
UPRIGHT: Final = 90
"""What cannot be crossed either, but stands in the LiDAR's plane: its scans show it, and when it has gone, at once and all round."""
HIDDEN: Final = 95
"""Floor behind an edge: of it is only known that it lies deeper than a step that can be crossed."""
WALL: Final = 100
"""Whatever else can neither be crossed nor passed under."""
UNSEEN: Final = -1

CROSSABLE: Final = 0.12
"""The highest step, up or down, that the trot crosses without seeing where it treads, m (measured: docs/reference/figures.md)."""
CEILING: Final = 0.85
"""What hangs higher than this over the floor is passed under, m; chosen: the robot's back is at 0.6, and it bounces by a few centimetres."""

_UNDERFOOT = 8
"""The ground that the robot stands on is so many cells about its middle: 40 cm."""
_CELL = 0.05
"""m; the map's."""
_CELLS = 160
"""A side of the square: 8 m."""
_BAND = 0.03
"""Points of a cell that lie so far under its highest are not its top, m; chosen: six sigma of a depth at two metres, seen at a slant."""
_NOISE, _SLANT = 0.006, 0.006
"""Of the height of a single picture's cell, m, and so much more per metre of distance: half a degree of tilt is 9 mm at one metre."""
_FADING = 0.01
"""Doubt about a height grows so fast while the cell is not seen, m per square root of a second."""
_MANY = 200
"""So many cells of a picture, known before, say by how much the height of odometry has drifted."""
_GATE = 0.02
_SIGMAS = 3.0
"""A picture contradicts what is known when it lies so far (m), and so many sigma, from it."""
_CONFIRMED_UP, _CONFIRMED_DOWN = 2, 3
"""Pictures that must say so: that something is there, and that it is gone."""
_MEMORY = 30.0
"""What has not been seen for longer is not known any more, s; that of the LiDAR's marks."""
_RISEN = 0.05
"""What is so much higher than the ground that the robot stands on is no floor, m."""
_COMPANY, _TOGETHER = 6, 1.0
"""So many cells about what has gone, 30 cm, went with it what had come no sooner than so long before it, s: legs, and feet."""
_TRODDEN = 0.1
"""Standard deviation of the height of a floor that nobody has seen, but somebody has stood on, m."""
_SCANNED, _PASSED = 5.0, 0.15
"""Beams of the LiDAR count up to here, m, and have passed what is nearer than what they meet by so much, m: three cells."""
_UNDER, _OVER = (0.2, 0.05), 0.08
"""A cell in which something is seen between these depths under the LiDAR's plane, m, and so far over it, m, holds what the LiDAR sees."""
_ABOVE = 0.15
"""A beam that passes a cell so far under its height, m, shows that nothing is there any more."""
_DEEP = 0.05
"""Points so far under the ground that the robot stands on lie in a hole, or behind the crest of a slope, m."""
_BOUND = 1.0
"""Variance of a height of which only is known that it is no higher, m2."""
_EDGE = 0.03
"""Up to here under that ground a ray into a hole says nothing about a cell, m."""
_SMALLEST = 0.025
"""Neighboring cells whose heights differ by less, m, and less than two sigma, are level; a ramp of 20 degrees rises by 1.8 cm."""
_SLACK = 0.015
"""By so much may a step be measured higher than it is, m."""


_Kind = TypeVar("_Kind", bound=np.generic)


@dataclass(frozen=True, slots=True)
class Relief:
    """What may be trodden on: `cells` holds `FREE`, `LOW`, `UPRIGHT`, `HIDDEN`, `WALL` or `UNSEEN`, shape (rows, columns), row 0 at the lowest
    y.
    """

    cells: NDArray[np.int8]
    resolution: float
    origin_x: float
    origin_y: float


class ElevationMap:
    """Heights in a square of 8 m that moves with the robot, in cells of 5 cm that stay where they are.

    A cell that was never seen, or not for half a minute, has a height of NaN.
    """

    def __init__(self, x: float = 0.0, y: float = 0.0, standing: float = 0.0, now: float = 0.0) -> None:
        """Around (x, y), m; at `now` (s) the floor is taken to be level within `standing` metres: a robot does not see what it stands on."""
        self._row, self._column = self._cell(y), self._cell(x)
        shape = (_CELLS, _CELLS)
        self._height: Floats = np.full(shape, np.nan)
        self._variance: Floats = np.zeros(shape)
        self._seen: Floats = np.full(shape, -np.inf)
        self._since: Floats = np.zeros(shape)
        """When each height was taken without regard to what was known before."""
        self._odd: NDArray[np.int8] = np.zeros(shape, dtype=np.int8)
        self._upright: NDArray[np.bool_] = np.zeros(shape, dtype=np.bool_)
        """Which cells hold something that stands in the LiDAR's plane: only of these a beam that passes shows that it is gone."""
        dx, dy = self.centres()
        near = np.hypot(dx - x, dy - y) < standing
        self._height[self._rolled(near)] = 0.0
        self._seen[self._rolled(near)] = now
        self.ground = 0.0
        """Height of the ground that the robot stands on, m: where nothing is known of it, of that which it stood on before."""

    def __repr__(self) -> str:
        return f"ElevationMap({int(np.isfinite(self._height).sum())} of {self._height.size} cells known)"

    @staticmethod
    def _cell(metres: float) -> int:
        return math.floor(metres / _CELL)

    @property
    def _first(self) -> tuple[int, int]:
        """Row and column, of all the world's, of the square's lowest corner."""
        return self._row - _CELLS // 2, self._column - _CELLS // 2

    def centres(self) -> tuple[Floats, Floats]:
        """x and y of the cells' middles, m, of shapes (1, n) and (n, 1)."""
        row, column = self._first
        steps: Floats = (np.arange(_CELLS, dtype=np.float64) + 0.5) * _CELL
        return (column * _CELL + steps)[None, :], (row * _CELL + steps)[:, None]

    def _unrolled(self, layer: NDArray[_Kind]) -> NDArray[_Kind]:
        """A layer with its lowest corner first. Cell (r, c) of the world lies at (r mod n, c mod n)."""
        row, column = self._first
        return np.roll(layer, (-(row % _CELLS), -(column % _CELLS)), axis=(0, 1))

    def _rolled(self, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
        row, column = self._first
        return np.roll(mask, (row % _CELLS, column % _CELLS), axis=(0, 1))

    @property
    def heights(self) -> Floats:
        """m over the floor that the robot began on, NaN where nothing is known; shape (n, n), row 0 at the lowest y."""
        return self._unrolled(self._height)

    def doubt(self, now: float) -> Floats:
        """Standard deviation of the heights at `now`, m; shape as `heights`."""
        return self._unrolled(np.sqrt(self._variance_at(now)))

    def age(self, now: float) -> Floats:
        """For how long each cell has not been seen, s; shape as `heights`."""
        return now - self._unrolled(self._seen)

    def _variance_at(self, now: float) -> Floats:
        waited = np.where(np.isfinite(self._seen), now - self._seen, 0.0)
        return np.asarray(self._variance + _FADING**2 * np.maximum(waited, 0.0))

    # --- taking in ------------------------------------------------------------------------------------------------------

    def move(self, x: float, y: float) -> None:
        """Centre the square on (x, y), m; the rows and columns that come in are unknown."""
        row, column = self._cell(y), self._cell(x)
        for axis, (old, new) in enumerate(((self._row, row), (self._column, column))):
            if old == new:
                continue
            if abs(new - old) >= _CELLS:
                fresh = np.arange(_CELLS)
            elif new > old:
                fresh = np.arange(old + _CELLS // 2, new + _CELLS // 2) % _CELLS
            else:
                fresh = np.arange(new - _CELLS // 2, old - _CELLS // 2) % _CELLS
            part = (fresh, slice(None)) if axis == 0 else (slice(None), fresh)
            self._height[part], self._seen[part], self._odd[part], self._upright[part] = np.nan, -np.inf, 0, False
        self._row, self._column = row, column
        near = np.arange(-_UNDERFOOT, _UNDERFOOT + 1)
        under = self._height[np.ix_((row + near) % _CELLS, (column + near) % _CELLS)]
        known = under[np.isfinite(under)]
        if len(known):
            self.ground = float(np.median(known))

    def integrate(self, now: float, points: Floats, eyes: Floats, plane: float = math.inf) -> None:
        """Take in one picture: `points` (n, 3) and the `eyes` (n, 3) they were seen from, m; x and y on the map, z over the floor begun on.

        `plane` is the height at which a LiDAR looks round, m: inf without one.
        """
        holes, under = points[:, 2] < self.ground - _DEEP, points[:, 2] < self.ground + CEILING
        self._forget(now)
        self._measured(now, points[under], eyes[under], plane)
        if holes.any():
            self._passed_over(now, points[holes], eyes[holes])

    def integrate_scan(
        self,
        now: float,
        x: float,
        y: float,
        height: float,
        angles: Floats,
        ranges: Floats,
        lean: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        """Take in one revolution of a LiDAR at (x, y) and so high, m: beams to `angles` on the map (rad) that met something at `ranges`, or
        nothing, which is inf. What stood in their way and does not any more is forgotten. Heights are left to the cameras: what a beam meets
        may be a wall, or a slope that is lower there than the LiDAR.

        `lean` is by how much the body's plane rises along the map's x and y, m/m: beams may have passed over what is no higher than that plane.
        """
        ways = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        rises = np.maximum(ways @ np.array(lean), 0.0)
        far = np.arange(_CELL, _SCANNED, _CELL)
        passed = far < ranges[:, None] - _PASSED
        through_x, through_y = (start + way[:, None] * far for start, way in zip((x, y), ways.T, strict=True))
        inside, places = self._places(through_x[passed], through_y[passed])
        above = (height + _ABOVE + rises[:, None] * far)[passed][inside]
        flat = self._upright.reshape(-1)
        self._leave(np.unique(places[flat[places] & (self._height.reshape(-1)[places] > above)]))
        met = ranges < _SCANNED
        ends = np.array([x, y]) + ways[met] * ranges[met, None]
        self._upright.reshape(-1)[self._places(ends[:, 0], ends[:, 1])[1]] = True

    def _leave(self, gone: NDArray[np.intp]) -> None:
        """What stood in these cells, and what came with it, is not there any more: there is the floor that it stood on."""
        if not len(gone):
            return
        was = np.zeros((_CELLS, _CELLS), dtype=np.bool_)
        was.reshape(-1)[gone] = True
        near = np.zeros_like(was)
        for rows, columns in zip(*np.nonzero(was), strict=True):
            beside = np.arange(-_COMPANY, _COMPANY + 1)
            near[np.ix_((rows + beside) % _CELLS, (columns + beside) % _CELLS)] = True
        with_it = near & (self._height > self.ground + _RISEN) & (self._since > self._since[was].min() - _TOGETHER)
        self._height[was | with_it], self._variance[was | with_it] = self.ground, _TRODDEN**2
        self._upright[was | with_it] = False

    def _forget(self, now: float) -> None:
        old = now - self._seen > _MEMORY
        self._height[old], self._seen[old], self._odd[old], self._upright[old] = np.nan, -np.inf, 0, False

    def _places(self, x: Floats, y: Floats) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
        """Which points lie in the square, and the places of those in a flat layer."""
        rows, columns = (np.floor(v / _CELL).astype(np.intp) for v in (y, x))
        top, left = self._first
        inside = (rows >= top) & (rows < top + _CELLS) & (columns >= left) & (columns < left + _CELLS)
        return inside, (rows[inside] % _CELLS) * _CELLS + columns[inside] % _CELLS

    def _measured(self, now: float, points: Floats, eyes: Floats, plane: float) -> None:
        inside, places = self._places(points[:, 0], points[:, 1])
        z, far = points[inside, 2], np.hypot(*(points - eyes)[inside, :2].T)
        highest = np.full(_CELLS * _CELLS, -np.inf)
        np.maximum.at(highest, places, z)
        under = places[(z > plane - _UNDER[0]) & (z < plane - _UNDER[1])]
        self._upright.reshape(-1)[under[highest[under] > plane + _OVER]] = True
        top = z > highest[places] - _BAND
        places, z, far = places[top], z[top], far[top]
        count = np.bincount(places, minlength=_CELLS * _CELLS)
        cells = np.flatnonzero(count)
        number = count[cells]
        mean = np.bincount(places, z, _CELLS * _CELLS)[cells] / number
        self._follow_drift(mean - self._height.reshape(-1)[cells])
        away = np.bincount(places, far, _CELLS * _CELLS)[cells] / number
        self._fuse(now, cells, mean, (_NOISE + _SLANT * away) ** 2)

    def _follow_drift(self, differs: Floats) -> None:
        """Heights are counted from where odometry began, which drifts: what most cells of a picture have risen by, all have."""
        known = differs[np.isfinite(differs)]
        if len(known) >= _MANY:
            drift = float(np.median(known))
            self._height += drift
            self.ground += drift

    def _fuse(self, now: float, cells: NDArray[np.intp], measured: Floats, variance: Floats) -> None:
        """A Kalman filter per cell. What contradicts it is taken when the next pictures say the same."""
        height, odd = self._height.reshape(-1), self._odd.reshape(-1)
        known = height[cells]
        before = self._variance_at(now).reshape(-1)[cells]
        differs = measured - known
        contrary = np.abs(differs) > _GATE + _SIGMAS * np.sqrt(before + variance)
        odd[cells] = np.where(contrary, odd[cells] + 1, 0)
        fresh = np.isnan(known) | (odd[cells] >= np.where(differs > 0.0, _CONFIRMED_UP, _CONFIRMED_DOWN))
        odd[cells[fresh]] = 0
        share = before / (before + variance)
        filtered = np.where(contrary, known, known + share * differs)
        self._upright.reshape(-1)[cells[fresh & (measured < known)]] = False
        height[cells] = np.where(fresh, measured, filtered)
        self._since.reshape(-1)[cells[fresh]] = now
        left = np.where(fresh, variance, np.where(contrary, before, (1.0 - share) * before))
        self._variance.reshape(-1)[cells] = left
        self._seen.reshape(-1)[cells] = now

    def _passed_over(self, now: float, points: Floats, eyes: Floats) -> None:
        """Cells that were never measured, and over which rays into a hole pass, lie at most as high as those."""
        ways = points - eyes
        shares = np.linspace(0.0, 1.0, math.ceil(float(np.hypot(ways[:, 0], ways[:, 1]).max()) / _CELL) + 2)
        x, y, z = (eyes[:, axis, None] + ways[:, axis, None] * shares for axis in range(3))
        deep = z < self.ground - _EDGE
        inside, places = self._places(x[deep], y[deep])
        bound = np.full(_CELLS * _CELLS, np.inf)
        np.minimum.at(bound, places, z[deep][inside])
        unmeasured = np.isnan(self._height) | (self._variance >= _BOUND)
        cells = np.flatnonzero(np.isfinite(bound) & unmeasured.reshape(-1))
        self._height.reshape(-1)[cells] = np.fmin(self._height.reshape(-1)[cells], bound[cells])
        self._variance.reshape(-1)[cells] = _BOUND
        self._seen.reshape(-1)[cells] = now

    # --- what follows from it -------------------------------------------------------------------------------------------

    def relief(self, now: float) -> Relief:
        """Where the floor is level enough to walk, where a step can be crossed, and where neither holds.

        Of two neighbors between which there is a step, the one counts that lies farther from the ground that the robot stands on.
        How deep it is behind the edge of a hole may not be known yet: what is seen so far counts.
        """
        height, variance = self.heights, self._unrolled(self._variance_at(now))
        cells = np.where(np.isnan(height), UNSEEN, FREE).astype(np.int8)
        for first, second in ((np.s_[1:], np.s_[:-1]), (np.s_[:, 1:], np.s_[:, :-1])):
            a, b = height[first], height[second]
            with np.errstate(invalid="ignore"):
                step = np.abs(a - b)
                doubt = 2.0 * np.sqrt(variance[first] + variance[second])
                kind = np.where(step > CROSSABLE + _SLACK, WALL, LOW)
                kind[~(step > _SMALLEST + doubt)] = UNSEEN
                farther = np.abs(a - self.ground) > np.abs(b - self.ground)
            for part, counts in ((first, farther), (second, ~farther)):
                np.maximum(cells[part], np.where(counts, kind, UNSEEN), out=cells[part], casting="unsafe")
        bounded = np.isfinite(height) & (variance >= _BOUND)
        cells[bounded] = np.where(height[bounded] < self.ground - CROSSABLE, HIDDEN, LOW)
        upright = self._unrolled(self._upright)
        cells[upright & (cells == WALL)] = UPRIGHT
        row, column = self._first
        return Relief(cells, _CELL, column * _CELL, row * _CELL)
