"""Where a replay stops in a debugger, and what is left of it when the debugger is quit."""

from __future__ import annotations

import sys
from bdb import BdbQuit
from io import StringIO

import pytest

from actors import execute
from actors.interfaces.std_msgs.msg import String
from actors.replay import ReplayError, replay
from actors.replay.debugger import Break
from tests.actors.replay.test_divergence import Plain, recorded


def test_another_debugger_is_started_once_at_the_message() -> None:
    stops: list[str] = []
    recording = execute(lambda: recorded(Plain), clock="virtual")
    verdict = replay(recording, pause=("/told", 0), debugger=lambda: stops.append("here"))
    assert (verdict.equal, stops) == (True, ["here"])
    assert verdict.compared == len([*recording.outputs()])


def test_the_debugger_that_breakpoint_starts_here_is_started(monkeypatch: pytest.MonkeyPatch) -> None:
    stops: list[str] = []
    monkeypatch.setattr("sys.breakpointhook", lambda: stops.append("here"))
    Break("/told", 0).stop()
    assert stops == ["here"]


@pytest.mark.usefixtures("own_debugger")
def test_pythons_debugger_stops_in_the_frame_that_asked_for_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    word = String(data="seen in the debugger")
    monkeypatch.setattr("sys.stdin", StringIO("p word.data\ncontinue\n"))
    stop = Break("/told", 0)
    stop.stop()
    stop.check_over()
    assert f"{word.data!r}\n" in capsys.readouterr().out


@pytest.mark.usefixtures("own_debugger")
def test_a_debugger_that_was_quit_is_told_apart_from_an_error_of_the_node(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", StringIO("quit\n"))
    trace, stop = sys.gettrace(), Break("/told", 0)
    stop.check_over()  # it has not been started

    def node() -> None:
        stop.stop()
        raise AssertionError("the debugger went on")

    with pytest.raises(BdbQuit):
        node()
    sys.settrace(trace)
    with pytest.raises(ReplayError, match="the debugger was quit, and the replay with it: there is no verdict"):
        stop.check_over()
