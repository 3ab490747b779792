"""A YAML text whose parts know their lines, so that what is wrong in it is reported at its place."""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import Any, Final, TypeVar, cast

import msgspec

from actors.errors import reduce_error
from actors.suggest import did_you_mean
from actors.transport.protocol import WireUnavailable
from actors.yaml_bounds import check_yaml, load_yaml, safe_loader


class SecurityError(WireUnavailable):
    """A security file, or a file that it names, cannot be used; the text is one line that begins with file and line. No secret is in it."""

    __reduce__ = reduce_error

    def __init__(self, problem: str, *, file: str, line: int | None = None) -> None:
        super().__init__(f"{file}: {problem}" if line is None else f"{file}:{line}: {problem}")
        self.file = file
        self.line = line


T = TypeVar("T")
Path = tuple[str | int, ...]
"""The place of a value: the keys and indices that lead to it."""

_WHERE: Final = re.compile(r" - at `\$(.*)`$")


class Document:
    """A mapping read from YAML. Keys do not repeat, and there are no aliases: what is written is what counts."""

    def __init__(self, text: str, file: str) -> None:
        """Raises SecurityError."""
        import yaml

        library: Any = yaml  # not all of it is typed
        self.file = file
        self._lines: dict[Path, int] = {}
        try:
            check_yaml(text)
            for event in library.parse(text, safe_loader()):
                if isinstance(event, library.AliasEvent):
                    raise self._at(event.start_mark.line, "an alias (*) is not understood here")
            self._read_lines((), library.compose(text, safe_loader()))
            self.values: Any = load_yaml(text)
        except library.YAMLError as error:
            mark = getattr(error, "problem_mark", None)
            problem = getattr(error, "problem", None) or "this is no YAML"
            raise self._at(0 if mark is None else mark.line, str(problem)) from error
        if not isinstance(self.values, dict):
            raise self._at(0, "this is no mapping; it begins with tls:")

    def error(self, path: Path, problem: str) -> SecurityError:
        """The error about the value at `path`, or about the nearest one that is there."""
        while path not in self._lines:
            path = path[:-1]
        name = ".".join(f"{part}" for part in path)
        return SecurityError(f"{name}: {problem}" if name else problem, file=self.file, line=self._lines[path])

    def section(self, path: Path, type: type[T]) -> T:
        """The mapping at `path` as a struct of msgspec. Raises SecurityError for what is missing, unknown or of another type."""
        value: Any = self.values
        for part in path:
            value = value[part]
        fields = msgspec.structs.fields(cast(Any, type))
        self.check_keys(path, value, [field.encode_name for field in fields])
        for field in fields:
            if field.required and field.encode_name not in value:
                raise self.error(path, f"{field.encode_name!r} is missing")
        try:
            return msgspec.convert(value, type)
        except msgspec.ValidationError as error:
            found = _WHERE.search(str(error))
            parts = () if found is None else tuple(re.findall(r"[^.\[\]]+", found[1].replace("[...]", "")))
            raise self.error((*path, *parts), _WHERE.sub("", str(error))) from None

    def check_keys(self, path: Path, value: object, known: Collection[str]) -> None:
        """Refuse what is no mapping, and a key of it that is not `known`."""
        if not isinstance(value, dict):
            raise self.error(path, f"this is no mapping; it has {', '.join(known)}")
        for key in map(str, cast("dict[object, object]", value)):
            if key not in known:
                raise self.error((*path, key), f"unknown{did_you_mean(key, known)}; there are {', '.join(known)}")

    def _read_lines(self, path: Path, node: Any) -> None:
        """`node` is what YAML composes; None for an empty text."""
        self._lines.setdefault(path, 1 if node is None else node.start_mark.line + 1)
        kind, inside = getattr(node, "id", ""), getattr(node, "value", ())
        if kind == "sequence":
            for number, item in enumerate(inside):
                self._read_lines((*path, number), item)
        if kind == "mapping":
            for key, value in inside:
                inner = (*path, str(key.value))
                if inner in self._lines:
                    raise self._at(key.start_mark.line, f"{key.value} stands here twice")
                self._lines[inner] = key.start_mark.line + 1
                self._read_lines(inner, value)

    def _at(self, line: int, problem: str) -> SecurityError:
        return SecurityError(problem, file=self.file, line=line + 1)
