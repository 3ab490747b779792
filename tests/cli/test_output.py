"""What others say cannot control the terminal on which commands print it."""

from __future__ import annotations

import io
import json
import sys

import pytest

from actors import GoalAborted, GoalRejected
from actors.errors import ServiceFailed
from actors.logs import INFO, LogRecord, console_sink
from actors.logs.terminal import shown
from cli.output import control, print_json, safe_output
from cli.parsing import complain

EVIL = "\x1b]0;PWN\x07\x1b[2J\x9b31m\u202e\b\r\nFAKE [info] all is well\x7f"


def test_controls_are_shown_as_escapes_and_line_breaks_and_tabs_stay() -> None:
    assert shown(EVIL) == r"\x1b]0;PWN\x07\x1b[2J\x9b31m\u202e\x08\r" + "\nFAKE [info] all is well\\x7f"
    assert shown("a\tb\nc", "  ") == "a\tb\n  c"
    assert shown("plain äöü 猫 🐕") == "plain äöü 猫 🐕"


def test_commands_print_shown_text_and_may_control_the_terminal_themselves(capsys: pytest.CaptureFixture[str]) -> None:
    before = sys.stdout
    with safe_output():
        print(EVIL)
        print(EVIL, file=sys.stderr)
        control("\x1b[K")
        assert (sys.stdout.isatty(), sys.stdout.encoding) == (before.isatty(), before.encoding)
        print_json({"x": EVIL + "\\x41"})
    assert sys.stdout is before
    out, err = capsys.readouterr()
    first, forged, last = out.splitlines()
    assert (first + "\n" + forged + "\n", err) == (shown(EVIL) + "\n", shown(EVIL) + "\n")
    assert last.startswith("\x1b[K")
    data = last.removeprefix("\x1b[K")
    assert data.isascii() and data.isprintable()
    assert json.loads(data) == {"x": EVIL + "\\x41"}


def test_log_lines_for_people_are_shown_on_lines_that_cannot_be_taken_for_others() -> None:
    out = io.StringIO()
    console_sink(out)(LogRecord(1.0, INFO, "evil\x1b[31m", 1, EVIL, {"field": EVIL, "bare": "\x1b[2J"}))
    text = out.getvalue()
    assert "\x1b" not in text and "\x9b" not in text and "\r" not in text
    assert [line for line in text.splitlines() if line.startswith("FAKE")] == []


@pytest.mark.parametrize(
    "error",
    [
        ServiceFailed("/evil", "RuntimeError", EVIL),
        GoalRejected("/act", EVIL),
        GoalAborted("/act", EVIL),
        Exception(EVIL),
    ],
    ids=lambda error: type(error).__name__,
)
def test_no_line_that_a_peer_has_written_looks_like_a_line_of_a_command(
    error: Exception, capsys: pytest.CaptureFixture[str]
) -> None:
    with safe_output():
        complain(str(error))
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert lines[1].lstrip().startswith("FAKE")
    assert lines[1].startswith("    ")
