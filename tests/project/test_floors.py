"""The floors of `actors`: each room imports only from rooms below it, in every kind of import, but for the exceptions named here."""

from __future__ import annotations

import ast
import re
from pathlib import Path

from tests.project.imports import Edge, circles, edges, modules

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

CIRCLES: dict[str, tuple[int, ...]] = {}
"""The rooms with circles of more than `CIRCLE` modules that import each other, and how many modules each has. These numbers only get smaller."""

CIRCLE = 4
"""The most modules of a room that may import each other in a circle. Imports for type checkers count, too: such modules are read together."""

FILE, FUNCTION = 800, 60
"""The most lines of a file and of a function. A file is about one thing: it is not cut in two for its length."""


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


COMMANDS = ("__main__.py", "commands", "run", "picture", "tutorials")
"""The parts of `robot` that are programs."""


def imports(path: Path, package: str) -> bool:
    return re.search(rf"^\s*(from|import) {package}\b", path.read_text(encoding="utf-8"), re.MULTILINE) is not None


def test_only_the_robots_programs_import_the_command_line() -> None:
    robot = [path for path in (ACTORS.parent / "robot").iterdir() if path.name not in COMMANDS]
    for root in (ACTORS, *robot):
        for path in root.rglob("*.py") if root.is_dir() else (root,):
            assert path.suffix != ".py" or not imports(path, "cli"), path


def test_the_command_line_knows_nothing_of_the_robot() -> None:
    """But for the sentence about another project's package of that name."""
    known = {path.name for path in (ACTORS.parent / "cli").rglob("*.py") if imports(path, "robot")}
    assert known == {"entry.py"}


def test_the_circles_inside_of_rooms_only_get_smaller() -> None:
    found: dict[str, list[int]] = {}
    for package in ("actors", "robot", "cli"):
        for circle in circles(edges(ACTORS.parent / package)):
            if len(circle) > CIRCLE:
                found.setdefault(".".join(circle[0].split(".")[:2]), []).append(len(circle))
    assert {room: tuple(sorted(sizes, reverse=True)) for room, sizes in found.items()} == CIRCLES


def test_files_and_functions_can_be_read() -> None:
    long: list[str] = []
    for path in ACTORS.rglob("*.py"):
        if "interfaces" in path.parts and path.parent.name in ("msg", "srv", "action"):
            continue  # generated
        text = path.read_text(encoding="utf-8")
        if (length := len(text.splitlines())) > FILE:
            long.append(f"{path}: {length} lines")
        functions = [
            one for one in ast.walk(ast.parse(text)) if isinstance(one, (ast.FunctionDef, ast.AsyncFunctionDef))
        ]
        long += [f"{path}, {one.name}: {length} lines" for one in functions if (length := own_lines(one)) > FUNCTION]
    assert long == []


def own_lines(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """How many lines a function has, without its head, its docstring and the functions in it."""
    body = function.body[1:] if ast.get_docstring(function) is not None else function.body
    inner = [one for one in body if isinstance(one, (ast.FunctionDef, ast.AsyncFunctionDef))]
    lines = (function.end_lineno or 0) - body[0].lineno + 1 if body else 0
    return lines - sum((one.end_lineno or 0) - one.lineno + 1 for one in inner)
