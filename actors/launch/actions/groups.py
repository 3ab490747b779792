"""Actions that hold other actions: groups, functions of the user's, and loops."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import cast

from actors.launch.conditions import Condition
from actors.launch.context import LaunchContext
from actors.launch.entity import Action, LaunchDescriptionEntity, evaluate, listed
from actors.launch.errors import LaunchError
from actors.launch.plan import Scope
from actors.launch.substitution import Text, Truth, as_bool, normalized, perform, yaml_value


class GroupAction(Action):
    """Actions under one condition. With `scoped` what they set holds in the group only; without `forwarding` it begins empty."""

    def __init__(
        self,
        actions: Iterable[LaunchDescriptionEntity],
        *,
        scoped: Truth = True,
        forwarding: Truth = True,
        launch_configurations: Mapping[Text, Text] | None = None,
        condition: Condition | None = None,
    ) -> None:
        super().__init__(condition=condition)
        self.actions: list[LaunchDescriptionEntity] = list(actions)
        self.scoped, self.forwarding = scoped, forwarding
        self.launch_configurations = dict(launch_configurations or {})

    def describe_sub_entities(self) -> list[LaunchDescriptionEntity]:
        return self.actions

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        given = {perform(context, name): perform(context, value) for name, value in self.launch_configurations.items()}
        if not as_bool(context, self.scoped):
            context.launch_configurations.update(given)
            evaluate(self.actions, context, scope)
            return
        context.push()
        if not as_bool(context, self.forwarding):
            context.scoped.configurations = {}
            context.scoped.remaps, context.scoped.parameters = [], []
        context.launch_configurations.update(given)
        inner = scope.inner("group", "group")
        try:
            evaluate(self.actions, context, inner)
        finally:
            context.pop()
        if not inner.items:
            scope.items.remove(inner)


class OpaqueFunction(Action):
    """Calls a function of the user's with the context; the actions that it returns follow."""

    def __init__(
        self,
        *,
        function: Callable[..., object],
        args: Iterable[object] | None = None,
        kwargs: Mapping[str, object] | None = None,
        condition: Condition | None = None,
    ) -> None:
        super().__init__(condition=condition)
        self.function = function
        self.args, self.kwargs = list(args or ()), dict(kwargs or {})

    def execute(self, context: LaunchContext) -> Iterable[LaunchDescriptionEntity] | None:
        return listed(self.function(context, *self.args, **self.kwargs))


class ForLoop(Action):
    """Calls a function with 0, 1, ... below a length; the actions that it returns follow, each time."""

    def __init__(
        self, length: Text, *, function: Callable[..., object], name: str = "", condition: Condition | None = None
    ) -> None:
        super().__init__(condition=condition)
        self.length, self.function, self.name = normalized(length), function, name

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        text = perform(context, self.length)
        if not text.strip().isdigit():
            raise LaunchError(f"the length of a loop is a whole number, not {text!r}")
        for index in range(int(text)):
            with_variables(context, {self.name: str(index)}, listed(self.function(index)), scope)


class ForEach(Action):
    """Calls a function with each of several sets of values, ``{name: a, id: 1};{name: b}``; the actions that it returns follow."""

    def __init__(
        self, input_values: Text, *, function: Callable[..., object], condition: Condition | None = None
    ) -> None:
        super().__init__(condition=condition)
        self.input_values, self.function = normalized(input_values), function

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        text = perform(context, self.input_values)
        for part in text.split(";") if text.strip() else ():
            values = yaml_value(part)
            if not isinstance(values, dict):
                raise LaunchError(f"the values of a loop are YAML structures such as {{name: a}}, not {part.strip()!r}")
            named = {str(name): value for name, value in cast("dict[str, object]", values).items()}
            texts = {name: _plain(value) for name, value in named.items()}
            with_variables(context, texts, listed(self.function(**named)), scope)


def with_variables(
    context: LaunchContext, values: Mapping[str, str], entities: Iterable[LaunchDescriptionEntity], scope: Scope
) -> None:
    """Evaluate entities while the variables of a loop have these values."""
    outer: Mapping[str, str] = getattr(context.locals, "for_each", {})
    context.extend_globals({"for_each": {**outer, **values}})
    try:
        evaluate(entities, context, scope)
    finally:
        context.extend_globals({"for_each": outer})


def _plain(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
