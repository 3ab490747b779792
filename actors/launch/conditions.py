"""Conditions of actions."""

from __future__ import annotations

from collections.abc import Callable

from actors.launch.context import LaunchContext
from actors.launch.errors import ConditionError
from actors.launch.looking import NotDone
from actors.launch.substitution import Text, normalized, perform, shown
from actors.launch.substitutions.paths import COMMAND


class Condition:
    """Whether an action applies. A subclass defines `evaluate`, or gives a `predicate`."""

    def __init__(self, *, predicate: Callable[[LaunchContext], object] | None = None) -> None:
        self.predicate = predicate

    def evaluate(self, context: LaunchContext) -> bool:
        """Whether it holds in this context. Raises `ConditionError`."""
        return True if self.predicate is None else bool(self.predicate(context))

    def _predicate_func(self, context: LaunchContext) -> bool:  # public launch files call it by this name
        return self.evaluate(context)

    def describe(self) -> str:
        """The condition for display."""
        return type(self).__name__


class IfCondition(Condition):
    """Holds if the text is ``true`` or ``1``; it does not hold if it is ``false`` or ``0``; anything else is an error."""

    word = "if"

    def __init__(self, predicate_expression: Text) -> None:
        super().__init__()
        self.expression = normalized(predicate_expression)

    def evaluate(self, context: LaunchContext) -> bool:
        return evaluate_condition_expression(context, self.expression)

    def describe(self) -> str:
        return f"{self.word} {shown(self.expression)}"


class UnlessCondition(IfCondition):
    """Holds if an `IfCondition` of the same text does not."""

    word = "unless"

    def evaluate(self, context: LaunchContext) -> bool:
        return not super().evaluate(context)


class LaunchConfigurationEquals(Condition):
    """Holds if a launch configuration has this value; with None, if it is not set."""

    equal = True

    def __init__(self, launch_configuration_name: str, expected_value: Text | None) -> None:
        super().__init__()
        self.name = launch_configuration_name
        self.expected = None if expected_value is None else normalized(expected_value)

    def evaluate(self, context: LaunchContext) -> bool:
        expected = None if self.expected is None else perform(context, self.expected)
        return (context.launch_configurations.get(self.name) == expected) == self.equal

    def describe(self) -> str:
        told = "not set" if self.expected is None else shown(self.expected)
        return f"if {self.name} {'==' if self.equal else '!='} {told}"


class LaunchConfigurationNotEquals(LaunchConfigurationEquals):
    """Holds if a launch configuration has another value."""

    equal = False


def evaluate_condition_expression(context: LaunchContext, expression: Text) -> bool:
    """The truth of a text. Raises `ConditionError`."""
    text = perform(context, expression).strip().lower()
    if text in ("true", "1"):
        return True
    if text in ("false", "0"):
        return False
    if context.lenient and COMMAND in text:
        context.note(
            NotDone(f"the condition {shown(expression)} depends on a command, which is not run here").at(context.line)
        )
        return False
    problem = f"the condition {shown(expression)} is {text!r}; it must be 'true', '1', 'false' or '0'"
    context.stand_in(ConditionError(problem), "false")
    return False
