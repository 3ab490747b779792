"""The gripper: two jaws that open and close at one speed and stop at what is between them. Metres and seconds, no clock of its own."""

from __future__ import annotations

from robot.hardware.arm import GripperState

WIDEST = 0.12
"""Opening of the jaws when open: thicker things cannot be gripped, m."""
SPEED = 0.4
"""How fast the opening changes, m/s: 0.3 s from open to closed."""


class Gripper:
    """Open to begin with."""

    __slots__ = ("_closing", "_gripping", "_opening")

    def __init__(self) -> None:
        self._opening, self._closing, self._gripping = WIDEST, False, False

    def __repr__(self) -> str:
        return f"<Gripper {'gripping' if self._gripping else 'empty'}, open {1000 * self._opening:.0f} mm>"

    @property
    def state(self) -> GripperState:
        """The state now."""
        return GripperState(self._opening, self._closing, self.moving, self._gripping)

    @property
    def moving(self) -> bool:
        """Whether the jaws are on their way."""
        return not self._gripping and self._opening != (0.0 if self._closing else WIDEST)

    @property
    def gripping(self) -> bool:
        """Whether it presses on something."""
        return self._gripping

    def tell(self, closing: bool) -> None:
        """Close or open. What is gripped is let go the moment the jaws begin to open."""
        self._closing = closing
        self._gripping = self._gripping and closing

    def step(self, seconds: float, between: float | None) -> None:
        """Let time pass. `between` is the thickness (m) of what is between the jaws, `None` for nothing."""
        if not self.moving:
            return
        if not self._closing:
            self._opening = min(WIDEST, self._opening + SPEED * seconds)
            return
        end = max(0.0, self._opening - SPEED * seconds)
        if between is not None and end <= between <= self._opening:
            end, self._gripping = between, True
        self._opening = end
