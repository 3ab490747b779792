"""What one robot is, as a value: its figures, and the laws by which the numbers of a controller follow from them.

Controllers are tuned on the reference body, `SPOT`. For another one their numbers are scaled so that it moves alike (dynamic similarity,
Alexander and Jayes 1983: equal Froude numbers v^2 / g l): with the ratio of leg lengths L and of masses M, lengths go with L, speeds with sqrt(L),
times with sqrt(L), accelerations stay, frequencies go with 1 / sqrt(L), forces with M, torques and joint springs with M L. See
docs/concepts/control.md#other-bodies.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from math import inf, isfinite, sqrt
from typing import Any

from robot.geometry.vectors import Triple
from robot.model import parameters as spot

Pair = tuple[float, float]


class ModelError(ValueError):
    """Figures that no robot of this kind can have, or a file that does not describe one; it names the figure or the element."""


@dataclass(frozen=True)
class RobotModel:
    """A quadruped with three joints in each leg: hip about x, shoulder and knee about y. Left and right legs are alike, and front and rear ones
    but for the way that their knees bend. SI units; legs in order fl, fr, rl, rr. Raises `ModelError` for figures that cannot be.
    """

    name: str
    thigh: float
    """Shoulder axis to knee axis, m."""
    calf: float
    """Knee axis to the centre of the ball that is the foot, m."""
    abduction: float
    """Hip axis to the plane the leg moves in, m."""
    foot_radius: float
    hips: tuple[Pair, Pair, Pair, Pair]
    """Hip frames in the body (x, y); their z is 0."""
    stand_height: float
    """Hip plane to foot centres when standing, m."""
    sit_height: float
    """The same when sitting."""
    hip_limits: Pair
    """Lowest and highest angle of a left hip, rad, with the leg straight down at zero; right ones are mirrored."""
    shoulder_limits: Pair
    knee_limits: Pair
    """Negative where it bends backwards, as the reference body's does, positive where it bends forwards."""
    mass: float
    """Of the whole robot, kg."""
    hip_mass: float
    thigh_mass: float
    calf_mass: float
    hip_com: Triple
    """Centre of mass of a front left hip link in its own frame, m; x is mirrored on rear legs, y on right ones."""
    thigh_com: Triple
    """Controllers take it to lie on the line from shoulder to knee."""
    calf_com: Triple
    """The same, from knee to foot."""
    body_inertia: Triple
    """Of the trunk about its centre of mass, kg m2."""
    hip_inertia: Triple
    thigh_inertia: Triple
    calf_inertia: Triple
    trunk: Triple
    """Full length, width and height of the trunk, m."""
    torque_limit: float
    """Of hip and shoulder, N m."""
    knee_torque: tuple[Pair, ...]
    """Angle (rad) of a knee that bends backwards against the largest torque (N m): linear between, constant beyond."""
    body_com: Triple = (0.0, 0.0, 0.0)
    """Of the trunk, in the body frame, m."""
    shoulder_rear_limits: Pair | None = None
    """Of the rear legs' shoulders, if they are others."""
    knee_rear_limits: Pair | None = None
    """Of the rear legs' knees, if they are others."""
    damping: float = 0.2
    """Of a joint, N m s/rad."""
    armature: float = 0.02
    """Of a joint: the rotor's inertia as the joint feels it, kg m2."""
    friction: float = 0.2
    """Of a joint, N m."""
    tuning: tuple[tuple[str, float | tuple[float, ...]], ...] = ()
    """Numbers of the controllers that are not to follow from the figures: such as ("walk.height", 0.4), ("limits.forward", 1.0), ("trot.period", 0.4)."""
    assumed: tuple[str, ...] = field(default=(), compare=False)
    """What its file does not tell, and is the reference body's, scaled; for people."""
    sides: tuple[float, float, float, float] = field(default=spot.SIDES, init=False)
    """+1 for a left leg, -1 for a right one."""

    def __post_init__(self) -> None:
        lengths = ("thigh", "calf", "foot_radius", "sit_height", "torque_limit", "hip_mass", "thigh_mass", "calf_mass")
        for name in lengths:
            if not 0.0 < getattr(self, name) < inf:
                raise ModelError(f"{self.name}: {name} is {getattr(self, name)!r}: give a number greater than zero")
        if not self.sit_height < self.stand_height < self.leg:
            raise ModelError(
                f"{self.name}: it sits at {self.sit_height:g} m, stands at {self.stand_height:g} m and has legs of {self.leg:g} m: "
                "each must be more than the one before"
            )
        if not (isfinite(self.mass) and self.body_mass > 0.0):
            raise ModelError(f"{self.name}: the legs weigh more than the whole robot, {self.mass!r} kg")

    @cached_property
    def leg(self) -> float:
        """Length of a stretched leg, m."""
        return self.thigh + self.calf

    @cached_property
    def body_mass(self) -> float:
        """Of the trunk, kg."""
        return self.mass - 4 * (self.hip_mass + self.thigh_mass + self.calf_mass)

    @cached_property
    def nominal(self) -> tuple[Pair, ...]:
        """Foot places (x, y) in the body frame straight below the shoulders, m."""
        return tuple((x, y + side * self.abduction) for (x, y), side in zip(self.hips, self.sides, strict=True))

    @cached_property
    def joint_limits(self) -> tuple[Pair, ...]:
        """Of all 12 joints, rad."""
        left, right = self.hip_limits, (-self.hip_limits[1], -self.hip_limits[0])
        front = (self.shoulder_limits, self.knee_limits)
        rear = (self.shoulder_rear_limits or self.shoulder_limits, self.knee_rear_limits or self.knee_limits)
        return tuple(pair for others in (front, rear) for hip in (left, right) for pair in (hip, *others))

    @cached_property
    def bends(self) -> tuple[float, float, float, float]:
        """Of each knee: -1 if it bends backwards, +1 if it bends forwards."""
        front, rear = (
            1.0 if low + high > 0.0 else -1.0
            for low, high in (self.knee_limits, self.knee_rear_limits or self.knee_limits)
        )
        return (front, front, rear, rear)

    @cached_property
    def length(self) -> float:
        """Leg length over the reference body's: what lengths are scaled by."""
        return self.leg / (spot.THIGH + spot.CALF)

    @cached_property
    def speed(self) -> float:
        """What speeds are scaled by, and times: equal Froude numbers."""
        return sqrt(self.length)

    @cached_property
    def force(self) -> float:
        """Mass over the reference body's: what forces are scaled by."""
        return self.mass / spot.MASS

    @cached_property
    def spring(self) -> float:
        """What torques and joint springs (N m/rad) are scaled by; joint dampers by this times `speed`."""
        return self.force * self.length

    @cached_property
    def damper(self) -> float:
        """What joint dampers (N m s/rad) are scaled by."""
        return self.spring * self.speed

    def tuned(self, group: str) -> dict[str, Any]:
        """The numbers of one group that are not to follow from the figures, by name."""
        return {name.partition(".")[2]: value for name, value in self.tuning if name.partition(".")[0] == group}

    def froude(self, number: float) -> float:
        """The speed (m/s) that has this Froude number at the height it stands at."""
        return sqrt(number * spot.GRAVITY * self.stand_height)


