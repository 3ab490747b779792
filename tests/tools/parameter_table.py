"""The table of the robot's parameters in the reference: every parameter that a node of the robot declares, as it is declared."""

from __future__ import annotations

from actors import Node
from actors.parameters import ParameterDeclaration, ParameterDescriptor
from robot.nodes.carrier import Carrier
from robot.run.tree_nodes import nodes_of
from tests.robot.stage import whole


def nodes() -> dict[str, type[Node]]:
    """Every node that the robot can have."""
    found = {child.name: child.factory for child in nodes_of(whole())}
    assert all(isinstance(factory, type) for factory in found.values())
    return {**found, "carrier": Carrier}  # type: ignore[dict-item]


def declarations(node: type[Node]) -> list[ParameterDeclaration[object]]:
    return [one for one in vars(node).values() if isinstance(one, ParameterDeclaration)]


def range_of(descriptor: ParameterDescriptor) -> str:
    if descriptor.choices:
        return ", ".join(str(choice) for choice in descriptor.choices)
    limits = descriptor.integer_range or descriptor.floating_point_range
    if limits is None:
        return ""
    low, high = f"{limits.from_value:g}", f"{limits.to_value:g}"
    return f"from {low}" if limits.to_value > 1e9 else f"{low} .. {high}"


def row(node: str, declaration: ParameterDeclaration[object]) -> str:
    """One line of the table."""
    descriptor = declaration.descriptor
    value = declaration.default.value
    shown = str(value).lower() if isinstance(value, bool) else f"{value:g}" if isinstance(value, float) else str(value)
    unit = descriptor.additional_constraints.removeprefix("unit: ")
    default = f"{shown} {unit}".strip() or "empty"
    words = descriptor.description + (" Set at the start only." if descriptor.read_only else "")
    return f"| `{node}` | `{declaration.name}` | {default} | {range_of(descriptor)} | {words} |"


def table() -> list[str]:
    """The table, with its head."""
    rows = [row(name, one) for name, node in nodes().items() for one in declarations(node)]
    return ["| node | parameter | default | range | what it is |", "|---|---|---|---|---|", *rows]
