"""Kinematics of the arm, exact and in closed form: yaw, shoulder, elbow and wrist pitch, and a tool tip.

The arm frame sits at the arm's mount, axes as the body's. All pitch angles turn about +y, so positive ones look
down: the tool's pitch is q2 + q3 + q4. Geometry and limits follow the arm of the MuJoCo menagerie's Spot, reduced
to four joints.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import acos, atan2, cos, hypot, isfinite, pi, sin, tau
from typing import NamedTuple

Angles = tuple[float, float, float, float]

JOINTS = ("arm_yaw", "arm_shoulder", "arm_elbow", "arm_wrist")
LIMITS = ((-2.618, 3.142), (-3.142, 0.524), (0.0, 3.142), (-1.833, 1.833))
"""Lowest and highest angle of each joint, rad."""
MOUNT = (0.292, 0.0, 0.188)
"""The arm frame's origin in the body frame, m."""
STOWED: Angles = (0.0, -3.12, 3.12, 0.0)
"""Folded back over the body."""

UPPER, FORE, TOOL = 0.3385, 0.410, 0.19
"""Shoulder to elbow, elbow to wrist (0.4033 ahead and 0.075 aside taken together), wrist to tool tip, m."""
_SLACK, _STRETCH = 1e-7, 1e-12
"""Rounding allowed at joint limits, rad, and in the elbow's cosine. At full stretch an angle is only known to 1e-8."""


class Tip(NamedTuple):
    """Where the tool's tip is in the arm frame (m), and how far it looks down (rad)."""

    x: float
    y: float
    z: float
    pitch: float


class OutOfReach(ValueError):
    """No joint angles within the limits bring the tool's tip there."""


def forward(angles: Sequence[float]) -> Tip:
    """Where four joint angles (rad) put the tool's tip."""
    q1, q2, q3, q4 = angles
    elbow, pitch = q2 + q3, q2 + q3 + q4
    r = UPPER * cos(q2) + FORE * cos(elbow) + TOOL * cos(pitch)
    z = -(UPPER * sin(q2) + FORE * sin(elbow) + TOOL * sin(pitch))
    return Tip(r * cos(q1), r * sin(q1), z, pitch)


def inverse(tip: Tip) -> Angles:
    """The joint angles, within their limits, that bring the tool's tip to `tip`.

    The elbow bends one way only, so at most two answers exist: facing the point, which is tried first, and reaching
    over the back. Raises `OutOfReach` if neither is possible.
    """
    x, y, z, pitch = tip
    if not (isfinite(x) and isfinite(y) and isfinite(z) and isfinite(pitch)):
        raise OutOfReach(f"The arm cannot reach {tip}: give four finite numbers.")
    distance, yaw = hypot(x, y), atan2(y, x)
    reason = ""
    for q1, r in ((yaw, distance), (yaw + pi, -distance)):
        wrist_r, wrist_z = r - TOOL * cos(pitch), -z - TOOL * sin(pitch)
        c3 = (wrist_r * wrist_r + wrist_z * wrist_z - UPPER * UPPER - FORE * FORE) / (2.0 * UPPER * FORE)
        if abs(c3) > 1.0 + _STRETCH:
            reason = reason or f"the wrist would be {hypot(wrist_r, wrist_z):.3f} m from the shoulder"
            continue
        q3 = acos(max(-1.0, min(1.0, c3)))
        q2 = atan2(wrist_z, wrist_r) - atan2(FORE * sin(q3), UPPER + FORE * c3)
        angles = (_turned(q1, 0), _turned(q2, 1), q3, _turned(pitch - q2 - q3, 3))
        complaint = _complaint(angles)
        if complaint is None:
            return angles
        reason = reason or complaint
    raise OutOfReach(
        f"The arm cannot reach ({x:.3f}, {y:.3f}, {z:.3f}) m with the tool at pitch {pitch:.3f} rad: {reason}. "
        "Move the body (robot.planning.reach says where to) or choose another pitch."
    )


def check_angles(angles: Sequence[float]) -> Angles:
    """The same four angles as floats; raises `ValueError` for another number of them, NaN, infinity, or beyond the limits."""
    if len(angles) != 4:
        raise ValueError(f"The arm has 4 joints ({', '.join(JOINTS)}), but {len(angles)} angles were given.")
    q1, q2, q3, q4 = (float(angle) for angle in angles)
    complaint = _complaint((q1, q2, q3, q4))
    if complaint is not None:
        raise ValueError(f"The arm cannot take the angles {(q1, q2, q3, q4)} rad: {complaint}.")
    return (q1, q2, q3, q4)


def _complaint(angles: Angles) -> str | None:
    for name, angle, (low, high) in zip(JOINTS, angles, LIMITS, strict=True):
        if not low - _SLACK <= angle <= high + _SLACK:
            return f"{name} would be at {angle:.3f} rad, outside {low} to {high}"
    return None


def _turned(angle: float, joint: int) -> float:
    """The same angle counted from the joint's lowest one up, as whole turns do not matter to a direction."""
    low = LIMITS[joint][0] - _SLACK
    return low + (angle - low) % tau
