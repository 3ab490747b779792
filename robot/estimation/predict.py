"""The state at the moment the motors will act: the estimate, carried over the motor delay.

Position to second order in time, with the acceleration that the forces asked for last imply; rotation and joint angles to first order
(docs/concepts/control.md#prediction-over-the-motor-delay).

Without it a controller answers a body that is one delay old; at 8 ms and 1.6 m/s that is what makes a trot fall.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import asin, atan2

from robot.estimation.leg_odometry import Estimator
from robot.geometry.vectors import Rows, Triple, to_ground
from robot.hardware.body import JointSample
from robot.model.legs import LegState, leg_state


class PredictedState:
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
        "turn",
        "velocity",
        "yaw",
    )

    def __init__(self, estimate: Estimator, joints: JointSample, lead: float, acceleration: Triple) -> None:
        self.lead = lead
        half = 0.5 * lead * lead
        (px, py, pz), (vx, vy, vz), (ax, ay, az) = estimate.position, estimate.velocity, acceleration
        self.position: Triple = (
            px + vx * lead + ax * half,
            py + vy * lead + ay * half,
            pz + vz * lead + az * half,
        )
        self.velocity: Triple = (vx + ax * lead, vy + ay * lead, vz + az * lead)
        self.turn: Triple = estimate.attitude.turn
        """Angular velocity, body axes, rad/s."""
        a, b, c = (rate * lead for rate in self.turn)
        first, second, third = (
            (x + c * y - b * z, y - c * x + a * z, z + b * x - a * y) for x, y, z in estimate.rotation
        )
        self.rotation: Rows = (first, second, third)
        up_x, up_y, up_z = third
        self.yaw = atan2(second[0], first[0])
        self.roll = atan2(up_y, up_z)
        self.pitch = -asin(max(-1.0, min(1.0, up_x)))
        angles, speeds = joints.position.tolist(), joints.velocity.tolist()
        self.angles: Sequence[float] = [angle + speed * lead for angle, speed in zip(angles, speeds, strict=True)]
        self.legs: LegState = leg_state(self.angles, third, estimate.legs.model)
        self.feet: list[Triple] = [to_ground(self.rotation, foot) for foot in self.legs.feet]
        """Foot centres from the body origin."""
