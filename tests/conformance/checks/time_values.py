"""Time and Duration."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from actors.time import ClockType, Duration, Time
from tests.conformance.checks.common import Case, Unsupported, Vector, by_kind, expected, number, raises, refused, same

_ERRORS: dict[str, type[Exception]] = {
    "type_error": TypeError,
    "value_error": ValueError,
    "overflow_error": OverflowError,
}
_OPERATORS: dict[str, Callable[[Any, Any], Any]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "//": operator.floordiv,
    "%": operator.mod,
    "==": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}


def clock_type(name: object) -> Any:
    return ClockType(name) if name in ClockType.__members__ else name


def construct(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]
    arguments = {key: number(given[key]) for key in ("seconds", "nanoseconds") if key in given}
    if given["what"] == "time" and given.get("clock") is not None:
        arguments["clock_type"] = clock_type(given["clock"])
    make: Callable[..., Time | Duration] = Time if given["what"] == "time" else Duration
    if expect["ok"]:
        made = make(**arguments)
        expected(expect, nanoseconds=made.nanoseconds)
        if isinstance(made, Time):
            expected(expect, clock=str(made.clock_type))
    else:
        raises(refused(expect["error"], _ERRORS), lambda: make(**arguments))


def operand(given: Any) -> Any:
    if not isinstance(given, dict):
        return number(given)
    if given["is"] == "duration":
        return Duration(nanoseconds=given["nanoseconds"])
    return Time(nanoseconds=given["nanoseconds"], clock_type=clock_type(given.get("clock", "ROS_TIME")))


def operators(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]
    if given["op"] not in _OPERATORS:
        raise Unsupported(f"unsupported operator {given['op']!r}")
    left, right, apply = operand(given["left"]), operand(given["right"]), _OPERATORS[given["op"]]
    if not expect["ok"]:
        raises(refused(expect["error"], _ERRORS), lambda: apply(left, right))
        return
    wanted = operand(expect["result"])
    got = apply(left, right)
    same("type", type(got), type(wanted))
    same("result", got, wanted)


def to_msg(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]
    make: Callable[..., Time | Duration] = Time if given["what"] == "time" else Duration
    value = make(nanoseconds=given["nanoseconds"])
    msg = value.to_msg()
    expected(expect, sec=msg.sec, nanosec=msg.nanosec)


def from_msg(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]
    msg = SimpleNamespace(sec=given["sec"], nanosec=given["nanosec"])
    if given["what"] == "duration":
        expected(expect, nanoseconds=Duration.from_msg(msg).nanoseconds)
        return
    clock = given.get("clock")
    time = Time.from_msg(msg) if clock is None else Time.from_msg(msg, clock_type(clock))
    expected(expect, nanoseconds=time.nanoseconds, clock=str(time.clock_type))


def cases(path: Path) -> Iterable[Case]:
    return by_kind(
        path,
        {"construct": construct, "operator": operators, "to_msg": to_msg, "from_msg": from_msg},
        optional={"clock"},
    )
