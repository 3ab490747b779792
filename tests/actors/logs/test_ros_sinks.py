"""Log lines as ROS 2 writes them, by its variables, and in its files."""

from __future__ import annotations

import io
import re
from pathlib import Path

import pytest

from actors import Node
from actors.logs import LogRecord, log_directory, ros_console_sink, ros_file_sink
from actors.testing import Rig


class Terminal(io.StringIO):
    """A stream that says it is one."""

    def isatty(self) -> bool:
        return True


def line(level: int = 20, event: str = "ready", **fields: object) -> LogRecord:
    return LogRecord(1.5, level, "/spot/arm", 1, event, dict(fields))


def written(record: LogRecord, stream: io.StringIO | None = None, **environ: str) -> str:
    out = stream or io.StringIO()
    ros_console_sink(out, environ)(record)
    return out.getvalue()


def test_a_line_looks_as_in_ros_2() -> None:
    text = written(line(speed=2))
    assert re.fullmatch(r"\[INFO\] \[\d{10}\.\d{9}\] \[spot\.arm\]: ready speed=2\n", text)


@pytest.mark.parametrize(
    ("pattern", "expected"),
    [
        ("{severity} {name}|{message}", r"WARN spot\.arm\|ready at=arm\.py:7 in move"),
        (r"{time_as_nanoseconds}\t{line_number}", r"\d{19}\t7"),
        ("{date_time_with_ms} {file_name}", r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d\.\d{3} arm\.py"),
        ("{function_name}{unknown} {", r"\{unknown\} \{"),
    ],
)
def test_the_format_is_that_of_the_variable(pattern: str, expected: str) -> None:
    text = written(line(30, at="arm.py:7 in move"), RCUTILS_CONSOLE_OUTPUT_FORMAT=pattern)
    assert re.fullmatch(expected + r"\n", text)
    assert written(line(), RCUTILS_CONSOLE_OUTPUT_FORMAT="{line_number}") == "0\n"


@pytest.mark.parametrize(
    ("level", "colour"), [(10, "\033[32m"), (20, "\033[0m"), (30, "\033[33m"), (40, "\033[31m"), (50, "\033[31m")]
)
def test_colours_are_for_terminals_unless_the_variable_says_otherwise(level: int, colour: str) -> None:
    plain = {"RCUTILS_CONSOLE_OUTPUT_FORMAT": "{message}"}
    assert written(line(level), Terminal(), **plain) == f"{colour}ready\033[0m\n"
    assert written(line(level), **plain) == "ready\n"
    assert written(line(level), Terminal(), RCUTILS_COLORIZED_OUTPUT="0", **plain) == "ready\n"
    assert written(line(level), RCUTILS_COLORIZED_OUTPUT="1", **plain) == f"{colour}ready\033[0m\n"


def test_lines_go_to_stderr_or_to_stdout(capsys: pytest.CaptureFixture[str]) -> None:
    for environ in ({}, {"RCUTILS_LOGGING_USE_STDOUT": "0"}, {"RCUTILS_LOGGING_USE_STDOUT": "1"}):
        ros_console_sink(environ={**environ, "RCUTILS_CONSOLE_OUTPUT_FORMAT": "{message}"})(line())
    assert capsys.readouterr() == ("ready\n", "ready\nready\n")


def test_a_buffered_stream_is_not_flushed_at_each_line() -> None:
    flushed: list[int] = []

    class Counting(io.StringIO):
        def flush(self) -> None:
            flushed.append(1)

    ros_console_sink(Counting(), {"RCUTILS_LOGGING_BUFFERED_STREAM": "1"})(line())
    assert flushed == []
    ros_console_sink(Counting(), {})(line())
    assert flushed == [1]


@pytest.mark.parametrize(
    "name", ["RCUTILS_COLORIZED_OUTPUT", "RCUTILS_LOGGING_USE_STDOUT", "RCUTILS_LOGGING_BUFFERED_STREAM"]
)
def test_a_variable_that_is_neither_0_nor_1_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match=f"{name} is 'yes'; it must be 0 or 1"):
        ros_console_sink(io.StringIO(), {name: "yes"})


def test_the_environment_of_the_program_is_read(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("RCUTILS_CONSOLE_OUTPUT_FORMAT", "<{message}>")
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path))
    out = io.StringIO()
    ros_console_sink(out)(line())
    assert out.getvalue() == "<ready>\n" and log_directory() == tmp_path
    ros_file_sink()(line())
    assert [path.read_text() for path in tmp_path.iterdir()] == ["<ready>\n"]


def only_text_in(folder: Path) -> str:
    (file,) = folder.iterdir()
    return file.read_text()


def test_files_lie_where_ros_2_puts_them(tmp_path: Path) -> None:
    assert log_directory({}) == Path.home() / ".ros" / "log"
    assert log_directory({"ROS_HOME": "/srv/ros"}) == Path("/srv/ros/log")
    assert log_directory({"ROS_HOME": "/srv/ros", "ROS_LOG_DIR": "~/logs"}) == Path.home() / "logs"
    folder = tmp_path / "a" / "b"
    sink = ros_file_sink("walker", {"ROS_LOG_DIR": str(folder)})
    assert not folder.exists()
    sink(line())
    sink(line(event="docked"))
    (file,) = folder.iterdir()
    assert re.fullmatch(r"walker_\d+_\d{13}\.log", file.name)
    assert [one.rpartition(": ")[2] for one in file.read_text().splitlines()] == ["ready", "docked"]


async def test_they_are_sinks_of_a_system(rig: Rig, tmp_path: Path) -> None:
    await rig.start(Node)
    rig.system.observe(lines=ros_file_sink("rig", {"ROS_LOG_DIR": str(tmp_path)}))
    rig.me.log.warning("low battery", percent=12)
    assert re.fullmatch(r"\[WARN\] \[[\d.]+\] \[rig\]: low battery percent=12\n", only_text_in(tmp_path))
