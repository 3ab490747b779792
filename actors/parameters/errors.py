"""Everything that can go wrong with parameters, one class per reason.

A refused *set* is not an error but a `SetResult`; these are raised for wrong declarations and wrong names.
Every one carries `node` (fully qualified name) and `names` (the parameters concerned).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Self

from actors.errors import ActorError
from actors.suggest import did_you_mean


class ParameterError(ActorError):
    """Base of all parameter errors. `node` is the fully qualified node name, `names` the parameters concerned."""

    def __init__(self, message: str, *, node: str = "", names: Iterable[str] = ()) -> None:
        super().__init__(message)
        self.node = node
        self.names = tuple(names)


class ParameterNotDeclared(ParameterError, LookupError):
    """A parameter was used that the node never declared, and the node does not allow undeclared ones."""

    @classmethod
    def among(cls, node: str, names: Iterable[str], declared: Iterable[str]) -> ParameterNotDeclared:
        """The error for `names`, with the nearest declared name as a hint."""
        missing = tuple(names)
        known = sorted(declared)
        hint = did_you_mean(missing[0], known, "did") or f"declared are: {', '.join(known)}."
        shown = ", ".join(repr(name) for name in missing)
        return cls(
            f"node {node} has not declared {shown}; {hint} "
            "Declare a parameter before using it, or let the node allow undeclared parameters.",
            node=node,
            names=missing,
        )


class ParameterAlreadyDeclared(ParameterError):
    """A parameter was declared twice on one node."""

    def __init__(self, node: str, names: Iterable[str]) -> None:
        twice = tuple(names)
        shown = ", ".join(repr(name) for name in twice)
        super().__init__(
            f"node {node} has already declared {shown}; set the value instead, or undeclare it first.",
            node=node,
            names=twice,
        )


class InvalidParameterName(ParameterError, ValueError):
    """A parameter name that cannot be used: it must be a non-empty string."""


class InvalidParameterType(ParameterError, TypeError):
    """An override has another type than the declaration."""


class InvalidParameterValue(ParameterError, ValueError):
    """A declared value breaks its range or choices, or an on-set callback refused it. `reason` says which."""

    def __init__(self, message: str, *, node: str = "", names: Iterable[str] = (), reason: str = "") -> None:
        super().__init__(message, node=node, names=names)
        self.reason = reason


class ParameterImmutable(ParameterError):
    """A read-only parameter was to be undeclared or described anew."""


class ParameterUninitialized(ParameterError, LookupError):
    """A parameter declared by type only was read before it had a value."""

    @classmethod
    def of(cls, node: str, name: str, type: str) -> Self:
        """The error for a parameter of this type, by its name."""
        return cls(
            f"parameter {name!r} of node {node} has no value: it was declared as "
            f"{type} only. Give an override, set it, or read it with get_or.",
            node=node,
            names=[name],
        )


class ParameterBusy(ParameterError, RuntimeError):
    """A parameter callback tried to change parameters of its own node."""
