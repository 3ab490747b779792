"""Reads .idl text: the part of OMG IDL that ROS 2 generates from its definitions, and that its users write.

    parse_idl("module my_pkg { module msg { struct Sample { long x; sequence<double, 3> y; }; }; };")

Modules, structs, constants, typedefs and annotations are understood; a struct is a message if it lies in `module PACKAGE { module msg {`
(or `srv`, `action`, whose parts are structs such as `Dock_Request`), and the constants of `Sample` lie in a module `Sample_Constants`.
"""

from __future__ import annotations

import re
from typing import Any, Final, NamedTuple

import msgspec

from actors.interfaces.fields import PLACEHOLDER, STRINGS, FieldType
from actors.interfaces.naming import KINDS, Kind
from actors.interfaces.parse import (
    PARTS,
    SEPARATOR,
    ConstantDefinition,
    Definition,
    DefinitionError,
    FieldDefinition,
    MessageDefinition,
    parse_value,
)

TYPES: Final = {
    "boolean": "bool", "octet": "byte", "char": "char", "wchar": "uint16", "float": "float32", "double": "float64",
    "short": "int16", "unsigned short": "uint16", "long": "int32", "unsigned long": "uint32", "long long": "int64",
    "unsigned long long": "uint64", "int8": "int8", "uint8": "uint8", "int16": "int16", "uint16": "uint16", "int32": "int32",
    "uint32": "uint32", "int64": "int64", "uint64": "uint64",
}  # fmt: skip
"""The primitive types of IDL, as a .msg file spells them."""

CONSTANTS: Final = "_Constants"

TOKEN: Final = re.compile(
    r"""(?P<blank>\s+|//[^\n]*|/\*.*?\*/|\#[^\n]*)
    |(?P<text>L?"(?:\\.|[^"\\])*")
    |(?P<char>L?'(?:\\.|[^'\\])+')
    |(?P<number>[-+]?(?:0[xX][0-9a-fA-F]+|(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)[fFdDlLuU]*)
    |(?P<word>[A-Za-z_][A-Za-z0-9_]*)
    |(?P<mark>::|[{}()<>\[\],;=@:])""",
    re.VERBOSE | re.DOTALL,
)
ESCAPES: Final = {"n": "\n", "t": "\t", "r": "\r"}


class _Token(NamedTuple):
    kind: str
    text: str
    line: int


def parse_idl(text: str, file: str | None = None) -> tuple[MessageDefinition, ...]:
    """The messages of a text, in its order, and of services and actions the parts. `file` is only for errors.

    Raises `DefinitionError`, with file, line and reason.
    """
    return _Reader(text, file).read()


def parse_idl_file(text: str, package: str, name: str, kind: Kind, file: str | None = None) -> Definition:
    """The type that an .idl file defines: one message, or the parts of one service or action, as ROS 2 has it.

    Raises `DefinitionError`, with file, line and reason.
    """
    found = {each.name: each for each in parse_idl(text, file)}
    wanted = [f"{package}/{kind}/{name}{suffix}" for suffix in PARTS[kind]]
    if sorted(found) != sorted(wanted):
        told = ", ".join(found) or "nothing"
        raise DefinitionError(
            "invalid_type_name", f"this defines {told:.300}, expected {', '.join(wanted)}", None, file
        )
    parts = tuple(found[each] for each in wanted)
    return Definition(f"{package}/{kind}/{name}", parts, f"{SEPARATOR}\n".join(map(as_written, parts)), file)


def as_written(message: MessageDefinition) -> str:
    """A definition in the words of a .msg file."""
    lines = [f"# {line}".rstrip() for line in message.comment]
    if message.comment:
        lines.append("")  # ends the comment of the type
    for one in message.constants:
        if not {"\n", "#"} & set(line := f"{one.type} {one.name}={one.value}"):  # a .msg file cannot say those
            lines += [*_remarks(one), line]
    for field in message.fields:
        default = "" if field.default is None else f" {_literal(field.default)}"
        # A '#' or '=' cannot stand in a default: the grammar takes it for a comment or a constant.
        if {"#", "=", "\n"} & set(default):
            default = ""
        lines += [*_remarks(field), f"{field.type} {field.name}{default}"]
    return "".join(f"{line}\n" for line in lines)


