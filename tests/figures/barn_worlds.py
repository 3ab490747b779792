"""BARN worlds: fields of upright cylinders between a start and a goal, read from JSON.

The benchmark is of Perille, Truong, Xiao and Stone, "Benchmarking Metric Ground Navigation" (2020). A file holds ``idx``, ``radius`` (of every
cylinder, m), ``start`` [x, y, yaw], ``goal`` [x, y], ``goal_radius`` (m), ``cylinders`` [[x, y], ...] and ``ref_length`` (m).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import msgspec

from cli.command import UsageError
from robot.geometry.planar import Pose2
from robot.scenes.scene import Cylinder, Scene

_HEIGHT = 1.5
"""Of the cylinders, m: taller than the robot, so that nothing passes over them."""
_MARGIN = 4.0
"""Open floor round everything, m."""


class _File(msgspec.Struct):
    idx: int
    radius: float
    start: tuple[float, float, float]
    goal: tuple[float, float]
    cylinders: list[tuple[float, float]]
    ref_length: float
    goal_radius: float = 1.0


@dataclass(frozen=True, slots=True)
class BarnWorld:
    """One world: where things stand, from where to where, and how long the reference path is (m)."""

    index: int
    scene: Scene
    goal: Pose2
    goal_radius: float
    reference: float

    @property
    def optimal_time(self) -> float:
        """Seconds for the reference path at 2 m/s."""
        return self.reference / 2.0


def read_world(path: Path) -> BarnWorld:
    """The world in a file. Raises `UsageError` with the file's name and what is wrong in it."""
    try:
        data = msgspec.json.decode(path.read_bytes(), type=_File)
    except (msgspec.DecodeError, OSError) as error:
        raise UsageError(f"{path} is not a BARN world: {error}") from None
    if not (data.radius > 0.0 and data.ref_length > 0.0 and data.goal_radius > 0.0):
        raise UsageError(f"{path} is not a BARN world: radius, ref_length and goal_radius must be positive")
    start = Pose2(*data.start)
    xs, ys = zip(*data.cylinders, data.start[:2], data.goal, strict=True)
    bounds = (min(xs) - _MARGIN, min(ys) - _MARGIN, max(xs) + _MARGIN, max(ys) + _MARGIN)
    posts = tuple(Cylinder(x, y, data.radius, _HEIGHT) for x, y in data.cylinders)
    scene = Scene(f"barn {data.idx}", bounds, posts, start, start)
    return BarnWorld(data.idx, scene, Pose2(*data.goal), data.goal_radius, data.ref_length)


def find_worlds(folder: Path, wanted: list[int] | None = None) -> list[BarnWorld]:
    """The worlds of a folder (or of one file), by index; only those `wanted`. Raises `UsageError` when there are none."""
    files = [folder] if folder.is_file() else sorted(folder.glob("*.json"))
    if not files:
        raise UsageError(f"{folder} holds no .json file" if folder.exists() else f"there is no {folder}")
    worlds = sorted((read_world(file) for file in files), key=lambda world: world.index)
    if wanted is None:
        return worlds
    found = [world for world in worlds if world.index in wanted]
    missing = sorted(set(wanted) - {world.index for world in found})
    if missing:
        known = ", ".join(str(world.index) for world in worlds)
        raise UsageError(f"{folder} has no world {missing[0]}; it has: {known}")
    return found
