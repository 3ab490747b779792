"""Which sensors can be believed: not one that is missing, is no number, does not change or cannot be.

Nothing here decides what the robot does about it: `GaitController` stands without an IMU, sits down without an encoder, and walks on by
its own schedule without a foot contact.
"""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from typing import Protocol

import numpy as np

from robot.estimation.stuck_encoder import StuckWatch
from robot.geometry.vectors import Triple, Vector
from robot.hardware.body import ImuSample, JointSample
from robot.model.legs import LegState
from robot.model.robot import SPOT, RobotModel

IMU_AGE = 0.05
"""Seconds for which one sample of the IMU will do, if it is slower than the encoders."""
IMU_LIFE = 0.1
"""Seconds without a believable sample after which the IMU counts as lost."""
JOINT_LIFE = 0.02
"""The same for a joint's encoder: the legs cannot be steered without it for longer."""
FROZEN = 0.02
"""Seconds after which a signal that repeats itself to the last bit is no signal: there is noise on every real one."""
BACK = 0.5
"""Seconds of believable samples after which a lost sensor is back."""
FASTEST_TURN, HARDEST = 50.0, 400.0
"""Bounds of what an IMU can show: rad/s, m/s2."""
FARTHEST, FASTEST = 4.0, 100.0
"""Bounds of what an encoder can show: rad, rad/s."""
IN_THE_AIR = (0.1, 0.38)
"""Between these shares of its swing a foot is off the ground: whatever touches during all of that time is no contact."""
FLYING = 1.5
"""A foot that is to be in the air and moves faster than this over the ground (m/s) does not touch it, whatever its contact says."""
FLOWN = 0.0125
"""Seconds of such a flight with a closed contact that make a verdict: three samples at 200 Hz, as contacts may come late."""
PRESSING = 40.0
"""A foot of the reference body that bears so much (N) by the torques of its leg stands, whatever its contact says."""
LOOKED = 0.0225
"""Seconds of looking at a foot that make a verdict: five samples at 200 Hz."""
OVERDUE = 0.04
"""Seconds after it should have landed from which on a foot is asked what it bears."""

MOVING = 1e-3
"""Only a joint that says to turn faster than this can be frozen, rad/s: one that does not turn may well repeat itself."""
SINGULAR = 1e-3
"""Directions of a leg's Jacobian with less than this share of its largest gain say nothing about the ground's push."""
ROUNDING = 1e-9
"""Of sums of sample times, s."""


class _Trust:
    """Lost after `life` seconds of bad samples, back after half a second of good ones."""

    __slots__ = ("bad_for", "good_for", "life", "lost")

    def __init__(self, life: float) -> None:
        self.life = life
        self.bad_for = self.good_for = 0.0
        self.lost = False

    def update(self, dt: float, good: bool) -> None:
        if good:
            self.bad_for = 0.0
            self.good_for += dt
            self.lost = self.lost and self.good_for < BACK - ROUNDING
        else:
            self.good_for = 0.0
            self.bad_for += dt
            self.lost = self.lost or self.bad_for > self.life - ROUNDING


class ImuWatch:
    """Silent, frozen, not a number, or beyond what there can be."""

    def __init__(self) -> None:
        self._trust = _Trust(IMU_LIFE)
        self._sample: ImuSample | None = None
        self._age = 0.0
        self._last: list[float] = []
        self._same_for = 0.0

    @property
    def lost(self) -> bool:
        """Whether the IMU cannot be relied on."""
        return self._trust.lost

    @property
    def fresh(self) -> bool:
        """Whether the latest sample is believed and was not there before."""
        return not self._trust.lost and not self._trust.bad_for and self._age == 0.0

    def check(self, dt: float, sample: ImuSample | None) -> ImuSample | None:
        """The sample, if it can be believed. The very same object again means that there is no newer one."""
        if sample is not None and sample is self._sample:
            self._age += dt
            good = self._age < IMU_AGE and not self._trust.bad_for
        else:
            good = sample is not None and self._believable(dt + self._age, sample)
            self._sample, self._age = sample, 0.0
        self._trust.update(dt, good)
        return sample if good and not self._trust.lost else None

    def _believable(self, dt: float, sample: ImuSample) -> bool:
        turn, force = sample.gyro.tolist(), sample.accel.tolist()
        if not isfinite(sum(turn) + sum(force)):
            return False
        if max(turn) > FASTEST_TURN or min(turn) < -FASTEST_TURN or max(force) > HARDEST or min(force) < -HARDEST:
            return False
        values = turn + force
        self._same_for = self._same_for + dt if values == self._last and any(turn) else 0.0
        self._last = values
        return self._same_for < FROZEN


