"""The numbers of walking. All were chosen, and are measured together by `tests.figures walk`; what a number comes to is computed from it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from robot.geometry.vectors import Triple
from robot.model.robot import SPOT, RobotModel

SWING_SPRING, SWING_DAMPER = 250.0, 4.0
"""Joint gains of the reference body's leg in the air, N m/rad and N m s/rad; chosen."""


@dataclass(frozen=True, slots=True)
class WalkConfig:
    """Gains are per mass or inertia, so that they are those of the motion and not of the robot.

    Raises `ValueError` for a height that no leg reaches, a crouch below the ground or upwards, and speeds of crouching that do not grow.
    """

    # -- the body over its feet
    height: float = 0.52
    """Hip plane over the foot centres, m; chosen: tall legs carry cheaply, as the knee's torque falls with its bend."""
    crouch: float = 0.05
    """How much less of it at speed, m; chosen: bent legs reach far."""
    crouch_speeds: tuple[float, float] = (1.0, 2.0)
    """Between these speeds it is lowered, m/s; chosen."""
    rise_speed: float = 0.15
    """How fast the wanted height changes, m/s; chosen."""
    height_spring: float = 60.0
    """k_h, 1/s2; chosen: a frequency of 1.2 Hz."""
    height_damper: float = 12.0
    """d_h, 1/s; chosen: 0.8 of critical damping."""
    least_lift: float = 0.2
    """Of the weight, the least that the feet carry; chosen: feet that carry nothing cannot steer."""
    turn_spring: Triple = (180.0, 180.0, 60.0)
    """k_R in roll, pitch and yaw, 1/s2; chosen: 2.1 Hz, 2.1 Hz and 1.2 Hz."""
    turn_damper: Triple = (18.0, 18.0, 12.0)
    """d_R, 1/s; chosen: 0.7 to 0.8 of critical damping."""
    heading_error: float = 0.3
    """Bound of the wanted turn against the body's yaw, rad; chosen: a robot that is held does not spin when it is let go."""
    most_slope: float = 0.5
    """Bound of roll and pitch that follow the ground, rad; chosen: 29 degrees."""

    # -- velocity
    least_stride: float = 0.2
    """A walk that is joined in mid-stride is taken to be at least so fast, m/s; chosen: the feet of a slower one do not tell its phase."""
    speed_gain: float = 6.0
    """k_v, 1/s; chosen: a time constant of 0.17 s, a third of a step."""
    speed_integral: float = 3.0
    """Growth of the integral, 1/s2; chosen: half the gain, so that it follows within half a second."""
    most_integral: float = 2.0
    """Bound of the integral, m/s2; chosen: what a slope of 12 degrees needs."""
    most_push: float = 5.0
    """Bound of the horizontal acceleration asked of the feet, m/s2; chosen: what friction of 0.5 gives."""

    # -- where the feet land
    step_share: float = 1.0
    """Share of the integral that is realised by shifting footholds instead of by friction; chosen: two feet cannot push across their line
    without tilting the body."""
    capture: float = 0.12
    """k: how far a foot steps beyond symmetry for each m/s of wrong speed, s; chosen: half of the
    sqrt(h / g) = 0.23 s that would stop an inverted pendulum within one step."""
    most_capture: float = 0.25
    """Bound of that, m; chosen: the legs' reach."""

    # -- one leg
    swing_spring: float = SWING_SPRING
    """Joint gain of a foot in the air, N m/rad; chosen."""
    swing_damper: float = SWING_DAMPER
    """N m s/rad; chosen."""
    stance_damper: float = 1.0
    """Of a standing leg, N m s/rad; chosen: forces rule, this only calms the joints."""
    leaving: float = 0.9
    """From this share of its stance on, a foot is about to lift, and the estimator doubts it; chosen: it unloads and may slip."""
    early: float = 0.5
    """From this progress of a swing on, a contact ends it; chosen."""
    latest: float = 0.85
    """A foot that is taken up in mid-swing has at least the rest from this progress on to come down; chosen."""
    stumble: tuple[float, float] = (0.2, 0.5)
    """A contact between these shares of a swing is something in the way; chosen: before, the foot may still scrape the floor it left."""
    boost_speed: float = 1.0
    """How fast a foot that stumbles is lifted over what it met, m/s; chosen."""
    most_boost: float = 0.10
    """How far, m; chosen: with the swing's clearance, above a step of 15 cm."""
    boost_end: float = 4.0
    """Per rest of the swing, how soon that is taken back: within its last quarter; chosen."""
    caution: float = 0.10
    """How much higher all feet are lifted after a stumble, m; chosen: what was in the way may come again."""
    most_caution: float = 0.16
    """At most, m; chosen: the legs' reach."""
    steep: float = 0.45
    """On ground that rises by so much per metre feet are lifted no higher than usual, on level ground by all of that, and between in
    proportion; chosen: a high swing takes weight off the standing feet, and with 0.16 m more they slide on 20 degrees at a friction of 0.6."""
    calm: float = 0.015
    """How soon that is forgotten, m/s; chosen: one stumble in 7 s."""
    grace: float = 0.02
    """Seconds for which a foot that should have landed is taken to stand without having reported contact; chosen: four samples."""
    sloping: float = 0.1
    """On ground that rises by more than this per metre a walk waits for a foot that has not found the ground; chosen: 6 degrees. On level ground
    the gaits that sway fall while they wait."""
    waiting_speed: float = 0.5
    """While a foot has not found the ground no other lifts, but not in a walk that is faster than this, m/s; chosen: its next foot is needed
    where it falls to."""
    most_wait: float = 0.3
    """Nor for longer than this, s; chosen: by then the foot has been lowered as far as the leg reaches."""
    search_speed: float = 1.0
    """How fast a foot that has not found the ground is lowered, m/s; chosen."""
    least_grip: float = 0.4
    """Share of the usual friction that a slipping foot is trusted with at least; chosen: of 0.6, that is 0.24."""
    grip_loss: float = 20.0
    """How fast a foot that slips loses trust, 1/s; chosen: within 30 ms."""
    grip_back: float = 0.5
    """How fast it gets it back, 1/s; chosen: within a second or two."""
    upright: float = 0.15
    """A body that leans more than this from what is wanted, rad, has been pushed: what its feet slide then says nothing of the floor; chosen."""

    # -- gaits that sway
    sway_time: float = 0.6
    """Seconds within which a gait's sway is begun, and before which no foot lifts; chosen."""
    side_change: float = 0.1
    """Share of a period within which the sway changes sides; chosen: while all four feet stand."""
    most_lean: float = 0.10
    """A body that leans more (rad) has lost the balance that a swaying gait relies on; chosen."""
    most_error: float = 0.30
    """The same for a velocity that is off by more, m/s; chosen."""

    reach: float = SPOT.leg
    """Length of a stretched leg, m."""

    @classmethod
    def of(cls, model: RobotModel) -> WalkConfig:
        """These numbers of the reference body, for another one, that moves alike at the same Froude number (docs/concepts/control.md#other-bodies)."""
        own = cls()
        changes: dict[str, Any] = {name: _scaled(getattr(own, name), law(model)) for name, law in _LAWS.items()}
        return replace(own, **changes | model.tuned("walk"))

    def __post_init__(self) -> None:
        if not 0.0 <= self.crouch < self.height < self.reach:
            raise ValueError(
                f"A walk at {self.height:g} m with a crouch of {self.crouch:g} m is none: choose 0 <= crouch < height < {self.reach:g} m."
            )
        slow, fast = self.crouch_speeds
        if not slow < fast:
            raise ValueError(
                f"The body is lowered between two speeds that grow, not between {slow:g} and {fast:g} m/s."
            )


