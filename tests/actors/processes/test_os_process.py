"""`OsProcess` watches a real process: whatever program it runs. And one whole process, from its launch to its orderly end."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import subprocess
import time
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader

from actors import Child, Node, Service, Supervisor, Topic, every, open_node, publishes, run
from actors.bag import FlightRecorder
from actors.errors import ProcessDied, ProcessHung
from actors.interfaces.std_msgs.msg import Int32
from actors.interfaces.std_srvs.srv import Trigger
from actors.logs import LogRecord
from actors.processes import os_process
from actors.processes.channel import framed
from actors.processes.flight_records import makers, save
from actors.processes.messages import BEAT, Line, Order, Ready, StopAsked, beat_seconds, next_beat
from actors.processes.os_process import OsProcess, spawn
from actors.processes.signals import PARENT
from actors.time.processor import Share
from actors.transport.zenoh import ZenohTransport
from tests.actors.processes.kit import alive, until


class Quiet(Node):
    """Does nothing but exist."""


class Program:
    """A program of the shell as the process of a child, with this test at the other end of its channel."""

    def __init__(self, program: str, hang: float = 5.0) -> None:
        self.events: list[Any] = []
        popen = subprocess.Popen(["/bin/sh", "-c", program])
        self.notes, self.noting = os.pipe()
        self.process = OsProcess(popen, ("top", "quiet"), hang, self.events.append, self.notes)
        self.ours, self.theirs = socket.socketpair()

    async def open(self) -> OsProcess:
        await self.process.connect(self.ours, b"first")
        assert self.theirs.recv(5) == b"first"
        return self.process

    def say(self, event: object) -> None:
        self.theirs.sendall(framed(event))

    def close(self) -> None:
        self.theirs.close()
        os.close(self.noting)


async def ended(program: Program) -> str:
    """How its process has ended, in words; it is told when all has been read."""
    error = await asyncio.wait_for(asyncio.shield(program.process.ended), 30.0)
    assert isinstance(error, ProcessDied)
    assert error.process == program.process.id
    return error.how


@pytest.mark.parametrize("descriptors", [True, False])
@pytest.mark.parametrize(
    ("program", "how"),
    [
        ("sleep 0.1; exit 3", "exit code 3"),
        ("kill -TERM $$", "signal SIGTERM"),
        ("kill -KILL $$", "signal SIGKILL, which the system sends when memory runs out"),
        ("kill -40 $$", "signal 40"),
    ],
)
async def test_the_end_of_a_process_is_seen_with_its_cause(
    monkeypatch: pytest.MonkeyPatch, program: str, how: str, descriptors: bool
) -> None:
    if not descriptors:
        monkeypatch.delattr(os, "pidfd_open")
    running = Program(program)
    process = await running.open()
    running.say(Ready())
    running.close()
    assert await ended(running) == how
    assert running.events == [Ready()]  # what it had told before is not lost
    process.kill()
    process.terminate()
    process.send(StopAsked("too late"))
    assert repr(process) == f"<process {process.id} of top/quiet>"


async def test_a_channel_that_a_forked_process_holds_does_not_hide_the_end() -> None:
    running = Program("exit 0")
    await running.open()
    assert await ended(running) == "exit code 0"
    running.close()


async def test_a_process_that_has_closed_its_channel_is_given_a_second(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os_process, "CLOSED_SECONDS", 0.05)
    running = Program("exec sleep 1000")
    await running.open()
    running.close()
    assert (await ended(running)).startswith("signal SIGKILL")


async def test_a_process_without_beats_is_named_and_killed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os_process, "NAMED_SECONDS", 0.1)
    running = Program("exec sleep 1000", hang=0.3)
    process = await running.open()
    process.watch()
    os.write(running.noting, b"what it did before\n/quiet Quiet.tick at quiet.py:3\n")
    error = await asyncio.wait_for(process.ended, 30.0)
    assert isinstance(error, ProcessHung)
    assert (error.seconds, error.where) == (0.3, "/quiet Quiet.tick at quiet.py:3")
    (line,) = running.events
    assert isinstance(line, Line)
    assert (line.node, line.fields["doing"]) == ("top/quiet", "/quiet Quiet.tick at quiet.py:3")
    running.close()


async def test_a_process_that_beats_again_in_time_lives(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os_process, "LATEST_SECONDS", 0.25)
    running = Program("exec sleep 1000", hang=30.0)
    process = await running.open()
    process.watch()
    os.write(running.noting, BEAT)
    await until(lambda: len(running.events) == 1)
    assert running.events[0].fields["doing"] == "not known"
    os.write(running.noting, b"/quiet what it was doing\n" + BEAT)
    await until(lambda: len(running.events) == 2)
    assert running.events[1].event == "event loop turns again"
    assert alive(process.id)
    process.terminate()
    running.close()
    assert await ended(running) == "signal SIGUSR1"


async def test_time_for_which_a_process_has_no_processor_does_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    """It could run and does not, for five beats; for five it has most of its time; then it sleeps, which is what hanging is."""
    runnable = True
    monkeypatch.setattr(os_process, "is_runnable", lambda process: runnable)
    running = Program("exec sleep 1000", hang=0.6)
    process = await running.open()
    period = process._period
    shares = [Share(1.0, 1.0)] * 6 + [Share(1.0, 1.0 + 0.4 * period * n) for n in range(1, 6)]
    silent: list[float] = []

    def share() -> Share:
        nonlocal runnable
        silent.append(process._silent)
        runnable = len(silent) < len(shares)
        return shares[min(len(silent), len(shares) - 1)]

    monkeypatch.setattr(process, "_share", shares[0])
    monkeypatch.setattr(process._processor, "share", share)
    process.watch()
    error = await asyncio.wait_for(process.ended, 30.0)
    assert isinstance(error, ProcessHung)
    assert silent[5] == 0.0
    assert silent[10] == pytest.approx(5 * 0.6 * period)
    assert silent[11] - silent[10] == pytest.approx(period)
    running.close()


async def test_a_parent_whose_own_loop_stands_still_blames_nobody() -> None:
    running = Program("exec sleep 1000", hang=0.2)
    process = await running.open()
    process.watch()
    for _ in range(3):
        time.sleep(0.3)  # noqa: ASYNC251  # meanwhile the process beats
        os.write(running.noting, BEAT)
        await asyncio.sleep(0.01)
    assert alive(process.id)
    process.unwatch()
    process.unwatch()
    process.kill()
    running.close()
    await ended(running)


async def test_notes_end_with_the_process() -> None:
    running = Program("exec sleep 1000")
    process = await running.open()
    os.close(running.noting)
    process.watch()
    await asyncio.sleep(0.2)  # the end of the pipe is read, more than once
    process.kill()
    running.theirs.close()
    await ended(running)


def test_beats_are_as_frequent_as_the_hang_demands() -> None:
    assert beat_seconds(0.1) == pytest.approx(0.02)
    assert beat_seconds(5.0) == 0.1


def test_beats_of_all_processes_are_looked_for_in_the_same_turns() -> None:
    assert next_beat(12.34, 0.1) == pytest.approx(12.4)
    assert next_beat(12.36, 0.1) == pytest.approx(12.5)  # at least half a period later
    assert next_beat(12.3999999, 0.1) == pytest.approx(12.5)  # a timer that fires a little early
    assert next_beat(12.41, 0.02) == pytest.approx(12.42)


async def test_a_program_that_cannot_be_started_leaves_nothing_open(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.executable", "/nowhere/python")
    before = len(os.listdir("/proc/self/fd"))
    with pytest.raises(FileNotFoundError):
        await spawn(Order(Child(Quiet), ("top", "quiet"), 0, 20, None, ZenohTransport, 0), lambda event: None)
    assert len(os.listdir("/proc/self/fd")) == before


DO = Service(Trigger, "do")
TICKS = Topic(Int32, "ticks")


class Servant(Node):
    ticks = publishes(TICKS)

    @every(hz=50)
    def tick(self) -> None:
        self.ticks(Int32(data=1))

    @DO.serve()
    async def do(self, request: Any) -> Any:
        return Trigger.Response(success=True, message=str(os.getpid()))


async def test_a_whole_process_from_its_launch_to_its_orderly_end() -> None:
    async with run(Supervisor("top", children=[Child(Servant, process=True)]), signals=False, sinks=()) as system:
        process = system.nodes["top", "servant"].process
        async with open_node("asker", system=system) as asker:
            assert (await asker.call(DO, Trigger.Request(), timeout=30.0)).message == str(process)
        system.kill_process("servant")
        await until(lambda: system.nodes["top", "servant"].incarnation == 2)
        await until(lambda: system.nodes["top", "servant"].state == "running")
        second = system.nodes["top", "servant"].process
        assert second != process
    assert not alive(process)
    assert not alive(second)
    assert signal.getsignal(PARENT) == signal.SIG_DFL  # what a process does with signals, its parent does not


async def test_the_flight_record_of_a_process_whose_child_fails_is_written_and_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    lines: list[LogRecord] = []
    tree = Supervisor("top", children=[Child(Servant, process=True)])
    async with run(tree, signals=False, sinks=(lines.append,), observers=(FlightRecorder(),)) as system:
        async with open_node("asker", system=system) as asker:
            await asker.subscribe(TICKS).next(timeout=30.0)
        system.crash("servant", OSError("broken"))
        await until(lambda: [line for line in lines if line.event == "flight record of a process"])
        (line,) = (line for line in lines if line.event == "flight record of a process")
        file = Path(line.fields["file"])
        assert file.parent == tmp_path
        await until(lambda: system.nodes["top", "servant"].incarnation == 2)
    summary = make_reader(BytesIO(file.read_bytes())).get_summary()  # noqa: ASYNC240
    assert summary is not None
    topics = {channel.topic for channel in summary.channels.values()}
    assert {"/ticks", "/rosout"} <= topics


def test_a_flight_record_that_cannot_be_written_says_why() -> None:
    class Full:
        def attach(self, system: object) -> None: ...

        def dump(self, path: object, *, notes: object = None) -> Path:
            raise OSError("disk full")

    assert list(save([Full()], ("top", "a"), "why")) == ["could not be written: disk full"]
    assert makers([Full(), FlightRecorder(seconds=5.0)])[0]().dump  # only what asks for it is made for processes
    assert len(makers([Full()])) == 0


def test_an_interpreter_that_dies_before_it_has_its_preparation_leaves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    died: list[os_process.Started] = []
    start = os_process.start

    def start_dead(name: str, *, fenced: bool) -> os_process.Started:
        started = start(name, fenced=fenced)
        started.popen.kill()
        started.popen.wait()
        died.append(started)
        return started

    monkeypatch.setattr(os_process, "start", start_dead)
    with pytest.raises(OSError):
        os_process.prepared("tree/a", framed("first"), fenced=False)
    (started,) = died
    assert started.channel.fileno() == -1
    with pytest.raises(OSError):
        os.fstat(started.notes)
