"""Parameter overrides from YAML files, ``-p`` rules and mappings, and which of them apply to a node.

Overrides are an ordered list of node patterns, each with its parameters. If a pattern occurs again, in the same file, in a later one or by
``-p``, its parameters are merged into the first occurrence. All patterns that match a node apply in order, and later ones win, even over
more specific ones. Grammar, types and order are those of rcl_yaml_param_parser, not of general YAML: keys may repeat, ``y`` and ``off`` are
booleans, and there is no null and no alias.
"""

import os
import re
from base64 import b64decode
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from types import ModuleType
from typing import Any, Final, NamedTuple, NoReturn, TypeAlias, cast

from actors.checks import whole_text
from actors.errors import reduce_error
from actors.names import names
from actors.parameters.values import Value
from actors.yaml_bounds import check_yaml, safe_loader

__all__ = [
    "ALL_NODES",
    "InvalidParams",
    "Origin",
    "ParamValue",
    "ParameterOverrides",
    "parse_value",
    "reaches",
]

ParamValue: TypeAlias = Value
"""A typed parameter value. The empty tuple is an empty list, whose type follows from the declaration. None means not set."""

ALL_NODES: Final = "/**"
"""The pattern to which ``-p name:=value`` applies."""

PARAMETERS: Final = "ros__parameters"
"""The key between the name of a node and its parameters."""

_INT64: Final = range(-(2**63), 2**63)
_DIGITS: Final = 4000
"""As many digits as Python makes a number of."""
_TRUE: Final = frozenset(["Y", "y", "yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON"])
_FALSE: Final = frozenset(["N", "n", "no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF"])
_SPECIAL: Final = re.compile(r"(?:\.(?:nan|NaN|NAN)|[+-]?\.(?:inf|Inf|INF))\Z")
_INTEGER: Final = re.compile(r"([+-]?)(?:(0[xX][0-9a-fA-F]+)|(0[0-7]*)|([1-9][0-9]*))\Z")
_DOUBLE: Final = re.compile(r"[+-]?(?:(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?|(?i:inf(?:inity)?|nan))\Z")
_HEX_DOUBLE: Final = re.compile(r"[+-]?0[xX](?:[0-9a-fA-F]+(?:\.[0-9a-fA-F]*)?|\.[0-9a-fA-F]+)(?:[pP][+-]?[0-9]+)?\Z")
_WORD: Final = r"(?:[A-Za-z][A-Za-z0-9]*+|_(?!_)[A-Za-z0-9]*+)(?:_[A-Za-z0-9]++)*+_?+"
_PART: Final = rf"(?:/|{_WORD})++"
_RULE: Final = re.compile(rf"(?:({_WORD}):(?!=))?({_PART}(?:\.{_PART})*+):=(.*)\Z", re.DOTALL)


class InvalidParams(ValueError):
    """A parameter file, rule or value that cannot be used. ``source`` is a file or an argument, ``line`` counts from 1."""

    __reduce__ = reduce_error

    def __init__(self, problem: str, *, source: str, line: int | None = None, key: str = "") -> None:
        place = f"{source}:{line}" if line is not None else source
        super().__init__(f"{place}: {key}: {problem}" if key else f"{place}: {problem}")
        self.source = source
        self.line = line
        self.key = key


class Origin(NamedTuple):
    """The source of a value: a file or an argument, and the line in a file (from 1)."""

    source: str
    line: int | None = None

    def error(self, problem: str, key: str = "") -> InvalidParams:
        """Create the error about the value from this source."""
        return InvalidParams(problem, source=self.source, line=self.line, key=key)


