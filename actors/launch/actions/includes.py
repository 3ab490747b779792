"""`IncludeLaunchDescription`, and where launch descriptions come from."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from actors.launch.entity import Action, LaunchDescription, evaluate
from actors.launch.errors import LaunchError
from actors.launch.loading import load
from actors.launch.substitution import Text, normalized, perform, shown

if TYPE_CHECKING:
    from actors.launch.conditions import Condition
    from actors.launch.context import LaunchContext
    from actors.launch.plan import Scope

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
        launch_description_source: Any,
        *,
        launch_arguments: Any = None,
        condition: Condition | None = None,
    ) -> None:
        super().__init__(condition=condition)
        given = launch_description_source
        self.source = given if isinstance(given, LaunchDescriptionSource) else LaunchDescriptionSource(given)
        pairs: Any = launch_arguments or ()
        self.launch_arguments: list[tuple[Text, Text]] = list(
            cast("Mapping[Text, Text]", pairs).items() if isinstance(pairs, Mapping) else pairs
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
    from actors.suggest import did_you_mean

    if not path.parent.is_dir():
        return ""
    return did_you_mean(path.name, sorted(each.name for each in path.parent.iterdir()))
