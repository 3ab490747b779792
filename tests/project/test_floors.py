"""The floors of `actors`: each room imports only from rooms below it, in every kind of import, but for the exceptions named here."""

from __future__ import annotations

from pathlib import Path

from tests.project.imports import Edge, edges, modules

ACTORS = Path(__file__).parents[2] / "actors"

FLOORS = (
    "typing",
    "testing",
    "check",
    "blocking",
    "launch",
    "replay",
    "bag",
    "nodes",
    "diagnostics",
    "tf2",
    "message_filters",
    "running",
    "hosts",
    "processes",
    "lifecycle",
    "system",
    "transport",
    "runtime",
    "node",
    "graph",
    "actions",
    "services",
    "topics",
    "inbox",
    "parameters",
    "contracts",
    "supervision",
    "logs",
    "time",
    "images",
    "interfaces",
    "checks",
    "names",
    "qos",
    "shield",
    "places",
    "errors",
    "suggest",
    "waiting",
    "yaml_bounds",
    "pickle_bounds",
)
"""The rooms from top to bottom. The face, ``actors/__init__.py``, stands above all of them, and nothing imports it."""

UPWARDS: frozenset[tuple[str, str]] = frozenset()
"""The exceptions, (module, module above it), none of them at module level. This list only gets shorter."""

LAZY_UPWARDS: frozenset[tuple[str, str]] = frozenset()
"""Those of them that are imported when a function is called, and not for type checkers only."""


def room_of(module: str) -> str:
    return module.split(".")[1] if "." in module else ""


def upwards() -> list[Edge]:
    floor = {room: number for number, room in enumerate(("", *FLOORS))}
    return [edge for edge in edges(ACTORS) if floor[room_of(edge.target)] < floor[room_of(edge.source)]]


def test_every_room_has_its_floor_and_every_floor_its_room() -> None:
    assert {room_of(name) for name in modules(ACTORS)} - {""} == set(FLOORS)


def test_imports_go_down_the_floors() -> None:
    for edge in upwards():
        where = f"{edge.source}, line {edge.line}, imports {edge.target}, which stands above it"
        assert edge.kind != "top", where
        assert (edge.source, edge.target) in UPWARDS, where
        assert edge.kind == "typing" or (edge.source, edge.target) in LAZY_UPWARDS, where


def test_no_exception_is_left_over() -> None:
    assert {(edge.source, edge.target) for edge in upwards()} == UPWARDS
    assert {(edge.source, edge.target) for edge in upwards() if edge.kind == "lazy"} == LAZY_UPWARDS


def test_no_module_imports_the_public_faces_at_the_top() -> None:
    assert [edge for edge in edges(ACTORS) if edge.target in ("actors", "actors.typing")] == []


def test_only_the_robots_command_imports_the_command_line() -> None:
    robot = [path for path in (ACTORS.parent / "robot").rglob("*.py") if path.name != "__main__.py"]
    for path in [*ACTORS.rglob("*.py"), *robot]:
        text = path.read_text(encoding="utf-8")
        assert "import cli" not in text and "from cli" not in text, path