SPOT = RobotModel(
    name="spot",
    thigh=spot.THIGH,
    calf=spot.CALF,
    abduction=spot.ABDUCTION,
    foot_radius=spot.FOOT_RADIUS,
    hips=spot.HIPS,
    stand_height=spot.STAND_HEIGHT,
    sit_height=spot.SIT_HEIGHT,
    hip_limits=spot.HIP_LIMITS,
    shoulder_limits=spot.SHOULDER_LIMITS,
    knee_limits=spot.KNEE_LIMITS,
    mass=spot.MASS,
    hip_mass=spot.HIP_MASS,
    thigh_mass=spot.THIGH_MASS,
    calf_mass=spot.CALF_MASS,
    hip_com=spot.HIP_COM,
    thigh_com=spot.THIGH_COM,
    calf_com=spot.CALF_COM,
    body_inertia=spot.BODY_INERTIA,
    hip_inertia=spot.HIP_INERTIA,
    thigh_inertia=spot.THIGH_INERTIA,
    calf_inertia=spot.CALF_INERTIA,
    trunk=spot.TRUNK,
    torque_limit=spot.TORQUE_LIMIT,
    knee_torque=spot.KNEE_TORQUE,
)
"""The reference body: a Spot-like quadruped, of `robot.model.parameters`."""
