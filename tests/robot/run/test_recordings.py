"""The black box of `python -m robot run`: its flight record and its trace."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader

from actors import Node
from actors.interfaces import decode, get_message
from actors.testing import Rig
from robot.run.judge import Score
from robot.run.options import parse
from robot.run.recordings import Recordings
from tests import warm

ROOT = Path(__file__).parents[3]
KINEMATIC = ("run", "--clock", "virtual", "--backend", "kinematic", "--seed", "1")


def command(*words: str) -> list[str]:
    return [sys.executable, "-m", "robot", *words]


def environment(hash_seed: str = "random") -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", "PYTHONHASHSEED": hash_seed}


def robot(*words: str, hash_seed: str | None = None) -> subprocess.CompletedProcess[str]:
    if hash_seed is None:
        return warm.run(*words)
    return subprocess.run(
        command(*words), cwd=ROOT, env=environment(hash_seed), capture_output=True, text=True, timeout=300
    )


def record(path: Path) -> tuple[list[tuple[str, Any]], dict[str, str]]:
    """(topic, message) of everything in a file, and what the file says of itself."""
    with path.open("rb") as stream:
        reader = make_reader(stream)
        messages = [
            (channel.topic, decode(get_message(schema.name), raw.data))
            for schema, channel, raw in reader.iter_messages()
            if schema is not None
        ]
        return messages, next(one.metadata for one in reader.iter_metadata())


def trace_on_a_terminal(*words: str) -> str:
    """The trace that a run prints whose log goes to a terminal."""
    terminal, inner = os.openpty()
    with subprocess.Popen(
        command(*words), cwd=ROOT, env=environment(), stdout=subprocess.PIPE, stderr=inner, text=True
    ) as process:
        os.close(inner)
        shown = b""
        try:
            while data := os.read(terminal, 65536):
                shown += data
        except OSError:  # how a terminal on Linux says that nobody is there any more
            pass
        assert process.stdout is not None
        printed = process.stdout.read()
    os.close(terminal)
    assert b"\x1b[2K" in shown  # the status line that renews itself
    return printed


# -- the trace ------------------------------------------------------------------------------------------------------------------


def test_a_run_has_the_same_trace_in_every_process_and_on_a_terminal(tmp_path: Path) -> None:
    report = tmp_path / "report.json"
    words = (*KINEMATIC, "--duration", "3", "--trace")
    first = robot(*words, "--report", str(report), hash_seed="1")
    assert first.returncode == 0, first.stderr
    label, trace = first.stdout.split()
    assert (label, len(trace)) == ("trace", 64)
    assert json.loads(report.read_text(encoding="utf-8"))["trace"] == trace
    assert robot(*words, "--log-format", "json", hash_seed="2").stdout == first.stdout
    assert trace_on_a_terminal(*words) == first.stdout


def test_a_run_with_another_seed_has_another_trace() -> None:
    words = (*KINEMATIC, "--duration", "1", "--trace")
    assert robot(*words).stdout == robot(*words).stdout != robot(*words, "--seed", "2").stdout


def test_there_is_no_trace_on_the_real_clock() -> None:
    done = robot("run", "--trace")
    assert (done.returncode, done.stdout) == (2, "")
    assert "--trace: two runs are equal on the virtual clock only; add --clock virtual" in done.stderr


@pytest.mark.slow(reason="five minutes of the robot")
@pytest.mark.parametrize("backend", ["kinematic", "physics"])
def test_a_minute_has_the_same_trace_five_times(backend: str) -> None:
    words = ("run", "--clock", "virtual", "--backend", backend, "--seed", "1", "--duration", "60", "--trace")
    traces = [robot(*words).stdout for _ in range(5)]
    assert traces == [traces[0]] * 5
    assert len(traces[0].split()[1]) == 64


# -- the flight record ----------------------------------------------------------------------------------------------------------


def test_at_the_end_of_a_run_its_last_seconds_are_in_the_file(tmp_path: Path) -> None:
    path, report = tmp_path / "flight.mcap", tmp_path / "report.json"
    done = robot(*KINEMATIC, "--duration", "2", "--flight-record", str(path), "--report", str(report))
    assert done.returncode == 0, done.stderr
    assert f"flight record: {path} (the run ended)" in done.stderr
    told = json.loads(report.read_text(encoding="utf-8"))
    assert (told["flight_record"], told["flight_record_of"]) == (str(path), "the run ended")
    messages, facts = record(path)
    assert (facts["why"], facts["seed"], facts["lost"], facts["unencodable"]) == ("the run ended", "1", "0", "0")
    counted = {row["name"]: row["messages"] for row in told["topics"] if row["messages"]}
    recorded = {topic for topic, _ in messages}
    assert recorded >= {*counted, "/rosout", "/supervisor_events"}
    assert sum(topic == "/map" for topic, _ in messages) == counted["/map"] == 1
    assert sum(topic == "/lidar/scan" for topic, _ in messages) >= counted["/lidar/scan"] > 0
    assert any(topic == "/rosout" and "braking and sitting down" in message.msg for topic, message in messages)


def test_a_supervisor_that_gives_up_leaves_the_record_of_why(tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"
    crashes = [word for at in ("1", "1.2", "1.4", "1.6") for word in ("--crash", f"navigation@{at}")]
    done = robot(*KINEMATIC, "--duration", "10", "--flight-record", str(path), "--log-format", "json", *crashes)
    assert done.returncode == 3, done.stderr
    messages, facts = record(path)
    assert facts["why"].startswith("SupervisorGaveUp: ")
    assert "flight record" not in done.stderr  # lines of JSON stay lines of JSON
    ends = [message for topic, message in messages if topic == "/supervisor_events" and message.reason]
    terminated = [(end.child, end.reason) for end in ends if end.context == "child_terminated"]
    assert (
        terminated[:-1] == [("robot/navigation/navigation", "it raised RuntimeError: crashed on request (--crash)")] * 4
    )
    concern, reason = terminated[-1]
    assert concern == "robot/navigation"
    assert "supervisor robot/navigation gave up: restart intensity reached: navigation needs another restart" in reason
    assert ends[-1].context == "shutdown"


def test_a_record_that_has_no_place_is_refused_before_the_run(tmp_path: Path) -> None:
    done = robot(*KINEMATIC, "--flight-record", str(tmp_path / "nowhere" / "flight.mcap"))
    assert done.returncode == 2
    assert "--flight-record" in done.stderr
    assert "there is no folder" in done.stderr


async def test_after_a_fall_the_record_is_that_of_the_fall(rig: Rig, tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"
    score = Score()
    flight = Recordings(parse(["--flight-record", str(path)]), score)
    for observer in flight.observers:
        rig.observe(observer)
    await rig.start(Node)
    log = rig.me.log
    log.info("walking")
    flight.look()
    log.info("slipping")
    score.falls = 1
    flight.look()
    log.info("lying")
    score.falls = 2
    flight.look()
    assert flight.conclude(quiet=True) == {"flight_record": str(path), "flight_record_of": "the robot fell"}
    messages, facts = record(path)
    assert [line.msg for topic, line in messages if topic == "/rosout" and line.name == "rig"] == [
        "walking",
        "slipping",
    ]
    assert facts["why"] == "the robot fell"


async def test_a_full_disk_does_not_spoil_the_rest(
    rig: Rig, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "unplugged"
    folder.mkdir()
    options = parse(["--flight-record", str(folder / "flight.mcap"), "--clock", "virtual", "--trace"])
    flight = Recordings(options, Score())
    for observer in flight.observers:
        rig.observe(observer)
    await rig.start(Node)
    folder.rmdir()
    words = flight.conclude(quiet=False)
    shown = capsys.readouterr()
    assert shown.out == f"trace {words['trace']}\n"
    assert "robot run: --flight-record " in shown.err
    assert list(words) == ["trace"]


def test_spans_of_a_run_are_given_to_the_provider_of_the_program() -> None:
    program = """
from opentelemetry import trace
from opentelemetry.sdk.trace import TracerProvider
from opentelemetry.sdk.trace.export import SimpleSpanProcessor
from opentelemetry.sdk.trace.export.in_memory_span_exporter import InMemorySpanExporter

exporter = InMemorySpanExporter()
provider = TracerProvider()
provider.add_span_processor(SimpleSpanProcessor(exporter))
trace.set_tracer_provider(provider)

from robot.run.command import main

main(["--clock", "virtual", "--backend", "kinematic", "--seed", "1", "--duration", "5", "--spans"])
print(*sorted({span.name for span in exporter.get_finished_spans()}))
"""
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, env=environment(), capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    assert {"/spot/stand", "/spot/walk", "/navigate_to_pose"} <= set(done.stdout.splitlines()[-1].split())
