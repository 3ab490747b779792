"""`IncludeLaunchDescription`, and where launch descriptions come from."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from actors.launch.entity import Action, LaunchDescription, evaluate
from actors.launch.errors import LaunchError
from actors.launch.substitution import Text, normalized, perform, shown

if TYPE_CHECKING:
    from actors.launch.conditions import Condition
    from actors.launch.context import LaunchContext
    from actors.launch.plan import Scope

__all__ = ["DEEPEST", "IncludeLaunchDescription", "LaunchDescriptionSource", "include_file"]

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
        known = set(context.declared)
        for name, value in self.launch_arguments:
            context.launch_configurations[perform(context, name)] = perform(context, value)
        description = self.source.launch_description
        if description is not None:
            evaluate([description], context, scope.inner("include", "include"))
            return
        include_file(Path(perform(context, self.source.location)), context, scope)
        given = {perform(context, name) for name, _ in self.launch_arguments}
        for name in set(context.declared) - known:
            if name in given:  # this include decides about it, so it is no argument of the whole
                del context.declared[name]


def include_file(path: Path, context: LaunchContext, scope: Scope) -> None:
    """Evaluate a launch file in a scope of its own below `scope`. Raises `LaunchError`."""
    from actors.launch.loading import load

    if context.depth >= DEEPEST:
        raise LaunchError(f"{path} is included by itself: {DEEPEST} launch files include each other")
    if not path.is_file():
        raise LaunchError(f"there is no launch file {path}{_nearest(path)}")
    outer, line = context.file, context.line
    context.file, context.line = path.absolute(), None
    context.depth += 1
    context.packages.add_package_of(path)
    try:
        description = load(path)
        evaluate([description], context, scope.inner(_stem(path), path.name))
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
