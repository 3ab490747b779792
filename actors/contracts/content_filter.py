"""`ContentFilter`: which messages a subscription takes, by an expression in the SQL-like language of DDS."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Sequence
from functools import lru_cache, reduce
from typing import Any, Final, NamedTuple, TypeAlias

from actors.errors import InvalidFilter
from actors.interfaces.message import Message

_Value: TypeAlias = Callable[[Any], object]
_Test: TypeAlias = Callable[[Any], bool]

_TOKEN: Final = re.compile(
    r"\s*(?:(?P<number>[+-]?(?:0[xX][0-9a-fA-F]+|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?))|(?P<text>'(?:[^']|'')*')"
    r"|(?P<parameter>%\d{1,2})|(?P<sign><>|!=|<=|>=|[=<>()])|(?P<word>[A-Za-z_]\w*(?:\[\d+\])?(?:\.[A-Za-z_]\w*(?:\[\d+\])?)*))"
)
_COMPARISONS: Final[dict[str, Callable[[Any, Any], bool]]] = {
    "=": operator.eq, "<>": operator.ne, "!=": operator.ne, "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge,
}  # fmt: skip


class ContentFilter:
    """Takes the messages for which `expression` is true: ``ContentFilter("speed > %0 AND frame LIKE 'arm%'", ["0.5"])``.

    It compares fields, nested ones by dots and elements by ``[n]``, with each other, with numbers, texts in single quotes, TRUE and FALSE,
    by ``=  <>  !=  <  <=  >  >=  LIKE`` (``%`` for any characters, ``_`` for one) and ``BETWEEN a AND b``, joined by ``AND``, ``OR``,
    ``NOT`` and parentheses. ``%0`` to ``%99`` stand for `parameters`, each written as a literal. The empty expression takes everything.

    Raises `InvalidFilter` for what is no expression; for a field that the messages lack, when it is given to a subscription.
    """

    # Invariant: `_test` is what `expression` says with `parameters`.

    __slots__ = ("_test", "expression", "fields", "parameters")

    def __init__(self, expression: str, parameters: Sequence[str] = ()) -> None:
        self.expression = ""
        self.parameters: tuple[str, ...] = ()
        self.fields: tuple[str, ...] = ()
        """The fields that the expression names."""
        self._test: _Test = _always
        self.set(expression, parameters)

    def __repr__(self) -> str:
        return f"ContentFilter({self.expression!r}, {list(self.parameters)!r})"

    def set(self, expression: str, parameters: Sequence[str] = ()) -> None:
        """Take other messages from now on. Nothing changes if the expression is invalid."""
        parser = _Parser(expression, tuple(parameters))
        test = parser.whole() if expression.strip() else _always
        self.expression, self.parameters = expression, tuple(parameters)
        self.fields, self._test = tuple(dict.fromkeys(parser.fields)), test

    def takes(self, message: object) -> bool:
        """Whether the expression is true for a message. A comparison of things that have no order is false."""
        return self._test(message)

    def check(self, type: type[Message]) -> None:
        """Raise `InvalidFilter` for a field that messages of this type lack."""
        for field in self.fields:
            try:
                _reader(field)(type())
            except AttributeError:
                raise InvalidFilter(
                    f"{type.__ros_type__} has no field {field!r}, which the filter {self!r} names"
                ) from None
            except IndexError:
                pass  # an array may be longer


def _always(message: object) -> bool:
    return True


class _Token(NamedTuple):
    kind: str
    text: str


class _Parser:
    """Reads an expression from left to right."""

    def __init__(self, expression: str, parameters: tuple[str, ...]) -> None:
        self.fields: list[str] = []
        self._expression = expression
        self._parameters = parameters
        self._tokens = _tokens(expression)
        self._at = 0

    def whole(self) -> _Test:
        test = self._either()
        if self._at < len(self._tokens):
            raise self._wrong("the end, AND or OR")
        return test

    def _either(self) -> _Test:
        tests = [self._both()]
        while self._takes("OR"):
            tests.append(self._both())
        return tests[0] if len(tests) == 1 else lambda message: any(test(message) for test in tests)

    def _both(self) -> _Test:
        tests = [self._one()]
        while self._takes("AND"):
            tests.append(self._one())
        return tests[0] if len(tests) == 1 else lambda message: all(test(message) for test in tests)

    def _one(self) -> _Test:
        if self._takes("NOT"):
            inner = self._one()
            return lambda message: not inner(message)
        if self._takes("("):
            inner = self._either()
            if not self._takes(")"):
                raise self._wrong("a closing parenthesis")
            return inner
        return self._comparison()

    def _comparison(self) -> _Test:
        left = self._value()
        negated = self._takes("NOT")
        if self._takes("BETWEEN"):
            low = self._value()
            if not self._takes("AND"):
                raise self._wrong("AND of BETWEEN")
            inside = _between(left, low, self._value())
            return (lambda message: not inside(message)) if negated else inside
        if self._takes("LIKE"):
            fits = _like(left, self._value())
            return (lambda message: not fits(message)) if negated else fits
        sign = self._next()
        if negated or sign is None or sign.text not in _COMPARISONS:
            self._at -= sign is not None
            raise self._wrong("a comparison")
        return _compared(_COMPARISONS[sign.text], left, self._value())

    def _value(self) -> _Value:
        token = self._next()
        if token is None or token.kind == "sign":
            self._at -= token is not None
            raise self._wrong("a field, a literal or a parameter")
        if token.kind == "parameter":
            number = int(token.text[1:])
            if number >= len(self._parameters):
                raise InvalidFilter(
                    f"{self._expression!r} has no parameter for {token.text}: {len(self._parameters)} are given"
                )
            found = _tokens(self._parameters[number])
            if len(found) != 1 or found[0].kind in ("sign", "parameter"):
                raise InvalidFilter(
                    f"the parameter {token.text} must be a literal such as 5 or 'text', not {self._parameters[number]!r}"
                )
            token = found[0]
        if token.kind == "word" and token.text.upper() not in ("TRUE", "FALSE"):
            self.fields.append(token.text)
            return _reader(token.text)
        literal = _literal(token)
        return lambda message: literal

    def _next(self) -> _Token | None:
        token = self._tokens[self._at] if self._at < len(self._tokens) else None
        self._at += token is not None
        return token

    def _takes(self, word: str) -> bool:
        found = self._at < len(self._tokens) and self._tokens[self._at].text.upper() == word
        self._at += found
        return found

    def _wrong(self, expected: str) -> InvalidFilter:
        there = repr(self._tokens[self._at].text) if self._at < len(self._tokens) else "the end"
        return InvalidFilter(f"{self._expression!r}: {expected} is expected, and there is {there}")


def _tokens(expression: str) -> list[_Token]:
    tokens: list[_Token] = []
    at, end = 0, len(expression.rstrip())
    while at < end:
        found = _TOKEN.match(expression, at)
        if found is None:
            raise InvalidFilter(f"{expression!r}: what is {expression[at:].strip()[:20]!r}?")
        tokens.append(_Token(str(found.lastgroup), found[str(found.lastgroup)]))
        at = found.end()
    return tokens


def _literal(token: _Token) -> object:
    if token.kind == "text":
        return token.text[1:-1].replace("''", "'")
    if token.kind == "word":
        return token.text.upper() == "TRUE"
    text = token.text
    if "x" in text.lower():
        return int(text, 16)
    return float(text) if re.search(r"[.eE]", text) else int(text)


def _reader(field: str) -> _Value:
    """The function that reads a field, nested or of an array."""
    steps: list[str | int] = []
    for name, index in re.findall(r"(\w+)(?:\[(\d+)\])?", field):
        steps += [name, int(index)] if index else [name]
    return lambda message: reduce(
        lambda held, step: held[step] if isinstance(step, int) else getattr(held, step), steps, message
    )


def _compared(compare: Callable[[Any, Any], bool], left: _Value, right: _Value) -> _Test:
    def test(message: object) -> bool:
        try:
            return bool(compare(left(message), right(message)))
        except (TypeError, IndexError, ValueError):
            return False

    return test


def _between(value: _Value, low: _Value, high: _Value) -> _Test:
    above, below = _compared(operator.ge, value, low), _compared(operator.le, value, high)
    return lambda message: above(message) and below(message)


def _like(value: _Value, pattern: _Value) -> _Test:
    return _compared(lambda text, wanted: _pattern(wanted).fullmatch(text) is not None, value, pattern)


@lru_cache
def _pattern(wanted: object) -> re.Pattern[str]:
    """What LIKE takes. Each part after a ``%`` is looked for once, from where the one before it was found first: texts come from others, and
    many ways to split one up would take its length to the power of their number."""
    if not isinstance(wanted, str):
        raise TypeError
    first, *others = ("".join("." if one == "_" else re.escape(one) for one in part) for part in wanted.split("%"))
    if not others:
        return re.compile(first, re.DOTALL)
    between = "".join(f"(?>.*?{part})" for part in others[:-1] if part)
    return re.compile(f"{first}{between}.*{others[-1]}", re.DOTALL)
