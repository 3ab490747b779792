"""The profiles of ROS 2, the matching of request and offer, and the resolution of ``best_available`` and ``system_default``.

Use them through ``actors.qos``. Rules and numbers are those of rmw and rclpy.
"""

import math
import warnings
from collections.abc import Iterable
from functools import lru_cache
from typing import Final, Literal, NamedTuple, cast

from actors.qos.policies import (
    BEST_AVAILABLE_DURATION,
    Changes,
    Durability,
    History,
    InvalidQoS,
    Liveliness,
    Policy,
    QoS,
    QoSWarning,
    Reliability,
    show_seconds,
)

# Profiles -----------------------------------------------------------------------------------------------------------

DEFAULT: Final = QoS(depth=10)
"""Reliable, volatile, keep_last 10: the profile of an endpoint unless another one is given."""
SENSOR_DATA: Final = QoS(depth=5, reliability=Reliability.BEST_EFFORT)
"""For sensors whose newest readings matter and lost ones do not: best effort, keep_last 5."""
SENSOR_STREAM: Final = SENSOR_DATA.replace(depth=10)
"""``SENSOR_DATA`` with keep_last 10, for fast sensors that are read in bursts."""
COMMANDS: Final = QoS(depth=10)
"""For messages that must arrive in order, and none from before the subscription: reliable, volatile, keep_last 10."""
STATE: Final = QoS(depth=1, durability=Durability.TRANSIENT_LOCAL)
"""For the latest value, which late subscriptions receive too: reliable, transient_local, keep_last 1."""
LATCHED: Final = STATE
"""``STATE`` by its name in ROS 1."""
MAP: Final = STATE
"""For maps and static transforms: the same as ``STATE``."""
LOGS: Final = QoS(depth=20, reliability=Reliability.BEST_EFFORT)
"""For logs and diagnostics: best effort, keep_last 20."""
SERVICES: Final = QoS(depth=10)
"""For the requests and replies of services."""
PARAMETERS: Final = QoS(depth=1000)
"""For the parameter services."""
PARAMETER_EVENTS: Final = QoS(depth=1000)
"""For the topic /parameter_events."""
ROSOUT: Final = QoS(depth=1000, durability=Durability.TRANSIENT_LOCAL, lifespan=10.0)
"""For the topic /rosout: a late subscription receives the last ten seconds."""
CLOCK: Final = QoS(depth=1, reliability=Reliability.BEST_EFFORT)
"""For subscriptions to /clock, which need only the newest time."""
ACTION_STATUS: Final = QoS(depth=1, durability=Durability.TRANSIENT_LOCAL)
"""For the status topic of an action."""
ACTION_FEEDBACK: Final = DEFAULT
"""For the feedback topic of an action."""
TRANSITION_EVENT: Final = DEFAULT
"""For the transition_event topic of a lifecycle node."""
SYSTEM_DEFAULT: Final = QoS(
    history=History.SYSTEM_DEFAULT,
    depth=0,
    reliability=Reliability.SYSTEM_DEFAULT,
    durability=Durability.SYSTEM_DEFAULT,
)
"""Leaves every policy to the middleware, here: reliable, volatile, keep_last 1."""
BEST_AVAILABLE: Final = QoS(
    depth=10,
    reliability=Reliability.BEST_AVAILABLE,
    durability=Durability.BEST_AVAILABLE,
    deadline=BEST_AVAILABLE_DURATION,
    liveliness=Liveliness.BEST_AVAILABLE,
    liveliness_lease=BEST_AVAILABLE_DURATION,
)
"""Matches the endpoints that exist when this one is created."""
UNKNOWN: Final = QoS(
    history=History.UNKNOWN,
    depth=0,
    reliability=Reliability.UNKNOWN,
    durability=Durability.UNKNOWN,
    liveliness=Liveliness.UNKNOWN,
)
"""Reported for an endpoint whose policies are not known."""

_PROFILES: Final = {
    "default": DEFAULT,
    "system_default": SYSTEM_DEFAULT,
    "sensor_data": SENSOR_DATA,
    "services_default": SERVICES,
    "parameters": PARAMETERS,
    "parameter_events": PARAMETER_EVENTS,
    "action_status_default": ACTION_STATUS,
    "best_available": BEST_AVAILABLE,
    "unknown": UNKNOWN,
    "rosout_default": ROSOUT,
    "clock": CLOCK,
    "action_feedback": ACTION_FEEDBACK,
    "transition_event": TRANSITION_EVENT,
    "commands": COMMANDS,
    "state": STATE,
    "latched": LATCHED,
    "map": MAP,
    "logs": LOGS,
    "sensor_stream": SENSOR_STREAM,
}


def profile_names() -> tuple[str, ...]:
    """The short names that ``profile`` accepts, beginning with those of ROS 2's tools."""
    return tuple(_PROFILES)


