"""Log lines as ROS 2 writes them: on the console by the variables ``RCUTILS_*``, and in files below ``ROS_LOG_DIR``."""

from __future__ import annotations

import os
import re
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import IO, Final

from actors.logs.levels import Level
from actors.logs.log import LogRecord, LogSink, log_message
from actors.logs.terminal import shown

FORMAT: Final = "RCUTILS_CONSOLE_OUTPUT_FORMAT"
COLOURS: Final = "RCUTILS_COLORIZED_OUTPUT"
STDOUT: Final = "RCUTILS_LOGGING_USE_STDOUT"
BUFFERED: Final = "RCUTILS_LOGGING_BUFFERED_STREAM"
DEFAULT_FORMAT: Final = "[{severity}] [{time}] [{name}]: {message}"

_COLOUR: Final = {Level.DEBUG: "\033[32m", Level.INFO: "\033[0m", Level.WARN: "\033[33m", Level.ERROR: "\033[31m"}
_ESCAPES: Final = {r"\a": "\a", r"\b": "\b", r"\n": "\n", r"\r": "\r", r"\t": "\t", r"\\": "\\"}


def ros_console_sink(stream: IO[str] | None = None, environ: Mapping[str, str] | None = None) -> LogSink:
    """Return a sink that writes lines as a node of ROS 2 does, by the variables of its environment.

    ``RCUTILS_CONSOLE_OUTPUT_FORMAT`` is the format, ``RCUTILS_COLORIZED_OUTPUT`` 0 or 1 (as it is: on a terminal),
    ``RCUTILS_LOGGING_USE_STDOUT`` 1 for stdout instead of stderr, and ``RCUTILS_LOGGING_BUFFERED_STREAM`` 1 to leave the flushing to the
    stream. A `stream` takes the place of both. Raises `ValueError` for a variable that is neither 0 nor 1.
    """
    given = os.environ if environ is None else environ
    to_stdout, wanted = _flag(given, STDOUT), _flag(given, COLOURS)
    out = stream or (sys.stdout if to_stdout else sys.stderr)
    coloured = out.isatty() if wanted is None else wanted
    flush = not _flag(given, BUFFERED)
    line = _formatter(given)

    def write(record: LogRecord) -> None:
        text = line(record)
        if coloured:
            text = f"{_COLOUR.get(Level(record.level), _COLOUR[Level.ERROR])}{text}\033[0m"
        print(text, file=out, flush=flush)

    return write


def ros_file_sink(program: str = "", environ: Mapping[str, str] | None = None) -> LogSink:
    """Return a sink that writes all lines to a file of its own in `log_directory`: ``<program>_<process>_<milliseconds>.log``.

    The folder is made, and the file with the first line. `program` is the name of the running one if none is given.
    """
    given = os.environ if environ is None else environ
    name = program or Path(sys.argv[0] or "python").stem
    path = log_directory(given) / f"{name}_{os.getpid()}_{time.time_ns() // 1_000_000}.log"
    line = _formatter(given)

    def write(record: LogRecord) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a", encoding="utf-8") as file:
            print(line(record), file=file)

    return write


def log_directory(environ: Mapping[str, str] | None = None) -> Path:
    """The folder for log files: ``$ROS_LOG_DIR``, else ``$ROS_HOME/log``, else ``~/.ros/log``."""
    given = os.environ if environ is None else environ
    if folder := given.get("ROS_LOG_DIR"):
        return Path(folder).expanduser()
    return Path(given.get("ROS_HOME") or "~/.ros").expanduser() / "log"


def _flag(environ: Mapping[str, str], name: str) -> bool | None:
    text = environ.get(name, "")
    if text not in ("", "0", "1"):
        raise ValueError(f"{name} is {text!r}; it must be 0 or 1")
    return bool(int(text)) if text else None


def _formatter(environ: Mapping[str, str]) -> Callable[[LogRecord], str]:
    """The function that makes a line of a record. An unknown word in braces stays as it is, as in rcutils."""
    pattern = re.sub(r"\\[abnrt\\]", lambda found: _ESCAPES[found[0]], environ.get(FORMAT) or DEFAULT_FORMAT)

    def line(record: LogRecord) -> str:
        now = time.time_ns()
        message = log_message(record, now)
        place = str(record.fields.get("at", ""))
        file, _, number = place.partition(" ")[0].rpartition(":")
        words = {
            "severity": Level(record.level).name,
            "name": message.name,
            "message": message.msg,
            "time": f"{now // 1_000_000_000}.{now % 1_000_000_000:09d}",
            "time_as_nanoseconds": str(now),
            "date_time_with_ms": f"{time.strftime('%Y-%m-%d %H:%M:%S', time.localtime(now // 1_000_000_000))}.{now // 1_000_000 % 1000:03d}",
            "file_name": file,
            "function_name": "",
            "line_number": number or "0",
        }
        return re.sub(r"\{(\w+)\}", lambda found: shown(words.get(found[1], found[0]), "    "), pattern)

    return line
