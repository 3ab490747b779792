"""Log levels by logger name, and the filters of a single log call. Nothing is written here.

The rules are those of rcutils (levels, inheritance along the dots) and rclpy (``once``, ``skip_first``, ``throttle_duration_sec``).
"""

from collections.abc import Hashable, Mapping
from enum import IntEnum
from typing import Final, NamedTuple, Protocol, TypedDict, cast


class Level(IntEnum):
    """The severity of a log line. ``UNSET`` means that the level of the nearest ancestor applies."""

    UNSET = 0
    DEBUG = 10
    INFO = 20
    WARN = 30
    ERROR = 40
    FATAL = 50

    @classmethod
    def parse(cls, text: str) -> "Level":
        """Return the level with this name, in any case. Raises ``ValueError`` that lists the names; WARNING is not one of them."""
        found = cls.__members__.get(text.upper())
        if found is None:
            raise ValueError(f"{text!r} is not a log level; use one of {', '.join(cls.__members__)}")
        return found


class LevelTree:
    """The levels of all loggers of a process. A logger without a level of its own has that of its nearest ancestor.

    Names are split at dots: ``robot.arm.joint`` inherits from ``robot.arm``, then from ``robot``, then from the default, which is INFO
    unless another one is given. The empty name stands for the default.
    """

    __slots__ = ("_effective", "_levels", "default", "version")

    default: Level

    def __init__(self, default: Level = Level.INFO) -> None:
        self.default = default
        self.version = 0
        """How often a level has been set: who keeps an effective level looks here whether it still holds."""
        self._levels: dict[str, Level] = {}
        self._effective: dict[str, Level] = {}

    def set(self, logger: str, level: int) -> None:
        """Set the level of a logger; ``UNSET`` removes it. Raises ``ValueError`` for a number that is not a level."""
        try:
            level = Level(level)
        except ValueError:
            raise ValueError(f"{level} is not a log level; use one of {', '.join(map(repr, Level))}") from None
        self._effective.clear()
        self.version += 1
        if not logger:
            self.default = level or Level.INFO
        elif level:
            self._levels[logger] = level
        else:
            self._levels.pop(logger, None)

    def get(self, logger: str) -> Level:
        """The logger's own level; ``UNSET`` if it has none."""
        return self._levels.get(logger, Level.UNSET) if logger else self.default

    def effective(self, logger: str) -> Level:
        """The lowest level at which this logger writes lines. Cached until the next ``set``."""
        found = self._effective.get(logger)
        if found is None:
            found = self._effective[logger] = self._look_up(logger)
        return found

    def enabled(self, logger: str, level: int) -> bool:
        """Whether this logger writes lines of this level."""
        return level >= self.effective(logger)

    def _look_up(self, logger: str) -> Level:
        dot = len(logger)
        while dot >= 0:
            if own := self._levels.get(logger[:dot]):
                return own
            dot = logger.rfind(".", 0, dot)
        return self.default

    def __repr__(self) -> str:
        own = "".join(f", {name}={level.name}" for name, level in self._levels.items())
        return f"LevelTree(default={self.default.name}{own})"


class NanosecondClock(Protocol):
    """An object that returns the time in nanoseconds."""

    def now_ns(self) -> int: ...


class FilterOptions(TypedDict, total=False):
    """The options of a log call. False and 0 have the same meaning as leaving an option out."""

    once: bool
    skip_first: bool
    throttle_duration_sec: float
    throttle_time_source_type: NanosecondClock


_OPTIONS: Final = frozenset(FilterOptions.__annotations__)


class _Identity(NamedTuple):
    """The options that must be the same in all calls from one place in the source."""

    logger: str
    level: int
    once: bool
    skip_first: bool
    throttle_ns: int
    time_source: NanosecondClock | None


class _CallSite:
    """The filter state of one place in the source. If the clock goes back, a throttled place may write again at once."""

    __slots__ = ("identity", "last_ns", "logged", "skipped")

    def __init__(self, identity: _Identity) -> None:
        self.identity = identity
        self.logged = False
        self.skipped = False
        self.last_ns: int | None = None

    def allow(self, now_ns: int) -> bool:
        """Apply the filters in the order throttle, skip_first, once. The first that refuses the line ends the check."""
        identity = self.identity
        if identity.throttle_ns:
            if self.last_ns is not None and self.last_ns <= now_ns < self.last_ns + identity.throttle_ns:
                return False
            self.last_ns = now_ns
        if identity.skip_first and not self.skipped:
            self.skipped = True
            return False
        if identity.once and self.logged:
            return False
        self.logged = True
        return True


class CallSites:
    """The filter state of one logger's log calls, with one entry for each place in the source that uses an option."""

    __slots__ = ("_sites",)

    def __init__(self) -> None:
        self._sites: dict[Hashable, _CallSite] = {}

    def allow(
        self, place: Hashable, logger: str, level: int, options: Mapping[str, object], clock: NanosecondClock
    ) -> bool:
        """Whether this call writes its line. ``place`` identifies the call, usually as (file, function, line).

        ``clock`` is used for throttling unless ``throttle_time_source_type`` names another. Raises ``TypeError`` for an unknown option or a
        time source without a duration, and ``ValueError`` if the place was used before with other options, another logger or another level.
        """
        identity = _read(logger, level, options)
        site = self._sites.get(place)
        if site is None:
            site = self._sites[place] = _CallSite(identity)
        elif site.identity != identity:
            raise ValueError(_changed(place, site.identity, identity))
        return site.allow((identity.time_source or clock).now_ns() if identity.throttle_ns else 0)


def _read(logger: str, level: int, options: Mapping[str, object]) -> _Identity:
    if unknown := options.keys() - _OPTIONS:
        raise TypeError(f"unknown log option {', '.join(sorted(unknown))}; there are {', '.join(sorted(_OPTIONS))}")
    known = cast(FilterOptions, options)
    source = known.get("throttle_time_source_type")
    throttle_ns = round((known.get("throttle_duration_sec") or 0) * 1e9)
    if source is not None and not throttle_ns:
        raise TypeError("throttle_time_source_type needs throttle_duration_sec, the least time between two lines")
    if throttle_ns < 0:
        raise ValueError(f"throttle_duration_sec must be positive, not {known.get('throttle_duration_sec')}")
    return _Identity(logger, level, bool(known.get("once")), bool(known.get("skip_first")), throttle_ns, source)


def _changed(place: Hashable, before: _Identity, now: _Identity) -> str:
    changes = ", ".join(
        f"{field} from {old!r} to {new!r}"
        for field, old, new in zip(_Identity._fields, before, now, strict=True)
        if old != new
    )
    return f"the log call at {place} changed its {changes}; a filtered call must be the same each time"
