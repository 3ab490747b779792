"""What a simulated robot stands on and carries, of which no controller knows."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Ice:
    """A strip of the floor that is smoother than the rest: between two places on the world's x axis, and endless along y.

    Raises `ValueError` for what cannot be.
    """

    friction: float
    """Coulomb's, between feet and floor."""
    start: float
    """Where it begins, x in m."""
    end: float
    """Where it ends, x in m."""

    def __post_init__(self) -> None:
        if not (self.friction > 0.0 and self.start < self.end):
            raise ValueError(
                f"There is no ice with a friction of {self.friction!r} from {self.start!r} to {self.end!r} m: "
                "give a friction above 0 and an end beyond the start."
            )


@dataclass(frozen=True, slots=True)
class Ground:
    """The floor under a robot, and the load on its back. Raises `ValueError` for what cannot be."""

    friction: float = 0.8
    """Coulomb's, between feet and floor."""
    slope: tuple[float, float] = (0.0, 0.0)
    """Rise of the floor along x and y, m/m; the floor passes through the origin."""
    payload: float = 0.0
    """On the back, kg."""
    payload_at: tuple[float, float] = (0.0, 0.0)
    """Where its centre of mass lies, forward and left of the body's, m."""
    ice: Ice | None = None
    """A smoother strip, if there is one."""

    def __post_init__(self) -> None:
        if not (self.friction > 0.0 and self.payload >= 0.0):
            raise ValueError(
                f"The ground cannot have a friction of {self.friction!r} and a payload of {self.payload!r} kg: "
                "give a friction above 0 and a payload of at least 0."
            )
