"""What a simulated robot stands on and carries, which no controller is told."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Ground"]


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

    def __post_init__(self) -> None:
        if not (self.friction > 0.0 and self.payload >= 0.0):
            raise ValueError(
                f"The ground cannot have a friction of {self.friction!r} and a payload of {self.payload!r} kg: "
                "give a friction above 0 and a payload of at least 0."
            )
