"""Log lines: what is in them, where they go, and that they never hurt who writes them."""

from __future__ import annotations

import asyncio
import io
import json
import sys
from typing import Any

import pytest
import structlog

from actors import Child, Intensity, Node, Stop, Supervisor, SupervisorGaveUp, System
from actors.checks import create
from actors.logs import (
    DEBUG,
    ERROR,
    FATAL,
    INFO,
    WARN,
    LogRecord,
    NodeLog,
    console_sink,
    json_sink,
    structlog_sink,
)
from actors.logs.levels import LevelTree
from actors.supervision.report import Report
from actors.testing import Rig, VirtualLoop
from actors.time.clock import Clock


def record(level: int = INFO, incarnation: int = 1, **fields: Any) -> LogRecord:
    return LogRecord(12.3456789, level, "/base/gait", incarnation, "step taken", fields)


def test_a_record_reads_as_one_line() -> None:
    assert repr(record(leg=3, side="left")) == "[    12.346] info /base/gait: step taken leg=3 side='left'"
    assert repr(LogRecord(0.0, 15, "n", 1, "odd", {})) == "[     0.000] 15 n: odd"


def test_a_nodes_log_has_five_levels_and_writes_from_its_own_upwards() -> None:
    loop = VirtualLoop()
    written: list[LogRecord] = []
    log = create(NodeLog, "/gait", 2, create(Clock, loop, virtual=True), written.append, LevelTree(WARN))
    for write in (log.debug, log.info, log.warning, log.warn, log.error, log.fatal):
        write("said", word="x")
    assert [line.level for line in written] == [WARN, WARN, ERROR, FATAL]
    assert [(line.node, line.incarnation, line.event, line.time) for line in written] == [("/gait", 2, "said", 0.0)] * 4
    log.level = DEBUG
    log.debug("said", event="a field of that name is fine", time=3.2)
    assert written[-1].fields == {"event": "a field of that name is fine", "time": 3.2}
    loop.close()


def test_lines_of_json_are_objects_with_everything() -> None:
    out = io.StringIO()
    write = json_sink(out, level=INFO)
    write(record(WARN, 3, leg=3, raw=b"x"))
    write(record(DEBUG))
    assert [json.loads(line) for line in out.getvalue().splitlines()] == [
        {
            "time": 12.345679, "level": "warning", "node": "/base/gait", "life": 3, "event": "step taken", "leg": 3, "raw": "b'x'",
        }
    ]  # fmt: skip


def test_json_goes_to_standard_error_by_default(capsys: pytest.CaptureFixture[str]) -> None:
    json_sink()(record())
    assert json.loads(capsys.readouterr().err)["event"] == "step taken"


def test_lines_for_people_have_time_level_node_event_and_fields() -> None:
    out = io.StringIO()
    write = console_sink(out, level=INFO)
    write(record(leg=3))
    write(record(ERROR, 2))
    write(record(DEBUG))
    first, second = out.getvalue().splitlines()
    assert first.startswith("   12.346 [info     ] step taken")
    assert first.endswith("[/base/gait] leg=3")
    assert "life=2" in second


def test_a_character_that_the_terminal_lacks_never_fails() -> None:
    raw = io.BytesIO()
    out = io.TextIOWrapper(raw, encoding="ascii")
    console_sink(out)(record(name="Müller"))
    out.flush()
    assert b"M?ller" in raw.getvalue()


@pytest.mark.parametrize("name", ["time", "level", "node", "life", "event", "logger"])
def test_a_field_named_like_the_lines_own_steps_aside(name: str) -> None:
    line = LogRecord(12.3456789, INFO, "/base/gait", 1, "step taken", {name: "mine"})
    with structlog.testing.capture_logs() as captured:
        structlog_sink(line)
    assert captured[0][f"{name}_"] == "mine"
    out = io.StringIO()
    json_sink(out)(line)
    shown = json.loads(out.getvalue())
    assert (shown[f"{name}_"], shown["time"], shown["node"]) == ("mine", 12.345679, "/base/gait")
    out = io.StringIO()
    console_sink(out)(line)
    assert f"{name}_=mine" in out.getvalue()


def test_without_a_configuration_of_structlog_the_lines_are_those_of_a_program(
    capsys: pytest.CaptureFixture[str],
) -> None:
    structlog.reset_defaults()
    structlog_sink(record(INFO, leg=3))
    plain = capsys.readouterr().out
    console_sink(sys.stdout)(record(INFO, leg=3))
    assert plain == capsys.readouterr().out != ""


@pytest.mark.parametrize(("level", "word"), [(DEBUG, "debug"), (WARN, "warning"), (FATAL, "critical")])
def test_structlog_gets_the_line_as_the_program_configured_it(level: int, word: str) -> None:
    with structlog.testing.capture_logs() as captured:
        structlog_sink(record(level, leg=3))
    assert captured == [
        {"event": "step taken", "log_level": word, "node": "/base/gait", "time": 12.345679, "life": 1, "leg": 3}
    ]


async def test_every_line_of_a_node_has_its_name_time_and_incarnation(rig: Rig) -> None:
    class Talkative(Node):
        async def on_start(self) -> None:
            self.log.info("awake", mood="good")

    await rig.start(Talkative)
    await rig.advance(1.5)
    rig.crash(Talkative)
    await rig.settled()
    lines = [line for line in rig.logs if line.event == "awake"]
    assert [(line.node, line.time, line.incarnation, line.fields) for line in lines] == [
        ("/talkative", 0.0, 1, {"mood": "good"}), ("/talkative", 1.5, 2, {"mood": "good"}),
    ]  # fmt: skip


@pytest.mark.virtual
async def test_a_sink_that_fails_hurts_nobody_and_further_sinks_get_the_line() -> None:
    heard: list[str] = []
    problems: list[dict[str, Any]] = []

    def broken(line: LogRecord) -> None:
        raise BrokenPipeError("nobody reads any more")

    asyncio.get_running_loop().set_exception_handler(lambda loop, context: problems.append(context))
    system = create(System, sinks=(broken,), level=DEBUG)
    system.observe(lines=lambda line: heard.append(line.event))
    await system.start(Supervisor("system"))
    system.log.info("still here")
    await system.stop()
    assert heard == ["still here"]
    assert "the log sink" in problems[0]["message"]
    assert isinstance(problems[0]["exception"], BrokenPipeError)


@pytest.mark.virtual
async def test_a_report_below_the_level_of_the_system_is_kept_and_told_but_not_logged() -> None:
    told: list[Report] = []
    lines: list[LogRecord] = []
    system = create(System, sinks=(lines.append,), level=ERROR)
    system.observe(reports=told.append)
    await system.start(Supervisor("system", children=[Child(Node, name="node")], intensity=Intensity(1, within=10.0)))
    state = system.nodes["system", "node"]
    told.clear()
    assert state.running is not None
    state.running.fail(Stop("enough"), "the test")
    while state.incarnation == 1 or state.running is None:
        await asyncio.sleep(0.1)
    assert [report.context for report in told] == ["child_terminated", "progress"]
    assert list(system.reports)[-2:] == told
    assert lines == [] == list(system.records), "a warning, and news"
    state.running.fail(OSError("a loose wire"), "the test")
    with pytest.raises(SupervisorGaveUp):
        await system.wait()
    assert [line.event for line in lines] == ["child terminated", "system gives up: restart intensity reached"], (
        "errors"
    )
    await system.stop()
