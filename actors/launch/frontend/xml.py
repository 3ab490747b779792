"""Launch files in XML."""

from __future__ import annotations

from pathlib import Path
from xml.parsers import expat

from actors.launch.errors import LaunchError, Line
from actors.launch.frontend.element import Element
from actors.yaml_bounds import DEEPEST


def read_xml(path: Path) -> Element:
    """The root element of a launch file in XML. Raises `LaunchError`, with the line.

    Entities that a document defines itself are refused: they can grow without bound.
    """
    reader = _Reader(path)
    try:
        reader.parser.Parse(path.read_bytes(), True)
    except expat.ExpatError as error:
        raise LaunchError(f"no XML: {expat.ErrorString(error.code)}", Line(str(path), error.lineno)) from None
    root = reader.root
    if root.tag != "launch":
        raise root.error(f"a launch file begins with <launch>, not with <{root.tag}>")
    return root


class _Reader:
    """Builds the tree of elements while expat reads; `open` are those that have begun and not ended."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.parser = parser = expat.ParserCreate()
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.EntityDeclHandler = self._entity
        self.open: list[tuple[Element, list[Element]]] = []
        self.root = Element("", {}, (), Line(str(path), 1))

    def _line(self) -> Line:
        return Line(str(self.path), self.parser.CurrentLineNumber)

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        if len(self.open) >= DEEPEST:
            raise LaunchError(f"it is nested more than {DEEPEST} levels deep", self._line())
        children: list[Element] = []
        element = Element(tag, dict(attributes), children, self._line())
        if self.open:
            self.open[-1][1].append(element)
        else:
            self.root = element
        self.open.append((element, children))

    def _end(self, tag: str) -> None:
        self.open.pop()

    def _entity(self, name: str, *_: object) -> None:
        raise LaunchError(f"the entity {name!r} is defined in the file: that is not supported", self._line())
