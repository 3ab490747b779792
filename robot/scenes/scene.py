"""What stands in a world: its walls, its shelves, its dock and the places worth walking to. Values only, metres and radians.

Frames follow REP-103: x forward, y left, z up. A yaw of zero looks along +x.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from types import MappingProxyType
from typing import Any

from robot.geometry.planar import Pose2
from robot.scenes.terrain import Ramp


@dataclass(frozen=True, slots=True)
class Box:
    """An upright box: centre (x, y), full side lengths along its own axes, yaw, height of its top; metres and radians."""

    x: float
    y: float
    length: float
    width: float
    yaw: float = 0.0
    height: float = 1.0
    bottom: float = 0.0
    """Height of its underside, m: above 0 it hangs over the floor, up to `height`."""
    mapped: bool = True
    """Whether the map that the robot is given shows it."""


@dataclass(frozen=True, slots=True)
class Cylinder:
    """An upright cylinder: centre (x, y), radius, height of its top; metres."""

    x: float
    y: float
    radius: float
    height: float = 1.0
    bottom: float = 0.0
    """Height of its underside, m: above 0 it hangs over the floor, up to `height`."""
    mapped: bool = True
    """Whether the map that the robot is given shows it."""


Obstacle = Box | Cylinder


@dataclass(frozen=True, slots=True)
class Pit:
    """A rectangle of the floor that lies deeper, along the axes of the world: a hole, or a lower floor behind a step down. No map shows it."""

    x: float
    y: float
    length: float
    """Along x, m."""
    width: float
    """Along y, m."""
    depth: float
    """m."""


@dataclass(frozen=True, slots=True)
class Walker:
    """A person who walks about, or a thing that is wheeled about or appears. The physics body moves it by force; no map shows it."""

    shape: Obstacle
    """As it is at the start."""
    way: tuple[tuple[float, float], ...] = ()
    """Where it goes, from place to place in straight lines, m, and then round again; without any it stays where it is."""
    speed: float = 1.0
    """m/s."""
    appears: float = 0.0
    """When, s; before that it is nowhere."""
    room: float = 0.4
    """It stands still while the robot's outline is nearer than this ahead of it, m; 0: it stops for nobody."""


@dataclass(frozen=True, slots=True)
class Thing:
    """A small coloured object that a camera sees and an arm may take; the LiDAR looks over it, and no leg is stopped by it."""

    name: str
    shape: Obstacle
    color: tuple[int, int, int]
    """Red, green, blue; 0..255 each."""
    z: float = 0.0
    """Height of its underside over the floor, m."""

    @property
    def thickness(self) -> float:
        """How far a gripper's jaws stay open around it, m."""
        shape = self.shape
        return min(shape.length, shape.width) if isinstance(shape, Box) else 2.0 * shape.radius


@dataclass(frozen=True, slots=True)
class Scene:
    """One world, the same for every back end, for the map and for the pictures."""

    name: str
    bounds: tuple[float, float, float, float]
    """x_min, y_min, x_max, y_max of the floor, metres."""
    obstacles: tuple[Obstacle, ...]
    start: Pose2
    dock: Pose2
    """Where the robot charges: the pose of its body when docked."""
    patrol: tuple[Pose2, ...] = ()
    places: Mapping[str, Pose2] = field(default_factory=lambda: MappingProxyType({}))
    """Named poses for the map service, such as ``shelf_3``."""
    things: tuple[Thing, ...] = ()
    """Small objects at the start. A body whose arm carries them off tells by a method ``things()`` where they are now."""
    pits: tuple[Pit, ...] = ()
    """Where the floor lies deeper; no two of them overlap."""
    walkers: tuple[Walker, ...] = ()
    """The people and things that move; in the physics body only, and not in one of another process."""
    terrain: tuple[Ramp, ...] = ()
    """What rises from the floor to be walked on, in the physics body; the robot begins on the floor."""

    def __reduce__(self) -> tuple[Any, ...]:
        """A read-only view of places is not copied to other processes, the places are."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return _scene, (values | {"places": dict(self.places)},)


def _scene(values: dict[str, Any]) -> Scene:
    """A scene from its fields."""
    values["places"] = MappingProxyType(values["places"])
    return Scene(**values)
