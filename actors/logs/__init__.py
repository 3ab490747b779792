"""Structured logs: an event with fields, and with node, level, time and incarnation on every line.

The library itself only hands records to sinks. The default sink gives them to `structlog` as the embedding program configured it; an
application calls `console_sink` or `json_sink`. structlog is imported at the first line that is written, not before.
"""

from __future__ import annotations

from actors.logs.levels import Level, NanosecondClock
from actors.logs.log import (
    DEBUG,
    ERROR,
    FATAL,
    INFO,
    LEVEL_NAMES,
    WARN,
    LogRecord,
    LogSink,
    NodeLog,
    console_sink,
    json_sink,
    log_message,
    printable,
    structlog_sink,
)

__all__ = [
    "DEBUG",
    "ERROR",
    "FATAL",
    "INFO",
    "LEVEL_NAMES",
    "WARN",
    "Level",
    "LogRecord",
    "LogSink",
    "NanosecondClock",
    "NodeLog",
    "console_sink",
    "json_sink",
    "log_message",
    "printable",
    "structlog_sink",
]
