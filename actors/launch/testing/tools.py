"""Processes that a test itself starts in the launch that it runs beside: `launch_process`; and comparison of their output."""

from __future__ import annotations

import re
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import contextmanager
from typing import Any

from actors.launch import events
from actors.launch.actions.processes import ExecuteProcess
from actors.launch.entity import LaunchDescription
from actors.launch.service import LaunchService
from actors.launch.testing.matching import Expected, build_text_match, without_colours
from actors.launch.testing.records import IoHandler, ProcInfoHandler

Filter = Callable[[str], str]


class ProcessProxy:
    """One process of a launch, as a test sees it: what it has written, and whether it runs. `output_filter` is applied to what it wrote."""

    def __init__(
        self,
        process_action: ExecuteProcess,
        proc_info: ProcInfoHandler,
        proc_output: IoHandler,
        *,
        output_filter: Filter | None = None,
    ) -> None:
        self.target_process_action = process_action
        self._info = proc_info
        self._output = proc_output
        self._filter = output_filter

    def wait_for_shutdown(self, timeout: float | None = None) -> bool:
        """Wait until it has ended; whether it has, within this time in seconds."""
        with self._info.proc_event:
            return self._info.proc_event.wait_for(lambda: self.terminated, timeout)

    def wait_for_output(self, condition: Callable[[str], object] | None = None, timeout: float | None = None) -> bool:
        """Wait until the condition holds for what it has written, or until it has written anything; whether it does, in time."""
        holds = bool if condition is None else condition
        with self._output.io_event:
            return bool(self._output.io_event.wait_for(lambda: holds(self.output), timeout))

    @property
    def stdout(self) -> str:
        """What it has written to stdout."""
        return self._text(lambda line: bool(line.from_stdout))

    @property
    def stderr(self) -> str:
        """What it has written to stderr."""
        return self._text(lambda line: bool(line.from_stderr))

    @property
    def output(self) -> str:
        """What it has written, on both streams."""
        return self._text(lambda line: True)

    @property
    def running(self) -> bool:
        """Whether it has started and not ended."""
        return isinstance(self._event, events.ProcessStarted)

    @property
    def terminated(self) -> bool:
        """Whether it has ended."""
        return isinstance(self._event, events.ProcessExited)

    @property
    def exit_code(self) -> int:
        """Its exit code. Raises `AttributeError` before its end."""
        return int(self._event.returncode)

    @property
    def _event(self) -> Any:
        known = {event.action: event for event in self._info}
        return known.get(self.target_process_action)

    def _text(self, wanted: Callable[[events.ProcessIO], bool]) -> str:
        lines = [line for line in self._output if line.action is self.target_process_action and wanted(line)]
        text = "".join(line.text.decode(errors="replace") for line in lines)
        return text if self._filter is None else self._filter(text)


@contextmanager
def launch_process(
    launch_service: LaunchService,
    process_action: ExecuteProcess,
    proc_info: ProcInfoHandler,
    proc_output: IoHandler,
    *,
    output_filter: Filter | None = None,
) -> Generator[ProcessProxy]:
    """Start a process in a launch that runs, and end it with the block if it runs still."""
    launch_service.include_launch_description(LaunchDescription([process_action]))
    proxy = ProcessProxy(process_action, proc_info, proc_output, output_filter=output_filter)
    try:
        yield proxy
    finally:
        if not proxy.terminated:
            launch_service.emit_event(events.ShutdownProcess(process_matcher=events.matches_action(process_action)))


def basic_output_filter(
    filtered_prefixes: Iterable[str] | None = None, filtered_patterns: Iterable[str] | None = None
) -> Filter:
    """A function that leaves out lines that begin with one of the prefixes, or match one of the patterns at their beginning."""
    prefixes = tuple(("pid", "rc") if filtered_prefixes is None else filtered_prefixes)
    patterns = [re.compile(pattern) for pattern in filtered_patterns or ()]

    def kept(output: str) -> str:
        return "".join(
            line
            for line in output.splitlines(keepends=True)
            if not line.startswith(prefixes) and not any(pattern.match(line) for pattern in patterns)
        )

    return kept


def expect_output(
    text: str | None = None,
    *,
    lines: Sequence[str] | None = None,
    expected_text: Expected | None = None,
    expected_lines: Sequence[object] | None = None,
    strip_ansi_escape_sequences: bool = True,
    strict: bool = False,
) -> bool:
    """Whether a text, or lines, are what is expected: somewhere in it, or with `strict` as a whole."""
    if (text is None) == (lines is None) or (expected_text is None) == (expected_lines is None):
        raise ValueError("give a text or lines, and an expected text or expected lines")
    whole = "\n".join(lines or ()) if text is None else text
    if strip_ansi_escape_sequences:
        whole = without_colours(whole)
    if expected_lines is None:
        assert expected_text is not None
        found = build_text_match(expected_text)(whole)
        return found is not None and (not strict or found == (0, len(whole)))
    return _lines_match(whole.splitlines(), expected_lines, strict)


def _lines_match(lines: Sequence[str], expected: Sequence[object], strict: bool) -> bool:
    """Whether neighbouring lines match: each contains its text or matches its pattern; with `strict` they are all lines."""

    def fits(line: str, wanted: Any) -> bool:
        if isinstance(wanted, str):
            return wanted == line if strict else wanted in line
        return wanted.match(line) is not None

    width = len(expected)
    starts = [0] if strict else range(len(lines) - width + 1)
    return (not strict or len(lines) == width) and any(
        all(fits(*pair) for pair in zip(lines[start : start + width], expected, strict=True)) for start in starts
    )
