"""What launch files use besides actions and substitutions: helpers for extensions of their own, and types for annotations."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterable
from typing import Any, TypeAlias

from actors.launch.context import LaunchContext
from actors.launch.entity import LaunchDescriptionEntity, listed, one_or_more
from actors.launch.substitution import Substitution, Text, normalized, perform

__all__ = [
    "SomeEntitiesType",
    "SomeSubstitutionsType",
    "SomeSubstitutionsType_types_tuple",
    "ensure_argument_type",
    "get_logger",
    "normalize_to_list_of_entities",
    "normalize_to_list_of_substitutions",
    "perform_substitutions",
]

SomeSubstitutionsType: TypeAlias = Text
SomeEntitiesType: TypeAlias = LaunchDescriptionEntity | Iterable[LaunchDescriptionEntity]
SomeSubstitutionsType_types_tuple = (str, os.PathLike, Substitution, Iterable)

normalize_to_list_of_substitutions = normalized
normalize_to_list_of_entities = listed


def perform_substitutions(context: LaunchContext, subs: Text) -> str:
    """The joined text of substitutions."""
    return perform(context, subs)


def ensure_argument_type(argument: object, types: Any, argument_name: str, caller: str | None = None) -> None:
    """Raise TypeError unless an argument is of one of these types."""
    wanted: tuple[type, ...] = tuple(one_or_more(types))
    if not isinstance(argument, wanted):
        names = ", ".join(kind.__name__ for kind in wanted)
        raise TypeError(f"{caller or 'argument'}: {argument_name} is {argument!r:.60}, not one of: {names}")


def get_logger(name: str | None = None) -> logging.Logger:
    """A logger of Python for a launch file."""
    return logging.getLogger(name or "launch")
