"""Quality of service as text, the last part of an endpoint's token.

``<reliability>:<durability>:<history>,<depth>:<deadline>:<lifespan>:<liveliness>,<lease>``,
where a duration is ``<seconds>,<nanoseconds>``.
Each number that equals its default is left out. The defaults are: reliable, volatile, keep last 42, automatic, infinite durations.
"""

from __future__ import annotations

import math
import warnings
from functools import lru_cache
from typing import Final, TypeVar

from actors.qos.policies import (
    BEST_AVAILABLE_DURATION,
    Durability,
    History,
    Liveliness,
    Policy,
    QoS,
    QoSWarning,
    Reliability,
)
from actors.transport.format.errors import refuse
from actors.transport.format.names import parse_number

_RELIABILITY: Final = {
    "": Reliability.RELIABLE,
    "0": Reliability.SYSTEM_DEFAULT,
    "1": Reliability.RELIABLE,
    "2": Reliability.BEST_EFFORT,
    "3": Reliability.UNKNOWN,
    "4": Reliability.BEST_AVAILABLE,
}
_DURABILITY: Final = {
    "": Durability.VOLATILE,
    "0": Durability.SYSTEM_DEFAULT,
    "1": Durability.TRANSIENT_LOCAL,
    "2": Durability.VOLATILE,
    "3": Durability.UNKNOWN,
    "4": Durability.BEST_AVAILABLE,
}
_HISTORY: Final = {
    "": History.KEEP_LAST,
    "0": History.SYSTEM_DEFAULT,
    "1": History.KEEP_LAST,
    "2": History.KEEP_ALL,
    "3": History.UNKNOWN,
}
_LIVELINESS: Final = {
    "": Liveliness.AUTOMATIC,
    "0": Liveliness.SYSTEM_DEFAULT,
    "1": Liveliness.AUTOMATIC,
    "3": Liveliness.MANUAL_BY_TOPIC,
    "4": Liveliness.UNKNOWN,
    "5": Liveliness.BEST_AVAILABLE,
}
_DEPTH: Final = 42
_SECOND: Final = 10**9
_INFINITE: Final = 2**63 - 1
"""The nanoseconds written for an infinite or unspecified duration."""
_BEST_AVAILABLE: Final = _INFINITE - 1

P = TypeVar("P", bound=Policy)


@lru_cache(maxsize=1024)
def write_qos(qos: QoS) -> str:
    """Write a QoS as text. Never raises.

    Values without a text are written as in ROS 2: ``system_default`` as the default, and a depth of 0 as 42. The depth of a KEEP_ALL
    history has no meaning and is left out, as is ``limit``, which concerns only this process.
    """
    depth = _DEPTH if qos.keep_all else qos.given_depth or _DEPTH
    policies = (
        _number(_RELIABILITY, qos.reliability),
        _number(_DURABILITY, qos.durability),
        f"{_number(_HISTORY, qos.history)},{'' if depth == _DEPTH else depth}",
        _write_duration(qos.deadline),
        _write_duration(qos.lifespan),
        f"{_number(_LIVELINESS, qos.liveliness)},{_write_duration(qos.liveliness_lease)}",
    )
    return ":".join(policies)


@lru_cache(maxsize=1024)
def parse_qos(text: str) -> QoS:
    """Parse the text of a QoS; additional parts are ignored. Raises WireFormatError.

    A depth of 0 is read as 42, and a duration of 0 or of 292 years as None. Durations are exact below 50 days, and then have the precision
    of a float.
    """
    parts = [part.split(",") for part in text.split(":")]
    if [len(part) for part in parts[:6]] != [1, 1, 2, 2, 2, 3]:
        raise refuse(text, "a QoS in a token", "it would have the form of ::,10:,:,:,,")
    (reliability,), (durability,), (history, depth), deadline, lifespan, (liveliness, *lease) = parts[:6]
    kept = _policy(_HISTORY, history, text)
    with warnings.catch_warnings():  # the user of this process cannot change a peer's profile
        warnings.simplefilter("ignore", QoSWarning)
        return QoS(
            history=kept,
            depth=None if kept is History.KEEP_ALL else _parse_depth(depth),
            reliability=_policy(_RELIABILITY, reliability, text),
            durability=_policy(_DURABILITY, durability, text),
            deadline=_parse_duration(deadline, may_follow=True),
            lifespan=_parse_duration(lifespan, may_follow=False),
            liveliness=_policy(_LIVELINESS, liveliness, text),
            liveliness_lease=_parse_duration(lease, may_follow=True),
        )


def _number(numbers: dict[str, P], policy: P) -> str:
    """The number of a policy in its shortest form; empty for ``system_default``."""
    if policy == "system_default":
        return ""
    return next(number for number, meant in numbers.items() if meant is policy)


def _policy(numbers: dict[str, P], number: str, text: str) -> P:
    found = numbers.get(number)
    if found is None:
        raise refuse(text, "a QoS in a token", f"{number[:20]!r} is not the number of a policy")
    return found


def _parse_depth(text: str) -> int:
    return (parse_number(text, "a depth") if text else 0) or _DEPTH


def _write_duration(seconds: float | None) -> str:
    total = _INFINITE
    if seconds == BEST_AVAILABLE_DURATION:
        total = _BEST_AVAILABLE
    elif seconds is not None and seconds != math.inf:
        top, bottom = seconds.as_integer_ratio()
        total = min((2 * top * _SECOND + bottom) // (2 * bottom), _INFINITE)  # rounded without floats
    return ",".join(
        "" if part == default else str(part)
        for part, default in zip(divmod(total, _SECOND), divmod(_INFINITE, _SECOND), strict=True)
    )


def _parse_duration(parts: list[str], *, may_follow: bool) -> float | None:
    seconds, nanoseconds = (
        parse_number(part, "a duration") if part else default
        for part, default in zip(parts, divmod(_INFINITE, _SECOND), strict=True)
    )
    total = seconds * _SECOND + nanoseconds
    if total == _BEST_AVAILABLE and may_follow:
        return BEST_AVAILABLE_DURATION
    return None if total == 0 or total >= _BEST_AVAILABLE else total / _SECOND
