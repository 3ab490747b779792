"""What all tests share: the virtual clock and the `rig` of `actors.testing`, also where the package is not installed."""

import gc
import signal

pytest_plugins = ["actors.testing.plugin", "pytester"]

from hypothesis import settings  # noqa: E402  # after the environment is set

settings.register_profile("repeatable", derandomize=True)
settings.register_profile("explore", derandomize=False, max_examples=1000)
# The suite run twice gives the same result; pytest --hypothesis-profile=explore looks further.
settings.load_profile("repeatable")

# A shell's background job ignores the interrupt key; a program that is tested does not.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_finish() -> None:
    """A million objects are there by now, and stay: looked through at each collection of garbage, they would cost minutes."""
    gc.collect()
    gc.freeze()
