"""The robot's figures: geometry, masses and motor limits of a Spot-like quadruped. Values only, SI units, angles in rad.

Sources: the public data sheet (32.5 kg net with battery, joint limits), the MuJoCo menagerie model of Spot (geometry, leg masses
and link centres of mass) and Isaac Lab's actuator data (torque limits). The menagerie puts 32.86 kg on the body link alone, so
50.3 kg on the robot; we follow the data sheet, and the body carries what the legs leave of 32.5 kg.
"""

from __future__ import annotations

GRAVITY = 9.81

THIGH = 0.321
"""Shoulder axis to knee axis (L1), m."""
CALF = 0.3365
"""Knee axis to the centre of the ball that is the foot (L2), m."""
ABDUCTION = 0.1108
"""Hip axis to the plane the leg moves in (d), m."""
FOOT_RADIUS = 0.036

HIPS = ((0.29785, 0.055), (0.29785, -0.055), (-0.29785, 0.055), (-0.29785, -0.055))
"""Hip frames in the body (x, y), legs in order fl, fr, rl, rr; their z is 0."""
SIDES = (1.0, -1.0, 1.0, -1.0)
"""+1 for a left leg, -1 for a right one."""

STAND_HEIGHT = 0.45
"""Hip plane to foot centres when standing, m."""
SIT_HEIGHT = 0.15
"""The same when sitting: the body is then 0.186 m above the floor (data sheet: 0.191 m)."""

HIP_LIMITS = (-0.785, 0.785)
SHOULDER_LIMITS = (-0.899, 2.295)
KNEE_LIMITS = (-2.793, -0.247)
JOINT_LIMITS = (HIP_LIMITS, SHOULDER_LIMITS, KNEE_LIMITS) * 4

MASS = 32.5
HIP_MASS, THIGH_MASS, CALF_MASS = 1.68, 2.34, 0.35
BODY_MASS = MASS - 4 * (HIP_MASS + THIGH_MASS + CALF_MASS)

HIP_COM = (-0.0054, 0.0128, 0.0)
"""Centre of the hip link in its own frame; x is mirrored on rear legs (hips lean inwards), y on right ones."""
THIGH_COM = (0.0, 0.0, -0.121)
CALF_COM = (0.0, 0.0, -0.180)

TRUNK = (0.84, 0.22, 0.18)
"""Full length, width and height of the trunk, m."""
BODY_INERTIA = (
    BODY_MASS * (TRUNK[1] ** 2 + TRUNK[2] ** 2) / 12,
    BODY_MASS * (TRUNK[0] ** 2 + TRUNK[2] ** 2) / 12,
    BODY_MASS * (TRUNK[0] ** 2 + TRUNK[1] ** 2) / 12,
)
"""Of the trunk about its centre, as a uniform box, kg m2."""
HIP_INERTIA, THIGH_INERTIA, CALF_INERTIA = (0.0021, 0.0021, 0.0021), (0.0275, 0.0275, 0.0028), (0.0041, 0.0041, 0.00015)
"""Of each link about its own centre of mass, link axes, kg m2: those of uniform rods and boxes of its mass."""

TORQUE_LIMIT = 45.0
"""Hip and shoulder motors, N m."""
KNEE_TORQUE = (
    (-2.793, 37.2),
    (-2.156, 87.4),
    (-1.80, 106.0),
    (-1.444, 113.2),
    (-1.10, 106.5),
    (-0.832, 91.1),
    (-0.50, 60.6),
    (-0.247, 30.6),
)
"""Knee angle (rad) against the largest torque (N m): the linkage's lever arm shrinks towards both ends; linear between, constant beyond."""
