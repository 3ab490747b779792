"""The assertions of launch tests about exit codes and output, under the names of `launch_testing.asserts` in the shim."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import contextmanager
from typing import Any, Protocol

from actors.launch.events import ProcessExited
from actors.launch.testing.matching import Expected, build_text_match, resolve_processes, without_colours

EXIT_OK = 0
EXIT_SIGINT = 130
EXIT_SIGQUIT = 131
EXIT_SIGKILL = 137
EXIT_SIGSEGV = 139
NEARBY = 3
"""How many lines around the last match an error shows."""


class _Known(Protocol):
    def processes(self) -> list[Any]: ...

    def __getitem__(self, key: object, /) -> Any: ...


def assert_exit_codes(
    proc_info: _Known,
    allowable_exit_codes: Iterable[Any] = (EXIT_OK,),
    process: object = None,
    cmd_args: object = None,
    *,
    strict_proc_matching: bool = True,
) -> None:
    """Every process that is meant has ended with one of these exit codes."""
    allowed = list(allowable_exit_codes)
    for code in allowed:
        if not isinstance(code, int):
            raise AssertionError(f"the exit code {code!r} is no integer")
    for action in resolve_processes(
        proc_info, process=process, cmd_args=cmd_args, strict_proc_matching=strict_proc_matching
    ):
        event = proc_info[action]
        if not isinstance(event, ProcessExited):
            raise AssertionError(f"{event.process_name} has not ended")
        if event.returncode not in allowed:
            raise AssertionError(
                f"{event.process_name} ended with exit code {event.returncode}, not {_either(allowed)}"
            )


def assert_in_stream(
    proc_output: _Known,
    expected_output: Expected,
    process: object,
    cmd_args: object = None,
    *,
    output_filter: Callable[[str], str] | None = None,
    strict_proc_matching: bool = True,
    strip_ansi_escape_sequences: bool = True,
    stream: str = "stderr",
) -> None:
    """One of the processes that are meant has written the text to the stream: "stdout" or "stderr"."""
    if stream not in ("stdout", "stderr"):
        raise ValueError(f"stream is 'stdout' or 'stderr', not {stream!r}")
    match = build_text_match(expected_output)
    found = resolve_processes(
        proc_output, process=process, cmd_args=cmd_args, strict_proc_matching=strict_proc_matching
    )
    for action in found:
        text = "".join(
            line.text.decode(errors="replace") for line in proc_output[action] if getattr(line, f"from_{stream}")
        )
        if strip_ansi_escape_sequences:
            text = without_colours(text)
        if match(text if output_filter is None else output_filter(text)) is not None:
            return
    names = ", ".join(sorted(action.process_details["name"] for action in found))
    raise AssertionError(f"{expected_output!r} is not in the {stream} of {names}")


def assert_in_stdout(
    proc_output: _Known, expected_output: Expected, process: object, cmd_args: object = None, **options: Any
) -> None:
    """`assert_in_stream` for stdout."""
    assert_in_stream(proc_output, expected_output, process, cmd_args, stream="stdout", **options)


def assert_in_stderr(
    proc_output: _Known, expected_output: Expected, process: object, cmd_args: object = None, **options: Any
) -> None:
    """`assert_in_stream` for stderr."""
    assert_in_stream(proc_output, expected_output, process, cmd_args, stream="stderr", **options)


def assert_default_stream() -> str:
    """The stream that is looked at unless another is named."""
    return "stderr"


class SequentialTextChecker:
    """Asserts that texts follow each other: each is looked for behind the last one that was found."""

    def __init__(self, output: Sequence[str]) -> None:
        self._text = "".join(output)
        self._place = 0

    def assertInStdout(self, msg: str) -> None:
        """The text is there, behind the last one."""
        found = self._text.find(msg, self._place)
        if found < 0:
            raise AssertionError(
                f"'{msg}' not found in sequence after previous match. The output near that:\n{self.get_nearby_lines()}"
            )
        self._place = found + len(msg)

    assertInText = assertInStdout

    def get_nearby_lines(self) -> str:
        """The lines around the last match."""
        before, after = self._text[: self._place].splitlines(), self._text[self._place :].splitlines()
        here = "".join([*before[-1:], *after[:1]])
        return "\n".join([*before[:-1][-NEARBY:], here, *after[1:][:NEARBY]])


@contextmanager
def assert_sequential_stdout(
    proc_output: _Known, process: object, cmd_args: object = None
) -> Generator[SequentialTextChecker]:
    """Give a checker of what one process has written, on both streams."""
    (action,) = resolve_processes(proc_output, process=process, cmd_args=cmd_args)
    yield SequentialTextChecker([line.text.decode(errors="replace") for line in proc_output[action]])


def _either(codes: Sequence[int]) -> str:
    return " or ".join(map(str, codes)) or "any"