def profile(name: str) -> QoS:
    """Return the predefined profile with this short name, in any case. Raises ``InvalidQoS`` that lists the names."""
    found = _PROFILES.get(name.lower())
    if found is None:
        raise InvalidQoS(f"there is no QoS profile {name!r}; use one of {', '.join(_PROFILES)}")
    return found


def of(qos_or_depth: QoS | int) -> QoS:
    """Return a QoS unchanged, or for a number n the default profile with depth n. Raises ``InvalidQoS`` or ``TypeError``."""
    if isinstance(qos_or_depth, QoS):
        return qos_or_depth
    if isinstance(qos_or_depth, bool) or not isinstance(cast(object, qos_or_depth), int):
        raise TypeError(
            f"a QoS or a depth (a number of messages) was expected, not {qos_or_depth!r}: write 10, qos.SENSOR_DATA or "
            "QoS(depth=10, reliability='best_effort'), for example"
        )
    return _of_depth(qos_or_depth) if qos_or_depth > 0 else QoS(depth=qos_or_depth)


@lru_cache(maxsize=64)
def _of_depth(depth: int) -> QoS:
    """One profile for all who give this depth: the same one is found faster than an equal one."""
    return QoS(depth=depth)


# Matching -----------------------------------------------------------------------------------------------------------


class Compatibility(NamedTuple):
    """The result of ``compatible``. It is true as a condition if the pair may exchange messages (``ok`` or ``warning``)."""

    level: Literal["ok", "warning", "error"]
    policies: tuple[str, ...] = ()
    reason: str = ""

    def __bool__(self) -> bool:
        return self.level != "error"

    @property
    def event_policy(self) -> str:
        """The policy name in an incompatible-QoS event: RELIABILITY, DURABILITY, DEADLINE, LIVELINESS or INVALID."""
        if self.level != "error":
            return "INVALID"
        return self.policies[-1].removesuffix("_lease_duration").upper()


_OK: Final = Compatibility("ok")
_UNDECIDED: Final = ("system_default", "unknown")
_WEAK_STRONG: Final[tuple[tuple[str, Policy, Policy], ...]] = (
    ("reliability", Reliability.BEST_EFFORT, Reliability.RELIABLE),
    ("durability", Durability.VOLATILE, Durability.TRANSIENT_LOCAL),
    ("liveliness", Liveliness.AUTOMATIC, Liveliness.MANUAL_BY_TOPIC),
)
_REPORT_ORDER: Final = ("reliability", "durability", "deadline", "liveliness", "liveliness_lease_duration")


def compatible(offered: QoS, requested: QoS) -> Compatibility:
    """Check whether a publisher with one profile and a subscription with the other exchange messages.

    ``error`` means that they never do, ``warning`` that it depends on the resolution of ``system_default``. History, depth and lifespan
    have no influence. An unresolved ``best_available`` is compatible with everything. As in rmw, unresolved profiles are compared
    literally: the liveliness of two ``system_default`` profiles is undecided, and a requested ``math.inf`` exceeds an unspecified offer.
    The profiles of real endpoints come from ``resolve_publisher`` and ``resolve_subscription``, which leave nothing undecided.
    """
    errors: dict[str, str] = {}
    doubts: dict[str, str] = {}
    for policy, weak, strong in _WEAK_STRONG:
        offer = cast(Policy, getattr(offered, policy))
        request = cast(Policy, getattr(requested, policy))
        if offer is weak and request is strong:
            errors[policy] = f"{policy} (offered {offer}, requested {request})"
        elif _depends(offer, request, weak, strong):
            doubts[policy] = f"{policy} (offered {offer}, requested {request})"
    for policy, offer_s, request_s in (
        ("deadline", offered.deadline, requested.deadline),
        ("liveliness_lease_duration", offered.liveliness_lease, requested.liveliness_lease),
    ):
        if _too_late(offer_s, request_s):
            told = "unspecified" if offer_s is None else show_seconds(offer_s)
            errors[policy] = f"{policy} (offered {told}, requested {show_seconds(cast(float, request_s))})"
    if errors:
        return _verdict("error", "the publisher offers less than the subscription requests: ", errors)
    if doubts:
        return _verdict("warning", "the publisher may offer less than the subscription requests: ", doubts)
    return _OK


def _verdict(level: Literal["warning", "error"], lead: str, found: dict[str, str]) -> Compatibility:
    policies = tuple(policy for policy in _REPORT_ORDER if policy in found)
    return Compatibility(level, policies, lead + "; ".join(found[policy] for policy in policies))


def _depends(offer: Policy, request: Policy, weak: Policy, strong: Policy) -> bool:
    if offer in _UNDECIDED:
        return request in _UNDECIDED or request is strong
    return offer is weak and request in _UNDECIDED


def _too_late(offer: float | None, request: float | None) -> bool:
    if request is None or BEST_AVAILABLE_DURATION in (offer, request):
        return False
    return offer is None or _nanoseconds(offer) > _nanoseconds(request)


def _nanoseconds(seconds: float) -> float:
    return seconds if seconds == math.inf else round(seconds * 1e9)


# Resolution ---------------------------------------------------------------------------------------------------------


