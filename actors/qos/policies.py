"""The policies of quality of service, and the immutable value ``QoS`` that holds one of each.

Use them through ``actors.qos``, which adds the profiles and the rules of matching.
"""

import math
import warnings
from enum import StrEnum
from typing import Final, NoReturn, Self, TypedDict, TypeVar, Unpack, cast

__all__ = [
    "BEST_AVAILABLE_DURATION",
    "KEEP_ALL_LIMIT",
    "Changes",
    "Durability",
    "History",
    "InvalidQoS",
    "Liveliness",
    "Policy",
    "QoS",
    "QoSWarning",
    "Reliability",
    "show_seconds",
]

KEEP_ALL_LIMIT: Final = 1000
"""Messages a KEEP_ALL endpoint holds before ``send`` waits, when ``limit`` is not given. Never unbounded."""

BEST_AVAILABLE_DURATION: Final = -math.inf
"""Marker for a deadline or lease that follows the endpoints found at creation (see ``resolve_subscription``)."""


class InvalidQoS(ValueError):
    """The policies of a ``QoS`` contradict each other or are out of range."""


class QoSWarning(UserWarning):
    """A ``QoS`` that is legal but surely not meant."""


class Policy(StrEnum):
    """Base of the policy enums: members are lower-case strings, the short keys of ROS 2 tools."""

    @classmethod
    def from_key(cls, key: str) -> Self:
        """The member with this short key, in any case; ``InvalidQoS`` lists the legal keys otherwise."""
        try:
            return cls(key.lower())
        except ValueError:
            raise InvalidQoS(f"{key!r} is no {cls.__name__.lower()} policy; use one of {', '.join(cls)}") from None


class History(Policy):
    """The messages that an endpoint keeps: the last ``depth``, or all (up to ``limit``)."""

    SYSTEM_DEFAULT = "system_default"
    KEEP_LAST = "keep_last"
    KEEP_ALL = "keep_all"
    UNKNOWN = "unknown"


class Reliability(Policy):
    """Whether a lost message is sent again. Reliable with KEEP_LAST still drops for a slow reader."""

    SYSTEM_DEFAULT = "system_default"
    RELIABLE = "reliable"
    BEST_EFFORT = "best_effort"
    UNKNOWN = "unknown"
    BEST_AVAILABLE = "best_available"


class Durability(Policy):
    """Whether a late subscription is given the messages that a publisher still keeps."""

    SYSTEM_DEFAULT = "system_default"
    TRANSIENT_LOCAL = "transient_local"
    VOLATILE = "volatile"
    UNKNOWN = "unknown"
    BEST_AVAILABLE = "best_available"


class Liveliness(Policy):
    """How a publisher is known to be alive: by its node's process, or by each publish on the topic."""

    SYSTEM_DEFAULT = "system_default"
    AUTOMATIC = "automatic"
    MANUAL_BY_TOPIC = "manual_by_topic"
    UNKNOWN = "unknown"
    BEST_AVAILABLE = "best_available"


class Changes(TypedDict, total=False):
    """The policies that `QoS.replace` changes, by name."""

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

    Needs ``depth`` or ``history``: ``QoS(depth=5)`` is KEEP_LAST 5, ``QoS(history=History.KEEP_ALL)`` needs no depth.
    Everything else defaults to reliable and volatile, as in ROS 2. ``deadline``, ``lifespan`` and
    ``liveliness_lease`` are seconds; ``None`` and ``0`` mean unspecified and are stored as ``None``, ``math.inf`` means
    the same to an endpoint but is kept as it was said.

    Attributes for hot paths are plain: ``depth`` (effective, at least 1), ``limit`` (the most messages a queue of
    this QoS holds: ``depth`` for KEEP_LAST, ``limit`` for KEEP_ALL), ``keep_all``, ``reliable`` (also for
    ``system_default`` and an unresolved ``best_available``), ``transient_local`` (only when said). ``given_depth``
    is the depth as written, which may be 0.

    Raises ``InvalidQoS`` for contradictions; warns ``QoSWarning`` for KEEP_LAST 0 (acts as 1) and for KEEP_ALL with
    best effort (nothing can hold the publisher back, so messages beyond ``limit`` are dropped).
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
        put(self, "_hash", hash(self._fields()))
        self._warn_about_surprises()

    def _warn_about_surprises(self) -> None:
        if self.history is History.KEEP_LAST and self.given_depth == 0:
            warnings.warn("a KEEP_LAST depth of 0 keeps nothing; it acts as depth 1", QoSWarning, stacklevel=3)
        if self.keep_all and self.reliability is Reliability.BEST_EFFORT:
            text = "KEEP_ALL with best_effort still drops beyond its limit; make it reliable, or use KEEP_LAST"
            warnings.warn(text, QoSWarning, stacklevel=3)

    def replace(self, **changes: Unpack[Changes]) -> "QoS":
        """A copy with these policies changed. Raises as the constructor does."""
        keywords = cast(Changes, dict(zip(_KEYWORDS, self._fields(), strict=True)))
        keywords.update(changes)
        if "limit" not in changes and keywords.get("history") != History.KEEP_ALL:
            keywords.pop("limit", None)
        return QoS(**keywords)

    def _fields(self) -> tuple[_Field, ...]:
        """The constructor's arguments that make an equal QoS, in the order of ``_KEYWORDS``."""
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

    def __reduce__(self) -> tuple[object, tuple[object]]:
        return _rebuild, (self._fields(),)

    def __copy__(self) -> "QoS":
        return self

    def __deepcopy__(self, memo: object) -> "QoS":
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


def _rebuild(fields: tuple[_Field, ...]) -> QoS:
    with warnings.catch_warnings():  # who made the original has been told
        warnings.simplefilter("ignore", QoSWarning)
        return QoS(**cast(Changes, dict(zip(_KEYWORDS, fields, strict=True))))


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
    """A policy value that can stand alone, or with its policy's name where the word is shared by several."""
    return f"{policy} {value}" if value in ("system_default", "unknown", "best_available") else str(value)
