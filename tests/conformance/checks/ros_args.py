"""Arguments behind --ros-args."""

from __future__ import annotations

import tempfile
import warnings
from collections.abc import Iterable
from pathlib import Path

from actors.running.arguments import InvalidRosArguments, RosArguments, UnknownRosArguments, parse
from tests.conformance.checks.common import Case, Vector, each, expected, raises, refused, same, same_typed

ERRORS: dict[str, type[Exception]] = {"unknown_ros_args": UnknownRosArguments, "invalid_ros_args": InvalidRosArguments}


def parse_with_files(given: Vector) -> RosArguments:
    """Parse argv, the files it names lying in a folder of their own."""
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        paths: dict[str, str] = {}
        for name, content in given.get("files", {}).items():
            path = Path(folder, Path(name).name)
            path.write_text(content, encoding="utf-8")
            paths[name] = str(path)
        arguments = parse([paths.get(argument, argument) for argument in given["argv"]])
        return arguments.require_known() if given.get("context") == "node_or_init" else arguments


def check(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]
    if not expect["ok"]:
        raises(refused(expect["error"], ERRORS), lambda: parse_with_files(given))
        return
    got = parse_with_files(given)
    level = got.default_log_level
    expected(
        expect,
        non_ros_indices=list(got.user_indices),
        unknown_ros_indices=list(got.unknown_indices),
        remap_rules=[{**rule._asdict(), "applies_to": list(rule.applies_to)} for rule in got.remap_rules],
        default_log_level=None if level is None else level.name,
        logger_levels=[[logger, level.name] for logger, level in got.logger_levels],
        enclave=got.enclave,
        stdout_logs=got.stdout_logs,
        rosout_logs=got.rosout_logs,
        external_lib_logs=got.external_lib_logs,
        log_config_file=got.log_config_file,
        log_file_name_prefix=got.log_file_name,
    )
    if "param_overrides" in expect:
        same_entries(got.parameters.entries, expect["param_overrides"])


def same_entries(got: Iterable[tuple[str, dict[str, object]]], wanted: list[Vector]) -> None:
    """Fail unless the overrides are these, in this order of nodes and of parameters."""
    entries = list(got)
    same("nodes", [pattern for pattern, _ in entries], [entry["node"] for entry in wanted])
    for (pattern, values), entry in zip(entries, wanted, strict=True):
        same(f"parameters of {pattern}", list(values), [one["name"] for one in entry["params"]])
        for one in entry["params"]:
            same_typed(f"{pattern} {one['name']}", values[one["name"]], one)


def cases(path: Path) -> Iterable[Case]:
    return each(path, check, optional={"context", "files"})
