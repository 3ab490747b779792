"""The public surface: what is public, where, and that it is closed.

Public is what the ``__all__`` of one of the `FACES` lists, and the message types in the modules of `actors.interfaces`. Everything else is the
framework's own and may change any day.

- *Closed*: every type of `actors` that stands in a public signature is public itself: in parameters, results, attributes, properties, type
  aliases and bounds of type variables. A base class that is not public is only a place for shared code: its members count as those of the
  public class. Not in the signature are the members that `tests.tools.reference.INTERNAL` lists, which are for other modules of the framework, and
  the constructors of classes whose docstring says that there is no public one.
- *Once*: each name is exported by one face only, so that there is one line to import it by, and one place where it is looked up. That the
  front door, `actors`, does not repeat what `actors.qos` or `actors.parameters` have keeps both lists short enough to be read.
"""

from __future__ import annotations

import ast
import importlib
import re
from pathlib import Path

import pytest

import actors
from actors.checks import NoPublicConstructor
from tests.project.surface import NO_CONSTRUCTOR, Definition, Surface
from tests.tools.reference import INTERNAL

ROOT = Path(__file__).parents[2]

FACES = (
    "actors",
    "actors.actions",
    "actors.bag",
    "actors.blocking",
    "actors.diagnostics",
    "actors.diagnostics.spans",
    "actors.errors",
    "actors.hosts",
    "actors.images",
    "actors.interfaces",
    "actors.interfaces.types",
    "actors.launch",
    "actors.launch.testing",
    "actors.lifecycle",
    "actors.logs",
    "actors.message_filters",
    "actors.nodes",
    "actors.parameters",
    "actors.parameters.client",
    "actors.parameters.files",
    "actors.parameters.messages",
    "actors.qos",
    "actors.replay",
    "actors.running",
    "actors.supervision",
    "actors.testing",
    "actors.testing.faults",
    "actors.tf2",
    "actors.time",
    "actors.transport",
    "actors.transport.dds",
    "actors.transport.security",
    "actors.transport.security.authority",
    "actors.transport.zenoh",
    "actors.typing",
)
"""The public places. Some of them stand apart from the package they lie in because they are imported only where they are needed."""

OPEN = frozenset(
    {
        "actors.interfaces.types.Numbers",  # these two exist for type checkers only
        "actors.interfaces.types.Octets",
    }
)
"""The exceptions: types in public signatures that are not public. This list only gets shorter."""

DEEP = frozenset(
    {
        "actors.processes.forked",
        "actors.processes.os_process",
        "actors.processes.signals",
        "actors.running.options",
        "actors.runtime.incarnation",
        "actors.suggest",
        "actors.time.lockstep",
        "actors.time.processor",
        "actors.yaml_bounds",
    }
)
"""The exceptions: modules of the framework from which the robot imports although they are not public. This list only gets shorter."""


@pytest.fixture(scope="module")
def surface() -> Surface:
    internal = {f"{kind}.{member}" for kind, members in INTERNAL.items() for member in members}
    return Surface(ROOT / "actors", internal)


@pytest.fixture(scope="module")
def public(surface: Surface) -> dict[Definition, list[str]]:
    return surface.exported(FACES)


def is_message_type(one: Definition) -> bool:
    return re.fullmatch(r"actors\.interfaces\.\w+\.(msg|srv|action)", one.module) is not None


def test_every_type_in_a_public_signature_is_public(surface: Surface, public: dict[Definition, list[str]]) -> None:
    found = {one: places for one, places in surface.missing(public).items() if not is_message_type(one)}
    new = {str(one): places[:3] for one, places in found.items() if str(one) not in OPEN}
    assert not new, "export it where it belongs, or let the signature speak of a Protocol"
    assert {str(one) for one in found} == OPEN


def test_every_name_is_exported_from_one_place(public: dict[Definition, list[str]]) -> None:
    assert [names for names in public.values() if len(names) > 1] == []


@pytest.mark.parametrize("face", FACES)
def test_a_face_has_what_it_exports_and_nothing_by_accident(face: str) -> None:
    module = importlib.import_module(face)
    assert all(hasattr(module, name) for name in module.__all__)
    with pytest.raises(AttributeError, match=r"has no attribute 'nothing_of_this_name'"):
        module.nothing_of_this_name  # noqa: B018


def test_a_name_that_has_left_the_front_door_says_where_it_is() -> None:
    for module, names in actors._MOVED.items():
        for name in names:
            assert name in importlib.import_module(module).__all__
            with pytest.raises(
                ImportError, match=f"^{name} is not a name of actors any more: from {module} import {name}$"
            ):
                getattr(actors, name)
    assert len(actors.__all__) <= 57


def test_a_room_that_is_no_face_exports_nothing(surface: Surface) -> None:
    for name, path in surface.paths.items():
        if path.name == "__init__.py" and name not in FACES:
            assert [type(one) for one in surface.modules[name].tree.body] == [ast.Expr], (
                f"{name} holds more than a docstring"
            )


