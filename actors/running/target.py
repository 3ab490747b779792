"""Finding and making the tree that ``MODULE:TREE`` names on a command line."""

from __future__ import annotations

import asyncio
import importlib
import inspect
import os
import sys
from collections.abc import Awaitable, Callable, Mapping
from types import ModuleType
from typing import TypeAlias, cast

from actors.errors import described
from actors.places import origin_of, place_of
from actors.runtime.node import Node
from actors.supervision.child import Child
from actors.supervision.declarations import DynamicSupervisor, Supervisor

MAKING_SECONDS = 60.0
"""How long an async function may take to make a tree, seconds on the loop's clock."""

Tree: TypeAlias = Supervisor | DynamicSupervisor | Child | type[Node]
Maker: TypeAlias = Callable[[], object]


class Unusable(ValueError):
    """The name does not lead to a tree that can be run."""


def find(name: str) -> Maker:
    """The maker of the tree that ``MODULE:TREE`` names, which may be a tree, a child, a node class, or a function that makes one.

    The function takes no arguments, and may be async. The current folder is searched first. Raises `Unusable`.
    """
    module_name, _, attribute = name.partition(":")
    if not module_name or not attribute:
        raise Unusable(f"{name!r}: write MODULE:TREE, such as my_robot.tree:tree")
    if module_name.endswith(".py"):
        dotted = module_name.removesuffix(".py").strip("./").replace("/", ".")
        raise Unusable(f"{name!r}: name the module as an import does: {dotted}:{attribute}")
    module = _imported(module_name)
    found: object = module
    for part in attribute.split("."):
        if not hasattr(found, part):
            known = ", ".join(sorted(_trees_in(module))) or "none"
            raise Unusable(f"{name!r}: {module_name} has nothing of the name {attribute!r}; trees that it has: {known}")
        found = getattr(found, part)
    if _is_tree(found) or _is_for_hosts(found):
        return lambda: found
    if isinstance(found, type) or not callable(found):
        raise Unusable(f"{name!r} is {_called(found)}: neither a tree, nor a node class, nor a function that makes one")
    try:
        inspect.signature(found).bind()
    except TypeError as error:
        raise Unusable(f"{name!r}: it is called without arguments, and cannot be: {error}") from None
    except ValueError:  # a callable without a signature
        pass
    return cast("Maker", found)


async def grown(make: Maker) -> list[Tree]:
    """Call the maker. Returns what is to be run side by side: one tree, or several nodes or children. Raises `Unusable`."""
    return _trees(await _made(make))


async def grown_hosts(make: Maker) -> dict[str, list[Tree]]:
    """Call the maker. Returns what is to be run side by side on each host, by name; empty if it made a tree for no host in particular.

    Raises `Unusable`.
    """
    made = await _made(make)
    if not isinstance(made, Mapping):
        return {}
    hosts = cast("Mapping[object, object]", made)
    return {str(host): _trees(trees) for host, trees in hosts.items()}


async def _made(make: Maker) -> object:
    try:
        made = make()
        if inspect.isawaitable(made):
            async with asyncio.timeout(MAKING_SECONDS):
                made = await cast("Awaitable[object]", made)
    except TimeoutError:
        raise Unusable(
            f"what should make a tree had made none after {MAKING_SECONDS:g} s: it is to return a tree, not to run it"
        ) from None
    except Exception as error:
        raise Unusable(f"the tree could not be made: {described(error)} (at {place_of(error)})") from error
    return made


def _trees(made: object) -> list[Tree]:
    trees = _side_by_side(made)
    if not trees or not all(_is_tree(tree) for tree in trees):
        raise Unusable(f"what should make a tree made {_called(made)}: return a Supervisor, a Child or a node class")
    return cast("list[Tree]", trees)


def _imported(name: str) -> ModuleType:
    if os.getcwd() not in sys.path:
        sys.path.insert(0, os.getcwd())
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name is not None and (name == error.name or name.startswith(f"{error.name}.")):
            raise Unusable(f"no module named {name!r}, neither here in {os.getcwd()} nor installed") from None
        raise Unusable(f"{name} cannot be imported: {error} (at {_line_in_user(error)})") from error
    except (Exception, SystemExit) as error:
        raise Unusable(f"{name} cannot be imported: {described(error)} (at {_line_in_user(error)})") from error


def _line_in_user(error: BaseException) -> str:
    """The line at which the import failed, in the module or in one that it imports."""
    if isinstance(error, SyntaxError) and error.filename is not None:
        return f"{error.filename}:{error.lineno}"
    place = origin_of(error)
    return f"{place.file}:{place.line}" if place is not None else "its import"


def _side_by_side(made: object) -> list[object]:
    return list(cast("list[object]", made)) if isinstance(made, (list, tuple)) else [made]


def _is_tree(value: object) -> bool:
    return isinstance(value, (Supervisor, DynamicSupervisor, Child)) or (
        isinstance(value, type) and issubclass(value, Node)
    )


def _is_for_hosts(value: object) -> bool:
    """Whether it may be a mapping from hosts to trees; the trees are looked at when they are made."""
    return isinstance(value, Mapping)


def _trees_in(module: ModuleType) -> list[str]:
    """The names of the trees, node classes and functions that are defined in the module itself."""
    return [
        name
        for name, value in vars(module).items()
        if not name.startswith("_")
        and (
            isinstance(value, (Supervisor, DynamicSupervisor, Child))
            or (getattr(value, "__module__", "") == module.__name__ and (_is_tree(value) or inspect.isfunction(value)))
        )
    ]


def _called(value: object) -> str:
    if isinstance(value, type):
        return f"the class {value.__name__}"
    kind, text = type(value).__name__, f"{value!r:.60}"
    return text if text.startswith(kind) else f"{kind} {text}"
