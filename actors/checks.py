"""The checks of declared values: each passes the value on, or says which option is wrong, where, and what it may be. And the metaclass of
classes that a program does not call."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, NoReturn, ParamSpec, TypeGuard, TypeVar, get_args

from actors.errors import DeclarationError
from actors.names.names import normalize_namespace, validate_node_name

P = ParamSpec("P")
T = TypeVar("T")


def is_whole(value: object) -> bool:
    """An int that is not a bool."""
    return isinstance(value, int) and not isinstance(value, bool)


def is_flag(value: object) -> bool:
    """A bool, or one of numpy, as a comparison of its numbers gives it."""
    kind = type(value)
    return kind is bool or (kind.__module__ == "numpy" and kind.__name__ in ("bool", "bool_"))


def is_number(value: object) -> TypeGuard[float]:
    """An int or a float that is neither a bool nor NaN."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and value == value


def one_of(choices: object) -> str:
    """The values of a Literal, for a sentence."""
    *first, last = get_args(choices)
    return f"{', '.join(first)} or {last}"


def shown(value: object) -> str:
    """The representation of a value for a sentence, cut to 80 characters: a declared tree may be some 10 kB long."""
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."


def factory_name(factory: object) -> str:
    """How a factory is called in sentences."""
    return str(getattr(factory, "__name__", None) or shown(factory))


def class_of_node(value: object) -> str | None:
    """The name of the class of a node that has been made; None for anything else."""
    return type(value).__name__ if hasattr(value, "__machinery__") and not isinstance(value, type) else None


def default_name(factory: object) -> str:
    """A child's id when none is given: the factory's `node_name`, or its name in snake_case, spelled as rosidl does."""
    chosen = getattr(factory, "node_name", None)
    if isinstance(chosen, str):
        return chosen
    name = getattr(factory, "__name__", "")
    if not name.isidentifier():
        raise DeclarationError(f"Child({factory_name(factory)}): it has no name of its own; give it one: name=...")
    name = re.sub(r"(.)([A-Z][a-z]+)", r"\1_\2", name)
    return re.sub(r"([a-z0-9])([A-Z])", r"\1_\2", name).lower()


def checked_name(where: str, name: object) -> str:
    """An id: a text that can be a part of a path."""
    if not isinstance(name, str) or not name or "/" in name:
        raise DeclarationError(f"{where}: name must be a text that is not empty and has no '/', not {shown(name)}")
    return name


def check_place(where: str, name: str, namespace: object, remap: Mapping[str, str]) -> None:
    """The ROS names of a node: its own, its namespace, and the names that it uses other ones for."""
    try:
        validate_node_name(name)
        if namespace:
            if not isinstance(namespace, str):
                raise ValueError(f"namespace must be a text such as '/robot1', not {shown(namespace)}")
            normalize_namespace(namespace)
        if remap:
            from actors.names.remapping import Rule  # late: few trees remap

            for old, new in remap.items():
                Rule.parse(f"{old}:={new}")
    except ValueError as problem:
        raise DeclarationError(f"{where}: {problem}") from None


def checked_choice(where: str, option: str, value: object, choices: object) -> None:
    """One of the values of a Literal."""
    if value not in get_args(choices):
        raise DeclarationError(f"{where}: {option} must be {one_of(choices)}, not {shown(value)}")


def checked_mapping(where: str, option: str, value: object) -> dict[object, object]:
    """A copy of a mapping; None is an empty one."""
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        raise DeclarationError(f"{where}: {option} must be a mapping, not {shown(value)}")
    return dict(value)  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]


def checked_sequence(where: str, option: str, value: object) -> tuple[object, ...]:
    """A list or tuple, as a tuple."""
    if isinstance(value, str) or not isinstance(value, Sequence):
        raise DeclarationError(f"{where}: {option} must be a list or a tuple, not {shown(value)}")
    return tuple(value)  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]


def checked_flag(where: str, option: str, value: object) -> bool:
    """A bool, and nothing that merely looks like one."""
    if not isinstance(value, bool):
        raise DeclarationError(f"{where}: {option} must be True or False, not {shown(value)}")
    return value


def whole_text(text: str) -> str:
    """The text with each surrogate pair, JSON's way to write a character such as an emoji, as that character.

    Raises `UnicodeDecodeError` for half of a pair.
    """
    return text if text.isascii() else text.encode("utf-16-le", "surrogatepass").decode("utf-16-le")


if TYPE_CHECKING:

    def create(kind: Callable[P, T], /, *args: P.args, **keywords: P.kwargs) -> T: ...
else:
    create = type.__call__
"""Make an object of a class without a public constructor: ``create(Clock, loop)``."""


class NoPublicConstructor(type):
    """A class of this metaclass cannot be called: the error says what gives an object of it, in the words of the class's docstring.

    The framework makes one by `create`. Classes of which there is one object for each tick or each node do without this metaclass, because
    it costs a quarter of a microsecond, and so do plain values, which anyone may make.
    """

    if not TYPE_CHECKING:

        def __call__(cls, *args: object, **keywords: object) -> NoReturn:
            text = " ".join((cls.__doc__ or "").split())
            said = re.search(r"no public constructor: (.*?)\.(?= [A-Z`]|$)", text)
            raise TypeError(f"{cls.__name__} has no public constructor{': ' + said[1] if said else ''}")
