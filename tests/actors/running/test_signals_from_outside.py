"""What a service manager, a terminal and a pipe do to a program: what it hears as one signal, and how it ends."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path
from typing import IO

import pytest

ROOT = Path(__file__).parents[3]

PRELUDE = """
import asyncio, os, re, signal, sys, time
from actors import Child, Node, Supervisor, every, execute, run
from actors.logs import console_sink

def say(*words):
    print(*words, file=sys.stderr, flush=True)

class Robot(Node):
    async def on_start(self):
        say("ready")

    async def on_stop(self, reason):
        say("brakes:", reason.why)
        await asyncio.sleep(0.3)
        say("sits")

async def main(*more):
    async with run(Supervisor("top", children=[Child(Robot), *more]), sinks=()) as system:
        await system.wait()
    return system.exit_code
"""


def program(tmp_path: Path, body: str, *before: str, stdout: int | IO[str] = subprocess.PIPE) -> subprocess.Popen[str]:
    """Start a program; the line "ready" of its standard error has been read."""
    file = tmp_path / "program.py"
    file.write_text(PRELUDE + textwrap.dedent(body), encoding="utf-8")
    started = subprocess.Popen(
        [*before, sys.executable, "-W", "error", str(file)], stdin=subprocess.DEVNULL, stdout=stdout, stderr=subprocess.PIPE,
        text=True, env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert started.stderr is not None
    while started.stderr.readline() not in ("ready\n", ""):
        pass
    return started


def ended(started: subprocess.Popen[str]) -> tuple[int, list[str]]:
    """The exit code of a program, and what it has said since it was ready."""
    assert started.stderr is not None
    with started:
        said = started.stderr.read().splitlines()
        return started.wait(60), said


WAITS = "sys.exit(execute(main))"
INT, TERM, HUP = signal.SIGINT, signal.SIGTERM, signal.SIGHUP


@pytest.mark.parametrize("numbers", [(TERM, TERM), (INT, TERM), (INT, INT, INT, INT), (HUP, TERM)])
def test_signals_that_come_together_are_one_and_do_not_cut_the_end_short(
    numbers: tuple[signal.Signals, ...], tmp_path: Path
) -> None:
    started = program(tmp_path, WAITS)
    for number in numbers:
        started.send_signal(number)
        time.sleep(0.02)
    code, said = ended(started)
    assert code in {128 + number for number in numbers}
    assert said[1:] == ["sits"]


def test_a_closed_terminal_is_a_signal_like_others(tmp_path: Path) -> None:
    started = program(tmp_path, WAITS)
    started.send_signal(HUP)
    assert ended(started) == (129, ["brakes: SIGHUP", "sits"])


def test_a_program_of_nohup_goes_on_without_its_terminal_and_its_reader(tmp_path: Path) -> None:
    started = program(tmp_path, WAITS, "sh", "-c", 'trap "" HUP; exec "$@"', "sh")
    started.send_signal(HUP)
    assert started.stdout is not None
    started.stdout.close()
    time.sleep(0.7)  # what comes together is one signal
    assert started.poll() is None
    started.send_signal(TERM)
    assert ended(started) == (143, ["brakes: SIGTERM", "sits"])


def test_when_its_reader_goes_a_program_ends_in_order_and_prints_into_the_void(tmp_path: Path) -> None:
    body = """
        class Talker(Node):
            @every(hz=50)
            def talk(self):
                print("hello", flush=True)

        sys.exit(execute(lambda: main(Child(Talker))))
    """
    started = program(tmp_path, body)
    assert started.stdout is not None
    assert started.stdout.readline() == "hello\n"
    started.stdout.close()
    assert ended(started) == (141, ["brakes: SIGPIPE", "sits"])


def test_a_pipe_that_the_program_reads_itself_is_no_reader_that_has_gone(tmp_path: Path) -> None:
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo)
    with open(os.open(fifo, os.O_RDWR), "w") as both:
        body = "print('something to read', flush=True)\n" + WAITS
        started = program(tmp_path, body, stdout=both)
        time.sleep(0.2)
        assert started.poll() is None
        started.send_signal(INT)
        assert ended(started) == (130, ["brakes: SIGINT", "sits"])


HANGS = {
    "sleep": "time.sleep(3600)",
    "loop": "while True: pass",
    "match": "re.match('[a-z](_?[a-z0-9]+)*$', 60 * 'a' + '!')",
    "read": "os.read(os.pipe()[0], 1)",
    "lock": "import threading; lock = threading.Lock(); lock.acquire(); lock.acquire()",
}


@pytest.mark.parametrize("how", HANGS)
def test_a_second_signal_ends_a_program_whose_loop_hangs_and_says_where(how: str, tmp_path: Path) -> None:
    body = f"""
        class Stuck(Node):
            @every(hz=100)
            def work(self):
                say("hangs")
                {HANGS[how]}

        execute(lambda: main(Child(Stuck)))
    """
    started = program(tmp_path, body)
    assert started.stderr is not None
    while started.stderr.readline() != "hangs\n":
        pass
    started.send_signal(TERM)
    time.sleep(0.05)
    started.send_signal(TERM)  # the same one
    time.sleep(0.6)
    assert started.poll() is None, "the first one has not been heard yet, and may be"
    started.send_signal(TERM)
    code, said = ended(started)
    assert code == 143
    assert len(said) == 1
    assert "program.py: ended by SIGTERM: the event loop has not turned for" in said[0]
    assert "program.py:" in said[0].rpartition("s, at ")[2] and said[0].endswith("in Stuck.work")


def test_a_signal_while_a_program_imports_leaves_no_trace(tmp_path: Path) -> None:
    body = """
        import actors.runtime.preload as module
        def importing(**options):
            try:
                say("ready")
                time.sleep(60)
            finally:
                say("unwound")
        module.preload = importing
        execute(main)
    """
    started = program(tmp_path, body)
    started.send_signal(INT)
    assert ended(started) == (130, ["unwound"])
