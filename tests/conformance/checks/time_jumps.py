"""Jumps of a clock: which are reported, and with what."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from actors.time import Duration
from actors.time.ros_clock import JumpThreshold, RosClock, TimeJump
from tests.conformance.checks.common import Case, Unsupported, Vector, by_kind, expected, raises, refused, steps_of

_CHANGES = {
    "ROS_TIME_NO_CHANGE": "no_change",
    "ROS_TIME_ACTIVATED": "activated",
    "ROS_TIME_DEACTIVATED": "deactivated",
}


def threshold_of(given: Vector) -> JumpThreshold:
    forward, backward = given.get("min_forward_ns"), given.get("min_backward_ns")
    return JumpThreshold(
        min_forward=None if forward is None else Duration(nanoseconds=forward),
        min_backward=None if backward is None else Duration(nanoseconds=backward),
        on_clock_change=given.get("on_clock_change", False),
    )


def threshold(vector: Vector) -> None:
    if vector["expect"]["ok"]:
        threshold_of(vector["input"])
    else:
        raises(refused(vector["expect"]["error"], {"value_error": ValueError}), lambda: threshold_of(vector["input"]))


def jump(vector: Vector) -> None:
    given = vector["input"]
    clock = RosClock(lambda: 0)
    clock.set(given["start_time_ns"])
    if given["active"]:
        clock.activate()
    heard: list[str] = []
    jumps: list[TimeJump] = []

    def post(seen: TimeJump) -> None:
        heard.append("post")
        jumps.append(seen)

    clock.on_jump(threshold_of(given), pre=lambda: heard.append("pre"), post=post)
    for step in steps_of(vector):
        heard.clear()
        jumps.clear()
        match step["op"]:
            case "set":
                clock.set(step["to"])
            case "enable":
                clock.activate()
            case "disable":
                clock.deactivate()
            case other:
                raise Unsupported(f"unsupported step {other!r}")
        expect = step.get("expect", {})
        expected(expect, callbacks=heard)
        if not jumps:
            expected(expect, delta_ns=None, clock_change=None)
        for seen in jumps:
            change = _CHANGES.get(seen.clock_change, seen.clock_change)
            expected(expect, delta_ns=seen.delta.nanoseconds, clock_change=change)


def cases(path: Path) -> Iterable[Case]:
    return by_kind(path, {"jump": jump, "threshold": threshold})
