"""The grid of a timer on a simulated clock."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.time.ros_clock import RosClock, TimerCanceled, TimerGrid
from actors.time.values import stamp_of
from tests.conformance import crossing
from tests.conformance.checks.common import Case, Unsupported, Vector, by_kind, expected, raises, refused, steps_of


def sim_timer(vector: Vector) -> None:
    clock = RosClock(lambda: 0)
    clock.activate()
    clock.set(vector["input"]["start_time_ns"])
    timer = TimerGrid(vector["input"]["period_ns"], clock.now_ns())
    timer.attach(clock)
    for step in steps_of(vector):
        expect = step.get("expect", {})
        match step["op"]:
            case "set":
                stamp = crossing.tell(Clock(clock=stamp_of(step["to"]))).clock
                clock.set(stamp.sec * 1_000_000_000 + stamp.nanosec)
            case "cancel":
                timer.cancel()
            case "reset":
                timer.reset(clock.now_ns())
            case "period":
                timer.period_ns = step["to"]
            case "enable":
                clock.activate()
            case "disable":
                clock.deactivate()
            case "call" if "error" in expect:
                raises(refused(expect["error"], {"timer_canceled": TimerCanceled}), lambda: timer.call(clock.now_ns()))
            case "call":
                call = timer.call(clock.now_ns())
                expected(
                    expect,
                    expected_call_time=call.expected,
                    actual_call_time=call.actual,
                    time_since_last_call=call.since_last,
                )
            case other:
                raise Unsupported(f"unsupported step {other!r}")
        now = clock.now_ns()
        expected(
            expect,
            ready=timer.ready(now),
            canceled=timer.canceled,
            time_until_next_call=timer.time_until_next_call(now),
        )


def cases(path: Path) -> Iterable[Case]:
    return by_kind(path, {"sim_timer": sim_timer})
