"""Parameter values and parameter files.

Edge: a file that holds plain text and no map is accepted as empty upstream; here it is refused, for it is surely a
mistake.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from actors.parameters.files import InvalidParams, ParameterOverrides, parse_value
from tests.conformance.checks.common import Case, Unsupported, Vector, by_kind, raises, refused, same, same_typed
from tests.conformance.checks.ros_args import same_entries

ERRORS: dict[str, type[Exception]] = {"invalid_value": InvalidParams, "invalid_params_file": InvalidParams}


def value(vector: Vector) -> None:
    text, expect = vector["input"]["text"], vector["expect"]
    if expect["ok"]:
        same_typed(repr(text), parse_value(text), expect)
    else:
        raises(refused(expect["error"], ERRORS), lambda: parse_value(text))


def read(sources: list[Vector]) -> ParameterOverrides:
    overrides = ParameterOverrides()
    for index, source in enumerate(sources):
        if "file" in source:
            overrides = overrides.with_text(source["file"], source=f"file {index}")
        elif "param" in source:
            overrides = overrides.with_rule(source["param"])
        else:
            raise Unsupported(f"unsupported source {source!r}")
    return overrides


def file(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]
    if not expect["ok"]:
        raises(refused(expect["error"], ERRORS), lambda: read(given["sources"]))
        return
    overrides = read(given["sources"])
    if "nodes" in expect:
        same_entries(overrides.entries, expect["nodes"])
    if "params" in expect:
        params = overrides.for_node(given["node_fqn"])
        same("parameters", set(params), set(expect["params"]))
        for name, wanted in expect["params"].items():
            same_typed(name, params[name], wanted)


def cases(path: Path) -> Iterable[Case]:
    return by_kind(path, {"value": value, "file": file}, optional={"node_fqn"})
