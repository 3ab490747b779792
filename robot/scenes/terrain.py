"""What of a world is there to be walked on: ramps, and level blocks, such as landings and the steps of stairs."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, hypot, sin


@dataclass(frozen=True, slots=True)
class Ramp:
    """Solid ground over the floor: it begins at height `bottom` and rises along its yaw, over `length` metres on the level, to `top`.

    (x, y) is its middle, `width` its side across; metres and radians. With `bottom` like `top` it is a level block. A ramp leads to
    something as high as its end, such as a block or another ramp: its back is no upright wall. Maps show it, as something to be walked on.
    """

    x: float
    y: float
    length: float
    width: float
    top: float
    bottom: float = 0.0
    yaw: float = 0.0

    @property
    def rise(self) -> float:
        """Its angle of slope, rad."""
        return atan2(self.top - self.bottom, self.length)

    @property
    def box(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Middle and half sides (m) of the box that is turned by `yaw` about z and then by minus `rise` about its own y: its upper face is
        what is walked on, and its lower one lies nowhere above the floor.
        """
        lower = max(self.top, self.bottom) / cos(self.rise) / 2
        back = lower * sin(self.rise)
        middle = (self.bottom + self.top) / 2 - lower * cos(self.rise)
        half = (hypot(self.length, self.top - self.bottom) / 2, self.width / 2, lower)
        return (self.x + back * cos(self.yaw), self.y + back * sin(self.yaw), middle), half
