"""What the navigator answers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

from robot.planning.errors import NavigationError


class State(StrEnum):
    """What the navigator is doing."""

    IDLE = "idle"
    FOLLOWING = "following"
    WAITING = "waiting"
    RECOVERING = "recovering"
    ARRIVED = "arrived"
    CANCELED = "canceled"
    FAILED = "failed"

    @property
    def running(self) -> bool:
        """Whether there is a goal that has not ended."""
        return self in (State.FOLLOWING, State.WAITING, State.RECOVERING)


@dataclass(frozen=True, slots=True)
class Motion:
    """One answer of the navigator: the command (m/s, m/s, rad/s in body axes) and how things stand."""

    vx: float
    vy: float
    wz: float
    state: State
    distance_remaining: float
    """Along the path, m."""
    eta: float
    """Seconds to the goal at the usual pace."""
    failure: NavigationError | None = None
    """Why, when the state is ``failed``."""
    detail: str = ""
    """The phase or the manoeuvre at work, or why there is neither."""
    clearance: float = math.inf
    """From the body's outline to the nearest thing now, m."""
