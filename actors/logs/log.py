"""Structured logs: an event with fields, and with node, level, time and incarnation on every line.

The library itself only hands records to sinks. The default sink gives them to `structlog` as the embedding program configured it; an
application calls `console_sink` or `json_sink`. structlog is imported at the first line that is written, not before.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from textwrap import indent
from typing import IO, TYPE_CHECKING, Any, Final, TypeAlias, cast

from actors.errors import described
from actors.logs.levels import CallSites, Level, NanosecondClock
from actors.places import Place, place_of, traceback_of, users_trace
from actors.time.values import stamp_of

if TYPE_CHECKING:
    from traceback import TracebackException

    from actors.interfaces.rcl_interfaces.msg import Log
    from actors.time.clock import Clock

__all__ = [
    "DEBUG",
    "ERROR",
    "FATAL",
    "INFO",
    "LEVEL_NAMES",
    "WARN",
    "LogRecord",
    "LogSink",
    "NodeLog",
    "console_sink",
    "json_sink",
    "log_message",
    "printable",
    "structlog_sink",
]

DEBUG, INFO, WARN, ERROR, FATAL = Level.DEBUG, Level.INFO, Level.WARN, Level.ERROR, Level.FATAL
"""The levels of log lines, by the names that ROS 2 gives them."""
LEVEL_NAMES: Final[dict[int, str]] = {DEBUG: "debug", INFO: "info", WARN: "warning", ERROR: "error", FATAL: "fatal"}
"""How a level is written in a line."""


class LogRecord:
    """One line: `time` is seconds on the system's clock.

    `error` is the error that the line tells of, as long as the sinks are called: afterwards only its `traceback` is left, because its frames
    keep alive what the handler held. `times`: the how-manieth error of its type and place this is, as far as it was counted.
    """

    __slots__ = ("_traceback", "error", "event", "fields", "incarnation", "level", "node", "time", "times")

    def __init__(
        self,
        time: float,
        level: int,
        node: str,
        incarnation: int,
        event: str,
        fields: dict[str, Any],
        error: BaseException | None = None,
        times: int = 1,
    ) -> None:
        self.time = time
        self.level = level
        self.node = node
        self.incarnation = incarnation
        self.event = event
        self.fields = fields
        self.error = error
        self.times = times
        self._traceback: TracebackException | None = None

    def __repr__(self) -> str:
        fields = "".join(f" {key}={value!r}" for key, value in self.fields.items())
        if self.times > 1:
            fields += f" times={self.times}"
        return f"[{self.time:10.3f}] {LEVEL_NAMES.get(self.level, self.level)} {self.node}: {self.event}{fields}"

    def __str__(self) -> str:
        """The line, and the traceback below it."""
        return "\n".join((repr(self), indent(self.traceback, " " * 13))) if self.traceback else repr(self)

    @property
    def traceback(self) -> str:
        """The traceback of the error and of what caused it, from the user's line on; empty when there is none."""
        shown = self._traceback if self.error is None else traceback_of(self.error)
        return "" if shown is None else "".join(shown.format()).rstrip()

    def let_go(self) -> None:
        """Keep the traceback, but not the error."""
        if self.error is not None:
            self._traceback, self.error = traceback_of(self.error), None


LogSink: TypeAlias = Callable[[LogRecord], None]
"""A function that is called with each log line of a system, in order, within the event loop."""

_NO_FILTERS: Final = (False, False, 0.0)


