"""What the guard's processes ask of the operating system, and how that is switched off."""

from __future__ import annotations

import os

import pytest

from robot.link import priority
from robot.link.priority import favour


def test_real_time_scheduling_is_asked_for_unless_it_is_switched_off(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []
    monkeypatch.setattr(os, "sched_setscheduler", lambda process, policy, parameter: asked.append(policy))
    monkeypatch.setattr(priority, "short_turns", lambda: asked.append(-1) is None)
    monkeypatch.setenv("ROBACTOR_REALTIME", "0")
    said = favour("control")
    assert all(part in said for part in ("control: no real-time scheduling", "ROBACTOR_REALTIME is 0", "short turns"))
    assert asked == [-1]
    monkeypatch.delenv("ROBACTOR_REALTIME")
    assert favour("control") == "control: real-time scheduling, SCHED_FIFO 10"
    assert asked == [-1, os.SCHED_FIFO]


def test_a_guard_that_gets_neither_says_what_that_means(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(process: int, policy: int, parameter: object) -> None:
        raise PermissionError

    monkeypatch.delenv("ROBACTOR_REALTIME", raising=False)
    monkeypatch.setattr(os, "sched_setscheduler", refused)
    monkeypatch.setattr(priority, "short_turns", lambda: False)
    said = favour("body")
    assert said.startswith("body: no real-time scheduling here (PermissionError)")
    assert "short turns" not in said
