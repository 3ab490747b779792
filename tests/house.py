"""`python -m tests.house [FOLDER]`: the figures of `actors` in a checkout, by which one sees whether a stranger can live in it.

They are counted from the syntax trees, so an older checkout needs nothing but its files; only the objects of a running node are counted in
a live system, by this Python with that checkout's package. Generated modules, those of message types, are left out.
"""

from __future__ import annotations

import ast
import subprocess
import sys
import tokenize
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

from tests.imports import edges, modules
from tests.surface import Definition, Surface

__all__ = ["Figure", "House", "circles", "main"]

LONG_FILE = 400
LONG_FUNCTION = 60
GENERATED = frozenset({"msg", "srv", "action"})
FOREIGN = frozenset(
    {"_args", "_callback", "_cancelled", "_check_closed", "_context", "_exit", "_fields", "_replace", "_run"}
)
"""Private names of asyncio's handles, of named tuples and of `os`, which modules of ours use, too."""

OBJECTS = """
import asyncio, gc
from collections import Counter
from actors import Child, Node, Supervisor, run

class Idle(Node):
    pass

def alive():
    gc.collect()
    return Counter(type(one).__qualname__ for one in gc.get_objects() if type(one).__module__.startswith(("actors.", "__main__")))

async def counted(nodes):
    children = [Child(Idle, name=f"idle_{number}") for number in range(nodes)]
    async with run(Supervisor("tree", children=children), sinks=()):
        await asyncio.sleep(0)
        return alive()

few, many = asyncio.run(counted(10)), asyncio.run(counted(20))
for name, count in sorted(many.items()):
    if count - few[name] >= 10:
        print(name, (count - few[name]) // 10)
"""
"""Prints the classes of `actors`, and how many instances of each one more idle node brings with it."""


class Figure(NamedTuple):
    """One line of the table: a count, and what was counted."""

    name: str
    count: int
    items: tuple[str, ...] = ()


