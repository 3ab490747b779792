"""`python -m tests.memory`: what a command and all that it starts take."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests import memory

pytestmark = pytest.mark.skipif(not Path("/proc/self/smaps_rollup").exists(), reason="the kernel tells it there")

TAKES = "import time; held = bytearray(b'x') * {megabytes}_000_000; time.sleep(1.0)"
STARTS = f"import subprocess, sys; held = bytearray(b'x') * 100_000_000; sys.exit(subprocess.call([sys.executable, '-c', {TAKES.format(megabytes=200)!r}]))"


def measured(printed: str) -> tuple[float, int]:
    """Gigabytes, and processes."""
    found = re.fullmatch(r"at most ([0-9.]+) GB in (\d+) processes at a time\n", printed)
    assert found, printed
    return float(found[1]), int(found[2])


def test_the_memory_of_all_processes_of_a_command_counts(capfd: pytest.CaptureFixture[str]) -> None:
    assert memory.main([sys.executable, "-c", STARTS]) == 0
    gigabytes, processes = measured(capfd.readouterr().out)
    assert 0.30 <= gigabytes < 0.40
    assert processes == 2


def test_more_than_the_limit_and_a_command_that_fails_are_told_by_the_exit_code(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    assert memory.main([sys.executable, "-c", "import sys; sys.exit(3)"]) == 3
    monkeypatch.setattr(memory, "LIMIT", 150_000_000)
    assert memory.main([sys.executable, "-c", TAKES.format(megabytes=200)]) == 1
    assert "at most 0.2" in capfd.readouterr().out


def test_a_process_that_has_ended_takes_nothing() -> None:
    with subprocess.Popen([sys.executable, "-c", ""]) as process:
        process.wait()
    assert memory.taken({process.pid}) == 0
