"""Substitutions for what is set: launch configurations, environment variables, names, variables of a loop."""

from __future__ import annotations

from operator import attrgetter
from typing import TYPE_CHECKING, Any, cast

from actors.launch.errors import SubstitutionFailure
from actors.launch.substitution import Substitution, Text, normalized, perform, shown
from actors.suggest import did_you_mean

if TYPE_CHECKING:
    from actors.launch.context import LaunchContext


class LaunchConfiguration(Substitution):
    """The value of a launch configuration: of an argument, or of what `SetLaunchConfiguration` has set."""

    def __init__(self, variable_name: Text, *, default: object = None) -> None:
        self.variable_name = normalized(variable_name)
        self.default = None if default is None else _text_of(default)

    def perform(self, context: LaunchContext) -> str:
        name = perform(context, self.variable_name)
        known = context.launch_configurations
        if name in known:
            return known[name]
        if self.default is not None:
            return perform(context, self.default)
        problem = f"launch configuration {name!r} does not exist{did_you_mean(name, known)}"
        return context.stand_in(SubstitutionFailure(problem), f"$(var {name})")

    def describe(self) -> str:
        return f"LaunchConfig({shown(self.variable_name)})"


class EnvironmentVariable(Substitution):
    """The value of an environment variable, as the processes that are started will see it."""

    def __init__(self, name: Text, *, default_value: Text | None = None) -> None:
        self.name = normalized(name)
        self.default_value = None if default_value is None else normalized(default_value)

    def perform(self, context: LaunchContext) -> str:
        name = perform(context, self.name)
        if name in context.environment:
            return context.environment[name]
        if self.default_value is not None:
            return perform(context, self.default_value)
        problem = f"environment variable {name!r} does not exist{did_you_mean(name, context.environment)}"
        return context.stand_in(SubstitutionFailure(problem), f"$(env {name})")

    def describe(self) -> str:
        return f"EnvVar({shown(self.name)})"


class LocalSubstitution(Substitution):
    """The value of an expression such as ``event.reason`` in the locals of the context, which an event handler sets."""

    def __init__(self, expression: str, description: str | None = None) -> None:
        self.expression = expression
        self.description = description or expression

    def perform(self, context: LaunchContext) -> str:
        try:
            return str(attrgetter(self.expression)(context.locals))
        except AttributeError as error:
            raise SubstitutionFailure(f"{self.expression!r} has no value here: {error}") from None

    def describe(self) -> str:
        return f"Local({self.description!r})"


class AnonName(Substitution):
    """A name made unique by a number. The same `name` gives the same text within a launch."""

    def __init__(self, name: Text) -> None:
        self.name = normalized(name)

    def perform(self, context: LaunchContext) -> str:
        import os

        name = perform(context, self.name)
        return context.anonymous.setdefault(name, f"{name}_{os.getpid()}_{len(context.anonymous) + 1}")

    def describe(self) -> str:
        return f"AnonName({shown(self.name)})"


class LaunchLogDir(Substitution):
    """The folder for log files: ``ROS_LOG_DIR``, else ``ROS_HOME/log``, else ``~/.ros/log``."""

    def perform(self, context: LaunchContext) -> str:
        import os

        env = context.environment
        home = env.get("ROS_HOME") or os.path.join(os.path.expanduser("~"), ".ros")
        return env.get("ROS_LOG_DIR") or os.path.join(home, "log")


class Parameter(Substitution):
    """The value of a global parameter, which `SetParameter` has set."""

    def __init__(self, name: Text, *, default: Text | None = None) -> None:
        self.name = normalized(name)
        self.default = None if default is None else normalized(default)

    def perform(self, context: LaunchContext) -> str:
        name = perform(context, self.name)
        for each in reversed(context.scoped.parameters):
            if isinstance(each, tuple):
                known, value = cast("tuple[str, object]", each)
                if known == name:
                    return str(value).lower() if isinstance(value, bool) else str(value)
        if self.default is not None:
            return perform(context, self.default)
        return context.stand_in(SubstitutionFailure(f"no global parameter {name!r} has been set"), f"$(param {name})")

    def describe(self) -> str:
        return f"Parameter({shown(self.name)})"


class ForEachVar(Substitution):
    """The value of a variable in one round of a `ForEach`, or `default_value`."""

    def __init__(self, name: Text, *, default_value: Text | None = None) -> None:
        self.name = normalized(name)
        self.default_value = None if default_value is None else normalized(default_value)

    def perform(self, context: LaunchContext) -> str:
        name = perform(context, self.name)
        values: dict[str, str] = getattr(context.locals, "for_each", {})
        if name in values:
            return values[name]
        if self.default_value is not None:
            return perform(context, self.default_value)
        raise SubstitutionFailure(f"there is no variable {name!r} in this round{did_you_mean(name, values)}")

    def describe(self) -> str:
        return f"ForEachVar({shown(self.name)})"


class ForLoopIndex(ForEachVar):
    """The number of the round of a `ForLoop` of this name."""

    def describe(self) -> str:
        return f"ForLoopIndex({shown(self.name)})"


def _text_of(value: Any) -> list[Substitution]:
    """A text, or what launch files give in its place: a bool or a number."""
    if isinstance(value, bool):
        return normalized(str(value).lower())
    return normalized(str(value) if isinstance(value, (int, float)) else value)