class JointWatch:
    """Encoders that are not a number, beyond what there can be, frozen, or stuck; each joint by itself."""

    def __init__(self, model: RobotModel = SPOT) -> None:
        self._trust = _Trust(JOINT_LIFE)
        self._position = [0.0] * 12
        self._shown = ([0.0] * 12, [0.0] * 12)
        """The latest sample as it came: positions and speeds."""
        self._same_for = [0.0] * 12
        self.sticking = StuckWatch(model)
        self.bad: list[int] = []
        """Joints whose latest sample is not believed."""

    @property
    def lost(self) -> bool:
        """Whether there is a joint whose encoder cannot be relied on."""
        return self._trust.lost

    def check(self, dt: float, sample: JointSample, expected: Callable[[], Vector | None]) -> JointSample:
        """The sample; a joint that cannot be believed is where it is `expected` to be (shape (12,)), or else where it was seen last."""
        position, velocity = sample.position.tolist(), sample.velocity.tolist()
        self.bad = self._doubtful(dt, position, velocity)
        self.sticking.check(dt, position, velocity, sample)
        self.bad += [joint for joint in self.sticking.stuck if joint not in self.bad]
        self._trust.update(dt, not self.bad)
        if not self.bad:
            self._position = position
            return sample
        position, velocity = position.copy(), velocity.copy()
        places = expected()
        for joint in self.bad:
            position[joint] = self._position[joint] if places is None else float(places[joint])
            velocity[joint] = 0.0
        self._position = position
        effort = np.nan_to_num(sample.effort, posinf=0.0, neginf=0.0)
        return JointSample(np.array(position), np.array(velocity), effort, sample.contact)

    def _doubtful(self, dt: float, position: list[float], velocity: list[float]) -> list[int]:
        bad: list[int] = []
        if not isfinite(sum(position) + sum(velocity)):
            bad = [joint for joint in range(12) if not isfinite(position[joint] + velocity[joint])]
        same = self._same_for
        for joint, (at, speed, before, was) in enumerate(zip(position, velocity, *self._shown, strict=True)):
            if at == before and speed == was and (speed > MOVING or speed < -MOVING):
                same[joint] += dt
                if same[joint] >= FROZEN:
                    bad.append(joint)
            else:
                same[joint] = 0.0
            if not (-FARTHEST < at < FARTHEST and -FASTEST < speed < FASTEST) and joint not in bad:
                bad.append(joint)
        self._shown = (position, velocity)
        return bad


class SwingSchedule(Protocol):
    """When a walk has its feet in the air."""

    def swing(self, leg: int) -> float:
        """Progress of a foot in the air, 0 to 1; negative while it stands."""
        ...

    def late(self, leg: int) -> float:
        """Seconds since a foot should have landed that has not been felt on the ground."""
        ...


class ContactWatch:
    """Foot contacts that are stuck: closed while the foot is in the air, or open while its leg bears weight.

    With `judging` false what they show is believed: a body that lifts its feet by a schedule of its own would be called a liar.
    """

    def __init__(self, judging: bool = True) -> None:
        self._judging = judging
        self.trusted = [True] * 4
        self._touched = [True] * 4
        """Whether the contact was closed at every moment of this swing so far."""
        self._seen = [0.0] * 4
        """Seconds for which the foot was looked at in the middle of this swing."""
        self._pressed = [0.0] * 4
        """Seconds for which its leg bore weight while the contact was open."""
        self._flown = [0.0] * 4
        """Seconds without a break for which it has flown while the contact was closed."""

    def check(
        self,
        dt: float,
        sample: JointSample,
        legs: LegState,
        walker: SwingSchedule | None,
        silent: bool,
        speed: Callable[[int], float] = lambda leg: 0.0,
    ) -> list[bool] | None:
        """What to believe of each foot; None: what it shows. In a walk (`walker`) a foot that is not believed stands when it ought to.

        `speed` tells of a leg how fast its foot moves over the ground, m/s.
        """
        if walker is None:
            return [True] * 4 if silent else None
        shown: list[bool] = sample.contact.tolist()
        believed: list[bool] = []
        for leg, contact in enumerate(shown):
            progress, flies = walker.swing(leg), False
            if self._judging and not silent:
                flies = contact and progress > IN_THE_AIR[0] and speed(leg) > FLYING
                self._judge(dt, leg, contact, progress, sample, legs, walker)
                self._flown[leg] = self._flown[leg] + dt if flies else 0.0
                self.trusted[leg] = self.trusted[leg] and self._flown[leg] < FLOWN
            believed.append((contact and not flies) if self.trusted[leg] and not silent else progress < 0.0)
        return None if believed == shown else believed

    def _judge(
        self,
        dt: float,
        leg: int,
        contact: bool,
        progress: float,
        sample: JointSample,
        legs: LegState,
        walker: SwingSchedule,
    ) -> None:
        if progress > IN_THE_AIR[0]:
            if progress < IN_THE_AIR[1]:
                self._seen[leg] += dt
                self._touched[leg] = self._touched[leg] and contact
            elif self._seen[leg] > LOOKED:
                self.trusted[leg] = not self._touched[leg] and (self.trusted[leg] or self._pressed[leg] == 0.0)
                self._seen[leg] = 0.0
        else:
            self._seen[leg], self._touched[leg] = 0.0, True
            if contact:
                self._pressed[leg] = 0.0
            elif walker.late(leg) > OVERDUE and _bearing(leg, sample, legs) > PRESSING * legs.model.force:
                self._pressed[leg] += dt
                if self._pressed[leg] > LOOKED:
                    self.trusted[leg] = False


def _bearing(leg: int, sample: JointSample, legs: LegState) -> float:
    """How hard the ground pushes a foot up by the motor torques of its leg, N: -J^-T (torque - weight), the vertical part."""
    joints = slice(3 * leg, 3 * leg + 3)
    a, b, c = (float(t) - w for t, w in zip(sample.effort[joints], legs.weight[joints], strict=True))
    (xa, xb, xc), (ya, yb, yc), (za, zb, zc) = legs.jacobians[leg]
    columns = ((xa, ya, za), (xb, yb, zb), (xc, yc, zc))
    return -_solve(columns, (a, b, c))[2]


def _solve(rows: tuple[Triple, Triple, Triple], right: Triple) -> Triple:
    """Three equations; of a leg that is nearly singular the least solution, without the direction that cannot be told."""
    x, y, z = np.linalg.lstsq(np.array(rows), np.array(right), rcond=SINGULAR)[0].tolist()
    return (x, y, z)
