"""Encoders that stick: what they show stays within their noise while the joint that they belong to turns."""

from __future__ import annotations

from collections import deque
from math import inf
from typing import Final

from robot.hardware.body import JointSample, MotorTargets
from robot.model.robot import SPOT, RobotModel

NOISE: Final = 4e-3
"""An encoder that shows no more change than this does not move, rad; chosen: eight standard deviations of a good one."""
STILL: Final = 0.03
"""Seconds of that after which a joint is looked at."""
LED: Final = 0.06
"""So far its drive must have been told to turn it meanwhile, rad; chosen: 15 N m of a swinging leg's spring."""
IDLE: Final = 0.5
"""A drive that gives less than this share of the torque that its law asks for at the place shown, is not at that place."""
UNCLEAR: Final = 1.5
"""A torque that is missing by less than this, N m, may be the noise of its measurement; chosen: three standard deviations. Of a robot of a few kilograms
the drives give no more while it stands."""
PUSHING: Final = 40.0
"""A drive of the reference body that gives more than this pushes against something, N m: its joint may well stand still."""
CERTAIN: Final = 0.0149
"""Seconds of that which make a verdict: three samples at 200 Hz, less a rounding."""
STRIDES: Final = 2.0
"""Seconds for which no joint of a robot that steps stands still: hips that walk straight on turn by 0.02 rad in each stride; measured: the hips
of a bound in place stand still for up to 1.04 s."""
LED_LITTLE: Final = 0.01
"""So far its drive must have been told to turn it then, rad; farther, where dry friction holds it."""
HELD: Final = 8e-4
"""So far a swinging leg's spring is bent by the dry friction of the reference body's joints, rad,"""
STICKING: Final = 4.0
"""and so many times what it is bent farther the drive must have been told more; measured: 2.1 at a joint with five times the friction."""
DOUBT: Final = 0.03
"""Seconds after which a shoulder or knee that does not move is doubted: the foot may seem to slide for it."""
LATE: Final = 6
"""Targets that may be those in force, the newest first: delays of up to 30 ms."""


class StuckWatch:
    """Compares what the drives were told, what they give and what the encoders show; call `check` once per control step.

    A drive holds the law torque = effort + kp (q* - q) + kd (qd* - qd). A joint that is held fast shows no motion and takes that torque; one that
    turns under an encoder that sticks takes much less than the law asks for at the place shown. Invariant: a joint that moves is not stuck.
    """

    __slots__ = (
        "_anchor",
        "_far",
        "_friction",
        "_idle_for",
        "_led",
        "_near",
        "_pushing",
        "_stepping",
        "_still_for",
        "_told",
        "stuck",
    )

    def __init__(self, model: RobotModel = SPOT) -> None:
        self._friction, self._pushing = model.friction, PUSHING * model.spring
        self._led = [LED_LITTLE] * 12
        """How far the drive must have been told to turn each joint that stands still for long, rad."""
        self._anchor = [0.0] * 12
        self._still_for = [0.0] * 12
        self._idle_for = [0.0] * 12
        self._near, self._far = [inf] * 12, [-inf] * 12
        """Least and largest target of each joint since it stands still, rad."""
        self._stepping = False
        self._told: deque[tuple[list[float], ...]] = deque(maxlen=LATE)
        self.stuck: set[int] = set()
        """Joints whose encoders stick."""

    def told(self, targets: MotorTargets, *, stepping: bool) -> None:
        """The drives have been told this; `stepping` says that the robot lifts its feet in turn."""
        if stepping and not self._stepping:  # a robot that stood has joints that stood still
            self._still_for = [0.0] * 12
            self._near, self._far = [inf] * 12, [-inf] * 12
        self._stepping = stepping
        self._told.append(
            (
                targets.position.tolist(),
                targets.velocity.tolist(),
                targets.effort.tolist(),
                targets.kp.tolist(),
                targets.kd.tolist(),
            )
        )

    @property
    def doubtful(self) -> bool:
        """Whether a shoulder or a knee has not moved for so long that a foot may seem to slide for it."""
        still = self._still_for
        return any(still[joint] > DOUBT for joint in range(12) if joint % 3)

    def check(self, dt: float, position: list[float], velocity: list[float], sample: JointSample) -> None:
        """Take in a sample; `stuck` says what follows from it."""
        anchor, still = self._anchor, self._still_for
        effort: list[float] | None = None
        for joint, at in enumerate(position):
            if not -NOISE < at - anchor[joint] < NOISE:
                anchor[joint], still[joint] = at, 0.0
                self._idle_for[joint] = 0.0
                self.stuck.discard(joint)
                self._near[joint], self._far[joint] = inf, -inf
                continue
            still[joint] += dt
            if not self._told or joint in self.stuck:
                continue
            self._lead(joint)
            way = self._far[joint] - self._near[joint]
            if self._stepping and still[joint] > STRIDES and way > self._led[joint]:
                self.stuck.add(joint)
            elif still[joint] > STILL and way > LED:
                given: list[float] = effort or sample.effort.tolist()
                effort = given
                if self._idles(joint, at, velocity[joint], given[joint]):
                    self._idle_for[joint] += dt
                    if self._idle_for[joint] >= CERTAIN:
                        self.stuck.add(joint)

    def _lead(self, joint: int) -> None:
        """Note the position target of the joint, if it has one."""
        position, _, _, kp, _ = self._told[-1]
        if kp[joint] > 0.0:
            self._near[joint] = min(self._near[joint], position[joint])
            self._far[joint] = max(self._far[joint], position[joint])
            self._led[joint] = LED_LITTLE + STICKING * max(0.0, self._friction / kp[joint] - HELD)

    def _idles(self, joint: int, at: float, speed: float, given: float) -> bool:
        """Whether the drive gives less than its law asks for here, by whichever of the latest targets."""
        if abs(given) > self._pushing:
            return False
        for position, velocity, effort, kp, kd in self._told:
            if kp[joint] <= 0.0:
                return False
            spring = kp[joint] * (position[joint] - at) + kd[joint] * (velocity[joint] - speed)
            missing = effort[joint] + spring - given
            if (
                abs(spring) < kp[joint] * LED * 0.5
                or missing * spring <= 0.0
                or abs(missing) < max(IDLE * abs(spring), UNCLEAR)
            ):
                return False
        return True
