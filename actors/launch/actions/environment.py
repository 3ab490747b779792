"""Actions that set environment variables for the processes that follow."""

from __future__ import annotations

import os
from collections.abc import Mapping

from actors.launch.conditions import Condition
from actors.launch.context import LaunchContext
from actors.launch.entity import Action
from actors.launch.plan import Scope
from actors.launch.substitution import Text, Truth, as_bool, normalized, perform


class SetEnvironmentVariable(Action):
    """Sets an environment variable."""

    def __init__(self, name: Text, value: Text, *, condition: Condition | None = None) -> None:
        super().__init__(condition=condition)
        self.name, self.value = normalized(name), normalized(value)

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        context.environment[perform(context, self.name)] = perform(context, self.value)


class UnsetEnvironmentVariable(Action):
    """Removes an environment variable."""

    def __init__(self, name: Text, *, condition: Condition | None = None) -> None:
        super().__init__(condition=condition)
        self.name = normalized(name)

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        context.environment.pop(perform(context, self.name), None)


class AppendEnvironmentVariable(Action):
    """Adds to a list in an environment variable, such as PATH: at its end, or at its beginning with `prepend`."""

    def __init__(
        self,
        name: Text,
        value: Text,
        *,
        prepend: Truth = False,
        separator: Text = os.pathsep,
        condition: Condition | None = None,
    ) -> None:
        super().__init__(condition=condition)
        self.name, self.value, self.separator = normalized(name), normalized(value), normalized(separator)
        self.prepend = prepend

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        name, value = perform(context, self.name), perform(context, self.value)
        first = as_bool(context, self.prepend)
        old = context.environment.get(name)
        both = [value] if old is None else [value, old] if first else [old, value]
        context.environment[name] = perform(context, self.separator).join(both)


class ReplaceEnvironmentVariables(Action):
    """Replaces the whole environment."""

    def __init__(self, environment: Mapping[Text, Text] | None = None, *, condition: Condition | None = None) -> None:
        super().__init__(condition=condition)
        self.variables = dict(environment or {})

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        context.environment = {perform(context, n): perform(context, v) for n, v in self.variables.items()}


class ResetEnvironment(Action):
    """Makes the environment again what it was when the launch began."""

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        context.reset_environment()


class PushEnvironment(Action):
    """Remembers the environment."""

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        context.push_environment()


class PopEnvironment(Action):
    """Brings back the environment that was remembered last."""

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        context.pop_environment()


class SetROSLogDir(SetEnvironmentVariable):
    """Sets the folder for log files."""

    def __init__(self, new_log_dir: Text, *, condition: Condition | None = None) -> None:
        super().__init__("ROS_LOG_DIR", new_log_dir, condition=condition)
