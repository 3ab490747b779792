"""The trial of a mutant: the tests of its subject run against a copy of the project in which one file is the mutant's."""

from __future__ import annotations

import multiprocessing
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from tests.tools.mutants.mutate import Mutant
from tests.tools.mutants.process import OUTPUT, PRELOADED, PROFILE, run_tests

OPTIONS: Final = (
    "-x", "-q", "-n", "0", "--no-header", "-p", "no:cacheprovider", f"--hypothesis-profile={PROFILE}",
    "-W", "ignore:Module already imported:pytest.PytestAssertRewriteWarning",
)  # fmt: skip
Fate = Literal["killed", "timed out", "survived"]


@dataclass(frozen=True)
class Subject:
    """What is mutated together, and the tests that must notice: arguments of pytest, the quickest to find something first.

    Names of files may hold asterisks.
    """

    files: tuple[str, ...]
    tests: tuple[str, ...]


THOUSAND: Final = "--deselect=tests/actors/supervision/test_dynamic_children.py::test_a_thousand_children_that_have_ended_leave_nothing_behind"
"""It takes most of the time of its file, whose other tests look at the same."""

SUBJECTS: Final = {
    "channel": Subject(
        (
            "actors/topics/publisher.py",
            "actors/topics/subscription.py",
            "actors/topics/handler.py",
            "actors/topics/stream.py",
            "actors/waiting.py",
        ),
        (
            "tests/actors/topics/test_waiting.py",
            "tests/actors/topics/test_delivery.py",
            "tests/actors/topics/test_timed.py",
            "tests/actors/graph/test_graph.py",
            "tests/actors/runtime/test_load.py",
            "tests/actors/topics/test_endpoint.py",
            "tests/actors/qos/test_qos_events.py",
            "tests/actors/topics/test_latched_restarts.py",
            "tests/actors/topics/test_qos_events.py",
            "tests/actors/runtime/test_load_of_systems.py",
            "tests/properties/test_channel_machine.py",
            "tests/actors/topics/test_topics.py",
            "tests/actors/lifecycle/test_lifecycle_nodes.py",
            "tests/actors/node/test_nodes.py",
        ),
    ),
    "services": Subject(
        ("actors/services/server.py", "actors/services/client.py", "actors/services/peers.py"),
        (
            "tests/actors/services/test_services.py",
            "tests/actors/node/test_standard_services.py",
            "tests/actors/runtime/test_crossings.py",
            "tests/actors/runtime/test_incarnation.py",
            "tests/actors/services/test_deadlines.py",
            "tests/actors/graph/test_graph.py",
            "tests/actors/topics/test_inbox.py",
            "tests/actors/graph/test_snapshot.py",
            "tests/actors/graph/test_graph_views.py",
            "tests/actors/supervision/test_restarts.py",
            "tests/actors/actions/test_retry.py",
            "tests/actors/runtime/test_load_of_systems.py",
            "tests/actors/node/test_nodes.py",
            "tests/actors/supervision/test_dynamic_children.py",
            THOUSAND,
        ),
    ),
    "actions": Subject(
        ("actors/actions/*.py",),
        (
            "tests/actors/actions/test_goals.py",
            "tests/actors/actions/test_actions.py",
            "tests/actors/runtime/test_crossings.py",
            "tests/conformance/test_action_scripts.py",
            "tests/actors/actions/test_result_expiry.py",
            "tests/actors/running/test_ends_in_between.py",
            "tests/actors/node/test_standard_services.py",
            "tests/actors/graph/test_snapshot.py",
            "tests/actors/graph/test_graph_views.py",
            "tests/properties/test_action_server_machine.py",
            "tests/properties/test_goals_machine.py",
            "tests/actors/supervision/test_dynamic_children.py",
            THOUSAND,
        ),
    ),
    "supervisor": Subject(  # without M02 and M03, which measure and take most of the time
        ("actors/supervision/*.py",),
        (
            "tests/actors/supervision/test_*.py",
            "tests/actors/logs/test_log_errors.py",
            "tests/actors/runtime/test_joined.py",
            "tests/properties/test_supervisor_machine.py",
            "tests/properties/test_supervisor_decide.py",
            "-k",
            "not M02 and not M03",
        ),
    ),
}


class Workshop:
    """A copy of the project's packages in a folder of its own, in which one mutant after another is tried."""

    def __init__(self, root: Path, folder: Path, packages: tuple[str, ...] = ("actors", "tests")) -> None:
        self.root = root
        self.folder = folder
        for package in packages:
            shutil.copytree(root / package, folder / package, ignore=shutil.ignore_patterns("__pycache__"))
        shutil.copy(root / "pyproject.toml", folder)
        # compiled files that know their source by its content: a mutant as old and as long as the original is not mistaken for it
        command = (sys.executable, "-m", "compileall", "-q", "--invalidation-mode", "checked-hash", *packages)
        subprocess.run(command, cwd=folder, check=True)
        self._server = multiprocessing.get_context("forkserver")  # loads what never changes once, not for every mutant
        self._server.set_forkserver_preload([*PRELOADED])

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
                + (self.folder / OUTPUT).read_text(encoding="utf-8", errors="replace")[-5000:]
            )
        return time.monotonic() - began

    def _pytest(self, tests: tuple[str, ...], limit: float | None) -> int | None:
        """The exit code of pytest in a process of its own, or None when it took longer than `limit` seconds."""
        names = [sorted(map(str, self.folder.glob(test))) if "*" in test else [test] for test in tests]
        arguments = [*OPTIONS, *(name for group in names for name in group)]
        process = self._server.Process(target=run_tests, args=(str(self.folder), arguments))
        process.start()
        process.join(limit)
        if process.exitcode is None:
            assert process.pid is not None
            os.killpg(process.pid, signal.SIGKILL)
            process.join()
            return None
        return process.exitcode
