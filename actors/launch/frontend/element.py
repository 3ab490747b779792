"""`Element`: a tag of a launch file in XML or YAML, with its attributes and children, of which each must be known."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from actors.launch.errors import LaunchError, Line
from actors.launch.substitution import Substitution
from actors.launch.substitutions.grammar import parse_substitution
from actors.suggest import did_you_mean


class Unquoted(str):
    """A scalar of YAML without quotes, as it is written: where a value with a type is wanted, that of ROS 2 is read in it."""


class Element:
    """A tag. What is read of it is remembered, so that `done` can name what nobody asked for.

    `attributes` are texts; in YAML also lists of them.
    """

    def __init__(
        self, tag: str, attributes: dict[str, object], children: Sequence[Element], line: Line, *, typed: bool = False
    ) -> None:
        self.tag = tag
        self.attributes = attributes
        self.children = children
        self.line = line
        self.typed = typed
        """Whether the attributes have the types that the file gives them, as in YAML: a text there is no number."""
        self._asked: set[str] = {"if", "unless"}
        self._parts: set[str] = set()

    def value(self, name: str) -> Any:
        """An attribute as it was written; None if it is not there."""
        self._asked.add(name)
        return self.attributes.get(name)

    def text(self, name: str) -> list[Substitution] | None:
        """An attribute as a text with substitutions; None if it is not there."""
        value = self.value(name)
        return None if value is None else parse_substitution(plain(value))

    def need(self, name: str) -> list[Substitution]:
        """An attribute that must be there, as a text with substitutions. Raises `LaunchError`."""
        found = self.text(name)
        if found is None:
            given = [one for one in self.attributes if one not in self._asked]
            raise self.error(f"<{self.tag}> needs the attribute {name!r}{did_you_mean(name, given)}")
        return found

    def word(self, name: str, default: str | None = None) -> str:
        """An attribute that must be there, without substitutions. Raises `LaunchError`."""
        value = self.value(name)
        if value is None:
            if default is not None:
                return default
            self.need(name)
        return plain(value)

    def parts(self, *tags: str) -> list[Element]:
        """The children with one of these tags, in order."""
        self._parts.update(tags)
        return [child for child in self.children if child.tag in tags]

    def all_children(self) -> Sequence[Element]:
        """The children, of any tag."""
        self._parts.update(child.tag for child in self.children)
        return self.children

    def done(self) -> None:
        """Raise `LaunchError` for an attribute or a child that nobody has asked for."""
        for name in self.attributes:
            if name not in self._asked:
                known = sorted(self._asked)
                near = did_you_mean(name, known) or f"; there are: {', '.join(known)}"
                raise self.error(f"<{self.tag}> has no attribute {name!r}{near}")
        for child in self.children:
            if child.tag not in self._parts:
                near = did_you_mean(child.tag, sorted(self._parts)) or _children(self._parts)
                raise child.error(f"<{self.tag}> takes no <{child.tag}>{near}")

    def error(self, problem: str) -> LaunchError:
        """An error at this tag."""
        return LaunchError(problem, self.line)


def plain(value: object) -> str:
    """A value of YAML as it is written in XML."""
    if isinstance(value, bool):
        return str(value).lower()
    return str(value)


def _children(known: set[str]) -> str:
    return f"; it takes: {', '.join(sorted(known))}" if known else "; it takes no children"
