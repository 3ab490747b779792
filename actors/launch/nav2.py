"""The substitutions of Nav2's package `nav2_common`, which many launch files of robots use, for where it is not installed."""

from __future__ import annotations

import atexit
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

from actors.launch.conditions import Condition
from actors.launch.context import LaunchContext
from actors.launch.errors import LaunchError
from actors.launch.looking import looking
from actors.launch.substitution import Substitution, Text, normalized, perform, shown, yaml_value
from actors.launch.substitutions.values import LaunchConfiguration
from actors.parameters.ros_yaml import dump_yaml


class RewrittenYaml(Substitution):
    """The path of a copy of a YAML file with other values.

    `param_rewrites` replaces the values of all keys of these names (``a.b.c`` for one place), `value_rewrites` whole values, `key_rewrites`
    names of keys; with `root_key` everything stands below that key.
    """

    def __init__(
        self,
        source_file: Text,
        param_rewrites: Mapping[str, Text],
        root_key: Text | None = None,
        key_rewrites: Mapping[str, Text] | None = None,
        convert_types: bool = False,
        value_rewrites: Mapping[str, Text] | None = None,
    ) -> None:
        self.source_file = normalized(source_file)
        self.param_rewrites = dict(param_rewrites)
        self.root_key = None if root_key is None else normalized(root_key)
        self.key_rewrites = dict(key_rewrites or {})
        self.value_rewrites = dict(value_rewrites or {})
        self.convert_types = convert_types

    @property
    def name(self) -> list[Substitution]:
        """The file that is copied."""
        return self.source_file

    def describe(self) -> str:
        return f"RewrittenYaml({shown(self.source_file)})"

    def perform(self, context: LaunchContext) -> str:
        source = Path(perform(context, self.source_file))
        if not source.is_file():
            return context.stand_in(LaunchError(f"there is no file {source}"), str(source))
        content = yaml_value(source.read_text(encoding="utf-8"))
        texts = {key: perform(context, value) for key, value in self.param_rewrites.items()}
        keys = {key: perform(context, value) for key, value in self.key_rewrites.items()}
        values = {key: perform(context, value) for key, value in self.value_rewrites.items()}
        content = self._rewritten(content, "", texts, keys, values)
        root = "" if self.root_key is None else perform(context, self.root_key)
        if root:
            content = {root: content}
        return _copy(dump_yaml(content), ".yaml")

    def _rewritten(
        self, value: object, path: str, texts: Mapping[str, str], keys: Mapping[str, str], values: Mapping[str, str]
    ) -> object:
        if isinstance(value, dict):
            found: dict[str, object] = {}
            for key, inner in cast("dict[str, object]", value).items():
                place = f"{path}.{key}" if path else str(key)
                text = texts.get(place, texts.get(str(key)))
                if text is not None and not isinstance(inner, dict):
                    found[keys.get(key, key)] = self._converted(text)
                else:
                    found[keys.get(key, key)] = self._rewritten(cast("Any", inner), place, texts, keys, values)
            return found
        if isinstance(value, list):
            return [self._rewritten(item, path, texts, keys, values) for item in cast("list[object]", value)]
        return self._converted(values[value]) if isinstance(value, str) and value in values else value

    def _converted(self, text: str) -> object:
        return yaml_value(text) if self.convert_types or text.lower() in ("true", "false") else text


class ReplaceString(Substitution):
    """The path of a copy of a file in which texts are replaced; of the file itself, if the condition does not hold."""

    def __init__(self, source_file: Text, replacements: Mapping[str, Text], condition: Condition | None = None) -> None:
        self.source_file = normalized(source_file)
        self.replacements = dict(replacements)
        self.condition = condition

    def describe(self) -> str:
        return f"ReplaceString({shown(self.source_file)})"

    def perform(self, context: LaunchContext) -> str:
        source = Path(perform(context, self.source_file))
        if self.condition is not None and not self.condition.evaluate(context):
            return str(source)
        if not source.is_file():
            return context.stand_in(LaunchError(f"there is no file {source}"), str(source))
        text = source.read_text(encoding="utf-8")
        for old, new in self.replacements.items():
            text = text.replace(old, perform(context, new))
        return _copy(text, source.suffix)


def _copy(text: str, suffix: str) -> str:
    """The path of a temporary file, which processes that are started later may read; it ends with this process."""
    with looking(False), tempfile.NamedTemporaryFile("w", suffix=suffix, delete=False, encoding="utf-8") as file:
        file.write(text)
    atexit.register(Path(file.name).unlink, missing_ok=True)
    return file.name


class HasNodeParams(Substitution):
    """``True`` if a parameter file has parameters for this node."""

    def __init__(self, source_file: Text, node_name: str) -> None:
        self.source_file = normalized(source_file)
        self.node_name = node_name

    def describe(self) -> str:
        return f"HasNodeParams({shown(self.source_file)}, {self.node_name!r})"

    def perform(self, context: LaunchContext) -> str:
        source = Path(perform(context, self.source_file))
        if not source.is_file():
            return context.stand_in(LaunchError(f"there is no file {source}"), "False")
        content = yaml_value(source.read_text(encoding="utf-8"))
        return str(isinstance(content, dict) and self.node_name in content)


class LaunchConfigAsBool(LaunchConfiguration):
    """The value of a launch configuration as ``True`` or ``False``."""

    def perform(self, context: LaunchContext) -> str:
        return str(super().perform(context).strip().lower() in ("true", "1", "yes", "on"))


class ParseMultiRobotPose:
    """Several robots in an argument, ``robots:="r1={x: 1.0}; r2={x: 2.0}"``."""

    def __init__(self, target_argument: str) -> None:
        import sys

        given = (one.partition(":=") for one in sys.argv)
        self.text = next((value for name, _, value in given if name == target_argument), "")

    def value(self) -> dict[str, dict[str, float]]:
        """Name of each robot -> its pose."""
        found: dict[str, dict[str, float]] = {}
        for part in self.text.split(";"):
            name, _, pose = part.partition("=")
            values = yaml_value(pose.strip())
            if name.strip() and isinstance(values, dict):
                pose_of = cast("dict[str, float]", values)
                found[name.strip()] = {
                    key: float(pose_of.get(key, 0.0)) for key in ("x", "y", "z", "roll", "pitch", "yaw")
                }
        return found
