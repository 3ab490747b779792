"""The floors of `cli`, and of its web server: each room imports only from rooms below it, in every kind of import, without exceptions."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.project.imports import edges, modules

CLI = Path(__file__).parents[2] / "cli"

FLOORS = {
    "cli": (
        "web",
        "verbs",
        "graph",
        "entry",
        "verb",
        "quality",
        "text",
        "values",
        "parsing",
        "command",
        "output",
        "starting",
    ),
    "cli.web": ("verb", "beside", "server", "rosbridge", "foxglove", "hub", "recordings", "graph", "clients"),
}
"""The rooms from top to bottom. What a package's own ``__init__`` would import stands above all of them, and nothing imports it."""


@pytest.mark.parametrize("package", FLOORS)
def test_imports_go_down_the_floors(package: str) -> None:
    depth = package.count(".") + 1

    def room_of(module: str) -> str:
        return module.split(".")[depth] if module.startswith(f"{package}.") else ""

    floor = {room: number for number, room in enumerate(("", *FLOORS[package]))}
    assert {room_of(name) for name in modules(CLI)} - {""} == set(FLOORS[package])
    upwards = [
        f"{edge.source}, line {edge.line}, imports {edge.target}"
        for edge in edges(CLI)
        if room_of(edge.source) and room_of(edge.target) and floor[room_of(edge.target)] < floor[room_of(edge.source)]
    ]
    assert upwards == []
