"""What all tests share: the virtual clock and the `rig` of `actors.testing`, also where the package is not installed."""

import gc
import os
import signal
import time

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

pytest_plugins = ["actors.testing.plugin", "pytester"]

from hypothesis import settings  # noqa: E402  # after the environment is set

settings.register_profile("repeatable", derandomize=True)
settings.register_profile("explore", derandomize=False, max_examples=1000)
# The suite run twice gives the same result; pytest --hypothesis-profile=explore looks further.
settings.load_profile("repeatable")

# A shell's background job ignores the interrupt key, one of `nohup` the end of its terminal; a program that is tested does not.
for _number, _handler in ((signal.SIGINT, signal.default_int_handler), (signal.SIGHUP, signal.SIG_DFL)):
    if signal.getsignal(_number) is signal.SIG_IGN:
        signal.signal(_number, _handler)


def pytest_collection_finish() -> None:
    """A million objects are there by now, and stay: looked through at each collection of garbage, they would cost minutes."""
    gc.collect()
    gc.freeze()
