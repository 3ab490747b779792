"""Which policies of an endpoint the parameters of its node may override, and what they change."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Final, NamedTuple

if TYPE_CHECKING:
    from actors.qos.policies import QoS

POLICIES: Final[Mapping[str, str]] = {
    "deadline": "deadline",
    "depth": "depth",
    "durability": "durability",
    "history": "history",
    "lifespan": "lifespan",
    "liveliness": "liveliness",
    "liveliness_lease_duration": "liveliness_lease",
    "reliability": "reliability",
}
"""The policies by their names in parameters, each with its attribute in `QoS`."""

QOS_OVERRIDES: Final = "qos_overrides."
"""What the names of these parameters begin with."""

DEFAULT_POLICIES: Final = ("history", "depth", "reliability")

DURATIONS: Final = frozenset({"deadline", "lifespan", "liveliness_lease_duration"})
"""In parameters they are whole nanoseconds."""


class Overriding(NamedTuple):
    """What `QoS.overridable` has been given."""

    policies: tuple[str, ...]
    validate: Callable[[QoS], str | None] | None
    id: str

    def parameters(self, topic: str, kind: str, qos: QoS) -> dict[str, tuple[str, Any]]:
        """The parameters of an endpoint, a ``publisher`` or ``subscription`` of `topic`: policy -> name and default value."""
        suffix = f"_{self.id}" if self.id else ""
        return {
            policy: (f"{QOS_OVERRIDES}{topic}.{kind}{suffix}.{policy}", value_of(qos, policy))
            for policy in self.policies
            if not (kind == "subscription" and policy == "lifespan")
        }


def value_of(qos: QoS, policy: str) -> str | int:
    """The value of a policy as that of a parameter."""
    if policy == "depth":
        return qos.given_depth
    value = getattr(qos, POLICIES[policy])
    return round((value or 0.0) * 1e9) if policy in DURATIONS else str(value)


def changes(values: Mapping[str, Any]) -> dict[str, Any]:
    """The arguments for `QoS.replace` that the values of parameters mean."""
    return {POLICIES[policy]: value / 1e9 if policy in DURATIONS else value for policy, value in values.items()}
