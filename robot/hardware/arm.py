"""The arm as its driver node meets it, the same for every body: joints that follow motions within limits, and a gripper.

The motion lives in the device, not in the node: joint drives follow it at their own rate, and there is one answer to where the arm is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from robot.geometry.vectors import Vector
from robot.hardware.devices import Device


class ArmBusy(RuntimeError):
    """The arm is moving and cannot take another target."""


@dataclass(frozen=True, slots=True, eq=False)
class ArmState:
    """The arm at one instant: rad and rad/s, shape (4,), order of `robot.model.arm.JOINTS`."""

    position: Vector
    velocity: Vector
    moving: bool
    progress: float
    """Share of the way of the latest motion, 0..1; never falls during a motion, and stays when it is cancelled."""


@dataclass(frozen=True, slots=True)
class GripperState:
    """What the gripper's own sensors tell; what it holds they do not know."""

    opening: float
    """Between the jaws, m."""
    closing: bool
    """What it was told last: to close, or to open."""
    moving: bool
    gripping: bool
    """The jaws were stopped by something between them, and press on it."""


class ArmDevice(Device, Protocol):
    """One arm on one body."""

    def move(self, target: Sequence[float]) -> float:
        """Begin a motion to four joint angles (rad); returns how long it takes, s.

        Raises `ArmBusy` while a motion lasts, `ValueError` for angles that the arm cannot take.
        """
        ...

    def stop(self) -> float:
        """Brake within limits; returns how long that takes, s. At rest nothing changes."""
        ...

    def state(self) -> ArmState:
        """What the joint encoders read, whether a motion lasts, and how far it has got."""
        ...

    def grip(self, closing: bool) -> None:
        """Close the gripper (True) or open it; it takes about 0.3 s."""
        ...

    @property
    def gripper(self) -> GripperState: ...
