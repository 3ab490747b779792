"""Logs: levels, records, every sink."""

import io
import json
import logging
import tempfile

from actors import Node, execute, run
from actors.interfaces.builtin_interfaces.msg import Time as Stamp
from actors.logs import (
    DEBUG, ERROR, FATAL, INFO, LEVEL_NAMES, WARN, Level, LogRecord, LogSink, LoggedNode, NanosecondClock, NodeHandler, NodeLog,
    console_sink, json_sink, log_directory, log_message, logging_sink, printable, ros_console_sink, ros_file_sink, structlog_sink,
)

# -- logs

assert DEBUG < INFO < WARN < ERROR < FATAL and LEVEL_NAMES[WARN] == "warning" and Level["INFO"] is INFO


class Driver(Node):
    """Logs its own lines, and those of a library that uses Python's logging."""

    async def on_start(self) -> None:
        log: NodeLog = self.log
        log.set_level("debug")
        log.warn("battery low", percent=12.5)
        me: LoggedNode = self
        logging.getLogger("vendor.driver").addHandler(NodeHandler(me))
        logging.getLogger("vendor.driver").warning("firmware %d is old", 3)


lines: list[LogRecord] = []
written, seen = io.StringIO(), io.StringIO()
sinks: tuple[LogSink, ...] = (lines.append, json_sink(written), ros_console_sink(seen, environ={}), console_sink(io.StringIO()))


async def main() -> None:
    async with run(Driver, sinks=sinks):
        ...


execute(main, clock="virtual")
(low,) = [one for one in lines if one.event == "battery low"]
assert (low.level, low.node, low.fields) == (WARN, "/driver", {"percent": 12.5})
assert any(json.loads(line)["event"] == "battery low" for line in written.getvalue().splitlines())
assert any(one.event == "firmware 3 is old" for one in lines)
assert log_message(low, nanoseconds=1_500_000_000).stamp == Stamp(sec=1, nanosec=500_000_000)  # what /rosout carries
assert printable("caf\udce9") == "caf\\udce9"

folder = tempfile.mkdtemp()
assert str(log_directory({"ROS_LOG_DIR": folder})) == folder
write: LogSink = ros_file_sink("driver", environ={"ROS_LOG_DIR": folder})
write(low)
assert len(list(log_directory({"ROS_LOG_DIR": folder}).iterdir())) == 1
more: list[LogSink] = [structlog_sink, logging_sink()]  # to Python's logging: the logger robactor.driver


def now_of(clock: NanosecondClock) -> int:
    """What the clock of a log's stamps answers."""
    return clock.now_ns()
