"""What all declarations have in common: they never change, are equal by content, and print what is not default."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, ClassVar, Self, TypeVar

__all__ = ["Declaration"]

D = TypeVar("D", bound="Declaration")


class Declaration(ABC):
    """Base of the tree's values: immutable, equal by content, printed without what is default."""

    __slots__ = ()
    _stored_defaults: ClassVar[dict[str, object]] = {}
    """What is stored for a default, where that is not the default itself."""

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"{self!r} is a declaration and never changes; .replace({name}=...) makes a changed copy")

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"{self!r} is a declaration and never changes")

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and self._fields() == other._fields()

    __hash__ = None  # type: ignore[assignment]  # equal by content, which may be unhashable: parameters, arguments

    def __repr__(self) -> str:
        fields = self._fields()
        keywords: dict[str, Any] = getattr(type(self).__init__, "__kwdefaults__", {})
        plain = keywords | self._stored_defaults | {"name": fields["name"]}
        shown = [f"{name}={value!r}" for name, value in fields.items() if value != plain.get(name, value)]
        return f"{type(self).__name__}({', '.join([*self._positional(), *shown])})"

    def __reduce__(self) -> tuple[Callable[[type[Self], dict[str, Any]], Self], tuple[type[Self], dict[str, Any]]]:
        return _rebuild, (type(self), self._fields())

    def replace(self, **changes: Any) -> Self:
        """A copy with these options changed; it is checked like a new declaration."""
        return _rebuild(type(self), self._fields() | changes)

    def _fields(self) -> dict[str, Any]:
        names: tuple[str, ...] = self.__slots__
        return {name: getattr(self, name) for name in names}

    @abstractmethod
    def _positional(self) -> list[str]: ...

    def _set(self, **values: object) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, value)


def _rebuild(kind: type[D], fields: dict[str, Any]) -> D:
    return kind(**fields)
