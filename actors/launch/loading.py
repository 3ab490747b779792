"""Launch files in Python, XML and YAML: reading one, evaluating it, and `IncludeLaunchDescription`, which does so in another."""

from __future__ import annotations

import sys
from collections.abc import Callable, Generator, Iterable, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, cast

from actors.errors import described
from actors.launch.entity import Action, LaunchDescription, evaluate, one_or_more
from actors.launch.errors import LaunchError, Line
from actors.launch.frontend.xml import read_xml
from actors.launch.frontend.yaml import read_yaml
from actors.launch.substitution import Text, normalized, perform, shown
from actors.suggest import did_you_mean

if TYPE_CHECKING:
    from actors.launch.conditions import Condition
    from actors.launch.context import LaunchContext
    from actors.launch.plan import Scope

SUFFIXES = (".py", ".xml", ".yaml", ".yml")
"""The kinds of launch files."""

MAKERS = ("generate_launch_description", "generate_test_description")
"""The function of a Python launch file that gives its description."""

DEEPEST = 50
"""How many launch files may include each other before they are taken for a circle."""


class LaunchDescriptionSource:
    """Gives a launch description: one that is there already, or that of a file, whose kind its name tells."""

    def __init__(
        self, launch_file_path: Text | None = None, *, launch_description: LaunchDescription | None = None
    ) -> None:
        self.location = normalized(launch_file_path or "")
        self.launch_description = launch_description

    def describe(self) -> str:
        """The source for display."""
        return shown(self.location)


class IncludeLaunchDescription(Action):
    """Evaluates another launch description here, with `launch_arguments`, which stay set for what follows in the same scope."""

    def __init__(
        self,
        launch_description_source: LaunchDescriptionSource | Text,
        *,
        launch_arguments: Mapping[Text, Text] | Iterable[tuple[Text, Text]] | None = None,
        condition: Condition | None = None,
    ) -> None:
        super().__init__(condition=condition)
        given = launch_description_source
        self.source = given if isinstance(given, LaunchDescriptionSource) else LaunchDescriptionSource(given)
        pairs = launch_arguments or ()
        self.launch_arguments: list[tuple[Text, Text]] = list(
            cast("Any", pairs.items() if isinstance(pairs, Mapping) else pairs)
        )

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        for name, value in self.launch_arguments:
            context.launch_configurations[perform(context, name)] = perform(context, value)
        description = self.source.launch_description
        if description is not None:
            evaluate([description], context, scope.inner("include", "include"))
            return
        include_file(Path(perform(context, self.source.location)), context, scope)

    def note_arguments(self, context: LaunchContext) -> None:
        """Remember the arguments of what would be included, if its condition held and as far as it can be read."""
        problems = list(context.problems)
        with suppress(LaunchError):
            if self.source.launch_description is not None:
                self.source.launch_description.note_arguments(context)
            elif (path := Path(perform(context, self.source.location)).absolute()) not in context.noted:
                context.noted.add(path)
                with reading(path, context):
                    load(path).note_arguments(context)
        context.problems[:] = problems  # it is not used


def include_file(path: Path, context: LaunchContext, scope: Scope) -> None:
    """Evaluate a launch file in a scope of its own below `scope`. Raises `LaunchError`."""
    with reading(path, context):
        evaluate([load(path)], context, scope.inner(_stem(path), path.name))


@contextmanager
def reading(path: Path, context: LaunchContext) -> Generator[None]:
    """Make a launch file the one that is evaluated. Raises `LaunchError`."""
    if context.depth >= DEEPEST:
        raise LaunchError(f"{path} is included by itself: {DEEPEST} launch files include each other")
    if not path.is_file():
        raise LaunchError(f"there is no launch file {path}{_nearest(path)}")
    outer, line = context.file, context.line
    context.file, context.line = path.absolute(), None
    context.depth += 1
    context.packages.add_package_of(path)
    try:
        yield
    finally:
        context.file, context.line = outer, line
        context.depth -= 1


def _stem(path: Path) -> str:
    """The name of the supervisor of a file."""
    stem = path.name.partition(".")[0]
    return "launch_file" if stem == "launch" else stem  # `launch` is the node that carries it out


def _nearest(path: Path) -> str:
    if not path.parent.is_dir():
        return ""
    return did_you_mean(path.name, sorted(each.name for each in path.parent.iterdir()))


def load(path: Path) -> LaunchDescription:
    """The launch description in a file. Raises `LaunchError`, with the line of the mistake."""
    if path.suffix == ".py":
        return load_python(path)
    if path.suffix in (".yaml", ".yml"):
        root = read_yaml(path)
    elif path.suffix == ".xml" or (path.suffix == ".launch" and _is_xml(path)):
        root = read_xml(path)
    else:
        raise LaunchError(f"{path}: a launch file ends in {', '.join(SUFFIXES)}")
    from actors.launch.frontend.tags import description_of  # late: one of the tags includes another launch file

    return description_of(root)


def _is_xml(path: Path) -> bool:
    return path.read_text(encoding="utf-8", errors="replace").lstrip().startswith("<")


def load_python(path: Path) -> LaunchDescription:
    """What ``generate_launch_description()`` of a Python file returns, inside of `shim`. Raises `LaunchError`."""
    module = load_module(path)
    make: Callable[[], object] | None = next((getattr(module, n) for n in MAKERS if hasattr(module, n)), None)
    if make is None:
        functions = [name for name, value in vars(module).items() if callable(value)]
        near = did_you_mean(MAKERS[0], functions)
        raise LaunchError(f"{path} has no function {MAKERS[0]}(){near}")
    try:
        made = make()
    except LaunchError as error:
        raise error.at(_line_in(path, error)) from error.__cause__
    except Exception as error:
        raise LaunchError(described(error), _line_in(path, error)) from error
    given = one_or_more(made)[:1]  # launch_testing returns the description and what the tests are given
    if not given or not isinstance(given[0], LaunchDescription):
        raise LaunchError(f"{path}: {make.__name__}() returned {described(made)}, no LaunchDescription")
    return given[0]


def load_module(path: str | Path) -> ModuleType:
    """The module in a file, which need not be on the path of Python. Raises `LaunchError`."""
    from importlib.util import module_from_spec, spec_from_file_location

    path = Path(path)
    spec = spec_from_file_location(f"robactor_launch_file_{path.name.partition('.')[0]}", path)
    assert spec is not None
    assert spec.loader is not None  # the name ends in .py
    module = module_from_spec(spec)
    writes, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    try:
        spec.loader.exec_module(module)
    except SyntaxError as error:
        raise LaunchError(f"{error.msg}: {(error.text or '').strip()}", Line(str(path), error.lineno or 1)) from error
    except LaunchError as error:
        raise error.at(_line_in(path, error)) from error.__cause__
    except Exception as error:
        raise LaunchError(described(error), _line_in(path, error)) from error
    finally:
        sys.dont_write_bytecode = writes
    return module


def _line_in(path: Path, error: BaseException) -> Line:
    """The innermost line of this file on the way to the error; its first one, if it has none."""
    found = 1
    trace = error.__traceback__
    name = str(path.absolute())  # as the import system names it
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == name:
            found = trace.tb_lineno
        trace = trace.tb_next
    return Line(str(path), found)
