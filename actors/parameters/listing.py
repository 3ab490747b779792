"""The selection of names by `ParameterStore.list`: prefixes are groups, separated by dots, and depth counts levels."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final, cast

from actors.parameters.values import ParameterNames

SEPARATOR: Final = "."


def listed(declared: Iterable[str], prefixes: Sequence[str], depth: int) -> ParameterNames:
    """Return the names in `declared` that prefixes and depth select, in order, and their groups.

    Raises TypeError for arguments of another type and ValueError for a negative depth.
    """
    if isinstance(prefixes, str) or not all(isinstance(cast("object", prefix), str) for prefix in prefixes):
        raise TypeError(f"prefixes must be a list of strings, not {prefixes!r}.")
    if not isinstance(cast("object", depth), int):
        raise TypeError(f"depth must be an integer, not {depth!r}.")
    if depth < 0:
        raise ValueError(f"depth must be 0 (all levels) or more, not {depth}.")
    names = tuple(name for name in declared if _is_listed(name, prefixes, depth))
    groups = dict.fromkeys(name.rpartition(SEPARATOR)[0] for name in names if SEPARATOR in name)
    return ParameterNames(names, tuple(groups))


def _is_listed(name: str, prefixes: Sequence[str], depth: int) -> bool:
    if not prefixes:
        return not depth or name.count(SEPARATOR) < depth
    return any(_is_in_group(name, prefix, depth) for prefix in prefixes)


def _is_in_group(name: str, prefix: str, depth: int) -> bool:
    if name == prefix:
        return True
    start = f"{prefix}{SEPARATOR}"
    return name.startswith(start) and (not depth or name.count(SEPARATOR, len(start)) < depth)
