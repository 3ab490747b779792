"""`Declaration`: the base of the values that a tree is declared with."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import cache
from operator import attrgetter
from typing import ClassVar, Self, TypeVar, cast

D = TypeVar("D", bound="Declaration")


class Declaration(ABC):
    """Base of the values of a tree: immutable, compared by content, and shown without options that have their default."""

    __slots__ = ()
    _stored_defaults: ClassVar[dict[str, object]] = {}
    """Option -> the value that is stored for its default, where that differs from the default."""

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"{self!r} is a declaration and never changes; .replace({name}=...) makes a changed copy")

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"{self!r} is a declaration and never changes")

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and self._fields() == other._fields()

    __hash__ = None  # type: ignore[assignment]  # parameters and arguments may be unhashable

    def __repr__(self) -> str:
        fields = self._fields()
        keywords: dict[str, object] = getattr(type(self).__init__, "__kwdefaults__", {})
        plain = keywords | self._stored_defaults | {"name": fields["name"]}
        shown = [f"{name}={value!r}" for name, value in fields.items() if value != plain.get(name, value)]
        return f"{type(self).__name__}({', '.join([*self._positional(), *shown])})"

    def __reduce__(
        self,
    ) -> tuple[Callable[[type[Self], dict[str, object]], Self], tuple[type[Self], dict[str, object]]]:
        return _rebuild, (type(self), self._fields())

    def replace(self, **changes: object) -> Self:
        """A copy with these options changed, which is checked like a new declaration. Raises `DeclarationError`."""
        return _rebuild(type(self), self._fields() | changes)

    def varied(self, **changes: object) -> Self:
        """A copy with these options changed, which are valid: nothing is checked."""
        copy, (values, setters) = object.__new__(type(self)), _slots(type(self))
        for put, value in zip(setters, values(self), strict=True):
            put(copy, value)
        for name, value in changes.items():
            object.__setattr__(copy, name, value)
        return copy

    def _fields(self) -> dict[str, object]:
        names: tuple[str, ...] = self.__slots__
        return {name: getattr(self, name) for name in names}

    @abstractmethod
    def _positional(self) -> list[str]: ...

    def _set(self, **values: object) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, value)


@cache
def _slots(kind: type[Declaration]) -> tuple[Callable[[object], tuple[object, ...]], list[Callable[..., None]]]:
    """What reads all slots of a declaration, and what sets each of them: a supervisor makes a declaration for each instance of its template."""
    names = cast("tuple[str, ...]", kind.__slots__)
    return attrgetter(*names), [getattr(kind, name).__set__ for name in names]


def _rebuild(kind: type[D], fields: dict[str, object]) -> D:
    return kind(**fields)
