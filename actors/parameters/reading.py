"""Reading the parameters of one node: values, types, descriptors, names. Nothing here changes anything."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final, cast

import msgspec

from actors.parameters.descriptor import ParameterDescriptor
from actors.parameters.errors import ParameterNotDeclared, ParameterUninitialized
from actors.parameters.values import Parameter, ParameterNames, ParameterType, widened

SEPARATOR: Final = "."
UNDESCRIBED: Final = ParameterDescriptor()


class ParameterView:
    """The parameters of the node `node` (its fully qualified name), as they can be read."""

    __slots__ = ("_descriptors", "allow_undeclared", "node", "values")

    node: str
    allow_undeclared: bool
    values: dict[str, Any]
    """The plain value by name; a parameter that has no value yet is missing here."""
    _descriptors: Mapping[str, ParameterDescriptor]

    def __repr__(self) -> str:
        return f"<parameters of {self.node}: {', '.join(f'{n}={v!r}' for n, v in self.values.items())}>"

    def has(self, name: str) -> bool:
        """True if `name` is declared, with or without a value."""
        return name in self._descriptors

    def value(self, name: str) -> Any:
        """The plain value. Raises as `get`."""
        return self.get(name).value

    def get(self, name: str) -> Parameter:
        """The parameter; one without type and value if `name` is undeclared and the node allows that.

        Raises ParameterNotDeclared, and ParameterUninitialized for one that was declared by type only.
        """
        if name in self.values:
            return self._present(name)
        if name in self._descriptors:
            raise ParameterUninitialized(
                f"parameter {name!r} of node {self.node} has no value: it was declared as "
                f"{self._descriptors[name].type.name} only. Give an override, set it, or read it with get_or.",
                node=self.node,
                names=[name],
            )
        if self.allow_undeclared:
            return Parameter(name)
        raise ParameterNotDeclared.among(self.node, [name], self._descriptors)

    def get_or(self, name: str, alternative: object) -> Parameter:
        """The parameter, or one of that name with the value `alternative` if it has none. Nothing is stored."""
        if self.values.get(name) is None:
            return Parameter(name, alternative)
        return self._present(name)

    def get_by_prefix(self, prefix: str) -> dict[str, Parameter]:
        """The parameters of the group `prefix`, by their names without it; all of them for ''."""
        start = f"{prefix}{SEPARATOR}" if prefix else ""
        return {name[len(start) :]: self._present(name) for name in self._descriptors if name.startswith(start)}

    def type_of(self, name: str) -> ParameterType:
        """The type of the value that `name` has now: NOT_SET if it has none, or is undeclared where that is allowed.

        Raises ParameterNotDeclared.
        """
        if not (self.allow_undeclared and name not in self._descriptors):
            self._declared(name)
        return self._present(name).type

    def list(self, prefixes: Sequence[str] = (), depth: int = 0) -> ParameterNames:
        """The names in order of declaration.

        `depth` 0 means all levels. Without prefixes a name counts if it has fewer than `depth` separators; with
        prefixes, if it is one of them or lies in its group with fewer than `depth` separators below it.
        Raises TypeError for arguments of another type and ValueError for a negative depth.
        """
        if isinstance(prefixes, str) or not all(isinstance(cast("object", prefix), str) for prefix in prefixes):
            raise TypeError(f"prefixes must be a list of strings, not {prefixes!r}.")
        if not isinstance(cast("object", depth), int):
            raise TypeError(f"depth must be an integer, not {depth!r}.")
        if depth < 0:
            raise ValueError(f"depth must be 0 (all levels) or more, not {depth}.")
        names = tuple(name for name in self._descriptors if _is_listed(name, prefixes, depth))
        groups = dict.fromkeys(name.rpartition(SEPARATOR)[0] for name in names if SEPARATOR in name)
        return ParameterNames(names, tuple(groups))

    def describe(self, name: str) -> ParameterDescriptor:
        """The descriptor, its type following the value if typing is dynamic; empty if undeclared and that is allowed.

        Raises ParameterNotDeclared.
        """
        if self.allow_undeclared and name not in self._descriptors:
            return UNDESCRIBED
        described = self._declared(name)
        if described.dynamic_typing:
            return msgspec.structs.replace(described, type=self._present(name).type)
        return described

    def coerced(self, name: str, value: object) -> Parameter:
        """`value` as a parameter to set, widened to the type that `name` has (an int to a float, an empty list).

        For values that come from Python or a command line, where 2 may stand for 2.0. Raises TypeError and ValueError
        for what no parameter can hold; an undeclared name keeps the value's own type.
        """
        described = self._descriptors.get(name)
        return Parameter(name, value) if described is None else widened(name, value, self.describe(name).type)

    def _present(self, name: str) -> Parameter:
        """The parameter as it is, without asking whether it may be read."""
        value = self.values.get(name)
        if value is None:
            return Parameter(name)
        kind = self._descriptors[name].type
        return Parameter(name, value) if kind is ParameterType.NOT_SET else Parameter(name, value, kind)

    def _declared(self, name: str) -> ParameterDescriptor:
        try:
            return self._descriptors[name]
        except KeyError:
            raise ParameterNotDeclared.among(self.node, [name], self._descriptors) from None


def _is_listed(name: str, prefixes: Sequence[str], depth: int) -> bool:
    if not prefixes:
        return not depth or name.count(SEPARATOR) < depth
    return any(_is_in_group(name, prefix, depth) for prefix in prefixes)


def _is_in_group(name: str, prefix: str, depth: int) -> bool:
    if name == prefix:
        return True
    start = f"{prefix}{SEPARATOR}"
    return name.startswith(start) and (not depth or name.count(SEPARATOR, len(start)) < depth)
