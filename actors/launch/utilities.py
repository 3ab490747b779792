"""What launch files use besides actions and substitutions: helpers for extensions of their own, and types for annotations."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeAlias

from actors.launch.context import LaunchContext
from actors.launch.entity import LaunchDescriptionEntity, listed, one_or_more
from actors.launch.substitution import Substitution, Text, normalized, perform

SomeSubstitutionsType: TypeAlias = Text
SomeEntitiesType: TypeAlias = LaunchDescriptionEntity | Iterable[LaunchDescriptionEntity]
SomeSubstitutionsType_types_tuple = (str, os.PathLike, Substitution, Iterable)

normalize_to_list_of_substitutions = normalized
normalize_to_list_of_entities = listed


def perform_substitutions(context: LaunchContext, subs: Text) -> str:
    """The joined text of substitutions."""
    return perform(context, subs)


def ensure_argument_type(argument: object, types: object, argument_name: str, caller: str | None = None) -> None:
    """Raise TypeError unless an argument is of one of these types."""
    wanted: tuple[type, ...] = tuple(one_or_more(types))
    if not isinstance(argument, wanted):
        names = ", ".join(kind.__name__ for kind in wanted)
        raise TypeError(f"{caller or 'argument'}: {argument_name} is {argument!r:.60}, not one of: {names}")


def get_logger(name: str | None = None) -> logging.Logger:
    """A logger of Python for a launch file."""
    return logging.getLogger(name or "launch")


def make_namespace_absolute(ns: str | None) -> str | None:
    """A namespace with a slash before it; None for None."""
    return ns if ns is None or ns.startswith("/") else f"/{ns}"


def prefix_namespace(base_ns: str | None = None, ns: str | None = None) -> str | None:
    """A namespace below another one; an absolute one as it is. None if both are."""
    joined = ns
    if ns is None:
        joined = base_ns
    elif base_ns and not ns.startswith("/"):
        joined = f"{base_ns.rstrip('/')}/{ns}"
    return joined if joined is None or joined == "/" else joined.rstrip("/")


def normalize_remap_rules(
    remappings: Iterable[tuple[Text, Text]],
) -> list[tuple[list[Substitution], list[Substitution]]]:
    """The pairs of remappings, each name as a list of substitutions."""
    return [(normalized(old), normalized(new)) for old, new in remappings]


def normalize_parameters(parameters: Iterable[object]) -> list[object]:
    """Files and dictionaries of parameters, as they are: `evaluate_parameters` takes both."""
    return list(parameters)


def evaluate_parameters(context: LaunchContext, parameters: Iterable[object]) -> tuple[object, ...]:
    """What parameters come to: a dictionary for values, a path for a file."""
    from actors.launch.parameters import own_layers

    layers = own_layers(context, list(parameters))
    return tuple(Path(layer.source) if layer.source else dict(layer.values) for layer in layers)


def is_substitution(value: object) -> bool:
    """Whether a value is a substitution, or a list with one."""
    return any(isinstance(one, Substitution) for one in one_or_more(value))


def normalize_typed_substitution(value: Any, data_type: object) -> object:
    """A value whose type is to be checked: texts and substitutions as a list of substitutions, anything else as it is."""
    return normalized(value) if isinstance(value, str) or is_substitution(value) else value


def perform_typed_substitution(context: LaunchContext, value: object, data_type: object) -> Any:
    """The value of this type that a normalized value stands for. Raises `SubstitutionFailure` if it is none."""
    from actors.launch.parameters import ParameterValue

    found: object = ParameterValue(value, value_type=data_type).evaluate(context)
    return [*found] if isinstance(found, tuple) else found  # pyright: ignore[reportUnknownVariableType]
