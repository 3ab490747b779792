"""What the gait controller knows of the robot, as a value."""

from __future__ import annotations

from dataclasses import dataclass

from robot.geometry.vectors import Vector
from robot.model.modes import Mode


@dataclass(frozen=True, slots=True)
class GaitState:
    """What the controller knows of the robot; estimated, in the `odom` frame that starts under the robot."""

    mode: Mode
    position: Vector
    """Body origin, shape (3,), m; z is its height over the standing feet's soles."""
    quaternion: Vector
    """Attitude body to odom, shape (4,), w first."""
    velocity: Vector
    """Body origin's velocity in the heading frame (forward, left, up), shape (3,), m/s."""
    angular_velocity: Vector
    """Body axes, gyro bias removed, shape (3,), rad/s."""
    contact: tuple[bool, ...]
    """Feet on the ground, fl, fr, rl, rr."""
    gyro_bias: Vector
    """Learned while the robot stands still, shape (3,), rad/s."""
    slope: tuple[float, float]
    """The ground's rise per metre along odom x and y."""
