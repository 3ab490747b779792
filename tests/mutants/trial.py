"""The trial of a mutant: the tests of its subject run against a copy of the project in which one file is the mutant's."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import IO, Final, Literal

from tests.mutants.mutate import Mutant

__all__ = ["SUBJECTS", "Fate", "Subject", "Workshop"]

Fate = Literal["killed", "timed out", "survived"]
MEMORY: Final = 4 * 2**30
"""Bytes that a mutant may take before it is stopped."""


@dataclass(frozen=True)
class Subject:
    """What is mutated together, and the tests that must notice: arguments of pytest, the quickest to find something first.

    Names of files may hold asterisks.
    """

    files: tuple[str, ...]
    tests: tuple[str, ...]


SUBJECTS: Final = {
    "channel": Subject(("actors/channel.py",), ("tests/scenarios/test_topics.py",)),
    "services": Subject(
        ("actors/services.py",), ("tests/scenarios/test_services.py", "tests/scenarios/test_derived.py")
    ),
    "actions": Subject(
        ("actors/actions.py", "actors/goal_client.py"),
        (
            "tests/scenarios/test_actions.py",
            "tests/conformance/test_action_scripts.py",
            "tests/scenarios/test_derived.py",
        ),
    ),
    "supervisor": Subject(
        ("actors/supervision/*.py",),
        (
            "tests/unit/test_supervisor_*.py",
            "-k",
            "not M02 and not M03",
        ),  # those two measure, and take most of the time
    ),
}


class Workshop:
    """A copy of the project's packages in a folder of its own, in which one mutant after another is tried."""

    def __init__(self, root: Path, folder: Path, packages: tuple[str, ...] = ("actors", "tests")) -> None:
        self.root = root
        self.folder = folder
        self.output = folder / "output.txt"
        """What the last run of the tests printed."""
        for package in packages:
            shutil.copytree(root / package, folder / package, ignore=shutil.ignore_patterns("__pycache__"))
        shutil.copy(root / "pyproject.toml", folder)
        # compiled files that know their source by its content: a mutant as old and as long as the original is not mistaken for it
        command = (sys.executable, "-m", "compileall", "-q", "--invalidation-mode", "checked-hash", *packages)
        subprocess.run(command, cwd=folder, check=True)

    def try_out(self, mutant: Mutant, tests: tuple[str, ...], limit: float) -> Fate:
        """Run the tests against one mutant, for `limit` seconds at most."""
        path = self.folder / mutant.path
        original = path.read_bytes()
        path.write_bytes(mutant.source.encode())
        try:
            code = self._pytest(tests, limit)
        finally:
            path.write_bytes(original)
        if code is None:
            return "timed out"
        return "survived" if code == 0 else "killed"

    def baseline(self, tests: tuple[str, ...]) -> float:
        """Run the tests against the copy as it is; the seconds they took. Raises RuntimeError unless all of them pass."""
        began = time.monotonic()
        code = self._pytest(tests, None)
        if code != 0:
            raise RuntimeError(
                f"the tests must pass before mutants are tried, but pytest exited with {code}:\n"
                + self.output.read_text(encoding="utf-8", errors="replace")[-5000:]
            )
        return time.monotonic() - began

    def _pytest(self, tests: tuple[str, ...], limit: float | None) -> int | None:
        arguments = [
            name for test in tests for name in (sorted(map(str, self.folder.glob(test))) if "*" in test else [test])
        ]
        command = (sys.executable, "-m", "pytest", "-x", "-q", "--no-header", "-p", "no:cacheprovider", *arguments)
        environment = {**os.environ, "PYTHONPATH": str(self.folder)}
        with self.output.open("wb") as output, Running(command, self.folder, environment, output) as process:
            try:
                return process.wait(limit)
            except subprocess.TimeoutExpired:
                return None


class Running:
    """A process in a group of its own; whatever is left of the group at the end of the block is killed."""

    def __init__(self, command: tuple[str, ...], folder: Path, environment: dict[str, str], output: IO[bytes]) -> None:
        self._process = subprocess.Popen(
            command,
            cwd=folder,
            env=environment,
            stdout=output,
            stderr=subprocess.STDOUT,
            stdin=subprocess.DEVNULL,
            start_new_session=True,
            preexec_fn=_limit_memory if sys.platform == "linux" else None,
        )

    def __enter__(self) -> subprocess.Popen[bytes]:
        return self._process

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._process.poll() is None:
            os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()


def _limit_memory() -> None:
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
