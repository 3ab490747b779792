"""The policies of quality of service, and the immutable value ``QoS`` that holds one of each.

Use them through ``actors.qos``, which adds the profiles and the rules of matching.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping
from enum import StrEnum
from typing import Any, Final, NamedTuple, NoReturn, Self, TypedDict, TypeVar, Unpack, cast

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


KEEP_ALL_LIMIT: Final = 1000
"""The number of messages that a KEEP_ALL endpoint holds before ``send`` waits, if ``limit`` is not given."""

BEST_AVAILABLE_DURATION: Final = -math.inf
"""Stands for a deadline or lease that is adapted to the endpoints present at creation (see ``resolve_subscription``)."""


class InvalidQoS(ValueError):
    """The policies of a ``QoS`` contradict each other or are out of range."""


class QoSWarning(UserWarning):
    """A ``QoS`` is legal but probably not intended."""


class Policy(StrEnum):
    """The base class of the policy enums. Members are lower-case strings, the short keys of ROS 2 tools."""

    @classmethod
    def from_key(cls, key: str) -> Self:
        """Return the member with this short key, in any case. Raises ``InvalidQoS`` that lists the valid keys."""
        try:
            return cls(key.lower())
        except ValueError:
            raise InvalidQoS(f"{key!r} is no {cls.__name__.lower()} policy; use one of {', '.join(cls)}") from None


class History(Policy):
    """Which messages an endpoint keeps: the last ``depth``, or all (up to ``limit``)."""

    SYSTEM_DEFAULT = "system_default"
    KEEP_LAST = "keep_last"
    KEEP_ALL = "keep_all"
    UNKNOWN = "unknown"


class Reliability(Policy):
    """Whether a lost message is sent again. With KEEP_LAST, messages are still dropped for a slow reader."""

    SYSTEM_DEFAULT = "system_default"
    RELIABLE = "reliable"
    BEST_EFFORT = "best_effort"
    UNKNOWN = "unknown"
    BEST_AVAILABLE = "best_available"


class Durability(Policy):
    """Whether a late subscription receives the messages that a publisher has kept."""

    SYSTEM_DEFAULT = "system_default"
    TRANSIENT_LOCAL = "transient_local"
    VOLATILE = "volatile"
    UNKNOWN = "unknown"
    BEST_AVAILABLE = "best_available"


class Liveliness(Policy):
    """What shows that a publisher is alive: the process of its node, or each message on the topic."""

    SYSTEM_DEFAULT = "system_default"
    AUTOMATIC = "automatic"
    MANUAL_BY_TOPIC = "manual_by_topic"
    UNKNOWN = "unknown"
    BEST_AVAILABLE = "best_available"


class Changes(TypedDict, total=False):
    """The arguments of `QoS.replace`."""

    history: History
    depth: int
    reliability: Reliability
    durability: Durability
    deadline: float | None
    lifespan: float | None
    liveliness: Liveliness
    liveliness_lease: float | None
    limit: int


_P = TypeVar("_P", bound=Policy)
_Field = Policy | int | float | None


class QoS:
    """The quality of service of one endpoint.

    ``depth`` or ``history`` is required: ``QoS(depth=5)`` is KEEP_LAST 5, and ``QoS(history=History.KEEP_ALL)`` needs no depth. The default
    is otherwise reliable and volatile, as in ROS 2. ``deadline``, ``lifespan`` and ``liveliness_lease`` are in seconds. ``None`` and ``0``
    mean unspecified and are stored as ``None``; ``math.inf`` has the same effect but is stored as given.

    These attributes are plain, for fast access: ``depth`` (effective, at least 1), ``limit`` (the maximum length of a queue: ``depth`` for
    KEEP_LAST, ``limit`` for KEEP_ALL), ``keep_all``, ``reliable`` (also true for ``system_default`` and an unresolved ``best_available``)
    and ``transient_local`` (true only if given). ``given_depth`` is the depth as given, which may be 0.

    Raises ``InvalidQoS`` for contradictions. Warns ``QoSWarning`` for KEEP_LAST 0, which acts as 1, and for KEEP_ALL with best effort,
    where messages beyond ``limit`` are dropped because the publisher never waits.
    """

    __slots__ = (
        "_hash",
        "deadline",
        "depth",
        "durability",
        "given_depth",
        "history",
        "keep_all",
        "lifespan",
        "limit",
        "liveliness",
        "liveliness_lease",
        "overriding",
        "reliability",
        "reliable",
        "transient_local",
    )

    history: History
    depth: int
    given_depth: int
    limit: int
    reliability: Reliability
    durability: Durability
    deadline: float | None
    lifespan: float | None
    liveliness: Liveliness
    liveliness_lease: float | None
    keep_all: bool
    reliable: bool
    transient_local: bool
    overriding: Overriding | None
    """What parameters may change of it; see `overridable`."""
    _hash: int

    def __init__(
        self,
        *,
        history: History | None = None,
        depth: int | None = None,
        reliability: Reliability = Reliability.RELIABLE,
        durability: Durability = Durability.VOLATILE,
        deadline: float | None = None,
        lifespan: float | None = None,
        liveliness: Liveliness = Liveliness.SYSTEM_DEFAULT,
        liveliness_lease: float | None = None,
        limit: int | None = None,
    ) -> None:
        history, depth = _history_and_depth(history, depth)
        keep_all = history is History.KEEP_ALL
        reliability = _member(Reliability, reliability)
        durability = _member(Durability, durability)
        put = object.__setattr__
        put(self, "history", history)
        put(self, "given_depth", depth)
        put(self, "depth", max(depth, 1))
        put(self, "limit", _limit(limit, keep_all=keep_all, depth=max(depth, 1)))
        put(self, "reliability", reliability)
        put(self, "durability", durability)
        put(self, "deadline", _duration("deadline", deadline, may_follow=True))
        put(self, "lifespan", _duration("lifespan", lifespan, may_follow=False))
        put(self, "liveliness", _member(Liveliness, liveliness))
        put(self, "liveliness_lease", _duration("liveliness_lease", liveliness_lease, may_follow=True))
        put(self, "keep_all", keep_all)
        put(self, "reliable", reliability not in (Reliability.BEST_EFFORT, Reliability.UNKNOWN))
        put(self, "transient_local", durability is Durability.TRANSIENT_LOCAL)
        put(self, "overriding", None)
        put(self, "_hash", hash(self._fields()))
        self._warn_about_surprises()

    def _warn_about_surprises(self) -> None:
        if self.history is History.KEEP_LAST and self.given_depth == 0:
            warnings.warn("a KEEP_LAST depth of 0 keeps nothing; it acts as depth 1", QoSWarning, stacklevel=3)
        if self.keep_all and self.reliability is Reliability.BEST_EFFORT:
            text = "KEEP_ALL with best_effort still drops beyond its limit; make it reliable, or use KEEP_LAST"
            warnings.warn(text, QoSWarning, stacklevel=3)

    def replace(self, **changes: Unpack[Changes]) -> QoS:
        """Return a copy with these policies changed. Raises what the constructor raises."""
        keywords = cast(Changes, dict(zip(_KEYWORDS, self._fields(), strict=True)))
        keywords.update(changes)
        if "limit" not in changes and keywords.get("history") != History.KEEP_ALL:
            keywords.pop("limit", None)
        changed = QoS(**keywords)
        object.__setattr__(changed, "overriding", self.overriding)
        return changed

    def overridable(self, *policies: str, validate: Callable[[QoS], str | None] | None = None, id: str = "") -> QoS:
        """Return an equal profile whose endpoints let parameters of their node override these policies when they are opened.

        Without `policies` these are history, depth and reliability. The parameters are ROS 2's, read-only, and named
        ``qos_overrides.<topic>.publisher.<policy>`` or ``...subscription...``, with ``_<id>`` after the kind if there is an `id`; durations
        are whole nanoseconds. `validate` gets the overridden profile and returns None, or why the endpoint cannot have it; its node then
        does not start. Raises ``InvalidQoS`` for an unknown policy.
        """
        unknown = [policy for policy in policies if policy not in POLICIES]
        if unknown:
            raise InvalidQoS(f"{unknown[0]!r} is no policy that can be overridden; there are {', '.join(POLICIES)}")
        allowed = self.replace()
        object.__setattr__(allowed, "overriding", Overriding(policies or DEFAULT_POLICIES, validate, id))
        return allowed

    def _fields(self) -> tuple[_Field, ...]:
        """The constructor arguments that give an equal QoS, in the order of ``_KEYWORDS``."""
        return (
            self.history,
            self.given_depth,
            self.reliability,
            self.durability,
            self.deadline,
            self.lifespan,
            self.liveliness,
            self.liveliness_lease,
            self.limit if self.keep_all else None,
        )

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, QoS):
            return NotImplemented
        return self is other or (self._hash == other._hash and self._fields() == other._fields())

    def __hash__(self) -> int:
        return self._hash

    def __repr__(self) -> str:
        if self.history is History.KEEP_LAST:
            parts = [f"keep_last {self.given_depth}"]
        elif self.keep_all:
            parts = [f"keep_all up to {self.limit}"]
        else:
            parts = [f"history {self.history}"]
        parts += [_word("reliability", self.reliability), _word("durability", self.durability)]
        if self.liveliness is not Liveliness.SYSTEM_DEFAULT:
            parts.append(_word("liveliness", self.liveliness))
        for name in ("deadline", "lifespan", "liveliness_lease"):
            seconds = cast("float | None", getattr(self, name))
            if seconds is not None:
                parts.append(f"{name} {show_seconds(seconds)}")
        return f"QoS({', '.join(parts)})"

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError(f"a QoS never changes; use qos.replace({name}=...) to make another")

    def __delattr__(self, name: str) -> NoReturn:
        raise AttributeError("a QoS never changes; use qos.replace(...) to make another")

    def __reduce__(self) -> tuple[object, tuple[object, object]]:
        return _rebuild, (self._fields(), self.overriding)

    def __copy__(self) -> QoS:
        return self

    def __deepcopy__(self, memo: object) -> QoS:
        return self


_KEYWORDS: Final = (
    "history",
    "depth",
    "reliability",
    "durability",
    "deadline",
    "lifespan",
    "liveliness",
    "liveliness_lease",
    "limit",
)


def _rebuild(fields: tuple[_Field, ...], overriding: Overriding | None = None) -> QoS:
    with warnings.catch_warnings():  # the warnings were given when the original was created
        warnings.simplefilter("ignore", QoSWarning)
        rebuilt = QoS(**cast(Changes, dict(zip(_KEYWORDS, fields, strict=True))))
    object.__setattr__(rebuilt, "overriding", overriding)
    return rebuilt


def _history_and_depth(history: History | None, depth: int | None) -> tuple[History, int]:
    if depth is not None and (isinstance(depth, bool) or not isinstance(cast(object, depth), int)):
        raise TypeError(f"depth is a number of messages, not {depth!r}")
    if depth is not None and depth < 0:
        raise InvalidQoS(f"depth must be 0 or more, not {depth}")
    if history is None:
        if depth is None:
            raise InvalidQoS(
                "a QoS needs a depth or a history; write QoS(depth=10) or start from qos.DEFAULT.replace(...)"
            )
        return History.KEEP_LAST, depth
    history = _member(History, history)
    if depth is None and history is History.KEEP_LAST:
        raise InvalidQoS("history keep_last needs a depth; write QoS(depth=10)")
    return history, _DEFAULT_DEPTH if depth is None else depth


_DEFAULT_DEPTH: Final = 10


def _limit(limit: int | None, *, keep_all: bool, depth: int) -> int:
    if not keep_all:
        if limit is not None:
            raise InvalidQoS("limit bounds a KEEP_ALL history; with KEEP_LAST the depth is the bound")
        return depth
    if limit is None:
        return KEEP_ALL_LIMIT
    if limit < 1:
        raise InvalidQoS(f"limit must be at least 1 message, not {limit}")
    return limit


def _member(kind: type[_P], value: _P) -> _P:
    return value if isinstance(cast(object, value), kind) else kind.from_key(str(value))


def _duration(name: str, seconds: float | None, *, may_follow: bool) -> float | None:
    if seconds is None or seconds == 0:
        return None
    if seconds == BEST_AVAILABLE_DURATION and may_follow:
        return BEST_AVAILABLE_DURATION
    if not seconds > 0:
        raise InvalidQoS(f"{name} is a time in seconds and must be positive (None = unspecified), not {seconds!r}")
    return float(seconds)


def show_seconds(seconds: float) -> str:
    if seconds == BEST_AVAILABLE_DURATION:
        return "best_available"
    return "infinite" if seconds == math.inf else f"{seconds:.12g} s"


def _word(policy: str, value: Policy) -> str:
    """The text of a policy value, with the name of its policy if several policies have that value."""
    return f"{policy} {value}" if value in ("system_default", "unknown", "best_available") else str(value)
