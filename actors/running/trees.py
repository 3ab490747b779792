"""Making one tree of the arguments of `run`: a tree, a child, a node class, or several of these."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from typing import Any, TypeAlias, cast

from actors.checks import factory_name
from actors.errors import DeclarationError
from actors.runtime.node import Node
from actors.supervision.child import Child
from actors.supervision.declarations import DynamicSupervisor, Spec, Supervisor

Runnable: TypeAlias = Spec | type[Node] | Sequence[Spec | type[Node]]
"""What `run` takes: a node class stands for `Child(class)`, several children for a supervisor of them."""


def tree_of(where: str, *given: Runnable) -> Supervisor | DynamicSupervisor:
    """The tree to run: a single supervisor as it is, anything else below a plain supervisor called "system".

    Raises `DeclarationError`, whose text begins with `where`, for an object that is no part of a tree, and if nothing is given.
    """
    if len(given) == 1 and isinstance(given[0], (Supervisor, DynamicSupervisor)):
        return given[0]
    children: list[Spec] = []
    for one in given:
        several = cast("Sequence[object]", one) if isinstance(one, (list, tuple)) else (one,)
        children += [_spec_of(where, each) for each in several]
    if not children:
        raise DeclarationError(f"{where}: there is nothing to run; give it a node class, a Child or a Supervisor")
    return Supervisor("system", *children)


def _spec_of(where: str, given: object) -> Spec:
    if isinstance(given, (Child, Supervisor, DynamicSupervisor)):
        return given
    if isinstance(given, type) and issubclass(given, Node):
        return Child(given)
    raise DeclarationError(
        f"{where}: {_remedy(cast('Any', given))}; what runs is a node class, a Child, a Supervisor, or a list of these"
    )


def _remedy(given: object) -> str:
    """The part of an error text that says what was given, and what to write instead."""
    if isinstance(given, Node):
        name = type(given).__name__
        return f"{given!r} is a node already made: give its class, {name}, which is made anew for every life"
    if isinstance(given, type):
        return f"the class {given.__name__} is no Node: derive it from Node"
    if inspect.iscoroutine(given):
        given.close()
        return f"{given.__qualname__}() is a coroutine: give the tree here, and run the program with execute({given.__qualname__})"
    if callable(given):
        name = factory_name(given)
        return f"{name} is a function: write {name}() if it returns the tree, Child({name}) if it makes the node"
    return f"{given!r:.60} is {type(given).__name__}, no part of a tree"
