"""What all tests share: the virtual clock and the `rig` of `actors.testing`, also where the package is not installed."""

import gc
import os
import signal
import sys
import time
from pathlib import Path

import pytest
import pytest_asyncio

_FOREIGN = ("ROS_", "RMW_", "RCUTILS_", "RCL_", "ZENOH_", "AMENT_", "COLCON_", "ROBACTOR_", "LC_")
"""What the shell of a ROS user has, and tests do not rest on,"""
_OWN = {"ROBACTOR_SHARED", "ROBACTOR_TRIALS", "ROBACTOR_SEED", "ROBACTOR_AXE"}
"""but for what tests themselves read."""
for _name in list(os.environ):
    if _name.startswith(_FOREIGN) and _name not in _OWN:
        del os.environ[_name]
for _name in ("COLUMNS", "FORCE_COLOR", "NO_COLOR", "OVERRIDE_LAUNCH_PROCESS_OUTPUT", "PYTHONHASHSEED"):
    os.environ.pop(_name, None)
os.environ |= {"RMW_IMPLEMENTATION": "in_process", "LANG": "C.UTF-8", "TZ": "UTC"}
time.tzset()
# Tests start hundreds of interpreters, and each would compile the packages anew.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

gc.disable()  # until all tests are collected: what they are made of is no garbage
pytest_plugins = ["actors.testing.plugin", "pytester"]

from hypothesis import settings  # noqa: E402  # after the environment is set

# No deadline: a wall clock says how busy the machine is, not how good the program.
settings.register_profile("repeatable", derandomize=True, deadline=None, max_examples=50)
settings.register_profile("explore", derandomize=False, max_examples=1000, deadline=None)
# The suite run twice gives the same result; pytest --hypothesis-profile=explore looks further.
settings.load_profile("repeatable")

# A shell's background job ignores the interrupt key, one of `nohup` the end of its terminal; a program that is tested does not.
for _number, _handler in ((signal.SIGINT, signal.default_int_handler), (signal.SIGHUP, signal.SIG_DFL)):
    if signal.getsignal(_number) is signal.SIG_IGN:
        signal.signal(_number, _handler)


def pytest_collection_finish() -> None:
    """A million objects are there by now, and stay: looked through at each collection of garbage, they would cost minutes."""
    gc.freeze()
    gc.enable()
    gc.set_threshold(50_000, 5, 2)


_NEWEST = pytest.StashKey[Path]()


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Collect the garbage of a file before the next one begins: each look at all tasks is one at the dead ones, too, and each fork copies them."""
    if item.session.stash.get(_NEWEST, None) != item.path:
        item.session.stash[_NEWEST] = item.path
        gc.collect()
        gc.freeze()  # what is there now stays: no collection looks at it again


def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """One and a half worker a core, since many tests wait for processes; a file that is named runs at once, without workers."""
    if any(argument.partition("::")[0].endswith(".py") for argument in config.args):
        return 0
    return max(2, len(os.sched_getaffinity(0)) * 3 // 2) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 2


@pytest_asyncio.fixture
async def hosts():
    """Systems that are joined by one network in memory; a `tests.actors.transport.hosts.Hosts`."""
    from tests.actors.transport.hosts import Hosts

    hosts = Hosts()
    yield hosts
    await hosts.close()


@pytest.fixture
def own_debugger(monkeypatch):
    """Python's own debugger, whatever the environment says; it leaves no trace function and takes no interrupt after the test."""
    trace, interrupt = sys.gettrace(), signal.getsignal(signal.SIGINT)
    monkeypatch.setattr("sys.breakpointhook", sys.__breakpointhook__)
    monkeypatch.delenv("PYTHONBREAKPOINT", raising=False)
    yield
    sys.settrace(trace)
    signal.signal(signal.SIGINT, interrupt)
