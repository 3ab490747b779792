"""Actions that set launch configurations, the environment, and what applies to all nodes that follow."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from actors.launch.context import Declared, LaunchContext
from actors.launch.entity import Action
from actors.launch.errors import LaunchError
from actors.launch.parameters import value_of
from actors.launch.substitution import Text, Truth, as_bool, normalized, perform
from actors.suggest import did_you_mean

if TYPE_CHECKING:
    from actors.launch.conditions import Condition
    from actors.launch.plan import Scope


class DeclareLaunchArgument(Action):
    """Declares an argument of the launch file. Without a default it is required; `choices` are the values that it may have."""

    def __init__(
        self,
        name: str,
        *,
        default_value: Text | None = None,
        description: str | None = None,
        choices: Iterable[str] | None = None,
        condition: Condition | None = None,
    ) -> None:
        super().__init__(condition=condition)
        self.name = name
        self.default_value = None if default_value is None else normalized(default_value)
        self.choices = None if choices is None else list(choices)
        self.description = description or "no description given"
        if self.choices is not None:
            told = f"Valid choices are: {self.choices}"
            self.description = f"{description}. {told}" if description else told

    def remember(self, context: LaunchContext, *, conditional: bool) -> None:
        """Remember for `--show-args` that this argument is declared."""
        known = context.declared.get(self.name)
        if known is None or (known.conditional and not conditional):
            context.declared[self.name] = Declared(self.description, self.default_value, conditional)

    def note_arguments(self, context: LaunchContext) -> None:
        self.remember(context, conditional=True)

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        self.remember(context, conditional=False)
        known = context.launch_configurations
        if self.name not in known:
            if self.default_value is None:
                near = did_you_mean(self.name, known)
                problem = f'Required launch argument "{self.name}" was not provided{near or "."}'
                known[self.name] = context.stand_in(LaunchError(problem), f"$(var {self.name})")
                return
            known[self.name] = perform(context, self.default_value)
        value = known[self.name]
        if self.choices is not None and value not in self.choices:
            problem = f"argument {self.name!r} is {value!r}{did_you_mean(value, self.choices)}; valid are: {', '.join(self.choices)}"
            context.stand_in(LaunchError(problem), value)


class DeclareBooleanLaunchArgument(DeclareLaunchArgument):
    """Declares an argument that is true or false."""

    def __init__(
        self,
        name: str,
        *,
        default_value: Text | bool | None = None,
        description: str | None = None,
        condition: Condition | None = None,
    ) -> None:
        default = str(default_value).lower() if isinstance(default_value, bool) else default_value
        choices = ["true", "false", "True", "False", "1", "0"]
        super().__init__(name, default_value=default, description=description, choices=choices, condition=condition)


class SetLaunchConfiguration(Action):
    """Sets a launch configuration, for what follows in the same scope."""

    def __init__(self, name: Text, value: Text, *, condition: Condition | None = None) -> None:
        super().__init__(condition=condition)
        self.name, self.value = normalized(name), normalized(value)

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        context.launch_configurations[perform(context, self.name)] = perform(context, self.value)


class UnsetLaunchConfiguration(Action):
    """Removes a launch configuration."""

    def __init__(self, name: Text, *, condition: Condition | None = None) -> None:
        super().__init__(condition=condition)
        self.name = normalized(name)

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        context.launch_configurations.pop(perform(context, self.name), None)


class ResetLaunchConfigurations(Action):
    """Removes all launch configurations but those given."""

    def __init__(
        self, launch_configurations: Mapping[Text, Text] | None = None, *, condition: Condition | None = None
    ) -> None:
        super().__init__(condition=condition)
        self.kept = dict(launch_configurations or {})

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        kept = {perform(context, name): perform(context, value) for name, value in self.kept.items()}
        context.scoped.configurations = kept


class PushLaunchConfigurations(Action):
    """Opens a scope: `PopLaunchConfigurations` brings back what is set now."""

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        context.push()


class PopLaunchConfigurations(Action):
    """Closes the scope that was opened last."""

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        context.pop()


class PushRosNamespace(Action):
    """Puts the nodes that follow in the same scope into a namespace; a relative one is below that which applies already."""

    def __init__(self, namespace: Text, *, condition: Condition | None = None) -> None:
        super().__init__(condition=condition)
        self.namespace = normalized(namespace)

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        known = context.launch_configurations
        known["ros_namespace"] = joined_namespace(known.get("ros_namespace", ""), perform(context, self.namespace))


class SetRemap(Action):
    """Lets the nodes that follow in the same scope use one name for another."""

    def __init__(self, src: Text, dst: Text, *, condition: Condition | None = None) -> None:
        super().__init__(condition=condition)
        self.src, self.dst = normalized(src), normalized(dst)

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        context.scoped.remaps.append((perform(context, self.src), perform(context, self.dst)))


class SetParameter(Action):
    """Sets a parameter of all nodes that follow in the same scope. Their own parameters count more."""

    def __init__(self, name: Text, value: object, *, condition: Condition | None = None) -> None:
        super().__init__(condition=condition)
        self.name, self.value = normalized(name), value

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        context.scoped.parameters.append((perform(context, self.name), value_of(context, self.value)))


class SetUseSimTime(Action):
    """Sets ``use_sim_time`` of all nodes that follow in the same scope."""

    def __init__(self, value: Truth, *, condition: Condition | None = None) -> None:
        super().__init__(condition=condition)
        self.value = value

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        context.scoped.parameters.append(("use_sim_time", as_bool(context, self.value)))


class SetParametersFromFile(Action):
    """Applies a parameter file to all nodes that follow in the same scope."""

    def __init__(self, filename: Text, *, condition: Condition | None = None) -> None:
        super().__init__(condition=condition)
        self.filename = normalized(filename)

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        context.scoped.parameters.append(perform(context, self.filename))


def joined_namespace(base: str, namespace: str) -> str:
    """A namespace below another one; an absolute one as it is. Absolute, without a slash at its end; empty if both are."""
    whole = namespace if namespace.startswith("/") else f"{base}/{namespace}"
    parts = [part for part in whole.split("/") if part]
    return f"/{'/'.join(parts)}" if parts else ""
