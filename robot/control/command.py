"""What the robot is asked to do, made into what a body can do: refused, clipped and slewed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite

from robot.geometry.vectors import Triple
from robot.model.robot import RobotModel


@dataclass(frozen=True, slots=True)
class CommandLimits:
    """Largest speeds forward, back, sideways (m/s) and turning (rad/s), and how fast commands may change (m/s2, rad/s2)."""

    forward: float = 1.6
    backward: float = 0.5
    sideways: float = 0.4
    turn: float = 1.5
    slew: float = 1.5
    turn_slew: float = 4.0

    def of(self, model: RobotModel) -> CommandLimits:
        """These limits of the reference body, for another one: speeds at the same Froude numbers."""
        length, speed = model.length, model.speed
        return CommandLimits(
            self.forward * speed, self.backward * speed, self.sideways * speed, self.turn / speed, self.slew, self.turn_slew / length
        )  # fmt: skip

    @classmethod
    def usual(cls, model: RobotModel) -> CommandLimits:
        """Those of a robot that is given no others."""
        return replace(cls().of(model), **model.tuned("limits"))

    def clip(self, vx: float, vy: float, wz: float) -> Triple:
        """The nearest velocity within the limits."""
        return (
            max(-self.backward, min(self.forward, vx)),
            max(-self.sideways, min(self.sideways, vy)),
            max(-self.turn, min(self.turn, wz)),
        )

    def between(self, other: CommandLimits, share: float) -> CommandLimits:
        """These limits at `share` 0, those of `other` at 1."""
        mine = (self.forward, self.backward, self.sideways, self.turn)
        theirs = (other.forward, other.backward, other.sideways, other.turn)
        return CommandLimits(*(a + (b - a) * share for a, b in zip(mine, theirs, strict=True)))

    def allows(self, velocity: Triple) -> bool:
        """Whether the velocity is within the limits."""
        return self.clip(*velocity) == velocity


class CommandShaper:
    """Holds the velocity asked for and lets the one in force follow it at a bounded rate."""

    def __init__(self, limits: CommandLimits) -> None:
        self.limits = limits
        self.asked = (0.0, 0.0, 0.0)
        self.velocity = (0.0, 0.0, 0.0)
        """In force now: forward, left (m/s), counter-clockwise (rad/s)."""
        self.refused = 0
        """How many commands were not numbers."""

    def ask(self, vx: float, vy: float, wz: float) -> bool:
        """Ask for a velocity; False, counted and without effect if any part is NaN or infinite."""
        if not (isfinite(vx) and isfinite(vy) and isfinite(wz)):
            self.refused += 1
            return False
        self.asked = self.limits.clip(vx, vy, wz)
        return True

    def advance(self, dt: float, walking: bool, *bounds: CommandLimits | None, least_slew: float = 0.0) -> Triple:
        """The velocity in force after `dt` seconds; zero is aimed at unless `walking`, and nothing beyond any of `bounds`.

        It follows at the rate of the limits, or at `least_slew`, m/s2, if that is more.
        """
        target = self.asked if walking else (0.0, 0.0, 0.0)
        for bound in bounds:
            if bound is not None:
                target = bound.clip(*target)
        step, turn = max(self.limits.slew, least_slew) * dt, self.limits.turn_slew * dt
        vx, vy, wz = self.velocity
        self.velocity = (_towards(vx, target[0], step), _towards(vy, target[1], step), _towards(wz, target[2], turn))
        return self.velocity

    def resume(self, vx: float, vy: float, wz: float) -> None:
        """What is asked for stays; the velocity in force follows it from this one on, clipped."""
        self.velocity = self.limits.clip(vx, vy, wz)

    def halt(self) -> None:
        """Forget everything: the robot stands."""
        self.asked = self.velocity = (0.0, 0.0, 0.0)


def _towards(value: float, target: float, step: float) -> float:
    return max(value - step, min(value + step, target))