class _Reader:
    """Invariants: `_at` is the next token. `_scope` holds the names of the modules that are open there."""

    def __init__(self, text: str, file: str | None) -> None:
        self._file = file
        self._at = 0
        self._tokens = list(self._split(text))
        self._scope: list[str] = []
        self._notes: dict[str, dict[str, object]] = {}
        """The annotations before the next declaration."""
        self._typedefs: dict[str, FieldType] = {}
        self._values: dict[str, object] = {}
        self._messages: dict[str, MessageDefinition] = {}
        self._constants: dict[str, list[ConstantDefinition]] = {}

    def read(self) -> tuple[MessageDefinition, ...]:
        while self._at < len(self._tokens):
            token = self._next()
            if token.text == "@":
                self._annotation()
            elif token.text == "module":
                self._scope.append(self._word())
                self._expect("{")
            elif token.text == "}" and self._scope:
                self._scope.pop()
            elif token.text == "struct":
                self._struct()
            elif token.text == "typedef":
                kind = self._type()
                for name, declared in self._declarators(kind):
                    self._typedefs["/".join([*self._scope, name])] = declared
            elif token.text == "const":
                self._constant()
            elif token.text != ";":
                raise self._error(f"{token.text!r} is not understood here", token)
        if self._scope:
            raise self._error("a '}' is missing at the end")
        return tuple(
            each._replace(constants=tuple(self._constants.get(name, ()))) for name, each in self._messages.items()
        )

    # -- declarations -------------------------------------------------------------------------------------------------------

    def _struct(self) -> None:
        token = self._tokens[self._at - 1]
        name, notes = self._word(), self._taken()
        if self._accept(";"):
            return  # declared before it is defined
        self._expect("{")
        if len(self._scope) != 2 or self._scope[1] not in KINDS:
            raise self._error(f"struct {name} is not in a module PACKAGE and there in msg, srv or action", token)
        fields: dict[str, FieldDefinition] = {}
        while not self._accept("}"):
            if self._accept("@"):
                self._annotation()
                continue
            line, kind, told = self._line(), self._type(), self._taken()
            for field, declared in self._declarators(kind):
                if field in fields:
                    raise self._error(f"{field!r} is there twice")
                default = _default(declared, told)
                unit = told.get("unit", {}).get("value")
                fields[field] = FieldDefinition(field, declared, default, _comment(told), unit, line)
        if list(fields) == [PLACEHOLDER]:
            fields.clear()
        full = "/".join([*self._scope, name])
        self._messages[full] = MessageDefinition(full, tuple(fields.values()), (), _comment(notes))

    def _constant(self) -> None:
        line, kind = self._line(), self._type()
        name, notes = self._word(), self._taken()
        self._expect("=")
        token = self._next()
        value: Any = self._value(token)
        self._expect(";")
        try:
            value = value if kind.base in STRINGS else parse_value(kind, str(value))
        except DefinitionError as error:
            raise self._error(error.reason, token) from None
        self._values["/".join([*self._scope, name])] = value
        if self._scope and self._scope[-1].endswith(CONSTANTS):
            owner = "/".join(self._scope).removesuffix(CONSTANTS)
            self._constants.setdefault(owner, []).append(
                ConstantDefinition(name, kind, value, _comment(notes), notes.get("unit", {}).get("value"), line)
            )

    def _annotation(self) -> None:
        """The rest of one, whose values are kept by their names; one that stands alone is called `value`."""
        name = self._word()
        given: dict[str, object] = {}
        if self._accept("("):
            while not self._accept(")"):
                token = self._next()
                key = "value"
                if token.kind == "word" and self._accept("="):
                    key, token = token.text, self._next()
                given[key] = self._value(token)
                self._accept(",")
        self._notes[name] = given

    def _taken(self) -> dict[str, dict[str, Any]]:
        notes, self._notes = self._notes, {}
        return notes

    # -- types --------------------------------------------------------------------------------------------------------------

    def _type(self) -> FieldType:
        token = self._next()
        if token.kind != "word":
            raise self._error(f"{token.text!r} is no type", token)
        if token.text == "sequence":
            self._expect("<")
            if self._peek() == "sequence":
                raise self._error("a sequence of sequences does not exist in ROS", token)
            element = self._type()
            size = self._size() if self._accept(",") else 0
            self._expect(">")
            if element.is_array:
                raise self._error("a sequence of sequences or arrays does not exist in ROS", token)
            return msgspec.structs.replace(element, array="bounded" if size else "unbounded", size=size)
        if token.text in STRINGS:
            bound = 0
            if self._accept("<"):
                bound = self._size()
                self._expect(">")
            return FieldType(token.text, bound)
        words = token.text
        while words in ("unsigned", "unsigned long", "long") and self._peek() in ("short", "long", "double"):
            words += f" {self._next().text}"
        if words in TYPES:
            return FieldType(TYPES[words])
        if words in ("long double", "enum", "union", "struct", "any", "map", "fixed"):
            raise self._error(f"{words!r} is no type that a message of ROS can hold", token)
        return self._named(self._scoped(token))

    def _named(self, name: str) -> FieldType:
        """The type of this name: what a typedef stands for, or a message, which may be defined elsewhere."""
        for known in self._candidates(name):
            if known in self._typedefs:
                return self._typedefs[known]
            if known in self._messages:
                return FieldType(known)
        parts = name.split("/")
        if len(parts) == 1:
            parts = [*self._scope[:2], *parts]
        if len(parts) != 3 or parts[1] not in KINDS:
            raise self._error(f"{name.replace('/', '::')!r} is not known, and no name such as std_msgs::msg::Header")
        return FieldType("/".join(parts))

    def _candidates(self, name: str) -> list[str]:
        """What a name may mean, from the innermost module outwards."""
        return ["/".join([*self._scope[:depth], name]) for depth in range(len(self._scope), -1, -1)]

    def _declarators(self, kind: FieldType) -> list[tuple[str, FieldType]]:
        """The names of a declaration, with the type of each, up to its end."""
        found: list[tuple[str, FieldType]] = []
        while True:
            token = self._tokens[self._at] if self._at < len(self._tokens) else None
            name, declared = self._word(), kind
            while self._accept("["):
                if declared.is_array:
                    raise self._error("an array of arrays or sequences does not exist in ROS", token)
                declared = msgspec.structs.replace(declared, array="fixed", size=self._size())
                self._expect("]")
            found.append((name, declared))
            if not self._accept(","):
                self._expect(";")
                return found

    def _size(self) -> int:
        token = self._next()
        value = self._value(token)
        if not isinstance(value, int) or isinstance(value, bool) or value <= 0:
            raise self._error(f"{token.text!r} is not a positive number", token)
        return value

    def _value(self, token: _Token) -> object:
        """What a literal stands for, or the constant of this name; another word stands for itself."""
        if token.kind == "text":
            text = _unquoted(token.text)
            while self._at < len(self._tokens) and self._tokens[self._at].kind == "text":
                text += _unquoted(self._next().text)
            return text
        if token.kind == "char":
            return ord(_unquoted(token.text)[:1] or "\0")
        if token.kind == "number":
            digits = token.text.rstrip("fFdDlLuU") if "x" not in token.text.lower() else token.text.rstrip("lLuU")
            try:
                return int(digits, 0 if "x" in digits.lower() else 10)
            except ValueError:
                return float(digits)
        if token.kind != "word":
            raise self._error(f"{token.text!r} is no value", token)
        if token.text in ("TRUE", "FALSE"):
            return token.text == "TRUE"
        name = self._scoped(token)
        return next((self._values[known] for known in self._candidates(name) if known in self._values), name)

    # -- tokens -------------------------------------------------------------------------------------------------------------

    def _split(self, text: str) -> list[_Token]:
        tokens: list[_Token] = []
        at, line = 0, 1
        while at < len(text):
            found = TOKEN.match(text, at)
            if found is None:
                raise DefinitionError("invalid_field_definition", f"{text[at : at + 20]!r} is no IDL", line, self._file)
            kind, word = found.lastgroup or "", found.group()
            if kind != "blank":
                tokens.append(_Token(kind, word, line))
            line += word.count("\n")
            at = found.end()
        return tokens

    def _next(self) -> _Token:
        if self._at >= len(self._tokens):
            raise self._error("it ends too early")
        self._at += 1
        return self._tokens[self._at - 1]

    def _peek(self) -> str:
        return self._tokens[self._at].text if self._at < len(self._tokens) else ""

    def _line(self) -> int:
        return self._tokens[min(self._at, len(self._tokens) - 1)].line

    def _accept(self, mark: str) -> bool:
        if self._peek() != mark:
            return False
        self._at += 1
        return True

    def _expect(self, mark: str) -> None:
        token = self._next()
        if token.text != mark:
            raise self._error(f"expected {mark!r}, not {token.text!r}", token)

    def _word(self) -> str:
        """A name. IDL escapes one that is also a keyword by `_`."""
        token = self._next()
        name = token.text.removeprefix("_")
        if token.kind != "word" or not name[:1].isalpha():
            raise self._error(f"{token.text!r} is no name", token)
        return name

    def _scoped(self, first: _Token) -> str:
        parts = [first.text]
        while self._accept("::"):
            parts.append(self._word())
        return "/".join(parts)

    def _error(self, reason: str, token: _Token | None = None) -> DefinitionError:
        line = token.line if token is not None else self._tokens[self._at - 1].line if self._tokens else 1
        return DefinitionError("invalid_field_definition", reason, line, self._file)


def _default(kind: FieldType, notes: dict[str, dict[str, object]]) -> Any:
    """The default that an annotation gives, as plain data; those of arrays are left out, as the hash of a type does."""
    value = notes.get("default", {}).get("value")
    if value is None or kind.is_array or kind.is_message:
        return None
    return value if kind.base in STRINGS and isinstance(value, str) else parse_value(kind, str(value))


def _literal(value: object) -> str:
    if isinstance(value, str):
        return '"' + value.replace('"', '\\"') + '"'
    return str(value).lower() if isinstance(value, bool) else str(value)


def _remarks(of: ConstantDefinition | FieldDefinition) -> list[str]:
    return [f"# {line}".rstrip() for line in (*of.comment, *([f"[{of.unit}]"] if of.unit else []))]


def _comment(notes: dict[str, dict[str, object]]) -> tuple[str, ...]:
    told = notes.get("verbatim", {})
    return tuple(str(told.get("text", "")).splitlines()) if told.get("language") == "comment" else ()


def _unquoted(text: str) -> str:
    inner = text.removeprefix("L")[1:-1]
    return re.sub(r"\\(.)", lambda found: ESCAPES.get(found[1], found[1]), inner, flags=re.DOTALL)