class ParameterOverrides:
    """Parameter values by node pattern, in the order of first occurrence. Immutable; the ``with_`` methods return a new object.

    A pattern is a fully qualified node name, with or without the first slash, in which ``*`` matches one part between slashes and ``**``
    any number of them.
    """

    __slots__ = ("_entries", "_origins")

    def __init__(
        self,
        entries: Mapping[str, Mapping[str, ParamValue]] | None = None,
        origins: Mapping[tuple[str, str], Origin] | None = None,
    ) -> None:
        self._entries: dict[str, dict[str, ParamValue]] = {
            pattern: dict(values) for pattern, values in (entries or {}).items()
        }
        self._origins = dict(origins or {})

    @property
    def entries(self) -> tuple[tuple[str, dict[str, ParamValue]], ...]:
        """The patterns as written, each with a copy of its parameters."""
        return tuple((pattern, dict(values)) for pattern, values in self._entries.items())

    def for_node(self, fully_qualified_name: str) -> dict[str, ParamValue]:
        """The overrides for this node: those of every matching pattern in order, where later ones win."""
        found: dict[str, ParamValue] = {}
        for pattern, values in self._entries.items():
            if reaches(pattern, fully_qualified_name):
                found.update(values)
        return found

    def named(self, fully_qualified_name: str) -> frozenset[str]:
        """The parameters that are set for this node by its name, not only by a pattern with ``*`` or ``**``."""
        return frozenset(
            name
            for pattern, values in self._entries.items()
            if "*" not in pattern and reaches(pattern, fully_qualified_name)
            for name in values
        )

    def origin(self, pattern: str, name: str) -> Origin:
        """The source of the value of a parameter in `entries`."""
        return self._origins[pattern, name]

    def with_file(self, path: str | os.PathLike[str]) -> "ParameterOverrides":
        """These overrides followed by those of a YAML file. Raises ``InvalidParams`` with file, line and key of the error."""
        source = os.fspath(path)
        try:
            with open(source, encoding="utf-8") as file:
                text = file.read()
        except OSError as error:
            raise InvalidParams(f"cannot read the parameter file: {error.strerror}", source=source) from error
        except UnicodeDecodeError as error:
            raise InvalidParams("the parameter file is not UTF-8 text", source=source) from error
        return self.with_text(text, source=source)

    def with_text(self, text: str, *, source: str = "parameters") -> "ParameterOverrides":
        """These overrides followed by those of a YAML text. ``source`` names it in errors."""
        return self._with(_FileReader(text, source).read())

    def with_rule(self, rule: str) -> "ParameterOverrides":
        """These overrides followed by ``[node:]name:=value`` as given to ``-p``. Without a node it applies to all nodes."""
        found = _RULE.match(rule)
        if found is None:
            problem = (
                "write [node:]name:=value, where node is a plain node name and name is words of letters, digits and "
                "underscores, joined by dots"
            )
            raise InvalidParams(problem, source=rule)
        value = parse_value(found[3], source=rule)
        return self._with([(found[1] or ALL_NODES, found[2], value, Origin(f"-p {rule}"))])

    def with_mapping(self, mapping: Mapping[str, Mapping[str, Any]], *, source: str) -> "ParameterOverrides":
        """These overrides followed by ``{pattern: {parameter: value}}``. ``source`` names it in errors, which are ``InvalidParams``."""
        origin = Origin(source)
        found: list[_Entry] = []
        for pattern, values in mapping.items():
            if not isinstance(cast("object", values), Mapping):
                raise origin.error("write {node: {parameter: value}}, where the node '/**' means all", repr(pattern))
            _check_pattern(pattern, source=source, line=None)
            for name, value in values.items():
                if isinstance(value, Mapping):
                    raise origin.error("a value cannot be a mapping; write 'group.name': value", f"{pattern}: {name}")
                found.append((pattern, name, value, origin))
        return self._with(found)

    def _with(self, additions: "Sequence[_Entry]") -> "ParameterOverrides":
        result = ParameterOverrides(self._entries, self._origins)
        for pattern, name, value, origin in additions:
            values = result._entries.setdefault(pattern, {})
            if name is not None and not (value == () and name in values):  # an empty list does not replace a value
                values[name] = value
                result._origins[pattern, name] = origin
        return result

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ParameterOverrides):
            return NotImplemented
        return list(self._entries.items()) == list(other._entries.items())

    def __bool__(self) -> bool:
        return bool(self._entries)

    def __repr__(self) -> str:
        return f"ParameterOverrides({self._entries!r})"


_Entry: TypeAlias = tuple[str, str | None, ParamValue, Origin]


def reaches(pattern: str, fully_qualified_name: str) -> bool:
    """Whether a pattern matches this node."""
    return _matcher(pattern).match(fully_qualified_name) is not None


@lru_cache(maxsize=1024)
def _matcher(pattern: str) -> re.Pattern[str]:
    words = {"*": "/[^/]+", "**": "(?:/[^/]+)*"}
    path = pattern.removeprefix("/").split("/")
    return re.compile("".join(words.get(word, "/" + re.escape(word)) for word in path) + r"\Z")


def _check_pattern(pattern: str, *, source: str, line: int | None) -> None:
    for word in pattern.removeprefix("/").split("/"):
        if word in ("*", "**"):
            continue
        try:
            names.validate_node_name(word)
        except names.InvalidName as error:
            problem = f"not a node name or pattern: {error}" if word else "there is an empty word between slashes"
            remedy = "; wildcards * and ** stand for whole words" if "*" in word else ""
            raise InvalidParams(problem + remedy, source=source, line=line, key=pattern) from None


# Values -------------------------------------------------------------------------------------------------------------


