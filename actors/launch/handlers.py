"""Event handlers: which events they answer, and by which actions."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from actors.launch import events
from actors.launch.entity import LaunchDescriptionEntity, listed

if TYPE_CHECKING:
    from actors.launch.context import LaunchContext


class EventHandler:
    """Answers the events for which `matcher` is true by `entities`, or by what that function returns, called with event and context."""

    def __init__(self, *, matcher: Callable[[Any], bool], entities: object = None, handle_once: bool = False) -> None:
        self.matcher = matcher
        self.entities = entities
        self.handle_once = handle_once

    def matches(self, event: object) -> bool:
        """Whether this event is answered."""
        return self.matcher(event)

    def handle(self, event: object, context: LaunchContext) -> list[LaunchDescriptionEntity]:
        """The actions that answer it."""
        return listed(self.entities(event, context) if callable(self.entities) else self.entities)

    def describe(self) -> str:
        """The handler for display: when it acts."""
        return type(self).__name__


class _OnAction(EventHandler):
    """Answers events of some kinds about one action, or about any."""

    kinds: tuple[type[events.ProcessEvent | events.ExecutionComplete | events.StateTransition], ...] = ()
    words = ""

    def __init__(self, *, target: object, entities: object, handle_once: bool) -> None:
        self.target = target
        super().__init__(matcher=self._answers, entities=entities, handle_once=handle_once)

    def _answers(self, event: object) -> bool:
        if not isinstance(event, self.kinds):
            return False
        if self.target is None or event.action is self.target:
            return True
        return callable(self.target) and bool(self.target(event.action))

    def describe(self) -> str:
        return f"{self.words} {_target(self.target)}"


class OnProcessStart(_OnAction):
    """When an executable has started."""

    kinds = (events.ProcessStarted,)
    words = "when started:"

    def __init__(self, *, target_action: object = None, on_start: object, handle_once: bool = False) -> None:
        super().__init__(target=target_action, entities=on_start, handle_once=handle_once)


class OnProcessExit(_OnAction):
    """When an executable has ended."""

    kinds = (events.ProcessExited,)
    words = "when ended:"

    def __init__(self, *, target_action: object = None, on_exit: object, handle_once: bool = False) -> None:
        super().__init__(target=target_action, entities=on_exit, handle_once=handle_once)


class OnExecutionComplete(_OnAction):
    """When an action is done."""

    kinds = (events.ExecutionComplete,)
    words = "when done:"

    def __init__(self, *, target_action: object = None, on_completion: object, handle_once: bool = False) -> None:
        super().__init__(target=target_action, entities=on_completion, handle_once=handle_once)


class OnProcessIO(_OnAction):
    """When a process has written a line. The functions are called with the event; what they return is done."""

    kinds = (events.ProcessStdout, events.ProcessStderr)
    words = "on output of"

    def __init__(
        self,
        *,
        target_action: object = None,
        on_stdin: Callable[[Any], object] | None = None,
        on_stdout: Callable[[Any], object] | None = None,
        on_stderr: Callable[[Any], object] | None = None,
        handle_once: bool = False,
    ) -> None:
        self.on_stdin, self.on_stdout, self.on_stderr = on_stdin, on_stdout, on_stderr
        super().__init__(target=target_action, entities=self._written, handle_once=handle_once)

    def _written(self, event: events.ProcessIO, context: LaunchContext) -> object:
        answer = self.on_stdout if event.from_stdout else self.on_stderr
        return None if answer is None else answer(event)


class OnStateTransition(_OnAction):
    """When a lifecycle node has made a transition, or reached a state."""

    kinds = (events.StateTransition,)
    words = "on a transition of"

    def __init__(
        self,
        *,
        entities: object,
        target_lifecycle_node: object = None,
        transition: str | None = None,
        start_state: str | None = None,
        goal_state: str | None = None,
        handle_once: bool = False,
    ) -> None:
        self.transition, self.start_state, self.goal_state = transition, start_state, goal_state
        super().__init__(target=target_lifecycle_node, entities=entities, handle_once=handle_once)

    def _answers(self, event: Any) -> bool:
        return super()._answers(event) and all(
            wanted in (None, seen)
            for wanted, seen in (
                (self.transition, event.transition),
                (self.start_state, event.start_state),
                (self.goal_state, event.goal_state),
            )
        )

    def describe(self) -> str:
        told = [f"{self.start_state or '*'} -> {self.goal_state or '*'}", self.transition or ""]
        return f"{super().describe()} ({' '.join(told).strip()})"


class OnShutdown(EventHandler):
    """When the launch ends."""

    def __init__(self, *, on_shutdown: object, handle_once: bool = False) -> None:
        super().__init__(
            matcher=lambda event: isinstance(event, events.Shutdown), entities=on_shutdown, handle_once=handle_once
        )

    def describe(self) -> str:
        return "on shutdown"


class OnIncludeLaunchDescription(EventHandler):
    """When a launch description is to be included by an event."""

    def __init__(self, *, entities: object = None, handle_once: bool = False) -> None:
        super().__init__(
            matcher=lambda event: isinstance(event, events.IncludeLaunchDescription),
            entities=entities or _included,
            handle_once=handle_once,
        )


def _included(event: events.IncludeLaunchDescription, context: LaunchContext) -> object:
    return event.launch_description


def event_named(name: str) -> Callable[[Any], bool]:
    """A matcher for events of this name."""
    return lambda event: event.name == name


def _target(target: object) -> str:
    return "anything" if target is None else getattr(target, "display_name", type(target).__name__)
