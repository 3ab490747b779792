"""What the guard's processes ask of the operating system, and how that is switched off."""

from __future__ import annotations

import os

import pytest

from robot.link.priority import SWITCH, favour


def test_real_time_scheduling_is_asked_for_unless_it_is_switched_off(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []
    monkeypatch.setattr(os, "sched_setscheduler", lambda process, policy, parameter: asked.append(policy))
    monkeypatch.setenv(SWITCH, "0")
    assert favour("control") == "control: no real-time scheduling, as ROBACTOR_REALTIME is 0"
    assert asked == []
    monkeypatch.delenv(SWITCH)
    assert favour("control") == "control: real-time scheduling, SCHED_FIFO 10"
    assert asked == [os.SCHED_FIFO]
