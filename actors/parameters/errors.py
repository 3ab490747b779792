"""The errors of parameters, one class per cause.

A refused *set* is not an error but a `SetResult`. These are raised for wrong declarations and wrong names. Each has `node` (the fully
qualified name) and `names` (the parameters concerned).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Self

from actors.errors import ActorError
from actors.suggest import did_you_mean


class ParameterError(ActorError):
    """The base class of all parameter errors. `node` is the fully qualified node name, `names` are the parameters concerned."""

    def __init__(self, message: str, *, node: str = "", names: Iterable[str] = ()) -> None:
        super().__init__(message)
        self.node = node
        self.names = tuple(names)


class ParameterNotDeclared(ParameterError, LookupError):
    """A parameter was used that the node has not declared, and the node does not allow undeclared parameters."""

    @classmethod
    def among(cls, node: str, names: Iterable[str], declared: Iterable[str]) -> ParameterNotDeclared:
        """Create the error for `names`, with the most similar declared name as a hint."""
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
    """A parameter name is not a non-empty string."""


class InvalidParameterType(ParameterError, TypeError):
    """An override has a type other than the declared one."""


class InvalidParameterValue(ParameterError, ValueError):
    """A value is outside its range or choices, or was refused by an on-set callback. `reason` says which."""

    def __init__(self, message: str, *, node: str = "", names: Iterable[str] = (), reason: str = "") -> None:
        super().__init__(message, node=node, names=names)
        self.reason = reason


class ParameterImmutable(ParameterError):
    """A read-only parameter cannot be undeclared or given a new descriptor."""


class ParameterUninitialized(ParameterError, LookupError):
    """A parameter declared by type only was read before it had a value."""

    @classmethod
    def of(cls, node: str, name: str, type: str) -> Self:
        """Create the error for a parameter of this type and name."""
        return cls(
            f"parameter {name!r} of node {node} has no value: it was declared as "
            f"{type} only. Give an override, set it, or read it with get_or.",
            node=node,
            names=[name],
        )


class ParameterBusy(ParameterError, RuntimeError):
    """A parameter callback tried to change parameters of its own node."""
