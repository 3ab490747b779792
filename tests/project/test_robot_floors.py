"""The floors of `robot`: each room imports only from rooms below it, in every kind of import, without exceptions."""

from __future__ import annotations

import re
from pathlib import Path

from tests.project.imports import edges, modules

ROBOT = Path(__file__).parents[2] / "robot"

FLOORS = (
    "__main__",
    "commands",
    "tutorials",
    "picture",
    "run",
    "testing",
    "assembly",
    "tree",
    "urdf",
    "nodes",
    "link",
    "sim",
    "navigation",
    "control",
    "estimation",
    "planning",
    "hardware",
    "scenes",
    "model",
    "contracts",
    "concerns",
    "interfaces",
    "png",
    "geometry",
)
"""The rooms from top to bottom. The face, ``robot/__init__.py``, stands above all of them, and nothing imports it."""

PURE = ("geometry", "model", "scenes", "planning", "estimation", "control", "navigation", "sim")
"""Rooms of values and algorithms: they know nothing of nodes and messages."""

MESSAGES = frozenset({"robot.geometry.messages"})
"""What turns their values into messages and back."""


def room_of(module: str) -> str:
    return module.split(".")[1] if "." in module else ""


def test_every_room_has_its_floor_and_every_floor_its_room() -> None:
    assert {room_of(name) for name in modules(ROBOT)} - {""} == set(FLOORS)


def test_imports_go_down_the_floors() -> None:
    floor = {room: number for number, room in enumerate(("", *FLOORS))}
    upwards = [
        f"{edge.source}, line {edge.line}, imports {edge.target}"
        for edge in edges(ROBOT)
        if floor[room_of(edge.target)] < floor[room_of(edge.source)]
    ]
    assert upwards == []


def test_no_two_modules_of_one_room_import_each_other_when_they_are_loaded() -> None:
    pairs = {(edge.source, edge.target) for edge in edges(ROBOT) if edge.kind == "top"}
    assert [pair for pair in sorted(pairs) if pair[::-1] in pairs] == []


def test_only_the_commands_import_the_public_face() -> None:
    assert [edge for edge in edges(ROBOT) if edge.target == "robot"] == []


def test_algorithms_know_nothing_of_nodes_and_messages() -> None:
    for name, path in modules(ROBOT).items():
        if room_of(name) in PURE and name not in MESSAGES:
            text = path.read_text(encoding="utf-8")
            assert "from actors import" not in text and "actors.interfaces" not in text, name


def test_worlds_can_be_named_without_numpy() -> None:
    """`python -m robot run --help` lists them, and is not to wait for numpy."""
    reached, waiting = set[str](), ["robot.scenes.worlds"]
    targets: dict[str, set[str]] = {}
    for edge in edges(ROBOT):
        if edge.kind == "top":
            targets.setdefault(edge.source, set()).add(edge.target)
    while waiting:
        name = waiting.pop()
        if name not in reached:
            reached.add(name)
            waiting += targets.get(name, ())
    paths = modules(ROBOT)
    assert [name for name in sorted(reached) if "import numpy" in paths[name].read_text(encoding="utf-8")] == []


def test_what_controls_a_robot_knows_nothing_of_the_simulation() -> None:
    """A real robot brings hardware and devices of its own, and changes nothing else."""
    rooms = ("nodes", "control", "navigation", "estimation", "planning", "hardware", "model")
    assert [edge for edge in edges(ROBOT) if room_of(edge.source) in rooms and room_of(edge.target) == "sim"] == []


def test_controllers_and_estimators_take_the_robots_figures_from_its_model() -> None:
    """What they import of the reference body would be wrong for another one; gravity is the same for all."""
    for name, path in modules(ROBOT).items():
        if room_of(name) in ("control", "navigation", "estimation"):
            taken = re.findall(
                r"^from robot\.model\.(?:parameters|stance) import (.*)$",
                path.read_text(encoding="utf-8"),
                re.MULTILINE,
            )
            assert set(taken) <= {"GRAVITY", "nominal_feet"}, name
