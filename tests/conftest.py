"""What all tests share: the virtual clock and the `rig` of `actors.testing`, also where the package is not installed."""

import gc
import os
import signal
import sys

import pytest

pytest_plugins = ["actors.testing.plugin", "pytester"]

from hypothesis import settings  # noqa: E402  # after the environment is set

# No deadline: a wall clock says how busy the machine is, not how good the program.
settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.register_profile("explore", derandomize=False, max_examples=1000, deadline=None)
# The suite run twice gives the same result; pytest --hypothesis-profile=explore looks further.
settings.load_profile("repeatable")

# Tests start hundreds of interpreters, and each would compile the packages anew.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# A shell's background job ignores the interrupt key; a program that is tested does not.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_finish() -> None:
    """A million objects are there by now, and stay: looked through at each collection of garbage, they would cost minutes."""
    gc.collect()
    gc.freeze()


def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """One and a half worker a core, since many tests wait for processes; a file that is named runs at once, without workers."""
    if any(argument.partition("::")[0].endswith(".py") for argument in config.args):
        return 0
    return max(2, len(os.sched_getaffinity(0)) * 3 // 2) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 2
