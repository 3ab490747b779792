"""Short turns: what is asked of the kernel, what it says of itself, and that processes which somebody scheduled otherwise are left alone."""

from __future__ import annotations

import os
import platform
import subprocess
import sys

import pytest

from robot.link.time_slices import short_turns

linux = pytest.mark.skipif(platform.system() != "Linux", reason="the turns of Linux")
ASK = "import os\n{before}\nfrom robot.link.time_slices import short_turns\nprint(short_turns(), os.getpriority(os.PRIO_PROCESS, 0))\n{after}"


def asked(before: str = "", after: str = "") -> list[str]:
    """What a new process prints that asks for short turns: this one keeps those that it has."""
    done = subprocess.run(
        [sys.executable, "-c", ASK.format(before=before, after=after)], capture_output=True, text=True, check=True
    )
    return done.stdout.split()


def kernel() -> tuple[int, ...]:
    return tuple(int(part) for part in platform.release().split(".")[:2])


@linux
def test_a_kernel_of_6_12_or_later_gives_them_and_leaves_the_priority_as_it_is() -> None:
    if kernel() < (6, 12) or platform.machine() not in {"x86_64", "aarch64", "riscv64"}:
        pytest.skip("Linux 6.12 or later gives short turns")
    nice = os.getpriority(os.PRIO_PROCESS, 0)
    assert asked("os.nice(3)") == ["True", str(min(nice + 3, 19))]


@linux
def test_a_process_that_is_scheduled_otherwise_is_left_as_it_is() -> None:
    nice = os.getpriority(os.PRIO_PROCESS, 0)
    assert asked("os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))", "print(os.sched_getscheduler(0))") == [
        "False", str(nice), "3",
    ]  # fmt: skip


@pytest.mark.parametrize(("system", "machine"), [("Darwin", "arm64"), ("Windows", "AMD64"), ("Linux", "m68k")])
def test_where_the_call_is_not_known_nothing_is_asked(
    monkeypatch: pytest.MonkeyPatch, system: str, machine: str
) -> None:
    monkeypatch.setattr(platform, "system", lambda: system)
    monkeypatch.setattr(platform, "machine", lambda: machine)
    monkeypatch.delattr(os, "sched_getscheduler", raising=False)  # which other systems do not have
    assert not short_turns()