class House:
    """The package in a folder, read once. Its public modules are those that the tests beside it name; without them, all its packages."""

    def __init__(self, package: Path) -> None:
        self.package = package
        self.paths = {name: path for name, path in modules(package).items() if name.rpartition(".")[2] not in GENERATED}
        self.trees = {name: ast.parse(path.read_text(encoding="utf-8")) for name, path in self.paths.items()}
        self.edges = [one for one in edges(package) if one.source in self.paths and one.target in self.paths]
        tests = package.parent / "tests"
        internal: dict[str, tuple[str, ...]] = _literal(tests / "reference.py", "INTERNAL") or {}
        self.surface = Surface(
            package, {f"{kind}.{member}" for kind, members in internal.items() for member in members}
        )
        packages = [name for name, path in self.paths.items() if path.name == "__init__.py"]
        self.faces: tuple[str, ...] = _literal(tests / "unit" / "test_surface.py", "FACES") or tuple(packages)

    def figures(self) -> Iterator[Figure]:
        """The whole table, without the objects of a node."""
        root = self.package.name
        rooms = sorted({self.room(name) for name in self.paths} - {""})
        yield Figure("modules", len(self.paths))
        yield Figure("files at the top of the package", len([*self.package.glob("*.py")]))
        yield Figure("rooms: folders and files at the top", len(rooms))
        floors = self.floors()
        yield Figure("import floors of the rooms", max(floors.values(), default=0))
        yield _listed("edges between rooms that lead upwards", self.upwards(floors))
        for kinds in (("top",), ("top", "lazy"), ("top", "lazy", "typing")):
            found = circles(self.arrows(kinds))
            yield Figure(
                f"circles of modules, imports {' + '.join(kinds)}",
                len(found),
                tuple(f"{len(one)}: {' '.join(one)}" for one in found),
            )
        for kind in ("top", "lazy", "typing"):
            yield Figure(f"import edges, {kind}", len({one[:3] for one in self.edges if one.kind == kind}))
        yield _listed("classes with exactly one heir", self.single_heirs())
        for name in ("cast", "getattr"):
            yield Figure(f"{name}(", sum(map(_calls(name), self.trees.values())))
        yield Figure("# type: ignore", sum(map(_ignores, self.paths.values())))
        yield _listed("private access across our own modules", self.private_access())
        yield Figure(f"names in {root}.__all__", len(self.surface.exports(root)))
        public = self.surface.exported([root])
        yield _listed("own types in their signatures, not in it", map(str, self.surface.missing(public)))
        public = self.surface.exported(self.faces)
        yield Figure("names in the __all__ of all public modules", len(public))
        missing = (one for one in self.surface.missing(public) if one.module.rpartition(".")[2] not in GENERATED)
        yield _listed("own types in their signatures, not in them", map(str, missing))
        yield _listed(f"files over {LONG_FILE} lines", self.long_files())
        yield _listed(f"functions over {LONG_FUNCTION} lines", self.long_functions())

    def room(self, module: str) -> str:
        """The folder or file at the top of the package in which a module lies; empty for the package's own face."""
        return module.split(".")[1] if "." in module else ""

    def arrows(self, kinds: Iterable[str], by: Callable[[str], str] = str) -> dict[str, set[str]]:
        """Who imports whom, for these kinds of import; modules, or what `by` makes of them."""
        found: dict[str, set[str]] = {by(name): set() for name in self.paths}
        for one in self.edges:
            if one.kind in kinds and by(one.source) != by(one.target):
                found[by(one.source)].add(by(one.target))
        return found

    def floors(self) -> dict[str, int]:
        """The floor of every room: one more than the highest of those that it imports at module level; a circle shares one."""
        arrows = self.arrows(["top"], self.room)
        arrows.pop("")
        for inside in arrows.values():
            inside.discard("")
        together = {room: tuple(group) for group in circles(arrows) for room in group}
        floors: dict[str, int] = {}

        def floor(room: str) -> int:
            if room not in floors:
                group = together.get(room, (room,))
                below = chain.from_iterable(arrows[one] for one in group)
                height = 1 + max((floor(one) for one in below if one not in group), default=0)
                floors.update(dict.fromkeys(group, height))
            return floors[room]

        for room in arrows:
            floor(room)
        return floors

    def upwards(self, floors: Mapping[str, int]) -> Iterator[str]:
        """Imports of any kind between two rooms, from a lower floor to a higher one."""
        for source, targets in sorted(self.arrows(["top", "lazy", "typing"], self.room).items()):
            for target in sorted(targets - {""}) if source else ():
                if floors[target] > floors[source]:
                    yield f"{source} -> {target}"

    def single_heirs(self) -> Iterator[str]:
        """Classes from which exactly one other class of the package is derived."""
        heirs: dict[Definition, list[str]] = {}
        for name, module in self.surface.modules.items():
            for kind in ast.walk(module.tree):
                for base in kind.bases if isinstance(kind, ast.ClassDef) else ():
                    found = self._class(name, base)
                    if found is not None:
                        heirs.setdefault(found, []).append(
                            f"{name}.{kind.name}" if isinstance(kind, ast.ClassDef) else ""
                        )
        return (f"{one} <- {names[0]}" for one, names in sorted(heirs.items()) if len(names) == 1)

    def _class(self, module: str, base: ast.expr) -> Definition | None:
        plain = base.value if isinstance(base, ast.Subscript) else base
        found = self.surface.resolve(module, plain.id) if isinstance(plain, ast.Name) else None
        if found is None or not found.name:
            return None
        return found if isinstance(self.surface.modules[found.module].defined[found.name], ast.ClassDef) else None

    def private_access(self) -> Iterator[str]:
        """Uses of a private name, of an object, that another module of the package defines and the own one does not."""
        defined = {name: set(_private_definitions(tree)) for name, tree in self.trees.items()}
        ours = set(chain.from_iterable(defined.values()))
        for name, tree in self.trees.items():
            for node in ast.walk(tree):
                if not isinstance(node, ast.Attribute) or _is_self(node.value):
                    continue
                if node.attr in ours - defined[name] - FOREIGN and _is_private(node.attr):
                    yield f"{name}:{node.lineno} {ast.unparse(node)}"
            for node in tree.body:
                if isinstance(node, ast.ImportFrom) and (
                    node.level or (node.module or "").startswith(self.package.name)
                ):
                    yield from (f"{name}:{node.lineno} {one.name}" for one in node.names if _is_private(one.name))

    def long_files(self) -> Iterator[str]:
        for name, path in self.paths.items():
            count = len(path.read_text(encoding="utf-8").splitlines())
            if count > LONG_FILE:
                yield f"{name} {count}"

    def long_functions(self) -> Iterator[str]:
        for name, tree in self.trees.items():
            for node in ast.walk(tree):
                if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                    count = (node.end_lineno or node.lineno) - node.lineno + 1
                    if count > LONG_FUNCTION:
                        yield f"{name}.{node.name} {count}"


