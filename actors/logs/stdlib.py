"""The bridges between the logs of nodes and Python's `logging`."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import Any, Final, Protocol

from actors.logs.levels import Level
from actors.logs.log import LogRecord, LogSink, NodeLog

_OURS: Final = "robactor_record"
"""The attribute that marks a record of `logging` that comes from a node."""


class LoggedNode(Protocol):
    """A node, as `NodeHandler` uses it."""

    @property
    def log(self) -> NodeLog: ...
    def threadsafe(self, function: Callable[..., object], *arguments: Any) -> None: ...


def logging_sink(parent: str = "robactor") -> LogSink:
    """Return a sink that passes the lines of nodes to Python's `logging`: those of ``/arm/gripper`` to the logger ``robactor.arm.gripper``.

    Fields stand in the text, as ``key=value``, and each by itself in ``record.fields``.
    """

    def write(record: LogRecord) -> None:
        name = record.node.strip("/").replace("/", ".")
        text = " ".join((record.event, *(f"{key}={value}" for key, value in record.fields.items())))
        error = record.error if record.times == 1 else None
        logging.getLogger(f"{parent}.{name}" if parent else name).log(
            record.level, "%s", text, exc_info=error, extra={"fields": dict(record.fields), _OURS: True}
        )

    return write


class NodeHandler(logging.Handler):
    """A handler of Python's `logging` that writes to the log of a node: ``logging.getLogger("driver").addHandler(NodeHandler(self))``.

    The name of the logger is the field `logger_name`. It may be used from any thread; records from `logging_sink` are left out. Make it in
    the node's event loop, and remove it when the node ends.
    """

    def __init__(self, node: LoggedNode, level: int = logging.NOTSET) -> None:
        super().__init__(level)
        self._node = node
        self._thread = threading.get_ident()

    def emit(self, record: logging.LogRecord) -> None:
        """Write a record to the log of the node, unless it came from there."""
        if hasattr(record, _OURS):
            return
        error = record.exc_info[1] if record.exc_info else None
        fields = {"logger_name": record.name}
        arguments = (_level_of(record.levelno), record.getMessage(), fields, error)
        if threading.get_ident() == self._thread:
            self._node.log.write(*arguments)
        else:
            self._node.threadsafe(self._node.log.write, *arguments)


def _level_of(number: int) -> Level:
    """The level at or below a number of `logging`."""
    return max((level for level in Level if Level.UNSET < level <= number), default=Level.DEBUG)
