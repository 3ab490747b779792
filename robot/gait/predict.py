"""The state at the moment the motors will act: the estimate, carried over the motor delay.

Without it a controller answers a body that is one delay old; at 8 ms and 1.6 m/s that is what makes a trot fall.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import asin, atan2

import numpy as np

from robot.gait.estimator import Estimator
from robot.gait.limbs import Limbs, limbs
from robot.world.body import Vector

__all__ = ["Ahead"]


class Ahead:
    """Body and legs `lead` seconds after the estimate; odom axes unless said otherwise."""

    __slots__ = (
        "angles",
        "feet",
        "lead",
        "legs",
        "pitch",
        "position",
        "roll",
        "rotation",
        "speeds",
        "turn",
        "velocity",
        "yaw",
    )

    def __init__(
        self,
        estimate: Estimator,
        angles: Vector,
        speeds: Vector,
        lead: float,
        acceleration: Vector,
    ) -> None:
        self.lead = lead
        self.position: Vector = estimate.position + estimate.velocity * lead + acceleration * (0.5 * lead * lead)
        self.velocity: Vector = estimate.velocity + acceleration * lead
        x, y, z = estimate.attitude.turn
        self.turn: Vector = np.array((x, y, z))
        """Angular velocity, body axes, rad/s."""
        a, b, c = x * lead, y * lead, z * lead
        step = np.array(((1.0, -c, b), (c, 1.0, -a), (-b, a, 1.0)))
        self.rotation: Vector = estimate.rotation @ step
        rows: list[list[float]] = self.rotation.tolist()
        up_x, up_y, up_z = rows[2]
        self.yaw = atan2(rows[1][0], rows[0][0])
        self.roll = atan2(up_y, up_z)
        self.pitch = -asin(max(-1.0, min(1.0, up_x)))
        self.speeds: Sequence[float] = speeds.tolist()
        self.angles: Sequence[float] = (angles + speeds * lead).tolist()
        self.legs: Limbs = limbs(self.angles, (up_x, up_y, up_z))
        self.feet: Vector = np.array(self.legs.feet) @ self.rotation.T
        """Foot centres from the body origin, shape (4, 3)."""
