"""`python -m tests.house`: that it counts right, on a package made up for it."""

from __future__ import annotations

from pathlib import Path
from textwrap import dedent

import pytest

from tests import house
from tests.house import Figure, House, circles

FILES = {
    "__init__.py": """
        from toy.top.door import Door, open_door
        __all__ = ["Door", "open_door"]
    """,
    "errors.py": "class Broken(Exception): ...\n",
    "top/__init__.py": "",
    "top/door.py": '''
        from __future__ import annotations
        from typing import TYPE_CHECKING
        from toy.middle.hinge import Hinge, _oil
        if TYPE_CHECKING:
            from toy.middle import lock

        class Door(Hinge):
            """A door."""
            def __init__(self, lock: lock.Lock) -> None:
                self.lock = lock
                self._open = False
            def __repr__(self) -> str:
                return f"{self._open} {self.lock._turned}"  # type: ignore[attr-defined]

        def open_door(name: str) -> Door | None: ...
    ''',
    "middle/__init__.py": '"""No face."""\n',
    "middle/hinge.py": """
        from typing import cast
        from toy.errors import Broken
        class Hinge: ...
        def _oil() -> int:
            return cast("int", getattr(Hinge, "oil"))
        class Wide(Hinge): ...
        class Wider(Wide): ...
    """,
    "middle/lock.py": """
        from toy import errors
        class Lock:
            def __init__(self):
                self._turned = False
            def turn(self):
                from toy.top.door import Door
                return Door(self)
    """,
    "messages/__init__.py": "",
    "messages/msg.py": "class Generated: ...\n",
}


@pytest.fixture
def toy(tmp_path: Path) -> House:
    for name, text in FILES.items():
        path = tmp_path / "toy" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(dedent(text).lstrip("\n"), encoding="utf-8")
    return House(tmp_path / "toy")


def test_it_counts(toy: House) -> None:
    found = {figure.name: figure for figure in toy.figures()}
    assert {name: figure.count for name, figure in found.items()} == {
        "modules": 8,
        "files at the top of the package": 2,
        "rooms: folders and files at the top": 4,
        "import floors of the rooms": 3,
        "edges between rooms that lead upwards": 1,
        "circles of modules, imports top": 0,
        "circles of modules, imports top + lazy": 0,
        "circles of modules, imports top + lazy + typing": 1,
        "import edges, top": 4,
        "import edges, lazy": 1,
        "import edges, typing": 1,
        "classes with exactly one heir": 1,
        "cast(": 1,
        "getattr(": 1,
        "# type: ignore": 1,
        "private access across our own modules": 2,
        "names in toy.__all__": 2,
        "own types in their signatures, not in it": 1,
        "names in the __all__ of all public modules": 2,
        "own types in their signatures, not in them": 1,
        "files over 400 lines": 0,
        "functions over 60 lines": 0,
    }
    assert found["edges between rooms that lead upwards"].items == ("middle -> top",)
    assert found["circles of modules, imports top + lazy + typing"].items == ("2: toy.middle.lock toy.top.door",)
    assert found["classes with exactly one heir"].items == ("toy.middle.hinge.Wide <- toy.middle.hinge.Wider",)
    assert found["private access across our own modules"].items == (
        "toy.top.door:13 self.lock._turned",
        "toy.top.door:3 _oil",
    )
    assert found["own types in their signatures, not in it"].items == ("toy.middle.lock.Lock",)


def test_what_is_public_is_read_from_the_tests_beside_the_package(toy: House) -> None:
    assert toy.faces == ("toy", "toy.messages", "toy.middle", "toy.top")
    tests = toy.package.parent / "tests" / "unit"
    tests.mkdir(parents=True)
    (tests / "test_surface.py").write_text("FACES = ('toy',)\n", encoding="utf-8")
    (tests.parent / "reference.py").write_text(
        "INTERNAL: dict[str, tuple[str, ...]] = {'Door': ('lock', '__init__')}\n", encoding="utf-8"
    )
    found = House(toy.package)
    assert found.faces == ("toy",)
    assert found.surface.missing(found.surface.exported(found.faces)) == {}


def test_rooms_that_import_each_other_share_a_floor(toy: House) -> None:
    assert toy.floors() == {"errors": 1, "messages": 1, "middle": 2, "top": 3}
    errors = toy.paths["toy.errors"]
    errors.write_text("from toy.middle.hinge import Hinge\n", encoding="utf-8")
    assert House(toy.package).floors() == {"errors": 1, "messages": 1, "middle": 1, "top": 2}


def test_long_files_and_long_functions_are_named(toy: House) -> None:
    body = "    pass\n" * 60
    toy.paths["toy.errors"].write_text(f"def long():\n{body}" + "#\n" * 340, encoding="utf-8")
    toy = House(toy.package)
    assert [*toy.long_files()] == ["toy.errors 401"]
    assert [*toy.long_functions()] == ["toy.errors.long 61"]


def test_circles_come_largest_first() -> None:
    arrows = {"a": "b", "b": "a", "c": "d", "d": "e", "e": "ca", "f": "f"}
    assert circles(arrows) == [["c", "d", "e"], ["a", "b"]]


def test_the_objects_of_a_node_are_counted_in_a_live_system() -> None:
    root = Path(__file__).parents[2]
    figure = house.objects(root)
    assert "Idle 1" in figure.items  # the node itself
    assert "Child 1" in figure.items
    assert figure.count >= len(figure.items) >= 4


def test_the_table_is_printed(toy: House, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(house, "objects", lambda folder: Figure("objects", 2, ("Idle 1", "Child 1")))
    for path in toy.paths.values():
        path.write_text(path.read_text(encoding="utf-8").replace("toy", "actors"), encoding="utf-8")
    toy.package.rename(toy.package.with_name("actors"))
    assert house.main([str(toy.package.parent)]) == 0
    assert capsys.readouterr().out.startswith("     8  modules\n     2  files at the top of the package\n     4  rooms")
    assert house.main(["-v", str(toy.package.parent)]) == 0
    assert capsys.readouterr().out.endswith("     2  objects\n          Idle 1\n          Child 1\n")