def circles(arrows: Mapping[str, Iterable[str]]) -> list[list[str]]:
    """The groups of two and more in which each reaches each, the largest first."""
    reached = {name: _reached(name, arrows) for name in arrows}
    groups = {frozenset(other for other in reached[name] if name in reached[other]) for name in arrows}
    return sorted((sorted(one) for one in groups if len(one) > 1), key=lambda one: (-len(one), one))


def objects(folder: Path) -> Figure:
    """Instances of the package's own classes that one idle node has, its declaration in the tree included."""
    command = [sys.executable, "-c", OBJECTS]
    text = subprocess.run(
        command, cwd=folder, env={"PYTHONPATH": str(folder)}, capture_output=True, text=True, check=True
    ).stdout
    found = Counter({name: int(count) for name, count in (line.rsplit(" ", 1) for line in text.splitlines())})
    return Figure("objects of one idle node", found.total(), tuple(f"{name} {count}" for name, count in found.items()))


def main(arguments: list[str]) -> int:
    """Print the table; with ``-v`` also what was counted."""
    folders = [Path(one) for one in arguments if one != "-v"] or [Path(__file__).parents[1]]
    for folder in folders:
        for figure in (*House(folder / "actors").figures(), objects(folder)):
            print(f"{figure.count:6}  {figure.name}")
            for item in figure.items if "-v" in arguments else ():
                print(f"          {item}")
    return 0


def _literal(path: Path, name: str) -> Any:
    """The value of a constant of a module, as it is written there; None if there is no such file or constant."""
    tree = ast.parse(path.read_text(encoding="utf-8")) if path.is_file() else ast.Module([], [])
    for statement in tree.body:
        targets = statement.targets if isinstance(statement, ast.Assign) else [getattr(statement, "target", None)]
        if any(isinstance(one, ast.Name) and one.id == name for one in targets):
            return (
                ast.literal_eval(statement.value)
                if isinstance(statement, (ast.Assign, ast.AnnAssign)) and statement.value
                else None
            )
    return None


def _listed(name: str, items: Iterable[str]) -> Figure:
    found = tuple(items)
    return Figure(name, len(found), found)


def _reached(start: str, arrows: Mapping[str, Iterable[str]]) -> set[str]:
    found: set[str] = {start}
    left = [start]
    while left:
        new = set(arrows[left.pop()]) - found
        found |= new
        left += new
    return found


def _calls(name: str) -> Callable[[ast.AST], int]:
    def count(tree: ast.AST) -> int:
        return sum(
            isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == name
            for node in ast.walk(tree)
        )

    return count


def _ignores(path: Path) -> int:
    with path.open("rb") as file:
        return sum(
            token.type == tokenize.COMMENT and "type: ignore" in token.string
            for token in tokenize.tokenize(file.readline)
        )


def _private_definitions(tree: ast.AST) -> Iterator[str]:
    """Private names that a module gives to something: of functions, classes, variables, attributes of `self`, slots."""
    for node in ast.walk(tree):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            yield node.name
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store) and _is_self(node.value):
            yield node.attr
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and _is_private(node.value):
            yield node.value


def _is_private(name: str) -> bool:
    return name.startswith("_") and not name.endswith("_") and name.isidentifier()


def _is_self(expression: ast.expr) -> bool:
    return isinstance(expression, ast.Name) and expression.id in ("self", "cls")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
