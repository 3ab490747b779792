"""QoS as the vectors write it."""

from __future__ import annotations

import math
from typing import Any

from actors import QoS, qos
from tests.conformance.checks.common import Unsupported, Vector

POLICIES: dict[str, type[qos.Policy]] = {
    "history": qos.History,
    "reliability": qos.Reliability,
    "durability": qos.Durability,
    "liveliness": qos.Liveliness,
}
_NAMES = {"liveliness_lease_duration": "liveliness_lease", "lease": "liveliness_lease"}


def duration(given: Any) -> float | None:
    words = {"default": None, "infinite": math.inf, "best_available": qos.BEST_AVAILABLE_DURATION}
    if isinstance(given, str) and given not in words:
        raise Unsupported(f"unsupported duration {given!r}")
    return words[given] if isinstance(given, str) else given if given is None else float(given)


def endpoint(given: Vector) -> QoS:
    """The QoS of an endpoint as the vectors describe it."""
    return QoS(**{"depth": 10} | arguments(given))


def arguments(given: Vector) -> Vector:
    """The keyword arguments of ours for a QoS as the vectors describe it."""
    found: Vector = {}
    for key, value in given.items():
        name = _NAMES.get(key.removesuffix("_sec"), key.removesuffix("_sec"))
        if name in POLICIES:
            found[name] = POLICIES[name].from_key(value) if isinstance(value, str) else value
        elif name in ("deadline", "lifespan", "liveliness_lease"):
            found[name] = duration(value)
        elif name == "depth":
            found[name] = value
        elif name != "avoid_ros_namespace_conventions" or value:  # here names never carry a prefix
            raise Unsupported(f"unsupported policy {key!r}")
    return found
