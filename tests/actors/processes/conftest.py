"""Fixtures for children in processes of their own."""

from __future__ import annotations

import os
from collections.abc import Generator
from contextlib import suppress
from pathlib import Path

import pytest

from tests.actors.processes.kit import Diary, alive


def _children() -> set[int]:
    """The processes that this one has started, and that run."""
    found = set[int]()
    for thread in Path("/proc/self/task").iterdir():
        with suppress(FileNotFoundError):  # it has ended meanwhile
            found |= {int(pid) for pid in (thread / "children").read_text().split() if alive(int(pid))}
    return found


@pytest.fixture(autouse=True)
def nothing_left_running() -> Generator[None]:
    """No process that a test has started runs when it is over."""
    before, files = _children(), len(os.listdir("/proc/self/fd"))
    yield
    assert _children() <= before
    assert (
        len(os.listdir("/proc/self/fd")) <= files + 20
    )  # the transport keeps some; a channel that leaks with each life is seen


@pytest.fixture
def diary(tmp_path: Path) -> Diary:
    """The file in which all processes of the test write down what they do."""
    return Diary(tmp_path / "diary")
