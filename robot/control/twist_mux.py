"""The twist multiplexer: the one place where velocity commands of all sources meet before they reach the legs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum, IntEnum

from robot.geometry.planar import ZERO_TWIST, Twist2


class Source(IntEnum):
    """Where commands come from; the smaller number wins."""

    TELEOP = 1
    JOYSTICK = 2
    VOICE = 3
    AUTONOMY = 4


class Verdict(Enum):
    """What became of an offered command."""

    ACCEPTED = "accepted"
    NOT_A_NUMBER = "not a number"
    """Some part was NaN or infinite: dropped and counted."""
    OUTRANKED = "outranked"
    """A source of higher priority was heard within the timeout: dropped, not kept for later."""
    HELD_BACK = "held back by a spoken stop"
    DISABLED = "disabled"
    STOPPED = "emergency stop"


@dataclass(frozen=True, slots=True)
class VelocityLimits:
    """What any command is clipped to: m/s forward, back and sideways, rad/s turning; all positive."""

    forward: float = 1.6
    backward: float = 0.5
    sideways: float = 0.4
    turn: float = 1.5

    def clip(self, velocity: Twist2) -> Twist2:
        """The nearest velocity within the limits, each part by itself."""
        return Twist2(
            max(-self.backward, min(self.forward, velocity.vx)),
            max(-self.sideways, min(self.sideways, velocity.vy)),
            max(-self.turn, min(self.turn, velocity.wz)),
        )


@dataclass(frozen=True, slots=True)
class Decision:
    """The velocity command of the legs now, and why."""

    velocity: Twist2
    source: Source | None
    """The source that drives; `None` when the robot stands still because none does, or because it must."""
    reason: str


class TwistMux:
    """Chooses among the sources: the highest priority heard within `timeout` seconds drives, else the robot stands
    still.

    Disabled, or under an emergency stop, the decision is zero and every offer is refused; what was offered before
    is forgotten, so that nothing moves on enabling or clearing before a new command comes. The two are independent:
    clearing an emergency stop does not enable, and enabling does not clear. Times are seconds of any one clock; if
    it jumps back, commands from its future count for nothing.

    Who says "stop" means it: autonomy, which would go on half a second later, is held back until a person drives again
    (by any of the three other sources) or enables the robot.
    """

    __slots__ = ("_enabled", "_held", "_holding_back", "_limits", "_stopped", "_timeout", "dropped")

    def __init__(self, limits: VelocityLimits | None = None, *, timeout: float = 0.5, enabled: bool = True) -> None:
        self._limits = limits if limits is not None else VelocityLimits()
        self._timeout = timeout
        self._enabled = enabled
        self._stopped: str | None = None
        self._holding_back = False
        self._held: dict[Source, tuple[float, Twist2]] = {}
        self.dropped = dict.fromkeys(Source, 0)
        """How many commands of each source were not numbers."""

    def __repr__(self) -> str:
        state = f"stopped: {self._stopped}" if self._stopped is not None else "enabled" if self._enabled else "disabled"
        return f"<TwistMux {state}, dropped {sum(self.dropped.values())}>"

    @property
    def enabled(self) -> bool:
        return self._enabled

    @property
    def stopped(self) -> str | None:
        """The reason of the emergency stop in force, or `None`."""
        return self._stopped

    def offer(self, source: Source, velocity: Twist2, now: float) -> Verdict:
        """Take in a command that `source` gave at `now`. It is clipped, and valid for the timeout if accepted."""
        if not (math.isfinite(velocity.vx) and math.isfinite(velocity.vy) and math.isfinite(velocity.wz)):
            self.dropped[source] += 1
            return Verdict.NOT_A_NUMBER
        if self._stopped is not None:
            return Verdict.STOPPED
        if not self._enabled:
            return Verdict.DISABLED
        if any(higher < source and self._fresh(higher, now) for higher in self._held):
            return Verdict.OUTRANKED
        if source is Source.AUTONOMY:
            if self._holding_back:
                return Verdict.HELD_BACK
        elif velocity != ZERO_TWIST:
            self._holding_back = False
        elif source is Source.VOICE:
            self._holding_back = True
            self._held.pop(Source.AUTONOMY, None)
        self._held[source] = (now, self._limits.clip(velocity))
        return Verdict.ACCEPTED

    def decide(self, now: float) -> Decision:
        """The command of the legs at `now`."""
        if self._stopped is not None:
            return Decision(ZERO_TWIST, None, f"emergency stop: {self._stopped}")
        if not self._enabled:
            return Decision(ZERO_TWIST, None, "disabled")
        for source in sorted(self._held):
            if self._fresh(source, now):
                return Decision(self._held[source][1], source, source.name.lower())
        if self._holding_back:
            return Decision(ZERO_TWIST, None, Verdict.HELD_BACK.value)
        return Decision(ZERO_TWIST, None, "no command" if not self._held else "all commands timed out")

    def enable(self) -> None:
        """Let commands through, those of autonomy too."""
        self._enabled = True
        self._holding_back = False

    def disable(self) -> None:
        """Stand still and forget all commands, until enabled."""
        self._enabled = False
        self._held.clear()

    def stop(self, reason: str) -> None:
        """Emergency stop: overrides everything until `clear`. A second stop keeps the first reason."""
        if self._stopped is None:
            self._stopped = reason
        self._held.clear()

    def clear(self) -> None:
        """End the emergency stop; the robot stands still until a new command comes."""
        self._stopped = None

    def _fresh(self, source: Source, now: float) -> bool:
        return 0.0 <= now - self._held[source][0] < self._timeout
