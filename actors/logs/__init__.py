"""Structured logs: each line has an event, fields, the time, the level, the node and its incarnation.

The library only passes records to sinks. The default sink passes them to `structlog` as configured by the program; an application may use
`console_sink` or `json_sink`. structlog is imported when the first line is written.
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