class NodeLog:
    """A node's own log. Events are nouns or short sentences, what varies goes into fields: ``self.log.info("goal reached", after=3.2)``.

    Any field name will do; one that the line itself has (time, level, node, life, event, logger) is shown as ``time_`` and so on. Values
    after the event are put in place of its ``%s`` and ``%d``, as in `logging`.

    Three options, those of rclpy, keep a line from being written too often. They count for each place in the source, each node and each of
    its lives, on the node's clock: ``once=True``, ``skip_first=True``, ``throttle_duration_sec=1.0`` (at most one line in so many seconds). Of
    one place in the source they must not change: `ValueError`.

    It has no public constructor: `Node.log` is one.
    """

    __slots__ = ("_clock", "_incarnation", "_level", "_levels", "_node", "_sink", "_sites", "_throttle_clock")

    def __init__(
        self,
        node: str,
        incarnation: int,
        clock: Clock,
        sink: LogSink,
        level: int = INFO,
        *,
        levels: dict[str, int] | None = None,
        throttle_clock: NanosecondClock | None = None,
    ) -> None:
        self._node = node
        self._incarnation = incarnation
        self._clock = clock
        self._throttle_clock: NanosecondClock = throttle_clock or clock
        self._sink = sink
        self._levels: dict[str, int] = {} if levels is None else levels
        self._level = self._levels.get(node, level)
        self._sites: CallSites | None = None

    @property
    def level(self) -> int:
        """The least level that is written. Set it at any time; it holds for the node's next lives, too."""
        return self._level

    @level.setter
    def level(self, level: int) -> None:
        self._level = self._levels[self._node] = level

    def set_level(self, level: int | str) -> None:
        """Write lines of this level and above from now on: ``node.log.set_level("debug")``. `ValueError` for a name that is no level."""
        self.level = Level.parse(level) if isinstance(level, str) else level

    def debug(
        self, event: str, /, *args: object, once: bool = False, skip_first: bool = False, throttle_duration_sec: float = 0.0,
        **fields: Any,
    ) -> None:  # fmt: skip
        self._say(DEBUG, event, args, fields, (once, skip_first, throttle_duration_sec))

    def info(
        self, event: str, /, *args: object, once: bool = False, skip_first: bool = False, throttle_duration_sec: float = 0.0,
        **fields: Any,
    ) -> None:  # fmt: skip
        self._say(INFO, event, args, fields, (once, skip_first, throttle_duration_sec))

    def warning(
        self, event: str, /, *args: object, once: bool = False, skip_first: bool = False, throttle_duration_sec: float = 0.0,
        **fields: Any,
    ) -> None:  # fmt: skip
        self._say(WARN, event, args, fields, (once, skip_first, throttle_duration_sec))

    warn = warning

    def error(
        self, event: str, /, *args: object, once: bool = False, skip_first: bool = False, throttle_duration_sec: float = 0.0,
        **fields: Any,
    ) -> None:  # fmt: skip
        self._say(ERROR, event, args, fields, (once, skip_first, throttle_duration_sec))

    def fatal(
        self, event: str, /, *args: object, once: bool = False, skip_first: bool = False, throttle_duration_sec: float = 0.0,
        **fields: Any,
    ) -> None:  # fmt: skip
        self._say(FATAL, event, args, fields, (once, skip_first, throttle_duration_sec))

    def exception(
        self, event: str, /, *args: object, once: bool = False, skip_first: bool = False, throttle_duration_sec: float = 0.0,
        **fields: Any,
    ) -> None:  # fmt: skip
        """An error line with the exception that is being handled, where it arose, and its traceback: for an ``except`` block."""
        error = sys.exception()
        if error is not None:
            fields = {"error": described(error), "at": place_of(error), **fields}
        self._say(ERROR, event, args, fields, (once, skip_first, throttle_duration_sec), error)

    def write(
        self, level: int, event: str, fields: dict[str, Any], error: BaseException | None = None, times: int = 1
    ) -> None:
        """A line as it is, with the error that it tells of."""
        if level >= self._level:
            self._sink(LogRecord(self._clock.now(), level, self._node, self._incarnation, event, fields, error, times))

    def _say(
        self,
        level: int,
        event: str,
        args: tuple[object, ...],
        fields: dict[str, Any],
        filters: tuple[bool, bool, float],
        error: BaseException | None = None,
    ) -> None:
        if level < self._level:
            return
        if (filters != _NO_FILTERS or "throttle_time_source_type" in fields) and not self._passes(
            level, fields, filters
        ):
            return
        if args:
            event = _formatted(event, args, fields)
        self._sink(LogRecord(self._clock.now(), level, self._node, self._incarnation, event, fields, error))

    def _passes(self, level: int, fields: dict[str, Any], filters: tuple[bool, bool, float]) -> bool:
        """Whether the call in the source that led here writes its line this time."""
        frame = sys._getframe(3)  # pyright: ignore[reportPrivateUsage]  # as `logging` does; documented
        place = Place(frame.f_code.co_filename, frame.f_lineno, frame.f_code.co_qualname)
        if self._sites is None:
            self._sites = CallSites()
        once, skip_first, throttle = filters
        options: dict[str, object] = {
            "once": once, "skip_first": skip_first, "throttle_duration_sec": throttle,
            "throttle_time_source_type": fields.pop("throttle_time_source_type", None),
        }  # fmt: skip
        return self._sites.allow(place, self._node, level, options, self._throttle_clock)