def test_classes_without_a_public_constructor_say_who_gives_one(
    surface: Surface, public: dict[Definition, list[str]]
) -> None:
    said = [one for one in public if one.name and surface.made_by_the_framework(one)]
    assert Definition("actors.actions.client", "Goal") in said
    for one in said:
        statement = surface.modules[one.module].defined[one.name]
        assert isinstance(statement, ast.ClassDef)
        text = " ".join((ast.get_docstring(statement) or "").split())
        assert re.search(rf"{NO_CONSTRUCTOR}: [^.]*`", text), f"{one}: its docstring does not say what gives one"


SPARED = {"Tick", "NodeRecord", "Identity", "HandlerSubscription", "Finding", "Snapshot", "Security", "Field"}
"""Of these there is one for each tick or each node, or they are plain values."""


def test_a_class_without_a_public_constructor_says_what_gives_one_when_it_is_called(
    surface: Surface, public: dict[Definition, list[str]]
) -> None:
    spared: set[str] = set()
    for one in public:
        if one.name and surface.made_by_the_framework(one):
            kind = getattr(importlib.import_module(one.module), one.name)
            if isinstance(kind, NoPublicConstructor):
                with pytest.raises(TypeError, match=rf"^{one.name} has no public constructor: .*`"):
                    kind()
            else:
                spared.add(one.name)
    assert spared == SPARED


def test_the_members_for_the_framework_only_exist(surface: Surface, public: dict[Definition, list[str]]) -> None:
    """No entry of INTERNAL is left over."""
    from tests.tools.reference import entries

    kinds = {name: value for _, name, value, _ in entries()}
    for name, members in INTERNAL.items():
        for member in members:
            assert hasattr(kinds[name], member) or member in kinds[name].__init__.__code__.co_names, f"{name}.{member}"


def is_public(module: str) -> bool:
    return not module.startswith("actors") or module in FACES or is_message_type(Definition(module, ""))


def test_documents_import_from_public_places_only() -> None:
    for path in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")), *(ROOT / "docs").rglob("*.py")):
        for module in re.findall(r"^\s*from (actors[\w.]*) import", path.read_text(encoding="utf-8"), re.MULTILINE):
            assert is_public(module), f"{path.name} imports from {module}"


def test_the_robot_imports_from_public_places_only() -> None:
    found: set[str] = set()
    for path in sorted((ROOT / "robot").rglob("*.py")):
        if path.stem in ("msg", "srv", "action"):  # written by the framework
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and not node.level:
                module = node.module or ""
                if not is_public(module) and not all(is_public(f"{module}.{one.name}") for one in node.names):
                    found.add(module)
    assert found == DEEP


SIGNATURES = """
from __future__ import annotations
from typing import TYPE_CHECKING, Annotated, Any, Generic, Literal, NamedTuple, TypeAlias, TypeVar
if TYPE_CHECKING:
    from toy import hidden
    from toy.hidden import Argument, Attribute, Base, Bound, Given, Made, Member, Nested, Result, Text, Word

T = TypeVar("T", bound="Bound")
Alias: TypeAlias = "dict[str, Word]"

def function(one: list[Argument], *more: Literal["Text"], **rest: Annotated[hidden.Nested, Text]) -> Result | None: ...

class Shared(Base[T]):
    member: Member
    def _private(self, one: Text) -> Text: ...

class Thing(Shared[T], Generic[T]):
    def __init__(self, given: Given) -> None:
        self.given = given
        self.attribute: Attribute = given.attribute
        self._secret: Text = given.text
    def internal(self) -> Text: ...

class Goal:
    \"\"\"It has no public constructor: `function` gives one.\"\"\"
    def __init__(self, text: Text) -> None:
        self.made = Made(text)
"""


def test_a_type_is_found_wherever_it_stands_in_a_signature(tmp_path: Path) -> None:
    names = ("Argument", "Attribute", "Base", "Bound", "Given", "Made", "Member", "Nested", "Result", "Text", "Word")
    (tmp_path / "toy").mkdir()
    (tmp_path / "toy" / "hidden.py").write_text("".join(f"class {name}: ...\n" for name in names), encoding="utf-8")
    (tmp_path / "toy" / "face.py").write_text(SIGNATURES, encoding="utf-8")
    text = "from toy.face import Alias, Goal, Thing, function\n__all__ = ['Alias', 'Goal', 'Thing', 'function']\n"
    (tmp_path / "toy" / "__init__.py").write_text(text, encoding="utf-8")
    surface = Surface(tmp_path / "toy", {"Thing.internal"})
    found = surface.missing(surface.exported(["toy"]))
    assert {one.name: sorted({*places}) for one, places in found.items()} == {
        "Argument": ["function"],
        "Attribute": ["Thing.attribute"],
        "Bound": ["Thing"],
        "Given": ["Thing.__init__", "Thing.given"],
        "Made": ["Goal.made"],
        "Member": ["Thing.member"],
        "Nested": ["function"],
        "Result": ["function"],
        "Word": ["Alias"],
    }