def parse_value(text: str, *, source: str = "value") -> ParamValue:
    """Parse the value of ``-p name:=text``: a scalar or a list of scalars of one type, with the types of parameter files.

    Raises ``InvalidParams`` for a missing value, a mapping, a mixed list or invalid YAML.
    """
    events = _Events(text, source)
    first = events.next()
    if first.kind == "end":
        raise InvalidParams("there is no value; write '' for an empty text", source=source)
    value = _value(first, events, "")
    extra = events.next()
    if extra.kind != "end":
        raise InvalidParams("there is more than one value; put quotes around a text", source=source)
    return value


def plain_scalar(text: str) -> bool | int | float | str:
    """The value of a plain scalar, by the C number grammar of rcl_yaml_param_parser."""
    if text in _TRUE:
        return True
    if text in _FALSE:
        return False
    if (found := _INTEGER.match(text)) and len(text) < _DIGITS:
        sign, hexadecimal, octal, decimal = found.groups()
        number = int(hexadecimal, 16) if hexadecimal else int(octal, 8) if octal else int(decimal)
        if sign == "-":
            number = -number
        if number in _INT64:
            return number
    if _SPECIAL.match(text):
        return float(text.replace(".", ""))
    if _DOUBLE.match(text) or _HEX_DOUBLE.match(text):
        return _double(text)
    return text


def _double(text: str) -> float | str:
    if "x" not in text and "X" not in text:
        value = float(text)
        return text if value in (float("inf"), float("-inf")) and text.lstrip("+-")[0] not in "iI" else value
    try:
        return float.fromhex(text)
    except OverflowError:
        return text


def _value(event: "_Event", events: "_Events", key: str) -> ParamValue:
    if event.kind == "scalar":
        return _binary(event, events, key) if event.tag == _BINARY else _scalar_of(event, events, key)
    if event.kind != "list":
        events.fail(event, key, "a value must be a scalar or a list of scalars, not a map")
    return _items(events.next(), events, key)


def _items(item: "_Event", events: "_Events", key: str) -> ParamValue:
    """The items of a list, of which the first event has been taken."""
    items: list[bool | int | float | str] = []
    while item.kind != "list end":
        if item.kind != "scalar":
            events.fail(item, key, "a list may hold only scalars, neither lists nor maps")
        items.append(_scalar_of(item, events, key))
        if type(items[-1]) is not type(items[0]):
            problem = f"a list holds values of one type, but {items[0]!r} and {items[-1]!r} differ"
            events.fail(item, key, f"{problem}; mind that unquoted y, n, on and off are booleans and 1 is not 1.0")
        item = events.next()
    return cast(ParamValue, tuple(items))


def _scalar_of(event: "_Event", events: "_Events", key: str) -> bool | int | float | str:
    if event.tag not in ("", "tag:yaml.org,2002:str"):
        return _tagged(event, events, key)
    if event.is_text:
        return event.value
    if not event.value:
        events.fail(event, key, "has no value; write one, or '' for an empty text")
    return plain_scalar(event.value)


def _binary(event: "_Event", events: "_Events", key: str) -> tuple[bytes, ...]:
    """The bytes of a scalar with the tag ``!!binary``, which is base64."""
    try:
        data = b64decode("".join(event.value.split()), validate=True)
    except ValueError as error:
        events.fail(event, key, f"{event.value!r:.60} has the tag !!binary and is no base64: {error}")
    return tuple(bytes([byte]) for byte in data)


def _tagged(event: "_Event", events: "_Events", key: str) -> bool | int | float:
    """The value of a scalar with a tag such as ``!!float``, which must be one of its type."""
    wanted = _TAGS.get(event.tag)
    value = plain_scalar(event.value)
    if wanted is float and type(value) is int:
        return float(value)
    if wanted is None or isinstance(value, str) or type(value) is not wanted:
        events.fail(
            event,
            key,
            f"{event.value!r:.60} has the tag {event.tag}; !!bool, !!int, !!float and !!str are known, and !!binary outside of lists",
        )
    return value


# Events -------------------------------------------------------------------------------------------------------------


class _Event(NamedTuple):
    kind: str  # scalar, list, list end, map, map end, end
    value: str
    is_text: bool  # quoted, or tagged !!str with a value: always text
    line: int
    tag: str = ""


_BINARY: Final = "tag:yaml.org,2002:binary"
_TAGS: Final = {f"tag:yaml.org,2002:{kind.__name__}": kind for kind in (bool, int, float)}
_KINDS: Final = {
    "ScalarEvent": "scalar",
    "SequenceStartEvent": "list",
    "SequenceEndEvent": "list end",
    "MappingStartEvent": "map",
    "MappingEndEvent": "map end",
}