def _scaled(value: float | Triple, scale: float) -> float | tuple[float, ...]:
    return tuple(part * scale for part in value) if isinstance(value, tuple) else value * scale


_LAWS: Mapping[str, Callable[[RobotModel], float]] = {
    **dict.fromkeys(
        ("height", "crouch", "most_capture", "most_boost", "caution", "most_caution", "reach"),
        lambda model: model.length,
    ),
    **dict.fromkeys(
        (
            "crouch_speeds",
            "rise_speed",
            "least_stride",
            "boost_speed",
            "calm",
            "waiting_speed",
            "search_speed",
            "most_error",
        ),
        lambda model: model.speed,
    ),
    **dict.fromkeys(("capture", "most_wait", "sway_time"), lambda model: model.speed),
    **dict.fromkeys(("height_damper", "turn_damper", "speed_gain"), lambda model: 1.0 / model.speed),
    **dict.fromkeys(("height_spring", "turn_spring", "speed_integral"), lambda model: 1.0 / model.length),
    "swing_spring": lambda model: model.spring,
    "swing_damper": lambda model: model.damper,
    "stance_damper": lambda model: model.damper,
}
"""By what each number is multiplied: lengths, speeds, times, frequencies and their squares, joint springs and dampers. The others are shares, angles
and accelerations, which stay, and `grace`, which is that of the samples."""
