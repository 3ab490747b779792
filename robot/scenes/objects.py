"""What the robot knows of the objects it may be sent for: how they look and how big they are. Not where they are: the camera tells that."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from colorsys import rgb_to_hsv
from dataclasses import dataclass

from robot.scenes.scene import Thing

HUES = (("red", 0.0), ("yellow", 1 / 6), ("green", 1 / 3), ("blue", 2 / 3), ("red", 1.0))


@dataclass(frozen=True, slots=True)
class Look:
    """One object."""

    label: str
    """What the camera's detections call it: its color."""
    thickness: float
    """Between the jaws, m."""
    height: float
    """m."""


def color_name(color: tuple[int, int, int]) -> str:
    """The name, of red, yellow, green and blue, that is nearest to a color (0..255 each)."""
    hue, _, _ = rgb_to_hsv(*(value / 255.0 for value in color))
    return min(HUES, key=lambda known: abs(known[1] - hue))[0]


def looks_of(things: Iterable[Thing]) -> Mapping[str, Look]:
    """How the things of a scene look, by name."""
    return {thing.name: Look(color_name(thing.color), thing.thickness, thing.shape.height) for thing in things}
