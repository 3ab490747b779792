"""Substitutions that compare and choose. Those that are conditions give ``true`` or ``false``."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

from actors.launch.errors import LaunchError, SubstitutionFailure
from actors.launch.substitution import Substitution, Text, as_bool, normalized, perform, shown

if TYPE_CHECKING:
    from actors.launch.context import LaunchContext

_WORDS = {"true": 1.0, "1": 1.0, "false": 0.0, "0": 0.0}


class _Logic(Substitution):
    """A condition on several texts; `rule` takes what they mean, `word` is its name for display."""

    def __init__(self, word: str, rule: Callable[[Iterable[bool]], bool], texts: Iterable[Text]) -> None:
        self.word = word
        self.rule = rule
        self.texts = [normalized(text) for text in texts]

    def perform(self, context: LaunchContext) -> str:
        return _word(self.rule([as_bool(context, text) for text in self.texts]))

    def describe(self) -> str:
        return f"{self.word}({', '.join(map(shown, self.texts))})"


class AllSubstitution(_Logic):
    """``true`` if every one of the texts is true."""

    def __init__(self, *texts: Text) -> None:
        super().__init__("All", all, texts)


class AnySubstitution(_Logic):
    """``true`` if one of the texts is true."""

    def __init__(self, *texts: Text) -> None:
        super().__init__("Any", any, texts)


class AndSubstitution(_Logic):
    """``true`` if both texts are true."""

    def __init__(self, left: Text, right: Text) -> None:
        super().__init__("And", all, (left, right))


class OrSubstitution(_Logic):
    """``true`` if one of two texts is true."""

    def __init__(self, left: Text, right: Text) -> None:
        super().__init__("Or", any, (left, right))


class NotSubstitution(_Logic):
    """``true`` if the text is false."""

    def __init__(self, value: Text) -> None:
        super().__init__("Not", lambda truths: not all(truths), (value,))


class EqualsSubstitution(Substitution):
    """``true`` if two texts are equal: as truth values, as numbers (almost equal), or as texts."""

    equal = True

    def __init__(self, left: object, right: object) -> None:
        self.left, self.right = normalized(_plain(left)), normalized(_plain(right))

    def perform(self, context: LaunchContext) -> str:
        return _word(_same(perform(context, self.left), perform(context, self.right)) == self.equal)

    def describe(self) -> str:
        return f"{type(self).__name__.removesuffix('Substitution')}({shown(self.left)}, {shown(self.right)})"


class NotEqualsSubstitution(EqualsSubstitution):
    """``true`` unless two texts are equal."""

    equal = False


class IfElseSubstitution(Substitution):
    """One of two texts, by a condition."""

    def __init__(self, condition: Text, if_value: Text = "", else_value: Text = "") -> None:
        if not if_value and not else_value:
            raise LaunchError("IfElseSubstitution needs if_value, else_value, or both")
        self.condition = normalized(condition)
        self.if_value, self.else_value = normalized(if_value), normalized(else_value)

    def perform(self, context: LaunchContext) -> str:
        return perform(context, self.if_value if as_bool(context, self.condition) else self.else_value)

    def describe(self) -> str:
        return f"IfElse({shown(self.condition)}, {shown(self.if_value)}, {shown(self.else_value)})"


class StringJoinSubstitution(Substitution):
    """Texts, joined by a delimiter."""

    def __init__(self, substitutions: Iterable[Text], delimiter: Text = "") -> None:
        self.parts = [normalized(each) for each in substitutions]
        self.delimiter = normalized(delimiter)

    def perform(self, context: LaunchContext) -> str:
        return perform(context, self.delimiter).join(perform(context, part) for part in self.parts)

    def describe(self) -> str:
        return f"StringJoin({', '.join(map(shown, self.parts))})"


class PythonExpression(Substitution):
    """The value of a Python expression. It sees the modules named, and the functions of `math` by their own names."""

    def __init__(self, expression: Text, python_modules: Iterable[Text] = ("math",)) -> None:
        self.expression = normalized(expression)
        self.python_modules = [normalized(one) for one in python_modules]

    def perform(self, context: LaunchContext) -> str:
        from importlib import import_module

        expression = perform(context, self.expression)
        names: dict[str, object] = {}
        try:
            for module in (import_module(perform(context, name)) for name in self.python_modules):
                names |= {**vars(module), module.__name__: module} if module is math else {module.__name__: module}
            return str(eval(expression, {}, names))
        except Exception as error:
            problem = f"the expression {expression!r} has no value: {type(error).__name__}: {error}"
            return context.stand_in(SubstitutionFailure(problem), f"$(eval {expression})")

    def describe(self) -> str:
        return f"PythonExpr({shown(self.expression)})"


def _word(truth: bool) -> str:
    return "true" if truth else "false"


def _plain(value: object) -> Any:
    if value is None:
        return ""
    return _word(value) if isinstance(value, bool) else str(value) if isinstance(value, (int, float)) else value


def _same(left: str, right: str) -> bool:
    one, other = left.lower(), right.lower()
    if one in _WORDS and other in _WORDS:
        return _WORDS[one] == _WORDS[other]
    try:
        return math.isclose(float(left), float(right))
    except ValueError:
        return left == right
