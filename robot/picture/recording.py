"""What was seen of a run, as plain values: all that the pictures are made of."""

from __future__ import annotations

from dataclasses import dataclass, field

from robot.geometry.planar import Pose2
from robot.scenes.scene import Scene, Thing
from robot.sim.simulation import Truth


@dataclass(slots=True)
class Recording:
    """A run up to the instant of the picture. World frame, SI units; lists hold one entry per watched instant, 50 a second."""

    scene: Scene
    backend: str
    truth: Truth
    """The body at the instant of the picture."""
    time: float = 0.0
    """That instant, s."""
    times: list[float] = field(default_factory=lambda: [])
    trail: list[tuple[float, float]] = field(default_factory=lambda: [])
    footprints: list[tuple[float, float]] = field(default_factory=lambda: [])
    """Where a foot came down, in the order of time."""
    path: tuple[tuple[float, float], ...] = ()
    """The newest /plan, frame `map`; empty without one."""

    things: tuple[Thing, ...] = ()
    """The scene's things, where they are at the instant of the picture."""
    arm: tuple[float, ...] | None = None
    """The angles of the arm's joints, rad; `None` without an arm."""

    @property
    def pose(self) -> Pose2:
        """The body on the floor at the instant of the picture."""
        return Pose2(float(self.truth.position[0]), float(self.truth.position[1]), self.truth.yaw)
