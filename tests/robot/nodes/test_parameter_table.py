"""The table of parameters in docs/robot.md: every parameter that a node of the robot declares, as it is declared."""

from __future__ import annotations

import re
from pathlib import Path

from actors import Node
from actors.parameters import ParameterDeclaration, ParameterDescriptor
from robot.nodes.carrier import Carrier
from robot.run.choice import nodes_of
from tests.robot.stage import whole

PAGE = (Path(__file__).parents[3] / "docs" / "robot.md").read_text(encoding="utf-8")


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
    return [row(name, one) for name, node in nodes().items() for one in declarations(node)]


def test_every_parameter_of_the_robot_has_its_row_in_the_order_of_the_tree() -> None:
    found = re.findall(
        r"^\| `\w+` \| `\w+` \|.*\|$", PAGE.split("## Parameters")[1].split("\n## ")[0], flags=re.MULTILINE
    )
    assert found == table()


def test_every_parameter_says_what_it_is_for_and_a_number_its_range() -> None:
    for name, node in nodes().items():
        for one in declarations(node):
            assert one.descriptor.description.endswith("."), f"{name}.{one.name}"
            if isinstance(one.default.value, float):
                assert range_of(one.descriptor), f"{name}.{one.name}"
