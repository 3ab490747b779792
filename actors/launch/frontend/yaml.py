"""Launch files in YAML."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from actors.launch.errors import LaunchError, Line
from actors.launch.frontend.element import Element, Unquoted
from actors.parameters.ros_yaml import PLAIN, loader
from actors.yaml_bounds import check_yaml


def read_yaml(path: Path) -> Element:
    """The root element of a launch file in YAML. Raises `LaunchError`, with the line."""
    import yaml  # late: few programs launch

    try:
        text = path.read_text(encoding="utf-8")
        check_yaml(text)
        reader: Any = loader()(text)
        root = reader.get_single_node()
        if root is None:
            raise LaunchError("the file is empty: it needs a list under the key 'launch'", Line(str(path), 1))
        return _Reader(path, reader).root(root)
    except UnicodeDecodeError as error:
        raise LaunchError(f"no YAML: {error}", Line(str(path), 1)) from None
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = Line(str(path), mark.line + 1 if mark is not None else 1)
        raise LaunchError(f"no YAML: {getattr(error, 'problem', None) or error}", line) from None


class _Reader:
    """Makes elements of the nodes of a YAML document, each with its line."""

    def __init__(self, path: Path, loader: Any) -> None:
        self.path = path
        self.loader = loader

    def root(self, node: object) -> Element:
        pairs = self.pairs(node, "the file")
        names = [name for name, _ in pairs]
        if names != ["launch"]:
            raise LaunchError(f"a launch file has one key, 'launch', not {', '.join(names) or 'none'}", self.line(node))
        return self.element("launch", pairs[0][1])

    def element(self, tag: str, node: Any) -> Element:
        """The element of a mapping, of a list of elements, or of a lone value, which is that of a file or of nothing."""
        line = self.line(node)
        if node.id == "sequence":
            return Element(tag, {}, self.children(node), line)
        if node.id == "scalar":
            if node.value in ("", "~", "null"):
                return Element(tag, {}, (), line)
            raise LaunchError(f"{tag!r} takes attributes, {tag}: {{name: value}}, not {node.value!r:.60}", line)
        attributes: dict[str, object] = {}
        children: list[Element] = []
        for name, value in self.pairs(node, tag):
            if name == "children":
                children += self.children(value)
            elif value.id == "sequence" and any(item.id == "mapping" for item in value.value):
                children += [self.element(name, item) for item in value.value]
            elif value.id == "mapping":
                children.append(self.element(name, value))
            else:
                attributes[name] = self.value(value)
        return Element(tag, attributes, children, line, typed=True)

    def children(self, node: Any) -> list[Element]:
        """The elements of a list, each a mapping with one key."""
        if node.id != "sequence":
            raise LaunchError("a list of actions begins each of them with '-'", self.line(node))
        found: list[Element] = []
        for item in node.value:
            pairs = self.pairs(item, "an action")
            if len(pairs) != 1:
                names = ", ".join(name for name, _ in pairs)
                raise LaunchError(
                    f"an action has one key, its kind, not {names}; what follows is indented deeper", self.line(item)
                )
            found.append(self.element(*pairs[0]))
        return found

    def value(self, node: Any) -> Any:
        """A value, or a list of them; one without quotes stays as it is written, as most attributes are texts."""
        if node.id == "sequence":
            return [self.value(item) for item in node.value]
        if node.id == "scalar" and node.tag == PLAIN:
            return Unquoted(node.value) if node.value else None
        return self.loader.construct_object(node, deep=True)

    def pairs(self, node: Any, what: str) -> list[tuple[str, Any]]:
        if node.id != "mapping":
            raise LaunchError(f"{what} is a mapping, 'name: value', here", self.line(node))
        return [(str(key.value), value) for key, value in node.value]

    def line(self, node: Any) -> Line:
        return Line(str(self.path), node.start_mark.line + 1)
