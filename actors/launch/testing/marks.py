"""What is written in a launch test beside its tests: decorators, a listener for a line, and a process that goes on."""

from __future__ import annotations

import functools
import sys
import time
from collections.abc import Callable, Iterable
from threading import Lock
from typing import ParamSpec, TypeVar

from actors.launch.actions.processes import ExecuteProcess
from actors.launch.events import ProcessIO
from actors.launch.handlers import OnProcessIO

Any_ = TypeVar("Any_")
P = ParamSpec("P")


def post_shutdown_test() -> Callable[[Any_], Any_]:
    """The tests of this class run when the launch has ended."""
    return _marked("__post_shutdown_test__", True)


def ready_to_test_action_timeout(timeout: float) -> Callable[[Any_], Any_]:
    """The launch is ready for its tests within this time in seconds."""
    return _marked("__ready_to_test_action_timeout__", timeout)


def keep_alive(test_description: Any_) -> Any_:
    """The launch goes on until the tests are done, although its processes may have ended before."""
    return _marked("__keep_alive__", True)(test_description)


def parametrize(argnames: str, argvalues: Iterable[object]) -> Callable[[Any_], Any_]:
    """The file is launched and tested once for each of the values: the names are those of arguments, separated by commas."""
    names = [name.strip() for name in argnames.split(",") if name.strip()]
    rows: list[tuple[object, ...]] = [value if isinstance(value, tuple) else (value,) for value in argvalues]
    return _marked("__parametrized__", [dict(zip(names, row, strict=True)) for row in rows])


def retry_on_failure(*, times: int, delay: float | None = None) -> Callable[[Callable[P, Any_]], Callable[P, Any_]]:
    """Try a test up to so many times, with a pause in seconds between two, as long as it raises AssertionError."""
    if times < 1:
        raise ValueError(f"retry_on_failure(times={times}): at least 1")

    def decorate(test: Callable[P, Any_]) -> Callable[P, Any_]:
        @functools.wraps(test)
        def tried(*arguments: P.args, **keywords: P.kwargs) -> Any_:
            for _ in range(times - 1):
                try:
                    return test(*arguments, **keywords)
                except AssertionError:
                    time.sleep(delay or 0)
            return test(*arguments, **keywords)

        return tried

    return decorate


class ReadyAggregator:
    """Calls a function when `ready_fn` was called for the nth time."""

    def __init__(self, ready_fn: Callable[[], object], num_to_aggregate: int) -> None:
        self._ready = ready_fn
        self._missing = num_to_aggregate
        self._lock = Lock()

    def ready_fn(self) -> None:
        """Count; from any thread."""
        with self._lock:
            self._missing -= 1
            last = self._missing == 0
        if last:
            self._ready()


class StdoutReadyListener(OnProcessIO):
    """Does actions when a process has written a line with a text to stdout."""

    def __init__(self, *, target_action: object = None, ready_txt: str, actions: object) -> None:
        def written(event: ProcessIO) -> object:
            return actions if ready_txt in event.text.decode(errors="replace") else None

        super().__init__(target_action=target_action, on_stdout=written)


def keep_alive_process() -> ExecuteProcess:
    """A process that runs until it is told to end, so that the launch goes on when the others have ended."""
    program = "import signal; signal.signal(signal.SIGINT, lambda *_: exit(0)); signal.pause()"
    return ExecuteProcess(cmd=[sys.executable, "-c", program])


def _marked(name: str, value: object) -> Callable[[Any_], Any_]:
    def decorate(marked: Any_) -> Any_:
        setattr(marked, name, value)
        return marked

    return decorate
