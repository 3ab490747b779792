"""The check of a node class's member names: none may hide a member of the framework, or a handler, by mistake.

Such a mistake would show as an error elsewhere, or as a handler that is never called. So it is refused when the class is made.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from functools import cached_property, partialmethod
from types import CodeType, FunctionType
from typing import Any, Final, NamedTuple, cast
from weakref import WeakKeyDictionary

from actors.contracts.contracts import declarations_of, positional
from actors.errors import DeclarationError
from actors.suggest import nearest

_FRAMEWORK: Final = ("actors.runtime.node", "actors.lifecycle.node")
"""The modules of the framework's node classes, whose members must not be replaced, except for the hooks."""


class _Hook(NamedTuple):
    is_async: bool
    arguments: str


_HOOKS: Final = {
    "on_start": _Hook(True, "self"),
    "on_stop": _Hook(True, "self, reason"),
    "on_error": _Hook(False, "self, error, handler"),
    "handover": _Hook(False, "self"),
    "resume": _Hook(False, "self, state"),
}
_LIFECYCLE_HOOKS: Final = {
    f"on_{name}": _Hook(True, "self, previous")
    for name in ("configure", "cleanup", "activate", "deactivate", "shutdown", "fault")
}
_SETTINGS: Final = {
    "allow_undeclared_parameters", "automatically_declare_parameters_from_overrides", "autostart", "declarations", "managed", "node_name",
}  # fmt: skip
"""The names that a node class may set, besides its hooks."""

_RESERVED: Final = {"__begin__", "__finish__", "__machinery__", "__standard_service__", "__standard_services__"}
"""The framework's names with two underscores on both sides. All other names of this form belong to Python."""

_Members = dict[str, list[tuple[type, object]]]
"""Name -> the classes that define it, the most derived one first, each with the value."""


def members_of(owner: type) -> dict[str, object]:
    """Name -> value of all members, those of base classes first. A redefinition has the place of the member that it overrides."""
    members: dict[str, object] = {}
    for base in reversed(owner.__mro__):
        members.update(vars(base))
    return members


def check_members(owner: type, declared: tuple[type, ...]) -> None:
    """Raise `DeclarationError` for a name of the node class `owner` that hides another member by mistake, or is a misspelt hook.

    `declared` are the types of those declarations that are not methods.
    """
    if owner.__module__ in _FRAMEWORK:
        return
    members: _Members = {}
    for base in owner.__mro__:
        for name, value in vars(base).items():
            members.setdefault(name, []).append((base, value))
    hooks = _HOOKS | _LIFECYCLE_HOOKS if "on_configure" in members and _is_ours(members, "on_configure") else _HOOKS
    spoken = _names_in_code(owner)
    for name, ((base, value), *hidden) in members.items():
        where = f"{owner.__name__}.{name}"
        if base.__module__ in _FRAMEWORK or base is object or (name.startswith("__") and name not in _RESERVED):
            continue
        if name in hooks:
            _check_hook(where, name, value, hooks[name])
        elif any(other.__module__ in _FRAMEWORK for other, _ in hidden):
            if name not in _SETTINGS and not _extends(name, value):
                _refuse_shadow(where, hidden)
        elif hidden:
            _check_override(where, value, *hidden[0], declared)
        _check_wrapped(where, value)
        if isinstance(value, FunctionType) and not declarations_of(value) and name not in spoken and not hidden:
            _check_spelling(where, name, value, hooks)


def has_fixed_parameters(kind: Any) -> bool:
    """Whether nodes of this class have the parameters that it declares and no others, so that another name is a mistake.

    They may have others if an option of the class says so, or if its methods speak of `declare_parameter`.
    """
    open_ended = kind.allow_undeclared_parameters or kind.automatically_declare_parameters_from_overrides
    return not open_ended and "declare_parameter" not in _names_in_code(kind)


def check_assigned(node: object) -> None:
    """Raise `DeclarationError` if an attribute of the instance hides a method of the framework, as ``self.on = False`` does.

    Only the first node of a class that starts is checked, because `vars()` makes an instance larger, and its attributes slower, for good.
    """
    kind = type(node)
    attributes, methods = vars(node), _methods(kind)
    if not methods.isdisjoint(attributes):
        name = min(methods.intersection(attributes))
        raise DeclarationError(
            f"{kind.__name__}: self.{name} = {attributes[name]!r:.60} hides the method {_described(kind, name)}: choose another name"
        )


# -- what is refused ------------------------------------------------------------------------------------------------------------


def _check_hook(where: str, name: str, function: object, hook: _Hook) -> None:
    if declarations := declarations_of(function):
        raise DeclarationError(f"{where} is a hook of the framework: {declarations[0]!r} needs another name")
    if callable(function) and not isinstance(function, FunctionType):
        return  # a callable object: whether it takes the arguments shows when it is called
    method = inspect.unwrap(function) if isinstance(function, FunctionType) else None
    takes_any = method is not None and bool(method.__code__.co_flags & inspect.CO_VARARGS)
    if (
        method is None
        or inspect.iscoroutinefunction(method) is not hook.is_async
        or not (takes_any or _takes(method, hook))
    ):
        raise DeclarationError(f"{where}: write it as `{_written(name, hook)}`")


def _refuse_shadow(where: str, hidden: list[tuple[type, object]]) -> None:
    name = where.rpartition(".")[2]
    ours = next(base for base, _ in hidden if base.__module__ in _FRAMEWORK)
    raise DeclarationError(f"{where} would take the place of {_described(ours, name)}: choose another name")


