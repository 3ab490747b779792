"""Actions about events: log lines, timers, handlers, and the end of the launch."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from actors.launch import events
from actors.launch.entity import Action, LaunchDescriptionEntity, one_or_more
from actors.launch.errors import LaunchError
from actors.launch.handlers import EventHandler
from actors.launch.plan import Deferred, Handler, Message, Scope, Signal, Timer, Unregister
from actors.launch.substitution import Number, Text, Truth, normalized, perform

if TYPE_CHECKING:
    from actors.launch.conditions import Condition
    from actors.launch.context import LaunchContext

LEVELS = ("debug", "info", "warning", "error")


class Log(Action):
    """Writes a line to the log, at a level: debug, info, warning or error."""

    def __init__(self, *, msg: Text, level: Text, condition: Condition | None = None) -> None:
        super().__init__(condition=condition)
        self.msg, self.level = normalized(msg), normalized(level)

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        from actors.suggest import did_you_mean

        level = perform(context, self.level).lower()
        if level == "warn":
            level = "warning"
        if level not in LEVELS:
            raise LaunchError(
                f"there is no level {level!r}{did_you_mean(level, LEVELS)}; there are: {', '.join(LEVELS)}"
            )
        scope.items.append(Message(perform(context, self.msg), level))


class LogDebug(Log):
    """Writes a line to the log, at level debug."""

    def __init__(self, *, msg: Text, condition: Condition | None = None) -> None:
        super().__init__(msg=msg, level="debug", condition=condition)


class LogInfo(Log):
    """Writes a line to the log, at level info."""

    def __init__(self, *, msg: Text, condition: Condition | None = None) -> None:
        super().__init__(msg=msg, level="info", condition=condition)


class LogWarning(Log):
    """Writes a line to the log, at level warning."""

    def __init__(self, *, msg: Text, condition: Condition | None = None) -> None:
        super().__init__(msg=msg, level="warning", condition=condition)


class LogError(Log):
    """Writes a line to the log, at level error."""

    def __init__(self, *, msg: Text, condition: Condition | None = None) -> None:
        super().__init__(msg=msg, level="error", condition=condition)


class TimerAction(Action):
    """Evaluates actions `period` seconds from now. With `cancel_on_shutdown` false, a shutdown waits for it."""

    def __init__(
        self,
        *,
        period: Number,
        actions: Iterable[LaunchDescriptionEntity],
        cancel_on_shutdown: Truth = True,
        condition: Condition | None = None,
    ) -> None:
        super().__init__(condition=condition)
        self.period = period
        self.actions = list(actions)
        self.cancel_on_shutdown = cancel_on_shutdown

    def describe_sub_entities(self) -> list[LaunchDescriptionEntity]:
        return self.actions

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        period = self.period
        if not isinstance(period, (int, float)):
            text = perform(context, period)
            try:
                period = float(text)
            except ValueError:
                raise LaunchError(f"the period {text!r} is no number of seconds") from None
        scope.items.append(Timer(float(period), Deferred(self.actions, context.fork()), self, self.line))


class RosTimer(TimerAction):
    """A `TimerAction` on the time of the nodes, which may be simulated. Here every timer is one."""


class RegisterEventHandler(Action):
    """From now on, a handler is asked about every event."""

    def __init__(self, event_handler: EventHandler, *, condition: Condition | None = None) -> None:
        super().__init__(condition=condition)
        self.event_handler = event_handler

    def describe_sub_entities(self) -> list[LaunchDescriptionEntity]:
        return [] if callable(self.event_handler.entities) else one_or_more(self.event_handler.entities)

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        scope.items.append(Handler(self.event_handler, context.fork(), self.line))


class UnregisterEventHandler(Action):
    """From now on, a handler is not asked any more."""

    def __init__(self, event_handler: EventHandler, *, condition: Condition | None = None) -> None:
        super().__init__(condition=condition)
        self.event_handler = event_handler

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        scope.items.append(Unregister(self.event_handler))


class EmitEvent(Action):
    """Emits an event."""

    def __init__(self, *, event: object, condition: Condition | None = None) -> None:
        super().__init__(condition=condition)
        self.event = event

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        scope.items.append(Signal(self.event, context.fork()))


class Shutdown(EmitEvent):
    """Ends the launch: everything stops in reverse order."""

    def __init__(self, *, reason: Text = "reason not given", condition: Condition | None = None) -> None:
        super().__init__(event=None, condition=condition)
        self.reason = normalized(reason)

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        scope.items.append(Signal(events.Shutdown(reason=perform(context, self.reason)), context.fork()))


class ReadyToTest(EmitEvent):
    """Says that the system is ready for its tests, as `launch_testing` has it."""

    def __init__(self, *, condition: Condition | None = None) -> None:
        super().__init__(event=events.ReadyToTest(), condition=condition)
