"""The equations of walking, as functions without state: what the body should feel, and where the feet should land.

Frames: `odom` axes unless said otherwise; the heading frame is odom turned by the body's yaw. With the unit vectors of the heading frame e,
the error of velocity d = v* - v + v_sway, the integral i of it, and the angles lean = (roll, pitch, yaw wanted) - (those predicted), with
the integrals i_h and i_R of height and lean (`robot.control.trim`):

    force   horizontal   m (clip(k_v d + i) + a_sway)
            vertical     m max(0.2 g, g + i_h + k_h (h* - h) + d_h (slope . v - v_z))
    moment  per axis     I (k_R lean + d_R (w* - w) + i_R)
    landing              p - s + u T + r + (u + w* x r) t_stance / 2 + clip(k (u - v*)) + h / (2 g) (u x w*) - h / g i

where s is the displacement of the sway, u = v - v_sway, T the time until the landing and r the foot's nominal place, turned by the yaw at
the landing. That is Raibert's rule (1986) with the term for turning of Kim et al. (2019). Symbols, numbers and sources:
docs/concepts/control.md#walking.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan, cos, hypot
from typing import NamedTuple

from robot.control.sway import Sway
from robot.control.walk_config import WalkConfig
from robot.estimation.predict import PredictedState
from robot.estimation.terrain import TerrainPlane
from robot.geometry.angles import wrap
from robot.geometry.planar import turned, turned_back
from robot.geometry.vectors import Triple
from robot.model.mass import StandingMass
from robot.model.parameters import GRAVITY

Planar = tuple[float, float]


class WalkState(NamedTuple):
    """What a walk remembers from one step to the next."""

    heading: float
    """The yaw that it holds, rad."""
    integral: Planar = (0.0, 0.0)
    """What makes up for lasting errors of velocity, heading frame, m/s2."""


@dataclass(frozen=True, slots=True)
class Step:
    """What one control step is about."""

    dt: float
    """Since the last one, s."""
    ahead: PredictedState
    """Body and legs when the motors will act."""
    terrain: TerrainPlane
    wanted: Planar
    """Velocity, odom axes, m/s."""
    turn: float
    """Rate wanted, rad/s."""
    sway: tuple[Sway, Sway]
    """Forward and to the left, heading frame."""
    height: float
    """Of the hip plane over the feet, wanted, m."""
    mass: StandingMass
    """How the mass lies at that height."""


class Tracking(NamedTuple):
    """How the body differs from what is wanted of it."""

    error: Planar
    """Of velocity, heading frame, m/s."""
    ground: Planar
    """Roll and pitch of the ground under the heading, rad."""
    lean: Triple
    """Roll, pitch and yaw by which the body is to turn, rad."""
    back: Planar
    """How far the feet are set back so that the body leans into what the integral has learned, odom axes, m."""


AT_REST = Tracking((0.0, 0.0), (0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0))
"""Of a body that is just as it should be."""


def track(config: WalkConfig, state: WalkState, step: Step) -> tuple[WalkState, Tracking]:
    """One step of the integral and of the heading that is held, and how far off the body is."""
    ahead, terrain = step.ahead, step.terrain
    vx, vy, _ = ahead.velocity
    slow, aside = turned_back(ahead.yaw, step.wanted[0] - vx, step.wanted[1] - vy)
    fore, side = step.sway
    error = (slow + fore[1], aside + side[1])
    ix, iy = (
        clip(learned + config.speed_integral * value * step.dt, config.most_integral)
        for learned, value in zip(state.integral, error, strict=True)
    )
    share = config.step_share * step.height / GRAVITY
    back_x, back_y = turned(ahead.yaw, ix, iy)
    heading = ahead.yaw + clip(wrap(state.heading + step.turn * step.dt - ahead.yaw), config.heading_error)
    rise_ahead, rise_left = turned_back(ahead.yaw, terrain.slope_x, terrain.slope_y)
    roll, pitch = clip(atan(rise_left), config.most_slope), clip(-atan(rise_ahead), config.most_slope)
    lean = (roll - ahead.roll, pitch - ahead.pitch, wrap(heading - ahead.yaw))
    return WalkState(heading, (ix, iy)), Tracking(error, (roll, pitch), lean, (share * back_x, share * back_y))


def has_lost_balance(config: WalkConfig, tracking: Tracking) -> bool:
    """Whether the body leans or moves in a way that a swaying gait was not made for."""
    roll, pitch, _ = tracking.lean
    return max(abs(roll), abs(pitch)) > config.most_lean or hypot(*tracking.error) > config.most_error


def sag(step: Step, standing: Sequence[int]) -> float:
    """How much too low the body is over its standing feet, m."""
    slope_x, slope_y = step.terrain.slope_x, step.terrain.slope_y
    below = (step.ahead.feet[leg] for leg in standing)
    return step.height + sum(z - slope_x * x - slope_y * y for x, y, z in below) / len(standing)


def body_wrench(
    config: WalkConfig,
    state: WalkState,
    tracking: Tracking,
    step: Step,
    standing: Sequence[int],
    trim: Triple = (0.0, 0.0, 0.0),
) -> tuple[float, ...]:
    """Force (N) and moment about the centre of mass (N m) that the standing feet shall give, odom axes.

    `trim` is what a load asks for besides: lift (m/s2), and turning about roll and pitch (rad/s2).
    """
    ahead, terrain = step.ahead, step.terrain
    vx, vy, vz = ahead.velocity
    fore, side = step.sway
    push_x, push_y = (
        clip(config.speed_gain * error + learned, config.most_push) + swaying[2]
        for error, learned, swaying in zip(tracking.error, state.integral, (fore, side), strict=True)
    )
    slope_x, slope_y = terrain.slope_x, terrain.slope_y
    climb = slope_x * vx + slope_y * vy - vz
    lift = GRAVITY + trim[0] + config.height_spring * sag(step, standing) + config.height_damper * climb
    wx, wy, wz = ahead.turn
    mx, my, mz = (
        inertia * (spring * angle + damper * rate + held)
        for inertia, spring, angle, damper, rate, held in zip(
            step.mass.inertia,
            config.turn_spring,
            tracking.lean,
            config.turn_damper,
            (-wx, -wy, step.turn - wz),
            (trim[1], trim[2], 0.0),
            strict=True,
        )
    )
    mass = ahead.legs.model.mass
    force_x, force_y = turned(ahead.yaw, push_x, push_y)
    return (
        mass * force_x,
        mass * force_y,
        mass * max(config.least_lift * GRAVITY, lift),
        *turned(ahead.yaw, mx, my),
        mz,
    )


def foothold(
    config: WalkConfig, tracking: Tracking, step: Step, leg: int, remaining: float, stance_time: float
) -> Triple:
    """Where a foot should land in `remaining` seconds, odom axes, m."""
    ahead, half = step.ahead, 0.5 * stance_time
    yaw = ahead.yaw + ahead.turn[2] * remaining
    roll, pitch = tracking.ground
    # Seen from above, the stance of a body that leans with the slope is shorter.
    place_x, place_y = ahead.legs.model.nominal[leg]
    nominal_x, nominal_y = place_x * cos(pitch) - step.mass.behind, place_y * cos(roll)
    rx, ry = turned(yaw, nominal_x, nominal_y)
    (fore, forward, _), (side, left, _) = step.sway
    swayed, swaying = turned(ahead.yaw, fore, side), turned(ahead.yaw, forward, left)
    vx, vy = ahead.velocity[0] - swaying[0], ahead.velocity[1] - swaying[1]
    lean = 0.5 * step.height / GRAVITY * step.turn
    back_x, back_y = tracking.back
    x = (
        ahead.position[0]
        - swayed[0]
        + vx * remaining
        + rx
        + (vx - step.turn * ry) * half
        + clip(config.capture * (vx - step.wanted[0]), config.most_capture)
        + lean * vy
        - back_x
    )
    y = (
        ahead.position[1]
        - swayed[1]
        + vy * remaining
        + ry
        + (vy + step.turn * rx) * half
        + clip(config.capture * (vy - step.wanted[1]), config.most_capture)
        - lean * vx
        - back_y
    )
    return (x, y, step.terrain.height(x, y))


def clip(value: float, most: float) -> float:
    """The nearest value whose magnitude is at most `most`."""
    return max(-most, min(most, value))
