"""What a launch test knows of its processes while they run and afterwards: `ProcInfoHandler` and `IoHandler`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from threading import Condition
from typing import Any

from actors.launch.events import ProcessEvent, ProcessExited, ProcessIO
from actors.launch.testing.asserts import assert_in_stream
from actors.launch.testing.matching import Expected, NoMatchingProcessException, resolve_processes

TAIL = 20
"""How many lines an error shows of what was written."""

WAIT_SECONDS = 10.0
"""How long the assertions below wait, unless told otherwise."""


class ProcInfoHandler:
    """The last event of each process: that it has started, or that it has ended. Events come from the launch's thread, questions from others.

    Invariants: everything is read and written under `_changed`, which is notified at every change.
    """

    def __init__(self) -> None:
        self._changed = Condition()
        self._events: dict[object, ProcessEvent] = {}

    @property
    def proc_event(self) -> Condition:
        """Notified at every change."""
        return self._changed

    def append(self, process_info: ProcessEvent) -> None:
        """Note an event of a process."""
        with self._changed:
            self._events[process_info.action] = process_info
            self._changed.notify_all()

    def __iter__(self) -> Iterator[ProcessEvent]:
        with self._changed:
            return iter(list(self._events.values()))

    def processes(self) -> list[Any]:
        """The actions of all processes that have started."""
        with self._changed:
            return list(self._events)

    def process_names(self) -> list[str]:
        """The names of all processes that have started."""
        return [event.process_name for event in self]

    def __getitem__(self, key: object) -> Any:
        """The last event of a process, by its action or by a part of its name. Raises `KeyError`."""
        with self._changed:
            if not isinstance(key, str):
                return self._events[key]
            for event in self._events.values():
                if key in event.process_name:
                    return event
        raise KeyError(key)

    def assertWaitForStartup(self, process: object, cmd_args: object = None, *, timeout: float = WAIT_SECONDS) -> None:
        """Wait until a process has started; AssertionError after `timeout` seconds."""
        self._wait(process, cmd_args, timeout, lambda event: True, "start")

    def assertWaitForShutdown(self, process: object, cmd_args: object = None, *, timeout: float = WAIT_SECONDS) -> None:
        """Wait until a process has ended; AssertionError after `timeout` seconds."""
        self._wait(process, cmd_args, timeout, lambda event: isinstance(event, ProcessExited), "end")

    def _wait(
        self, process: object, cmd_args: object, timeout: float, holds: Callable[[ProcessEvent], bool], what: str
    ) -> None:
        def met() -> bool:
            try:
                found = resolve_processes(self, process=process, cmd_args=cmd_args)
            except NoMatchingProcessException:
                return False
            return holds(self._events[found[0]])

        with self._changed:
            if self._changed.wait_for(met, timeout):
                return
        names = ", ".join(self.process_names()) or "none"
        raise AssertionError(f"after {timeout:g} s the process {process!r} did not {what}; started: {names}")


class IoHandler:
    """The lines that processes have written, in their order; lines on stderr are also those that nodes of this framework log.

    Invariants: as those of `ProcInfoHandler`. A process that has started has a list, which may be empty.
    """

    def __init__(self) -> None:
        self._changed = Condition()
        self._lines: dict[str, list[ProcessIO]] = {}
        self._all: list[ProcessIO] = []

    @property
    def io_event(self) -> Condition:
        """Notified at every line."""
        return self._changed

    def track(self, process_name: str) -> None:
        """Note that a process has started, so that its empty output is known."""
        with self._changed:
            self._lines.setdefault(process_name, [])
            self._changed.notify_all()

    def append(self, process_io: ProcessIO) -> None:
        """Note a line of a process."""
        with self._changed:
            self._all.append(process_io)
            self._lines.setdefault(process_io.process_name, []).append(process_io)
            self._changed.notify_all()

    def __iter__(self) -> Iterator[ProcessIO]:
        with self._changed:
            return iter(list(self._all))

    def processes(self) -> list[Any]:
        """The actions of all processes that have written something."""
        with self._changed:
            return [lines[0].action for lines in self._lines.values() if lines]

    def process_names(self) -> list[str]:
        """The names of all processes that have started."""
        with self._changed:
            return list(self._lines)

    def __getitem__(self, key: Any) -> list[ProcessIO]:
        """The lines of a process, by its action or its name. Raises `KeyError`."""
        name = str(key if isinstance(key, str) or not key.process_details else key.process_details["name"])
        with self._changed:
            return list(self._lines[name])

    def assertWaitFor(
        self, expected_output: Expected, process: object = None, cmd_args: object = None, **options: Any
    ) -> None:
        """Wait for a text, as `waitFor` does; AssertionError where it does not come."""
        if not self.waitFor(expected_output, process, cmd_args, **options):
            raise AssertionError(f"{expected_output!r} was not written in time; what was:\n{self.tail()}")

    def waitFor(
        self,
        expected_output: Expected,
        process: object = None,
        cmd_args: object = None,
        *,
        timeout: float = WAIT_SECONDS,
        stream: str = "stderr",
        **options: Any,
    ) -> bool:
        """Wait until a process, or any, has written a text to a stream. `options` are those of `assert_in_stream`."""

        def met() -> bool:
            try:
                assert_in_stream(self, expected_output, process, cmd_args, stream=stream, **options)
            except (AssertionError, NoMatchingProcessException):
                return False
            return True

        with self._changed:
            return self._changed.wait_for(met, timeout)

    def tail(self) -> str:
        """The last lines that were written, each with its process."""
        lines = [
            f"[{line.process_name}] {'stdout' if line.from_stdout else 'stderr'}: {line.text.decode(errors='replace').rstrip()}"
            for line in self
        ]
        return "\n".join(lines[-TAIL:]) or "(nothing)"