class _Events:
    """The content events of a YAML text, one document after another."""

    def __init__(self, text: str, source: str) -> None:
        self.source = source
        self._events = self._parse(text)

    def next(self) -> _Event:
        """Return the next event; its kind is "end" if there are no more."""
        return next(self._events, _Event("end", "", False, 0))

    def fail(self, event: _Event, key: str, problem: str) -> NoReturn:
        """Raise ``InvalidParams`` about this event."""
        raise InvalidParams(problem, source=self.source, line=event.line or None, key=key)

    def _parse(self, text: str) -> Iterator[_Event]:
        yaml = _yaml()
        try:
            check_yaml(text)
            for event in yaml.parse(text, Loader=safe_loader()):
                line = event.start_mark.line + 1
                if isinstance(event, yaml.AliasEvent):
                    problem = f"aliases are not supported in parameter files; write the value of *{event.anchor} here"
                    raise InvalidParams(problem, source=self.source, line=line)
                if kind := _KINDS.get(type(event).__name__):
                    value = whole_text(cast(str, event.value)) if kind == "scalar" else ""
                    yield _Event(
                        kind, value, kind == "scalar" and _is_text(event), line, getattr(event, "tag", None) or ""
                    )
        except yaml.MarkedYAMLError as error:
            mark = error.problem_mark or error.context_mark
            what = " ".join(part for part in (error.context, error.problem) if part)
            remedy = "" if "take it out" in what else "; check indentation (no tabs), colons and quotes"
            problem = f"not valid YAML: {what}{remedy}"
            raise InvalidParams(problem, source=self.source, line=mark.line + 1 if mark else None) from None
        except UnicodeDecodeError as error:
            raise InvalidParams(
                f"not valid YAML: half of a surrogate pair: {error.reason}", source=self.source
            ) from None


def _yaml() -> ModuleType:
    """Import PyYAML, which has no type annotations and is only needed when parameters are read."""
    import yaml

    return yaml


def _is_text(event: Any) -> bool:
    return event.style in ("'", '"') or (event.tag == "tag:yaml.org,2002:str" and event.value != "")


class _FileReader:
    """Reads one file: nested node names, then ``ros__parameters``, then nested parameters."""

    def __init__(self, text: str, source: str) -> None:
        self._events = _Events(text, source)
        self._found: list[_Entry] = []

    def read(self) -> list[_Entry]:
        """Return all entries in order. A pattern without parameters gives one entry without a name."""
        while (event := self._events.next()).kind != "end":
            if event.kind == "map":
                self._nodes("")
            elif event.kind != "scalar" or event.value:
                self._events.fail(event, "", "a parameter file is a map of node names; start a line with 'node_name:'")
        return self._found

    def _nodes(self, path: str) -> None:
        while (key := self._key(path)) is not None:
            event = self._events.next()
            if key.value == PARAMETERS:
                if not path:
                    self._events.fail(key, PARAMETERS, "there is no node name above it; put '/**:' above for all nodes")
                if event.kind != "map":
                    self._events.fail(event, path, f"{PARAMETERS} must hold a map of parameters")
                _check_pattern(path, source=self._events.source, line=key.line)
                self._found.append((path, None, None, Origin(self._events.source, key.line)))
                self._parameters(path, "")
                continue
            child = key.value if not path else f"{path}{key.value}" if path.endswith("/") else f"{path}/{key.value}"
            if event.kind != "map":
                remedy = f"put '{PARAMETERS}:' between the node's name and its parameters"
                self._events.fail(event, child, f"a node name cannot have a value; {remedy}")
            self._nodes(child)

    def _parameters(self, pattern: str, prefix: str, *, listed: bool = False) -> None:
        """The parameters of a map; `listed` is one that is the only item of a list, in which values are lists."""
        while (key := self._key(prefix or pattern)) is not None:
            name = f"{prefix}.{key.value}" if prefix else key.value
            event = self._events.next()
            if event.kind == "map":
                self._parameters(pattern, name, listed=listed)
            elif event.kind == "list":
                self._list(pattern, name, key.line)
            elif listed:
                self._events.fail(event, name, "a value of a map in a list must be a list")
            else:
                self._add(pattern, name, _value(event, self._events, name), key.line)

    def _list(self, pattern: str, name: str, line: int) -> None:
        """A list of scalars, or of one map, which is read as that map."""
        first = self._events.next()
        if first.kind != "map":
            self._add(pattern, name, _items(first, self._events, name), line)
            return
        self._parameters(pattern, name, listed=True)
        if (more := self._events.next()).kind != "list end":
            self._events.fail(more, name, "a list may hold scalars or one map, not more")

    def _add(self, pattern: str, name: str, value: ParamValue, line: int) -> None:
        self._found.append((pattern, name, value, Origin(self._events.source, line)))

    def _key(self, inside: str) -> _Event | None:
        event = self._events.next()
        if event.kind == "map end":
            return None
        if event.kind != "scalar" or not event.value:
            self._events.fail(event, inside, "a key must be a name; it is empty, a list or a map")
        return event
