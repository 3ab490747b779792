"""Structured logs: each line has an event, fields, the time, the level, the node and its incarnation.

The library only passes records to sinks. The default sink passes them to `structlog` as configured by the program; an application may use
`console_sink` or `json_sink`. structlog is imported when the first line is written.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

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

if TYPE_CHECKING:
    from actors.logs.ros import log_directory, ros_console_sink, ros_file_sink
    from actors.logs.stdlib import LoggedNode, NodeHandler, logging_sink

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
    "LoggedNode",
    "NanosecondClock",
    "NodeHandler",
    "NodeLog",
    "console_sink",
    "json_sink",
    "log_directory",
    "log_message",
    "logging_sink",
    "printable",
    "ros_console_sink",
    "ros_file_sink",
    "structlog_sink",
]

_LATE = {
    "LoggedNode": "stdlib",
    "NodeHandler": "stdlib",
    "log_directory": "ros",
    "logging_sink": "stdlib",
    "ros_console_sink": "ros",
    "ros_file_sink": "ros",
}


def __getattr__(name: str) -> Any:
    """Imports what few programs need when it is first used."""
    if name not in _LATE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_LATE[name]}"), name)
