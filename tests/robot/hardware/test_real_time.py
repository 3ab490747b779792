"""How fast a simulated robot is, and that people are told when it is slow; its clock is one that the test turns."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Any

import pytest

from actors.time.lockstep import Lockstep
from robot.hardware import real_time
from robot.hardware.real_time import WINDOW, RealTime


@pytest.fixture
def passes(monkeypatch: pytest.MonkeyPatch) -> Callable[[float], None]:
    now = 1000.0

    def on(seconds: float) -> None:
        nonlocal now
        now += seconds

    monkeypatch.setattr(real_time.time, "monotonic", lambda: now)
    monkeypatch.setattr(real_time.time, "process_time", lambda: 0.22 * now)
    return on


def looked(told: RealTime, passes: Callable[[float], None], factor: float, windows: int) -> list[Any]:
    """What is warned of while the robot is so fast."""
    found: list[Any] = []
    step = told._lockstep
    assert step is not None
    for _ in range(round(windows * WINDOW / 0.1)):
        passes(0.1)
        step.slipped += (1.0 - factor) * 0.1
        found.append(told.look())
    return [one for one in found if one is not None]


def execute(main: Callable[[], Any]) -> None:
    async def begin() -> None:
        main()

    asyncio.run(begin())


def test_a_machine_that_is_too_slow_is_told_once_with_the_factor_and_what_it_got(
    passes: Callable[[float], None],
) -> None:
    def main() -> None:
        Lockstep.of(asyncio.get_running_loop())
        told = RealTime()
        assert looked(told, passes, 0.4, 1) == [], "the start"
        ((text, fields),) = looked(told, passes, 0.4, 5)
        assert text == "this machine runs the robot at 0.40 of real time"
        assert fields["got"] == "22% of a core"
        assert "--clock virtual" in fields["remedy"]
        assert told.factor == pytest.approx(0.4)
        assert looked(told, passes, 1.0, 2) == []
        assert told.factor == pytest.approx(1.0)

    execute(main)


def test_a_stop_is_told_as_that_and_is_no_slowness(passes: Callable[[float], None]) -> None:
    def main() -> None:
        step = Lockstep.of(asyncio.get_running_loop())
        assert step is not None
        told = RealTime()
        looked(told, passes, 1.0, 2)
        passes(60.0)
        step.slipped += 59.9
        step.stopped += 59.9
        warning = told.look()
        assert warning is not None
        assert warning[0].startswith("the robot stood still for 59.9 s")
        assert looked(told, passes, 1.0, 3) == []
        assert told.factor == pytest.approx(1.0)

    execute(main)


def test_where_nothing_is_simulated_there_is_nothing_to_tell() -> None:
    def main() -> None:
        told = RealTime()
        time.sleep(0.01)
        assert (told.look(), told.factor) == (None, 1.0)

    execute(main)
