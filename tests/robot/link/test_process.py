"""The process of a body, really started: it tells where it is, ends with its maker, and leaves no shared memory, however it or its maker ends."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from robot.hardware.body import BodySilent, MotorTargets
from robot.link import segment
from robot.link.process import BodyProcess
from robot.link.segment import PREFIX
from robot.scenes.worlds import get_world

ROOT = Path(__file__).parents[3]

pytestmark = pytest.mark.skipif(not Path("/dev/shm").is_dir(), reason="shared memory is looked for in /dev/shm")


def segments(pid: int) -> list[str]:
    return [path.name for path in Path("/dev/shm").glob(f"{PREFIX}{pid}-*")]


def until(true: Callable[[], bool], seconds: float = 20.0) -> bool:
    deadline = time.monotonic() + seconds
    while not true() and time.monotonic() < deadline:
        time.sleep(0.01)
    return true()


def runs(pid: int) -> bool:
    """Whether the process is there and no zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_it_samples_in_real_time_and_leaves_nothing() -> None:
    process = BodyProcess(get_world("empty"), seed=1, delay=0.004, arm=False)
    try:
        process.ready()
        process.body.advance(0.0)
        process.body.sample(200.0)
        times: list[float] = []

        def heard() -> bool:
            times.extend(sample.time for sample in iter(process.body.next_sample, None))
            return len(times) >= 20

        assert until(heard)
        np.testing.assert_allclose(np.diff(times), 0.005, atol=1e-9)
        assert len(segments(os.getpid())) == 1
    finally:
        process.close()
    assert not process.alive
    assert segments(os.getpid()) == []


def test_a_body_whose_process_is_killed_is_silent_within_a_second_and_its_memory_goes_with_its_maker() -> None:
    process = BodyProcess(get_world("empty"), seed=1, delay=0.004, arm=False)
    process.ready()
    os.kill(process.pid, signal.SIGKILL)

    def silent() -> bool:
        try:
            process.body.truth()
        except BodySilent:
            return True
        return False

    assert until(silent, 5.0)
    process.close()
    assert segments(os.getpid()) == []


def test_a_body_that_cannot_be_made_is_said_and_leaves_nothing() -> None:
    process = BodyProcess(get_world("empty"), seed=1, delay=-1.0, arm=False)
    with pytest.raises(BodySilent, match="the body's process did not start: exit code 1"):
        process.ready()
    process.close()
    assert segments(os.getpid()) == []


MAKER = """
import os, time
from robot.link import segment
from robot.link.process import BodyProcess
from robot.scenes.worlds import get_world
if __name__ == "__main__":
    process = BodyProcess(get_world("empty"), seed=1, delay=0.004, arm=False)
    for number in SIGNALS:
        os.kill(process.pid, number)
    process.ready()
    print(process.pid, flush=True)
    time.sleep(1000)
"""


@pytest.mark.parametrize(
    ("how", "at_start"),
    [(signal.SIGKILL, []), (signal.SIGTERM, [signal.SIGINT, signal.SIGTERM])],
    ids=["killed", "ended, after signals to all during the start"],
)
def test_when_its_maker_is_killed_the_body_ends_by_itself_and_no_segment_and_no_complaint_is_left(
    how: signal.Signals, at_start: list[signal.Signals], tmp_path: Path
) -> None:
    script = tmp_path / "maker.py"
    script.write_text(MAKER.replace("SIGNALS", repr([*map(int, at_start)])), encoding="utf-8")
    with subprocess.Popen(
        [sys.executable, str(script)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    ) as maker:
        assert maker.stdout is not None and maker.stderr is not None
        pid = int(maker.stdout.readline())
        assert segments(maker.pid)
        maker.send_signal(how)
        maker.wait()
        assert maker.stderr.read() == ""  # Python's resource tracker would complain
    assert until(lambda: not runs(pid))
    assert until(lambda: segments(maker.pid) == [])


def test_what_a_maker_left_that_was_killed_with_all_its_helpers_is_removed_by_the_next() -> None:
    left = Path(f"/dev/shm/{PREFIX}999999999-0")
    left.write_bytes(b"\0" * 64)
    process = BodyProcess(get_world("empty"), seed=1, delay=0.004, arm=False)
    process.close()
    assert not left.exists()


def test_targets_reach_the_drives_of_a_real_process() -> None:
    process = BodyProcess(get_world("empty"), seed=1, delay=0.004, arm=False)
    try:
        process.ready()
        up = MotorTargets(
            np.tile((0.0, 0.9, -1.6), 4), np.zeros(12), np.zeros(12), np.full(12, 250.0), np.full(12, 6.0)
        )
        deadline = time.monotonic() + 10.0
        while process.body.truth().position[2] < 0.3 and time.monotonic() < deadline:
            process.body.command(up)
            time.sleep(0.01)
        assert process.body.truth().position[2] > 0.3
        assert until(lambda: process.body.truth().position[2] < 0.2, 5.0)  # and without any the drives sit it down
    finally:
        process.close()


def test_a_signal_that_comes_while_it_is_closed_waits_until_its_memory_is_gone(monkeypatch: pytest.MonkeyPatch) -> None:
    process = BodyProcess(get_world("empty"), seed=1, delay=0.004, arm=False)
    kill = process._process.kill

    def interrupted() -> None:
        signal.raise_signal(signal.SIGTERM)
        kill()

    monkeypatch.setattr(process._process, "kill", interrupted)
    before = signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(128 + number))
    try:
        with pytest.raises(SystemExit, match="143"):
            process.close()
    finally:
        signal.signal(signal.SIGTERM, before)
    assert segments(os.getpid()) == []


CLOSING = """
import os, signal, threading, time
from cli.starting import end_at_signals
from robot.link.process import BodyProcess
from robot.scenes.worlds import get_world
if __name__ == "__main__":
    end_at_signals()
    process = BodyProcess(get_world("empty"), seed=1, delay=0.004, arm=False)
    threading.Thread(target=time.sleep, args=(1000,), daemon=True).start()
    kill = process._process.kill
    def interrupted():
        kill()
        os.kill(os.getpid(), signal.SIGTERM)
    process._process.kill = interrupted
    process.close()
"""


def test_a_signal_that_another_thread_takes_while_it_is_closed_leaves_nothing(tmp_path: Path) -> None:
    script = tmp_path / "closing.py"
    script.write_text(CLOSING, encoding="utf-8")
    with subprocess.Popen(
        [sys.executable, str(script)], stderr=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": str(ROOT)}
    ) as maker:
        assert maker.communicate()[1] == ""
    assert maker.returncode == 143
    assert segments(maker.pid) == []


def test_shared_memory_that_the_machine_does_not_have_is_refused_and_not_left_behind() -> None:
    free = os.statvfs("/dev/shm")
    things = 2 * free.f_frsize * free.f_bavail // (segment.THING * segment.STATE_SLOTS)
    with pytest.raises(segment.SharedMemoryMissing, match="No space left on device"):
        segment.create(things)
    assert segments(os.getpid()) == []