_OPEN_DURATIONS: Final = (BEST_AVAILABLE_DURATION, math.inf)


def resolve_subscription(requested: QoS, offered: Iterable[QoS] = ()) -> QoS:
    """Resolve the profile of a subscription, given the publishers known when it is created. It does not change later.

    ``best_available`` becomes the strongest policy that every publisher offers (without publishers: reliable, transient_local,
    manual_by_topic), and durations the largest specified one. ``system_default`` becomes reliable, volatile, automatic.
    """
    if (alone := _alone(requested)) is not None:
        return alone
    known = tuple(offered)
    return _resolve(
        requested,
        reliable=all(one.reliability is Reliability.RELIABLE for one in known),
        transient_local=all(one.durability is Durability.TRANSIENT_LOCAL for one in known),
        manual=all(one.liveliness is Liveliness.MANUAL_BY_TOPIC for one in known),
        deadline=max(_specified(one.deadline for one in known), default=None),
        lease=max(_specified(one.liveliness_lease for one in known), default=None),
    )


def resolve_publisher(offered: QoS, requested: Iterable[QoS] = ()) -> QoS:
    """Resolve the profile of a publisher, given the subscriptions known when it is created. It does not change later.

    ``best_available`` becomes reliable and transient_local, and manual_by_topic if a subscription requests it; durations become the
    smallest specified one. ``system_default`` becomes reliable, volatile, automatic.
    """
    if (alone := _alone(offered)) is not None:
        return alone
    known = tuple(requested)
    return _resolve(
        offered,
        reliable=True,
        transient_local=True,
        manual=any(one.liveliness is Liveliness.MANUAL_BY_TOPIC for one in known),
        deadline=min(_specified(one.deadline for one in known), default=None),
        lease=min(_specified(one.liveliness_lease for one in known), default=None),
    )


def resolve_service(qos: QoS) -> QoS:
    """Resolve the profile of a service or client: ``best_available`` and ``system_default`` become the values of the default."""
    return _resolve(qos, reliable=True, transient_local=False, manual=False, deadline=None, lease=None)


def _alone(qos: QoS) -> QoS | None:
    """Resolve a profile that does not depend on the other side; None if it contains ``best_available``."""
    # Equal profiles may differ in what parameters may override of them, so one that says so is not given for another.
    return _resolved_alone(qos) if qos.overriding is None else _resolved_alone.__wrapped__(qos)


@lru_cache(maxsize=1024)
def _resolved_alone(qos: QoS) -> QoS | None:
    if (
        qos.reliability is Reliability.BEST_AVAILABLE
        or qos.durability is Durability.BEST_AVAILABLE
        or qos.liveliness is Liveliness.BEST_AVAILABLE
        or BEST_AVAILABLE_DURATION in (qos.deadline, qos.liveliness_lease)
    ):
        return None
    return resolve_service(qos)


def _specified(durations: Iterable[float | None]) -> list[float]:
    return [one for one in durations if one is not None and one != BEST_AVAILABLE_DURATION]


def _finite(duration: float | None) -> float | None:
    return None if duration == math.inf else duration


def _resolve(
    qos: QoS, *, reliable: bool, transient_local: bool, manual: bool, deadline: float | None, lease: float | None
) -> QoS:
    changes: Changes = {}
    if qos.reliability is Reliability.BEST_AVAILABLE:
        changes["reliability"] = Reliability.RELIABLE if reliable else Reliability.BEST_EFFORT
    elif qos.reliability is Reliability.SYSTEM_DEFAULT:
        changes["reliability"] = Reliability.RELIABLE
    if qos.durability is Durability.BEST_AVAILABLE:
        changes["durability"] = Durability.TRANSIENT_LOCAL if transient_local else Durability.VOLATILE
    elif qos.durability is Durability.SYSTEM_DEFAULT:
        changes["durability"] = Durability.VOLATILE
    if qos.liveliness is Liveliness.BEST_AVAILABLE:
        changes["liveliness"] = Liveliness.MANUAL_BY_TOPIC if manual else Liveliness.AUTOMATIC
    elif qos.liveliness is Liveliness.SYSTEM_DEFAULT:
        changes["liveliness"] = Liveliness.AUTOMATIC
    if qos.deadline in _OPEN_DURATIONS:
        changes["deadline"] = _finite(deadline) if qos.deadline == BEST_AVAILABLE_DURATION else None
    if qos.liveliness_lease in _OPEN_DURATIONS:
        changes["liveliness_lease"] = _finite(lease) if qos.liveliness_lease == BEST_AVAILABLE_DURATION else None
    if qos.lifespan == math.inf:
        changes["lifespan"] = None
    if qos.history is History.SYSTEM_DEFAULT:
        changes["history"] = History.KEEP_LAST
        changes["depth"] = qos.depth
    with warnings.catch_warnings():  # the warnings were given when the profile was created
        warnings.simplefilter("ignore", QoSWarning)
        return qos.replace(**changes) if changes else qos
