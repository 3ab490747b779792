"""The parameters of the robot, as the reference lists them."""

from __future__ import annotations

from tests.tools.parameter_table import declarations, nodes, range_of, table


def test_every_parameter_of_the_robot_has_a_row_with_its_default_and_its_range() -> None:
    rows = table()
    assert len(rows) - 2 == sum(len(declarations(node)) for node in nodes().values()) > 40
    said = "How long a command is valid. Set at the start only."
    assert f"| `robot_controller` | `timeout` | 0.5 s | 0.05 .. 5 | {said} |" in rows


def test_every_parameter_says_what_it_is_for_a_number_its_range_and_a_quantity_its_si_unit() -> None:
    for name, node in nodes().items():
        for one in declarations(node):
            unit = one.descriptor.additional_constraints.removeprefix("unit: ")
            assert unit in {"", "s", "Hz", "m", "m/s", "m/s2", "rad", "rad/s", "%"}, f"{name}.{one.name}"
            assert one.descriptor.description.endswith("."), f"{name}.{one.name}"
            if isinstance(one.default.value, float):
                assert range_of(one.descriptor), f"{name}.{one.name}"
