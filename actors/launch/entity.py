"""The parts of a launch description, and their evaluation."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, cast

from actors.errors import described
from actors.launch.errors import LaunchError, user_line
from actors.launch.plan import Missing, Scope
from actors.launch.substitution import Substitution

if TYPE_CHECKING:
    from actors.launch.conditions import Condition
    from actors.launch.context import LaunchContext


class LaunchDescriptionEntity:
    """A part of a launch description."""

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        """Evaluate this part: change the context, and add to `scope` what is to be started. Raises `LaunchError`."""
        raise NotImplementedError(f"{type(self).__name__} cannot be part of a launch description")

    def describe_sub_entities(self) -> list[LaunchDescriptionEntity]:
        """The parts of this part, whether or not they apply."""
        return []

    def note_arguments(self, context: LaunchContext) -> None:
        """Remember the arguments that are declared in this part, which does not apply now."""
        for inner in self.describe_sub_entities():
            inner.note_arguments(context)


class Action(LaunchDescriptionEntity):
    """Something that is done, if its condition holds. A subclass of the user's defines `execute`."""

    def __init__(self, *, condition: Condition | None = None) -> None:
        self.condition = condition
        self.line = user_line()

    def applies(self, context: LaunchContext) -> bool:
        """Whether the condition holds."""
        return self.condition is None or self.condition.evaluate(context)

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        if context.only_shown:
            scope.items.append(Missing(self.describe(), "what it does is seen when it is done"))
            return
        evaluate(listed(self.execute(context)), context, scope)

    def execute(self, context: LaunchContext) -> Iterable[LaunchDescriptionEntity] | None:
        """Do it, and return the parts that follow of it."""
        raise NotImplementedError(f"{type(self).__name__} does not define execute(context)")

    def describe(self) -> str:
        """The action for display."""
        return type(self).__name__


class LaunchDescription(LaunchDescriptionEntity):
    """The parts of a system, in order."""

    def __init__(
        self, initial_entities: Iterable[LaunchDescriptionEntity] | None = None, *, deprecated_reason: str | None = None
    ) -> None:
        self.entities: list[LaunchDescriptionEntity] = list(initial_entities or ())
        self.deprecated_reason = deprecated_reason

    def add_entity(self, entity: LaunchDescriptionEntity) -> None:
        """Add a part after the others."""
        self.entities.append(entity)

    add_action = add_entity

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        if self.deprecated_reason:
            context.note(LaunchError(f"this launch file is deprecated: {self.deprecated_reason}"))
        evaluate(self.entities, context, scope)

    def describe_sub_entities(self) -> list[LaunchDescriptionEntity]:
        return self.entities


def evaluate(entities: Iterable[LaunchDescriptionEntity], context: LaunchContext, scope: Scope) -> None:
    """Evaluate the parts in order. Raises `LaunchError`, with the line of the part; in a lenient context the part is left out."""
    outer = context.line
    for entity in entities:
        try:
            _evaluate(entity, context, scope)
        except LaunchError as error:
            placed = error.at(context.line)
            if not context.lenient:
                raise placed from error.__cause__
            context.note(placed)
            scope.items.append(Missing(type(entity).__name__, placed.problem))
        finally:
            context.line = outer


def listed(entities: object) -> list[LaunchDescriptionEntity]:
    """The entities that a function or a handler gives: one, several, or none."""
    if entities is None:
        return []
    if isinstance(entities, LaunchDescriptionEntity):
        return [entities]
    return list(cast("Iterable[LaunchDescriptionEntity]", entities))


def one_or_more(value: object) -> list[Any]:
    """The items of a list or a tuple; of a single value, itself; of None, nothing."""
    if value is None:
        return []
    return list(cast("Iterable[Any]", value)) if isinstance(value, (list, tuple)) else [value]


def _evaluate(entity: object, context: LaunchContext, scope: Scope) -> None:
    if isinstance(entity, Substitution) and entity.absent:
        return
    if not isinstance(entity, LaunchDescriptionEntity):
        raise LaunchError(f"{described(entity)} is no action, so it cannot be part of a launch description")
    try:
        if isinstance(entity, Action):
            context.line = entity.line or context.line
            if not entity.applies(context):
                entity.note_arguments(context)
                return
        entity.plan(context, scope)
    except LaunchError:
        raise
    except Exception as error:
        raise LaunchError(f"{type(entity).__name__}: {described(error)}{_line_of(error)}") from error


def _line_of(error: BaseException) -> str:
    from actors.places import origin_of

    place = origin_of(error)
    return f" (at {place.file}:{place.line})" if place is not None else ""
