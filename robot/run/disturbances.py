"""What the words of a run say of floor, load and blows: values, and their parsers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan, radians, tan

from cli.command import UsageError
from robot.run.tasks import at_a_time, checked
from robot.sim.ground import Ground

HARDEST_PUSH = 1000.0
"""N s: 30 m/s of the whole robot."""


@dataclass(frozen=True, slots=True)
class Push:
    """``--push FORWARD,LEFT@T``: push the body with an impulse (N s, along its own heading), at that many seconds."""

    forward: float
    left: float
    at: float


def parse_push(text: str, duration: float | None) -> Push:
    """The impulse and the time of ``FORWARD,LEFT@T``, in a run of `duration` seconds. Raises `UsageError`."""
    form = "FORWARD,LEFT@SECONDS in newton seconds, such as 0,40@10"
    impulse, at = at_a_time("--push", text, duration, form)
    try:
        forward, left = map(float, impulse.split(","))
    except ValueError:
        forward = left = nan
    if not (abs(forward) <= HARDEST_PUSH and abs(left) <= HARDEST_PUSH):
        raise UsageError(f"--push {text}: write {form}, each of at most {HARDEST_PUSH:g} N s")
    return Push(forward, left, at)


def parse_ground(mu: float | None, load: Sequence[float] | None, degrees: Sequence[float] | None) -> Ground | None:
    """What `--friction`, `--payload` and `--slope` say. Raises `UsageError`."""
    if (mu, load, degrees) == (None, None, None):
        return None
    plain = Ground()
    friction = plain.friction if mu is None else checked("--friction", mu, 0.01, 2.0, "(mu)")
    payload, at = plain.payload, plain.payload_at
    if load is not None:
        if len(load) not in (1, 3):
            raise UsageError(f"--payload takes KG or KG X Y, not {len(load)} numbers")
        mass, x, y = (*load, 0.0, 0.0)[:3]
        payload = checked("--payload", mass, 0.0, 30.0, "kg")
        at = checked("--payload X", x, -0.4, 0.4, "m"), checked("--payload Y", y, -0.2, 0.2, "m")
    rise = degrees if degrees is not None else [0.0]
    if len(rise) > 2:
        raise UsageError(f"--slope takes DEG_X or DEG_X DEG_Y, not {len(rise)} numbers")
    along, across = (tan(radians(checked("--slope", angle, -40.0, 40.0, "degrees"))) for angle in (*rise, 0.0)[:2])
    return Ground(friction, (along, across), payload, at)
