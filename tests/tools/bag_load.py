"""`python -m tests.tools.bag_load --seconds 60`: what it takes to record the running robot, from another process, on the real clock.

The robot runs in a process of its own, as `robactor run` starts it, and `bag record --all` in another one. Printed are MB a second, before
and after compression, how many messages were lost, and the share of a core that the recorder took. With `--without REGEX` topics are left
out, for instance the camera's raw pictures, for a recording of 20 minutes: `--seconds 1200 --without '^/camera/(rgb|depth|points)$'`.
"""

from __future__ import annotations

import argparse
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from actors.bag import BagReader
from tests.tools.cli_docs import ROBACTOR, Scene, running

ROBOT = Scene("the robot", ("",), ("/gait", "/motors"), ())
SUMMARY = re.compile(r"(\d+) messages recorded, (\d+) lost")


class Load(NamedTuple):
    """One recording."""

    seconds: float
    messages: int
    lost: int
    message_bytes: int
    """The size of all messages, as they were sent."""
    disk_bytes: int
    core: float
    """The CPU time of the recorder's process for each second."""

    def table(self) -> str:
        """The figures, one a line."""
        rows = (
            ("recorded", f"{self.seconds:.1f} s, {self.messages} messages"),
            ("lost", f"{self.lost}"),
            ("messages", f"{self.message_bytes / self.seconds / 1e6:.2f} MB/s"),
            ("on the disk", f"{self.disk_bytes / self.seconds / 1e6:.2f} MB/s"),
            ("share of a core", f"{self.core:.0%}"),
        )
        return "\n".join(f"{name:<16} {value}" for name, value in rows)


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures; 1 if a message was lost."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.tools.bag_load", description="What it takes to record the robot."
    )
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--without", metavar="REGEX", help="leave out these topics")
    options = parser.parse_args(argv)
    with running(ROBOT) as environment, tempfile.TemporaryDirectory() as folder:
        load = measured(Path(folder) / "walk", options.seconds, options.without, environment)
    print(f"{load.table()}\nCPython {sys.version.split()[0]}, {os.cpu_count()} cores")
    return 1 if load.lost else 0


def measured(bag: Path, seconds: float, without: str | None, environment: dict[str, str]) -> Load:
    """Record all that is sent into a bag."""
    words = [*ROBACTOR, "bag", "record", "--all", "-o", str(bag), *(["-x", without] if without else [])]
    process = subprocess.Popen(words, env=environment, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    process.stderr.readline()
    begun, spent = time.monotonic(), _cpu(process.pid)
    time.sleep(seconds)
    took, spent = time.monotonic() - begun, _cpu(process.pid) - spent
    process.send_signal(signal.SIGINT)
    told = process.communicate()[1]
    said = SUMMARY.findall(told)
    if process.returncode or not said:
        raise RuntimeError(f"bag record has ended with {process.returncode}: {told}")
    messages, lost = map(int, said[-1])
    with BagReader(bag) as read:
        sent = sum(len(message.data) for message in read.messages())
        return Load(took, messages, lost, sent, read.size, spent / took)


def _cpu(process: int) -> float:
    """The CPU time of all threads of a process so far, seconds (Linux)."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    sys.exit(main())