def _formatted(event: str, args: tuple[object, ...], fields: dict[str, Any]) -> str:
    """The event with the values in it; where they do not fit it stays as it is, with the values beside it: no reason for a robot to fall over."""
    try:
        return event % (cast("Any", args[0]) if len(args) == 1 and isinstance(args[0], Mapping) else args)
    except (TypeError, ValueError, KeyError):
        fields["args"] = args
        return event


def printable(text: str) -> str:
    """The text, with what no message can carry (lone surrogates) written out."""
    return text.encode("utf-8", "backslashreplace").decode()


def log_message(record: LogRecord, nanoseconds: int) -> Log:
    """The line as it goes to `/rosout`: stamped with this wall time, its fields in the text."""
    from actors.interfaces.rcl_interfaces.msg import Log

    fields = "".join(f" {key}={value}" for key, value in record.fields.items())
    return Log(
        stamp=stamp_of(nanoseconds),
        level=int(record.level),
        name=record.node.lstrip("/").replace("/", "."),
        msg=printable(
            "\n".join(filter(None, (f"{record.event}{fields}", record.traceback if record.times == 1 else "")))
        ),
    )


def structlog_sink(record: LogRecord) -> None:
    """Hand a record to structlog as the program configured it; an error goes as `exc_info`, the first time that it comes."""
    import structlog

    level = "critical" if record.level >= FATAL else LEVEL_NAMES[record.level]
    fields = _fields(record)
    if record.times > 1:
        fields = {**fields, "times": record.times}
    elif record.error is not None and record.traceback:
        fields = {**fields, "exc_info": (type(record.error), record.error, users_trace(record.error))}
    getattr(structlog.get_logger("actors"), level)(
        record.event, node=record.node, time=round(record.time, 6), life=record.incarnation, **fields
    )


_OWN: Final = frozenset(("event", "level", "life", "logger", "node", "time"))


def _fields(record: LogRecord) -> dict[str, Any]:
    """The fields of a record, those out of the way that are named like the line's own."""
    fields = record.fields
    return (
        fields if _OWN.isdisjoint(fields) else {f"{name}_" if name in _OWN else name: fields[name] for name in fields}
    )


def _event_dict(record: LogRecord) -> dict[str, Any]:
    return {
        "time": round(record.time, 6), "level": LEVEL_NAMES.get(record.level, str(record.level)), "node": record.node,
        "life": record.incarnation, "event": record.event, **_fields(record),
        **({"times": record.times} if record.times > 1 else {}),
    }  # fmt: skip


def json_sink(stream: IO[str] | None = None, level: int = 0) -> LogSink:
    """Lines of JSON, one object each, for files and machines; the traceback of an error is its field `exception`."""
    from structlog.processors import JSONRenderer

    render = JSONRenderer(default=str, ensure_ascii=False)

    def write(record: LogRecord) -> None:
        if record.level < level:
            return
        fields = _event_dict(record)
        if text := record.traceback:
            fields["exception"] = text
        print(render(None, "", fields), file=stream or sys.stderr, flush=True)

    return write


def console_sink(stream: IO[str] | None = None, level: int = 0) -> LogSink:
    """Lines for people: time, level, node, event, fields; in colour on a terminal. A character the terminal lacks never fails.

    Below the first line that tells of an error of its type and place stands the traceback; further ones say how many there were.
    """
    import structlog

    out = stream or sys.stderr
    columns = structlog.dev.ConsoleRenderer(
        colors=out.isatty(), pad_event_to=32, exception_formatter=structlog.dev.plain_traceback
    )
    encoding = getattr(out, "encoding", None) or "utf-8"

    def write(record: LogRecord) -> None:
        if record.level < level:
            return
        fields = _event_dict(record)
        clock, node = f"{fields.pop('time'):9.3f}", fields.pop("node")
        if record.incarnation == 1:
            del fields["life"]
        if record.times == 1 and (text := record.traceback):
            fields["exception"] = text
        line = f"{clock} {columns(None, '', {**fields, 'logger': node})}"
        print(line.encode(encoding, "replace").decode(encoding), file=out, flush=True)

    return write
