"""The text of a generated module: the messages, services and actions of one ROS package as typed Python classes."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from actors.interfaces import registry
from actors.interfaces.errors import BadDeclaration
from actors.interfaces.fields import INTEGER_RANGES, PRIMITIVES, STRINGS, FieldType
from actors.interfaces.naming import Kind
from actors.interfaces.parse import PARTS, Definition, FieldDefinition, MessageDefinition

BASES: dict[Kind, str] = {"srv": "ServiceType", "action": "ActionType"}
LINE_LENGTH = 120


def shipped(name: str) -> str | None:
    """The Python package that holds the generated class of a type by its full name; None if there is none."""
    found = registry.find_definition(name)
    return found[0].module if found is not None else None


class Module:
    """The text of one generated module.

    `homes` gives the Python package that holds the ROS package of a type, "" where it stands at the top; types that are not in it ship.
    `source` is the folder that the header names.
    """

    def __init__(
        self, package: str, kind: Kind, definitions: Sequence[Definition], homes: Mapping[str, str], source: str
    ) -> None:
        self.package = package
        self.kind: Kind = kind
        self.definitions = definitions
        self.homes = homes
        self.source = source
        self.imports: dict[str, dict[str, str]] = {}  # module -> ROS name -> local name
        self.typing: set[str] = set()
        self.aliases: set[str] = set()
        self.exported = {part.name.rpartition("/")[2] for d in definitions for part in d.parts}
        self.exported |= {d.name.rpartition("/")[2] for d in definitions}
        self.taken = set(self.exported)
        fields = {field.name for d in definitions for part in d.parts for field in part.fields}
        # A field called `string` would hide the type of that name from the fields below it.
        hidden = fields & {*PRIMITIVES, *(f"{name}_array" for name in PRIMITIVES), "default"}
        self.prefix = "types." if hidden else ""

    def text(self) -> str:
        """The whole module."""
        blocks: list[str] = []
        for definition in self._in_order():
            blocks += [self._message(part) for part in definition.parts]
            if self.kind != "msg":
                blocks.append(self._tie(definition))
        names = sorted(self.exported, key=_natural)
        exported = "__all__ = [\n" + "".join(f'    "{name}",\n' for name in names) + "]\n"
        head = f'"""{self.package}/{self.kind}. Generated from its definitions in {self.source}; do not edit."""\n'
        return "\n\n".join([f"{head}\n{self._import_lines()}\n{exported}", *blocks])

    def _in_order(self) -> list[Definition]:
        """A message after those it contains."""
        by_name = {definition.name: definition for definition in self.definitions}
        done: dict[str, Definition] = {}
        under_way: list[str] = []

        def visit(definition: Definition) -> None:
            if definition.name in done:
                return
            if definition.name in under_way:
                circle = " -> ".join([*under_way[under_way.index(definition.name) :], definition.name])
                raise BadDeclaration(f"a message cannot contain itself: {circle}")
            under_way.append(definition.name)
            for part in definition.parts:
                for field in part.fields:
                    if field.type.base in by_name:
                        visit(by_name[field.type.base])
            under_way.remove(definition.name)
            done[definition.name] = definition

        for definition in self.definitions:
            visit(definition)
        return list(done.values())

    def _message(self, part: MessageDefinition) -> str:
        name = part.name.rpartition("/")[2]
        lines = [f"class {name}(Message, frozen=True, kw_only=True):", f'    """{part.name}{_doc(part.comment)}"""', ""]
        for constant in part.constants:
            self.typing.add("ClassVar")
            lines.append(
                f"    {constant.name}: ClassVar[{self._alias(constant.type.base)}] = {_literal(constant.value)}"
            )
        if part.constants and part.fields:
            lines.append("")
        for field in part.fields:
            lines += self._field(field)
        if lines[-1] == "":
            lines.pop()
        return "\n".join(lines) + "\n"

    def _field(self, field: FieldDefinition) -> list[str]:
        lines = [f"    {field.name}: {self._annotation(field.type)} = {self._default(field)}"]
        remark = " ".join(field.comment) + (f" [{field.unit}]" if field.unit else "")
        if remark.strip():
            lines.append(f'    """{_quotable(remark.strip())}"""')
        return lines

    def _annotation(self, kind: FieldType) -> str:
        marks: list[str] = []
        if kind.string_bound:
            marks.append(f"{self._alias('Chars')}({kind.string_bound})")
        if kind.array in {"fixed", "bounded"}:
            marks.append(f"{self._alias('Exactly' if kind.array == 'fixed' else 'AtMost')}({kind.size})")
        if kind.is_message:
            text = self._class(kind.base)
            text = f"{self._alias('Many')}[{text}]" if kind.is_array else text
        else:
            text = self._alias(f"{kind.base}_array" if kind.is_array else kind.base)
        if not marks:
            return text
        self.typing.add("Annotated")
        return f"Annotated[{text}, {', '.join(marks)}]"

    def _default(self, field: FieldDefinition) -> str:
        if field.type.is_array or field.type.is_message:
            return (
                f"{self._alias('default')}({_literal(list(field.default)) if isinstance(field.default, tuple) else ''})"
            )
        if field.default is not None:
            return _literal(field.default)
        base = field.type.base
        return '""' if base in STRINGS else "False" if base == "bool" else "0" if base in INTEGER_RANGES else "0.0"

    def _alias(self, name: str) -> str:
        if name == "bool":
            return name
        self.aliases.add(name)
        return f"{self.prefix}{name}"

    def _class(self, ros_name: str) -> str:
        package, kind, name = ros_name.split("/")
        if (package, kind) == (self.package, self.kind) and ros_name in self.homes:
            return name
        names = self.imports.setdefault(self._module(ros_name), {})
        if name not in names:
            local = name if name not in self.taken else "".join(word.capitalize() for word in package.split("_")) + name
            self.taken.add(local)
            names[name] = local
        return names[name]

    def _module(self, ros_name: str) -> str:
        package, kind, _ = ros_name.split("/")
        home = self.homes.get(ros_name)
        if home is not None and package == self.package:
            return f".{kind}"  # right wherever the package stands
        home = shipped(ros_name) if home is None else home
        return f"{home}.{package}.{kind}" if home else f"{package}.{kind}"

    def _tie(self, definition: Definition) -> str:
        name, base = definition.name.rpartition("/")[2], BASES[self.kind]
        self.typing.add("TypeAlias")
        parts = [suffix.removeprefix("_") for suffix in PARTS[self.kind]]
        arguments = ", ".join(f"{name}_{part}" for part in parts)
        head = f"class {name}({base}[{arguments}]):"
        if len(head) > LINE_LENGTH:
            head = f"class {name}(\n    {base}[{arguments}]\n):"
        lines = [head, f'    """{definition.name}"""', ""]
        return "\n".join(lines + [f"    {part}: TypeAlias = {name}_{part}" for part in parts]) + "\n"

    def _import_lines(self) -> str:
        bases = ["Message"] if self.kind == "msg" else [BASES[self.kind], "Message"]
        blocks: dict[str, str] = {"actors.interfaces.message": _from_import("actors.interfaces.message", bases)}
        for module, names in self.imports.items():
            wanted = [name if name == local else f"{name} as {local}" for name, local in names.items()]
            blocks[module] = _from_import(module, wanted)
        if self.aliases and self.prefix:
            blocks["actors.interfaces"] = "from actors.interfaces import types\n"
        elif self.aliases:
            blocks["actors.interfaces.types"] = _from_import("actors.interfaces.types", self.aliases)
        typing = f"{_from_import('typing', self.typing)}\n" if self.typing else ""
        absolute = "".join(blocks[module] for module in sorted(blocks) if not module.startswith("."))
        own = "".join(blocks[module] for module in sorted(blocks) if module.startswith("."))
        return typing + absolute + (f"\n{own}" if own else "")


def _from_import(module: str, names: Iterable[str]) -> str:
    ordered = sorted(names, key=_natural)
    line = f"from {module} import {', '.join(ordered)}\n"
    if len(line) <= LINE_LENGTH + 1:
        return line
    return f"from {module} import (\n" + "".join(f"    {name},\n" for name in ordered) + ")\n"


def _natural(name: str) -> tuple[object, ...]:
    """The order of import sorters: constants, classes, then the rest; uint8 before uint16."""
    parts = re.split(r"(\d+)", name)
    return (not name.isupper(), name[0].islower(), [(int(p), "") if p.isdigit() else (-1, p) for p in parts])


def _doc(comment: Sequence[str]) -> str:
    return "".join(["\n\n", *(f"    {_quotable(line)}".rstrip() + "\n" for line in comment), "    "]) if comment else ""


def _quotable(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"""', '\\"\\"\\"').rstrip('"')


def _literal(value: Any) -> str:
    if isinstance(value, float) and (value != value or value in (float("inf"), float("-inf"))):
        return f'float("{value}")'
    if isinstance(value, list):
        return f"[{', '.join(_literal(item) for item in value)}]"  # pyright: ignore[reportUnknownVariableType]
    if isinstance(value, str) and '"' not in value and "'" not in value:
        return f'"{repr(value)[1:-1]}"'
    return repr(value)
