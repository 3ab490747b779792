"""`Substitution`: a text that is known only when a launch description is evaluated; and what is made of texts."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import TYPE_CHECKING, TypeAlias, cast

from actors.launch.errors import SubstitutionFailure

if TYPE_CHECKING:
    from actors.launch.context import LaunchContext


class Substitution:
    """Stands for a text. A subclass defines `perform`."""

    absent = False
    """Whether it stands in for what a module that is not installed would give, about which its import has been noted as the problem."""

    def perform(self, context: LaunchContext) -> str:
        """The text in this context. Raises `SubstitutionFailure`."""
        raise NotImplementedError(f"{type(self).__name__} does not define perform(context)")

    def describe(self) -> str:
        """The substitution in a form for display."""
        return f"{type(self).__name__}()"

    def __repr__(self) -> str:
        return self.describe()


Text: TypeAlias = str | os.PathLike[str] | Substitution | Iterable["str | os.PathLike[str] | Substitution"]
"""A text, a substitution, or a sequence of both that is joined."""

Truth: TypeAlias = bool | Text
"""A truth value, or a text that stands for one."""

Number: TypeAlias = float | Text
"""A number, or a text that stands for one."""


class TextSubstitution(Substitution):
    """Stands for itself."""

    def __init__(self, *, text: str) -> None:
        self.text = text

    def perform(self, context: LaunchContext) -> str:
        return self.text

    def describe(self) -> str:
        return repr(self.text)


def normalized(text: Text) -> list[Substitution]:
    """The substitutions whose texts are joined to that of `text`. Raises TypeError for what is no text."""
    if isinstance(text, Substitution):
        return [text]
    if isinstance(text, (str, os.PathLike)):
        return [TextSubstitution(text=os.fspath(text))]
    if not isinstance(cast("object", text), Iterable):
        raise TypeError(f"{text!r:.60} is neither a text, nor a substitution, nor a list of these")
    return [one for each in text for one in normalized(each)]


def perform(context: LaunchContext, text: Text) -> str:
    """The joined text in this context."""
    return "".join(one.perform(context) for one in normalized(text))


def shown(text: Text) -> str:
    """The text for display, without its value in a context."""
    return " + ".join(one.describe() for one in normalized(text)) or "''"


def yaml_value(text: str) -> object:
    """The value that YAML reads in a text, with the scalars of ROS 2; the text itself, if it is no YAML."""
    import yaml  # late: few programs launch

    from actors.parameters.ros_yaml import load_yaml

    try:
        return load_yaml(text)
    except (yaml.YAMLError, ValueError):
        return text


def as_bool(context: LaunchContext, text: Truth) -> bool:
    """The truth, or that which a text stands for. Raises `SubstitutionFailure` for what is neither true nor false."""
    if isinstance(text, bool):
        return text
    word = perform(context, text).strip().lower()
    if word in ("true", "1", "yes", "on"):
        return True
    if word in ("false", "0", "no", "off"):
        return False
    raise SubstitutionFailure(f"{shown(text)} is {word!r}, neither 'true' nor 'false'")
