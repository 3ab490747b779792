"""Structured logs: an event with fields, and with node, level, time and incarnation on every line.

The library itself only hands records to sinks. The default sink gives them to `structlog` as the embedding program configured it; an
application calls `console_sink` or `json_sink`. structlog is imported at the first line that is written, not before.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import IO, TYPE_CHECKING, Any, Final

from actors.levels import Level

if TYPE_CHECKING:
    from actors.clock import Clock
    from actors.interfaces.rcl_interfaces.msg import Log

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
LEVEL_NAMES: Final[dict[int, str]] = {DEBUG: "debug", INFO: "info", WARN: "warning", ERROR: "error", FATAL: "fatal"}


class LogRecord:
    """One line: `time` is seconds on the system's clock."""

    __slots__ = ("event", "fields", "incarnation", "level", "node", "time")

    def __init__(
        self, time: float, level: int, node: str, incarnation: int, event: str, fields: dict[str, Any]
    ) -> None:
        self.time = time
        self.level = level
        self.node = node
        self.incarnation = incarnation
        self.event = event
        self.fields = fields

    def __repr__(self) -> str:
        fields = "".join(f" {key}={value!r}" for key, value in self.fields.items())
        return f"[{self.time:10.3f}] {LEVEL_NAMES.get(self.level, self.level)} {self.node}: {self.event}{fields}"


LogSink = Callable[[LogRecord], None]


class NodeLog:
    """A node's own log. Events are nouns or short sentences, what varies goes into fields: ``self.log.info("goal reached", after=3.2)``.

    Any field name will do; one that the line itself has (time, level, node, incarnation, event, logger) is shown as ``time_`` and so on.
    """

    __slots__ = ("_clock", "_incarnation", "_node", "_sink", "level")

    def __init__(self, node: str, incarnation: int, clock: Clock, sink: LogSink, level: int = INFO) -> None:
        self._node = node
        self._incarnation = incarnation
        self._clock = clock
        self._sink = sink
        self.level = level

    def debug(self, event: str, /, **fields: Any) -> None:
        self._write(DEBUG, event, fields)

    def info(self, event: str, /, **fields: Any) -> None:
        self._write(INFO, event, fields)

    def warning(self, event: str, /, **fields: Any) -> None:
        self._write(WARN, event, fields)

    warn = warning

    def error(self, event: str, /, **fields: Any) -> None:
        self._write(ERROR, event, fields)

    def fatal(self, event: str, /, **fields: Any) -> None:
        self._write(FATAL, event, fields)

    def _write(self, level: int, event: str, fields: dict[str, Any]) -> None:
        if level >= self.level:
            self._sink(LogRecord(self._clock.now(), level, self._node, self._incarnation, event, fields))


def printable(text: str) -> str:
    """The text, with what no message can carry (lone surrogates) written out."""
    return text.encode("utf-8", "backslashreplace").decode()


def log_message(record: LogRecord, nanoseconds: int) -> Log:
    """The line as it goes to `/rosout`: stamped with this wall time, its fields in the text."""
    from actors.interfaces.builtin_interfaces.msg import Time
    from actors.interfaces.rcl_interfaces.msg import Log

    fields = "".join(f" {key}={value}" for key, value in record.fields.items())
    return Log(
        stamp=Time(sec=nanoseconds // 1_000_000_000, nanosec=nanoseconds % 1_000_000_000),
        level=int(record.level),
        name=record.node.lstrip("/").replace("/", "."),
        msg=printable(f"{record.event}{fields}"),
    )


def structlog_sink(record: LogRecord) -> None:
    """Hand a record to structlog as the program configured it."""
    import structlog

    level = "critical" if record.level >= FATAL else LEVEL_NAMES[record.level]
    getattr(structlog.get_logger("actors"), level)(
        record.event, node=record.node, time=round(record.time, 6), incarnation=record.incarnation, **_fields(record)
    )


_OWN: Final = frozenset(("event", "incarnation", "level", "logger", "node", "time"))


def _fields(record: LogRecord) -> dict[str, Any]:
    """The fields of a record, those out of the way that are named like the line's own."""
    fields = record.fields
    return (
        fields if _OWN.isdisjoint(fields) else {f"{name}_" if name in _OWN else name: fields[name] for name in fields}
    )


def _event_dict(record: LogRecord) -> dict[str, Any]:
    return {
        "time": round(record.time, 6), "level": LEVEL_NAMES.get(record.level, str(record.level)), "node": record.node,
        "incarnation": record.incarnation, "event": record.event, **_fields(record),
    }  # fmt: skip


def json_sink(stream: IO[str] | None = None, level: int = INFO) -> LogSink:
    """Lines of JSON, one object each, for files and machines."""
    from structlog.processors import JSONRenderer

    render = JSONRenderer(default=str, ensure_ascii=False)

    def write(record: LogRecord) -> None:
        if record.level >= level:
            print(render(None, "", _event_dict(record)), file=stream or sys.stderr, flush=True)

    return write


def console_sink(stream: IO[str] | None = None, level: int = INFO) -> LogSink:
    """Lines for people: time, level, node, event, fields; in colour on a terminal. A character the terminal lacks never fails."""
    import structlog

    out = stream or sys.stderr
    columns = structlog.dev.ConsoleRenderer(colors=out.isatty(), pad_event_to=32)
    encoding = getattr(out, "encoding", None) or "utf-8"

    def write(record: LogRecord) -> None:
        if record.level < level:
            return
        fields = _event_dict(record)
        clock, node = f"{fields.pop('time'):9.3f}", fields.pop("node")
        if record.incarnation == 1:
            del fields["incarnation"]
        line = f"{clock} {columns(None, '', {**fields, 'logger': node})}"
        print(line.encode(encoding, "replace").decode(encoding), file=out, flush=True)

    return write
