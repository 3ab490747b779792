"""Instants and durations: values in whole nanoseconds within int64, by the rules of rclpy."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from math import isfinite
from typing import Final, NoReturn, Protocol, cast, overload

from actors.interfaces.builtin_interfaces.msg import Duration as DurationMessage
from actors.interfaces.builtin_interfaces.msg import Time as TimeMessage

NANOSECONDS: Final = 1_000_000_000
_INT64_MIN: Final = -(2**63)
_INT64_MAX: Final = 2**63 - 1


class SecNanosec(Protocol):
    """A stamp of a message: ``sec`` and ``nanosec`` (0 to 999999999)."""

    @property
    def sec(self) -> int: ...
    @property
    def nanosec(self) -> int: ...


class ClockType(StrEnum):
    """The clock of a time. ROS time is system time unless simulated time is active."""

    ROS_TIME = "ROS_TIME"
    SYSTEM_TIME = "SYSTEM_TIME"
    STEADY_TIME = "STEADY_TIME"


def _total(what: str, seconds: float, nanoseconds: float) -> int:
    total = int(seconds * NANOSECONDS) + int(nanoseconds)
    if not _INT64_MIN <= total <= _INT64_MAX:
        raise OverflowError(f"{what} of {total} ns does not fit into 64 bits; it must stay within about 292 years")
    return total


def stamp_of(nanoseconds: int) -> TimeMessage:
    """A number of nanoseconds as a ``builtin_interfaces/msg/Time``."""
    from actors.interfaces.builtin_interfaces.msg import Time as Message

    return Message(sec=nanoseconds // NANOSECONDS, nanosec=nanoseconds % NANOSECONDS)


def nanoseconds_of(stamp: SecNanosec) -> int:
    """A stamp or a duration of a message in whole nanoseconds."""
    return stamp.sec * NANOSECONDS + stamp.nanosec


class Duration:
    """A span of time in nanoseconds, which may be negative. Immutable.

    Write ``Duration(seconds=0.5)``; a fraction of a nanosecond is cut off. Raises ``OverflowError`` beyond int64. Durations can be added,
    subtracted, compared, and multiplied by numbers. Multiplied by inf they become the longest span, which ROS 2 takes for infinite; nan and
    -inf raise ``ValueError``. A comparison with another type raises ``TypeError``, except ``==``, which is False.
    """

    __slots__ = ("nanoseconds",)

    nanoseconds: int

    def __init__(self, *, seconds: float = 0, nanoseconds: float = 0) -> None:
        object.__setattr__(self, "nanoseconds", _total("a duration", seconds, nanoseconds))

    @property
    def seconds(self) -> float:
        """The span in seconds, as the nearest float."""
        return self.nanoseconds / NANOSECONDS

    def sec_nanosec(self) -> tuple[int, int]:
        """Whole seconds (rounded down) and the remaining nanoseconds: -1 ns is ``(-1, 999999999)``."""
        return divmod(self.nanoseconds, NANOSECONDS)

    def to_msg(self) -> DurationMessage:
        """The span as ``builtin_interfaces/msg/Duration``."""
        from actors.interfaces.builtin_interfaces.msg import Duration as Message

        sec, nanosec = self.sec_nanosec()
        return Message(sec=sec, nanosec=nanosec)

    @classmethod
    def from_msg(cls, msg: SecNanosec) -> Duration:
        """The span in a ``builtin_interfaces/msg/Duration``."""
        return cls(nanoseconds=nanoseconds_of(msg))

    def __add__(self, other: Duration) -> Duration:
        if not isinstance(cast(object, other), Duration):
            return NotImplemented
        return Duration(nanoseconds=self.nanoseconds + other.nanoseconds)

    def __sub__(self, other: Duration) -> Duration:
        if not isinstance(cast(object, other), Duration):
            return NotImplemented
        return Duration(nanoseconds=self.nanoseconds - other.nanoseconds)

    def __mul__(self, factor: float) -> Duration:
        if not isinstance(cast(object, factor), (int, float)):
            return NotImplemented
        if not isfinite(factor):
            if factor > 0:
                return Duration(nanoseconds=_INT64_MAX)
            raise ValueError(f"a duration cannot be multiplied with {factor}; only inf has a meaning: the longest span")
        return Duration(nanoseconds=self.nanoseconds * factor)

    __rmul__ = __mul__

    def __eq__(self, other: object) -> bool:
        return self.nanoseconds == other.nanoseconds if isinstance(other, Duration) else NotImplemented

    def __lt__(self, other: Duration) -> bool:
        return self.nanoseconds < other.nanoseconds if isinstance(cast(object, other), Duration) else NotImplemented

    def __le__(self, other: Duration) -> bool:
        return self.nanoseconds <= other.nanoseconds if isinstance(cast(object, other), Duration) else NotImplemented

    def __gt__(self, other: Duration) -> bool:
        return self.nanoseconds > other.nanoseconds if isinstance(cast(object, other), Duration) else NotImplemented

    def __ge__(self, other: Duration) -> bool:
        return self.nanoseconds >= other.nanoseconds if isinstance(cast(object, other), Duration) else NotImplemented

    def __hash__(self) -> int:
        return hash(("Duration", self.nanoseconds))

    def __repr__(self) -> str:
        return f"Duration({_decimal(self.nanoseconds)} s)"

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError("a Duration never changes; compute a new one")

    def __reduce__(self) -> tuple[Callable[[int], Duration], tuple[int]]:
        return _duration, (self.nanoseconds,)


class Time:
    """An instant of one clock, in nanoseconds since its epoch. Immutable.

    Raises ``ValueError`` below zero and ``OverflowError`` from 2**63 ns. ``Time - Time`` is a Duration, ``Time +- Duration`` a Time.
    Comparing (``==`` included) or subtracting times of different clocks raises ``TypeError``.
    """

    __slots__ = ("clock_type", "nanoseconds")

    nanoseconds: int
    clock_type: ClockType

    def __init__(
        self, *, seconds: float = 0, nanoseconds: float = 0, clock_type: ClockType = ClockType.SYSTEM_TIME
    ) -> None:
        if not isinstance(cast(object, clock_type), ClockType):
            raise TypeError(f"clock_type must be a ClockType such as ClockType.ROS_TIME, not {clock_type!r}")
        if seconds < 0 or nanoseconds < 0:
            raise ValueError(
                f"a time cannot lie before its clock's epoch: seconds={seconds}, nanoseconds={nanoseconds}"
            )
        object.__setattr__(self, "nanoseconds", _total("a time", seconds, nanoseconds))
        object.__setattr__(self, "clock_type", clock_type)

    @property
    def seconds(self) -> float:
        """Seconds since the epoch, as the nearest float (for system time, to about 0.2 us today)."""
        return self.nanoseconds / NANOSECONDS

    def sec_nanosec(self) -> tuple[int, int]:
        """Whole seconds and the remaining nanoseconds."""
        return divmod(self.nanoseconds, NANOSECONDS)

    def to_msg(self) -> TimeMessage:
        """The instant as ``builtin_interfaces/msg/Time``, which does not contain the clock type."""
        return stamp_of(self.nanoseconds)

    @classmethod
    def from_msg(cls, msg: SecNanosec, clock_type: ClockType = ClockType.ROS_TIME) -> Time:
        """The instant in a ``builtin_interfaces/msg/Time``, by default of the ROS clock."""
        return cls(nanoseconds=nanoseconds_of(msg), clock_type=clock_type)

    def __add__(self, other: Duration) -> Time:
        if not isinstance(cast(object, other), Duration):
            return NotImplemented
        return Time(nanoseconds=self.nanoseconds + other.nanoseconds, clock_type=self.clock_type)

    __radd__ = __add__

    @overload
    def __sub__(self, other: Time) -> Duration: ...
    @overload
    def __sub__(self, other: Duration) -> Time: ...
    def __sub__(self, other: Time | Duration) -> Time | Duration:
        if isinstance(other, Time):
            self._same_clock(other)
            return Duration(nanoseconds=self.nanoseconds - other.nanoseconds)
        if not isinstance(cast(object, other), Duration):
            return NotImplemented
        return Time(nanoseconds=self.nanoseconds - other.nanoseconds, clock_type=self.clock_type)

    def _same_clock(self, other: Time) -> None:
        if self.clock_type is not other.clock_type:
            raise TypeError(f"times of different clocks have no relation: {self.clock_type} and {other.clock_type}")

    def _comparable(self, other: object) -> bool:
        if not isinstance(other, Time):
            return False
        self._same_clock(other)
        return True

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Time):
            return NotImplemented
        self._same_clock(other)
        return self.nanoseconds == other.nanoseconds

    def __lt__(self, other: Time) -> bool:
        return self.nanoseconds < other.nanoseconds if self._comparable(other) else NotImplemented

    def __le__(self, other: Time) -> bool:
        return self.nanoseconds <= other.nanoseconds if self._comparable(other) else NotImplemented

    def __gt__(self, other: Time) -> bool:
        return self.nanoseconds > other.nanoseconds if self._comparable(other) else NotImplemented

    def __ge__(self, other: Time) -> bool:
        return self.nanoseconds >= other.nanoseconds if self._comparable(other) else NotImplemented

    def __hash__(self) -> int:
        return hash((self.clock_type, self.nanoseconds))

    def __repr__(self) -> str:
        return f"Time({_decimal(self.nanoseconds)} s, {self.clock_type})"

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError("a Time never changes; compute a new one")

    def __reduce__(self) -> tuple[Callable[[int, ClockType], Time], tuple[int, ClockType]]:
        return _time, (self.nanoseconds, self.clock_type)


def _duration(nanoseconds: int) -> Duration:
    return Duration(nanoseconds=nanoseconds)


def _time(nanoseconds: int, clock_type: ClockType) -> Time:
    return Time(nanoseconds=nanoseconds, clock_type=clock_type)


def _decimal(nanoseconds: int) -> str:
    """Nanoseconds as exact decimal seconds: 1500000000 -> ``1.5``, -1 -> ``-0.000000001``."""
    sec, rest = divmod(abs(nanoseconds), NANOSECONDS)
    fraction = f"{rest:09d}".rstrip("0") or "0"
    return f"{'-' if nanoseconds < 0 else ''}{sec}.{fraction}"
