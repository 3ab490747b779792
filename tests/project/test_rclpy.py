"""docs/reference/rclpy.md: every public name of rclpy, tf2_ros and message_filters has a line, and every name of ours in it exists."""

from __future__ import annotations

import importlib
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import actors

ROOT = Path(__file__).parents[2]
NAMES = (Path(__file__).parent / "rclpy_names.txt").read_text(encoding="utf-8").split()
"""The public classes and functions of the modules of rclpy 10.0.10 (without those of `rclpy.impl`), the members of its `Node` and its
profiles, as they were read from an installation."""
OTHERS = (Path(__file__).parent / "tf2_names.txt").read_text(encoding="utf-8").split()
"""The public names of tf2_ros, tf2_geometry_msgs and tf2_sensor_msgs 0.45.7 and of message_filters 7.4.2 for Python, with the public
methods of their classes, as they were read from their sources."""


def rows() -> Iterator[tuple[list[str], str]]:
    """The names of each row, and what stands on the right."""
    text = (ROOT / "docs" / "reference" / "rclpy.md").read_text(encoding="utf-8")
    for line in text.splitlines():
        if line.startswith("| `"):
            left, right = line.strip("| ").split(" | ")
            yield re.findall(r"`([\w.]+)`", left), right


def found(name: str) -> Any:
    """What a name of ours stands for: of `actors`, of a module, or of a type for annotations."""
    module, rest = actors, name.split(".")
    if rest[0] == "actors":
        for depth in range(len(rest), 0, -1):
            try:
                module = importlib.import_module(".".join(rest[:depth]))
            except ModuleNotFoundError:
                continue
            rest = rest[depth:]
            break
    elif rest[0] == "NodeRecord":
        module = importlib.import_module("actors.typing")
    value: Any = module
    for part in rest:
        value = getattr(value, part)
    return value


def test_every_public_name_of_rclpy_tf2_and_message_filters_has_one_line() -> None:
    listed = Counter(
        name if name.startswith(("tf2_", "message_filters.")) else f"rclpy.{name}"
        for names, _ in rows()
        for name in names
    )
    assert len(NAMES) > 230 and len(OTHERS) > 130
    assert sorted(listed) == sorted(NAMES + OTHERS)
    assert [name for name, times in listed.items() if times > 1] == []


OURS = sorted(
    {name for _, right in rows() for name in re.findall(r"`([A-Za-z_][\w.]*)`", right)}
    - {"RMW_IMPLEMENTATION", "use_sim_time"}
)


@pytest.mark.parametrize("name", OURS)
def test_what_takes_its_place_exists(name: str) -> None:
    assert found(name) is not None


def test_a_line_says_what_to_use_or_why_there_is_nothing() -> None:
    for names, right in rows():
        assert re.match(r"— \w+|.*`[A-Za-z_][\w.]*`", right), names
