"""Logging levels, and the filters of a log call."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from actors.logs.levels import CallSites, Level, LevelTree
from actors.names.names import child_logger_name
from tests.conformance.checks.common import Case, Vector, by_kind, expected, raises, refused, same

_ERRORS: dict[str, type[Exception]] = {
    "type_error": TypeError,
    "value_error": ValueError,
    "invalid_argument": ValueError,
}


class At:
    """A clock that stands still until it is told another time."""

    def __init__(self) -> None:
        self.nanoseconds = 0

    def now_ns(self) -> int:
        return self.nanoseconds


def effective(vector: Vector) -> None:
    tree = LevelTree(Level.parse(vector["input"]["default"]))
    for logger, level in vector["input"]["levels"].items():
        tree.set(logger, Level.parse(level))
    for query in vector["input"]["queries"]:
        same(query, tree.effective(query).name, vector["expect"][query])


def set_level(vector: Vector) -> None:
    expect, tree = vector["expect"], LevelTree()
    if not expect["ok"]:
        raises(refused(expect["error"], _ERRORS), lambda: tree.set("logger", vector["input"]["severity"]))
        return
    tree.set("logger", vector["input"]["severity"])
    expected(expect, name=tree.get("logger").name)


def parse_level(vector: Vector) -> None:
    expect, text = vector["expect"], vector["input"]["text"]
    if expect["ok"]:
        expected(expect, severity=int(Level.parse(text)))
    else:
        raises(refused(expect["error"], _ERRORS), lambda: Level.parse(text))


def options_of(given: Vector, clock: At) -> Vector:
    """The options of a log call; a time source, whatever its name, is the clock of the script."""
    options = dict(given)
    for name in ("throttle_time_source", "throttle_time_source_type"):
        if name in options:
            del options[name]
            options["throttle_time_source_type"] = clock
    return options


def filter_calls(vector: Vector) -> None:
    sites, clock = CallSites(), At()
    given = options_of(vector["input"]["options"], clock)
    logged: list[bool] = []
    for seconds in vector["input"]["call_times_s"]:
        clock.nanoseconds = round(seconds * 1e9)
        logged.append(sites.allow("here", "logger", Level.INFO, given, clock))
    expected(vector["expect"], logged=logged)


def options(vector: Vector) -> None:
    sites, clock, expect = CallSites(), At(), vector["expect"]

    def call_all() -> None:
        for call in vector["input"]["calls_from_one_site"]:
            given = options_of(call, clock)
            logger = given.pop("name", "logger")
            level = given.pop("severity", Level.INFO)
            sites.allow("here", logger, Level.parse(level) if isinstance(level, str) else level, given, clock)

    if expect["ok"]:
        call_all()
    else:
        raises(refused(expect["error"], _ERRORS), call_all)


def logger_name(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]

    def build() -> str:
        name = child_logger_name("", given["get_logger"])
        return child_logger_name(name, given["get_child"]) if "get_child" in given else name

    if expect["ok"]:
        expected(expect, name=build())
    else:
        raises(refused(expect["error"], _ERRORS), build)


def cases(path: Path) -> Iterable[Case]:
    checks = {
        "effective": effective,
        "set_level": set_level,
        "parse_level": parse_level,
        "filter": filter_calls,
        "options": options,
        "logger_name": logger_name,
    }
    return by_kind(path, checks)
