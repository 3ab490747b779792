"""`NodeLog`, the records that it makes, and the sinks that write them. Use them through ``actors.logs``."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from functools import lru_cache
from textwrap import indent
from typing import IO, TYPE_CHECKING, Any, Final, TypeAlias, cast

from actors.checks import NoPublicConstructor
from actors.logs.levels import CallSites, Level, LevelTree, NanosecondClock
from actors.logs.terminal import shown
from actors.names.names import logger_name
from actors.places import Place, error_fields, traceback_of, users_trace
from actors.time.values import stamp_of

if TYPE_CHECKING:
    from traceback import TracebackException

    from actors.interfaces.rcl_interfaces.msg import Log
    from actors.time.clock import Clock

DEBUG, INFO, WARN, ERROR, FATAL = Level.DEBUG, Level.INFO, Level.WARN, Level.ERROR, Level.FATAL
"""The levels of log lines, by their names in ROS 2."""
LEVEL_NAMES: Final[dict[int, str]] = {DEBUG: "debug", INFO: "info", WARN: "warning", ERROR: "error", FATAL: "fatal"}
"""The text of each level in a line."""


class LogRecord:
    """One log line. `time` is in seconds on the system's clock. `trace` is the traceback of an error that was logged in another process.

    `error` is the logged error. It is only available while the sinks are called, because its frames keep objects of the handler alive;
    later only its `traceback` is. `times` is the number of errors of the same type and place so far, this one included, as far as they are
    counted.
    """

    __slots__ = ("_trace", "_traceback", "error", "event", "fields", "incarnation", "level", "node", "time", "times")

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
        trace: str = "",
    ) -> None:
        self.time = time
        self.level = level
        self.node = node
        self.incarnation = incarnation
        self.event = event
        self.fields = fields
        self.error = error
        self.times = times
        self._trace = trace
        self._traceback: TracebackException | None = None

    def __repr__(self) -> str:
        fields = "".join(f" {key}={value!r}" for key, value in self.fields.items())
        if self.times > 1:
            fields += f" times={self.times}"
        return f"[{self.time:10.3f}] {LEVEL_NAMES.get(self.level, self.level)} {self.node}: {self.event}{fields}"

    def __str__(self) -> str:
        """The line, followed by the traceback if there is one."""
        return "\n".join((repr(self), indent(self.traceback, " " * 13))) if self.traceback else repr(self)

    @property
    def traceback(self) -> str:
        """The traceback of the error and its causes, beginning in user code; empty if there is no error."""
        self._keep_traceback()
        return self._trace if self._traceback is None else "".join(self._traceback.format()).rstrip()

    def let_go(self) -> None:
        """Store the traceback and drop the error."""
        if self.error is not None:
            self._keep_traceback()
            self.error = None

    def _keep_traceback(self) -> None:
        if self.error is not None and self._traceback is None:
            self._traceback = traceback_of(self.error)


LogSink: TypeAlias = Callable[[LogRecord], None]
"""A function that is called with each log line of a system, in order, in the event loop."""

_NO_FILTERS: Final = (False, False, 0.0)


class NodeLog(metaclass=NoPublicConstructor):
    """The log of one node. An event is a noun or a short sentence; variable parts are fields: ``self.log.info("goal reached", after=3.2)``.

    A field may have any name; one that the line itself uses (time, level, node, life, event, logger) is shown as ``time_`` and so on.
    Positional values replace ``%s`` and ``%d`` in the event, as in `logging`.

    Three options, those of rclpy, limit how often a line is written: ``once=True``, ``skip_first=True`` and ``throttle_duration_sec=1.0``
    (at most one line in that many seconds). They count separately for each place in the source, each node and each incarnation, on the
    node's clock. Calls from one place must always pass the same options; otherwise `ValueError` is raised.

    It has no public constructor: `Node.log` is one.
    """

    __slots__ = (
        "_clock",
        "_incarnation",
        "_level",
        "_levels",
        "_logger",
        "_node",
        "_sink",
        "_sites",
        "_throttle_clock",
        "_version",
    )

    def __init__(
        self,
        node: str,
        incarnation: int,
        clock: Clock,
        sink: LogSink,
        levels: LevelTree,
        throttle_clock: NanosecondClock | None = None,
    ) -> None:
        self._node = node
        self._logger = logger_name(node)
        self._incarnation = incarnation
        self._clock = clock
        self._throttle_clock: NanosecondClock = throttle_clock or clock
        self._sink = sink
        self._levels = levels
        self._level, self._version = levels.effective(self._logger), levels.version
        self._sites: CallSites | None = None

    @property
    def level(self) -> int:
        """The lowest level that is written. It can be changed at any time, and holds for later incarnations too.

        ``UNSET`` takes back what was set, so that the level of the logger above, or else that of the system, applies again.
        """
        levels = self._levels
        if levels.version != self._version:
            self._level, self._version = levels.effective(self._logger), levels.version
        return self._level

    @level.setter
    def level(self, level: int) -> None:
        self._levels.set(self._logger, level)

    def set_level(self, level: int | str) -> None:
        """Write lines of this level and above from now on: ``node.log.set_level("debug")``. Raises `ValueError` for what is no level."""
        self.level = Level.parse(level) if isinstance(level, str) else level

    def debug(
        self, event: str, /, *args: object, once: bool = False, skip_first: bool = False, throttle_duration_sec: float = 0.0,
        **fields: object,
    ) -> None:  # fmt: skip
        self._say(DEBUG, event, args, fields, (once, skip_first, throttle_duration_sec))

    def info(
        self, event: str, /, *args: object, once: bool = False, skip_first: bool = False, throttle_duration_sec: float = 0.0,
        **fields: object,
    ) -> None:  # fmt: skip
        self._say(INFO, event, args, fields, (once, skip_first, throttle_duration_sec))

    def warning(
        self, event: str, /, *args: object, once: bool = False, skip_first: bool = False, throttle_duration_sec: float = 0.0,
        **fields: object,
    ) -> None:  # fmt: skip
        self._say(WARN, event, args, fields, (once, skip_first, throttle_duration_sec))

    warn = warning

    def error(
        self, event: str, /, *args: object, once: bool = False, skip_first: bool = False, throttle_duration_sec: float = 0.0,
        **fields: object,
    ) -> None:  # fmt: skip
        self._say(ERROR, event, args, fields, (once, skip_first, throttle_duration_sec))

    def fatal(
        self, event: str, /, *args: object, once: bool = False, skip_first: bool = False, throttle_duration_sec: float = 0.0,
        **fields: object,
    ) -> None:  # fmt: skip
        self._say(FATAL, event, args, fields, (once, skip_first, throttle_duration_sec))

    def exception(
        self, event: str, /, *args: object, once: bool = False, skip_first: bool = False, throttle_duration_sec: float = 0.0,
        **fields: object,
    ) -> None:  # fmt: skip
        """Write an error line with the exception being handled and its traceback. Use it in an ``except`` block."""
        error = sys.exception()
        if error is not None:
            fields = error_fields(error) | fields
        self._say(ERROR, event, args, fields, (once, skip_first, throttle_duration_sec), error)

    def write(
        self, level: int, event: str, fields: dict[str, Any], error: BaseException | None = None, times: int = 1
    ) -> None:
        """Write a line without filtering or formatting, with the error that it reports."""
        if level >= self.level:
            self._sink(LogRecord(self._clock.now(), level, self._node, self._incarnation, event, fields, error, times))

    def _say(
        self,
        level: int,
        event: str,
        args: tuple[object, ...],
        fields: dict[str, object],
        filters: tuple[bool, bool, float],
        error: BaseException | None = None,
    ) -> None:
        if level < (self._level if self._levels.version == self._version else self.level):
            return
        if (filters != _NO_FILTERS or "throttle_time_source_type" in fields) and not self._passes(
            level, fields, filters
        ):
            return
        if args:
            event = _formatted(event, args, fields)
        self._sink(LogRecord(self._clock.now(), level, self._node, self._incarnation, event, fields, error))

    def _passes(self, level: int, fields: dict[str, object], filters: tuple[bool, bool, float]) -> bool:
        """Whether the log call in user code writes its line this time."""
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


def _formatted(event: str, args: tuple[object, ...], fields: dict[str, object]) -> str:
    """The event with the values inserted. If they do not fit, it is returned unchanged with the values after it: a log call must not
    fail."""
    try:
        return event % (cast("Any", args[0]) if len(args) == 1 and isinstance(args[0], Mapping) else args)
    except (TypeError, ValueError, KeyError):
        fields["args"] = args
        return event


def printable(text: str) -> str:
    """The text with lone surrogates, which no message can contain, written as escapes."""
    return text.encode("utf-8", "backslashreplace").decode()


def log_message(record: LogRecord, nanoseconds: int) -> Log:
    """The record as a message for `/rosout`: stamped with this wall time, with its fields in the text."""
    from actors.interfaces.rcl_interfaces.msg import Log

    fields = "".join(f" {key}={value}" for key, value in record.fields.items())
    return Log(
        stamp=stamp_of(nanoseconds),
        level=int(record.level),
        name=logger_name(record.node),
        msg=printable(
            "\n".join(filter(None, (f"{record.event}{fields}", record.traceback if record.times == 1 else "")))
        ),
    )


def structlog_sink(record: LogRecord) -> None:
    """Pass a record to structlog as configured by the program. An error is passed as `exc_info` when it occurs for the first time.

    In a program that has not configured structlog the line is that of `console_sink`, as `spin` and `robactor run` write it.
    """
    import structlog

    if not structlog.is_configured():
        _console_on(sys.stdout)(record)
        return
    level = "critical" if record.level >= FATAL else LEVEL_NAMES[record.level]
    fields = _fields(record)
    if record.times > 1:
        fields = {**fields, "times": record.times}
    elif record.error is not None and record.traceback:
        fields = {**fields, "exc_info": (type(record.error), record.error, users_trace(record.error))}
    elif record.error is None and record.traceback:
        fields = {**fields, "exception": record.traceback}
    getattr(structlog.get_logger("actors"), level)(
        shown(record.event, _INDENT),
        node=record.node,
        time=round(record.time, 6),
        life=record.incarnation,
        **_shown(fields),
    )


_INDENT: Final = "    "
_OWN: Final = frozenset(("event", "level", "life", "logger", "node", "time"))


def _fields(record: LogRecord) -> dict[str, object]:
    """The fields of a record. Those with a name that the line itself uses are renamed."""
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


def _shown(fields: dict[str, Any]) -> dict[str, Any]:
    """The same for a terminal: texts come from anywhere."""
    return {
        name: shown(value, None if name == "exception" else _INDENT) if isinstance(value, str) else value
        for name, value in fields.items()
    }


def json_sink(stream: IO[str] | None = None, level: int = 0) -> LogSink:
    """Return a sink that writes one JSON object per line. The traceback of an error is in the field `exception`."""
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
    """Return a sink that writes lines for people: time, level, node, event, fields; in colour on a terminal.

    The first line about an error of its type and place is followed by the traceback, later ones state how many there were. A character that
    the terminal cannot show is replaced.
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
        line = f"{clock} {columns(None, '', {**_shown(fields), 'logger': shown(node)})}"
        print(line.encode(encoding, "replace").decode(encoding), file=out, flush=True)

    return write


_console_on: Final = lru_cache(maxsize=1)(console_sink)
