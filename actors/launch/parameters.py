"""The parameters of nodes in launch files: values, files, and both with substitutions."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast, get_args, get_origin

from actors.launch.errors import LaunchError, SubstitutionFailure
from actors.launch.substitution import Substitution, Text, Truth, as_bool, normalized, perform, shown, yaml_value
from actors.launch.substitutions.grammar import parse_substitution
from actors.parameters.files import ALL_NODES, PARAMETERS, InvalidParams, ParameterOverrides

if TYPE_CHECKING:
    from actors.launch.context import LaunchContext


@dataclass(frozen=True)
class Layer:
    """Parameters from one source: `values`, or the `text` of a parameter file, of which `source` is the path.

    `values` are for the nodes that match `pattern`; without one, for the node itself.
    """

    values: Mapping[str, object]
    text: str | None = None
    source: str = ""
    pattern: str = ""


class ParameterValue:
    """The value of a parameter, with its type: `value_type` is bool, int, float, str, or a list of one; None for that which YAML reads."""

    def __init__(self, value: object, *, value_type: object = None) -> None:
        self.value = value
        self.value_type = value_type

    def evaluate(self, context: LaunchContext) -> object:
        """The value. Raises `SubstitutionFailure` if the text is no value of the type."""
        if not _is_text(self.value):
            return value_of(context, self.value) if self.value_type is None else self.value
        text = perform(context, cast("Text", self.value))
        if self.value_type is None:
            return _typed(text, shown(cast("Text", self.value)))
        return _as_type(context, text, self.value_type)


class Parameter:
    """A parameter by name and value."""

    def __init__(self, name: Text, value: object, *, value_type: object = None) -> None:
        self.name = normalized(name)
        self.value = ParameterValue(value, value_type=value_type)

    def evaluate(self, context: LaunchContext) -> tuple[str, object]:
        """Its name and value."""
        return perform(context, self.name), self.value.evaluate(context)


class ParameterFile:
    """A parameter file. With `allow_substs`, the substitutions in it, such as ``$(var name)``, are replaced."""

    def __init__(self, param_file: Text, *, allow_substs: Truth = False) -> None:
        self.param_file = normalized(param_file)
        self.allow_substs = allow_substs

    def layer(self, context: LaunchContext, *, flat: bool = False) -> Layer:
        """What is in the file; nothing, and a note, if there is no such file. With `flat` it may be a map of parameters without nodes.

        Raises `LaunchError`, with file and line, for what is no parameter file.
        """
        path = perform(context, self.param_file)
        if any(part.absent for part in self.param_file):
            return Layer({}, None, path)
        try:
            text = Path(path).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            context.note(LaunchError(f"parameter file {path} cannot be read, so it is left out: {_reason(error)}"))
            return Layer({}, source=path)
        if as_bool(context, self.allow_substs):
            text = perform(context, parse_substitution(text))
        if flat and PARAMETERS not in text and isinstance(values := yaml_value(text), dict):
            return Layer(_flat(context, cast("dict[Text, object]", values)))
        try:
            _checked(text, path)
        except InvalidParams as error:
            context.stand_in(LaunchError(str(error)), "")
            return Layer({}, None, path)
        return Layer({}, text, path)


@lru_cache(maxsize=64)
def _checked(text: str, source: str) -> ParameterOverrides:
    return ParameterOverrides().with_text(text, source=source)


def layers_of(context: LaunchContext, parameters: object, *, flat: bool = False) -> list[Layer]:
    """The parameters of a node in their order: those set for all nodes, then its own. `flat` files are those of components."""
    return [
        *(_global(context, each) for each in context.scoped.parameters),
        *own_layers(context, parameters, flat=flat),
    ]


def own_layers(context: LaunchContext, parameters: object, *, flat: bool = False) -> list[Layer]:
    """The parameters that are given for one node, in their order."""
    given: object = parameters
    if isinstance(given, (str, Mapping)) or not isinstance(given, Iterable):
        kind = type(parameters).__name__
        raise LaunchError(f"parameters must be a list of files and of dictionaries, not {kind}")
    found: list[Layer] = []
    for each in cast("Iterable[object]", given):
        if isinstance(each, Mapping):
            found.append(Layer(_flat(context, cast("Mapping[Text, object]", each))))
        elif isinstance(each, Parameter):
            found.append(Layer(dict([each.evaluate(context)])))
        elif isinstance(each, ParameterFile):
            found.append(each.layer(context, flat=flat))
        else:
            found.append(ParameterFile(cast("Text", each)).layer(context, flat=flat))
    return found


def value_of(context: LaunchContext, value: object) -> object:
    """The value that a parameter is given: texts as they are, substitutions as YAML reads them, sequences as tuples of one type."""
    if isinstance(value, ParameterValue):
        return value.evaluate(context)
    if isinstance(value, (str, bool, int, float)):
        return value
    if isinstance(value, Substitution):
        return _typed(perform(context, value), shown(value))
    if isinstance(value, os.PathLike):
        return os.fspath(cast("os.PathLike[str]", value))
    if isinstance(value, bytes):
        return tuple(bytes([byte]) for byte in value)
    if not isinstance(value, Sequence):
        raise LaunchError(f"{value!r:.60} of type {type(value).__name__} is no value of a parameter")
    items = cast("Sequence[object]", value)
    if any(isinstance(item, Substitution) for item in items) and all(isinstance(i, (str, Substitution)) for i in items):
        return _typed(perform(context, cast("Text", items)), shown(cast("Text", items)))  # parts of one text
    return _uniform([_item(context, item) for item in items], repr(items))


def effective(fqn: str, layers: Iterable[Layer]) -> Mapping[str, object]:
    """The parameters of the node of this full name: the last source that sets one counts. Raises `LaunchError`."""
    try:
        return _overrides(fqn, layers).for_node(fqn)
    except InvalidParams as error:
        raise LaunchError(str(error)) from error


def _overrides(fqn: str, layers: Iterable[Layer]) -> ParameterOverrides:
    overrides = ParameterOverrides()
    for layer in layers:
        if layer.text is not None:
            overrides = overrides.with_text(layer.text, source=layer.source)
        elif layer.values:
            overrides = overrides.with_mapping({layer.pattern or fqn: dict(layer.values)}, source="launch file")
    return overrides


def _global(context: LaunchContext, each: object) -> Layer:
    if isinstance(each, tuple):
        name, value = cast("tuple[str, object]", each)
        return Layer({name: value}, pattern=ALL_NODES)
    return ParameterFile(cast("str", each)).layer(context)


def _flat(context: LaunchContext, values: Mapping[Text, object], prefix: str = "") -> dict[str, object]:
    """Nested dictionaries as names with dots."""
    found: dict[str, object] = {}
    for key, value in values.items():
        name = prefix + perform(context, key)
        if isinstance(value, Mapping):
            found |= _flat(context, cast("Mapping[Text, object]", value), f"{name}.")
        else:
            found[name] = value_of(context, value)
    return found


def _is_text(value: object) -> bool:
    if isinstance(value, (str, Substitution, os.PathLike)):
        return True
    parts = cast("list[object]", value) if isinstance(value, (list, tuple)) else []
    return any(isinstance(part, Substitution) for part in parts)


def _item(context: LaunchContext, item: object) -> object:
    if isinstance(item, (list, tuple)):  # a list of texts and substitutions stands for one text
        return _typed(perform(context, cast("Text", item)), repr(cast("object", item)))
    return value_of(context, item)


def _typed(text: str, origin: str) -> object:
    value = yaml_value(text) if text else ""
    if isinstance(value, list):
        return _uniform(cast("list[object]", value), origin)
    if isinstance(value, (str, bool, int, float)):
        return value
    raise SubstitutionFailure(
        f"{origin} is {text!r:.60}, which YAML reads as {type(value).__name__}: no value of a parameter; "
        "if it is meant as a text, write ParameterValue(..., value_type=str)"
    )


def _uniform(items: list[object], origin: str) -> tuple[object, ...]:
    kinds: set[type] = {type(item) for item in items}
    if kinds == {int, float}:
        return tuple(map(float, cast("list[float]", items)))
    if len(kinds) > 1 and str in kinds:
        return tuple(str(item).lower() if isinstance(item, bool) else str(item) for item in items)
    if len(kinds) > 1 or not kinds <= {bool, int, float, str}:
        raise LaunchError(f"the items of an array are of one type: bool, int, float or str; {origin:.60} has others")
    return tuple(items)


def _as_type(context: LaunchContext, text: str, kind: Any) -> object:
    if kind is str:
        return text
    if kind is bool:
        return as_bool(context, text)
    value: object = yaml_value(text)
    if get_origin(kind) is list and isinstance(value, list):
        (inner,) = get_args(kind)
        return tuple(_as_type(context, str(item), inner) for item in cast("list[object]", value))
    try:
        return kind(text) if get_origin(kind) is None else _no(text)
    except (ValueError, TypeError):
        raise SubstitutionFailure(f"{text!r:.60} is no {getattr(kind, '__name__', kind)}") from None


def _no(text: str) -> object:
    raise ValueError(text)


def _reason(error: OSError | UnicodeDecodeError) -> str:
    return (error.strerror or str(error)) if isinstance(error, OSError) else "it is not UTF-8"