def _check_override(where: str, value: object, base: type, before: object, declared: tuple[type, ...]) -> None:
    """Refuse a member that overrides a declaration, unless it is a declaration itself, or None to drop the inherited one."""
    name = where.rpartition(".")[2]
    was_declared = declarations_of(before) or isinstance(before, declared)
    if not was_declared or value is None or declarations_of(value) or isinstance(value, declared):
        return
    was = declarations_of(before)[0] if declarations_of(before) else before
    again = "repeat the decorator above it" if declarations_of(before) else "declare it again"
    raise DeclarationError(
        f"{where} overrides {base.__name__}.{name}, which is {was!r}, and would not be so any more: {again}, "
        f"choose another name, or write `{name} = None` to do without it"
    )


def _check_wrapped(where: str, value: object) -> None:
    """Refuse a decorator such as `staticmethod` above a declaration, because it hides the declaration from the framework."""
    if not isinstance(value, (staticmethod, classmethod, property, cached_property, partialmethod)):
        return
    inner: Any = cast("Any", value)
    function = inner.fget if isinstance(value, property) else inner.func if hasattr(inner, "func") else inner.__func__
    if declarations := declarations_of(function):
        kind = type(cast("object", value)).__name__
        raise DeclarationError(f"{where} is {declarations[0]!r} and a {kind}: make it a plain method, without {kind}")


def _check_spelling(where: str, name: str, function: FunctionType, hooks: Mapping[str, _Hook]) -> None:
    """Refuse a misspelt hook, or one of another kind of node: it would never be called. Not for names that the class itself uses."""
    if name in _LIFECYCLE_HOOKS:
        raise DeclarationError(
            f"{where} is a hook of LifecycleNode, and {where.rpartition('.')[0]} is none: derive it from LifecycleNode"
            f"{', write on_stop' if name == 'on_shutdown' else ''}, or choose another name"
        )
    for meant in nearest(name, hooks, cutoff=0.85):
        hook = hooks[meant]
        if inspect.iscoroutinefunction(function) is hook.is_async and _takes(function, hook):
            raise DeclarationError(
                f"{where} is never called; did you mean `{_written(meant, hook)}`? If not, choose another name"
            )


# -- questions about members ----------------------------------------------------------------------------------------------------


def _is_ours(members: _Members, name: str) -> bool:
    return any(base.__module__ in _FRAMEWORK for base, _ in members[name])


def _extends(name: str, value: object) -> bool:
    """Whether a method calls the one that it overrides by ``super()``, and so overrides it on purpose."""
    return (
        isinstance(value, FunctionType)
        and not declarations_of(value)
        and {"super", name} <= set(value.__code__.co_names)
    )


def _names_in_code(owner: type) -> set[str]:
    """The names that the methods of the class and its bases use."""
    found: set[str] = set()
    for base in owner.__mro__:
        if base.__module__ not in _FRAMEWORK:
            for value in vars(base).values():
                if isinstance(value, FunctionType):
                    _collect_names(value.__code__, found)
    return found


def _collect_names(code: CodeType, found: set[str]) -> None:
    found.update(code.co_names)
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            _collect_names(constant, found)


def _methods(kind: type) -> frozenset[str]:
    """The names of the framework's methods that an instance attribute of a node of this class would hide."""
    known = _METHODS.get(kind)
    if known is None:
        bases = [base for base in kind.__mro__ if base.__module__ in _FRAMEWORK]
        known = _METHODS[kind] = frozenset(
            name for base in bases for name, value in vars(base).items() if isinstance(value, FunctionType)
        )
    return known


_METHODS: Final[WeakKeyDictionary[type, frozenset[str]]] = WeakKeyDictionary()


def _described(kind: type, name: str) -> str:
    """A member of the framework with the first line of its docstring: ``Node.stop ("Ask for this node's own orderly end.")``"""
    ours = next(base for base in kind.__mro__ if base.__module__ in _FRAMEWORK and name in vars(base))
    said = inspect.getdoc(vars(ours)[name]) if not name.startswith("_") else ""
    first = (said or "").partition("\n")[0]
    return f'{ours.__name__}.{name} ("{first}")' if first else f"{ours.__name__}.{name}, which is the framework's own"


def _takes(function: Callable[..., Any], hook: _Hook) -> bool:
    return positional(function) == len(hook.arguments.split(","))


def _written(name: str, hook: _Hook) -> str:
    return f"{'async ' if hook.is_async else ''}def {name}({hook.arguments})"


def check_arguments(
    kind: type[Any], base: type[object], arguments: tuple[object, ...], keywords: Mapping[str, object]
) -> None:
    """Raise `DeclarationError` unless a class that comes after `base`, which is `Node`, has an ``__init__`` that may take arguments."""
    following = kind.__mro__[kind.__mro__.index(base) + 1 : -1]
    if any("__init__" in vars(each) for each in following):
        return
    name = kind.__name__
    given = ", ".join([*map(repr, arguments), *(f"{key}={value!r}" for key, value in keywords.items())])
    raise DeclarationError(
        f"{name}: a Node is made without arguments, not with ({given:.60}): its name belongs to its place, "
        f"Child({name}, name=...), and what its own __init__ takes comes by Child({name}, args=(...))"
    )
