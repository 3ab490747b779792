"""The events of a launch: what handlers are asked about."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from actors.launch.entity import LaunchDescriptionEntity

Matcher = Callable[[Any], bool]
"""Whether an action is meant: it is given the action of each job."""


class Event:
    """Something that has happened, or that somebody wants. Classes of the user's are derived from it."""

    name = "launch.Event"


class Shutdown(Event):
    """The launch is to end. `due_to_sigint` says that Ctrl-C was pressed."""

    name = "launch.events.Shutdown"

    def __init__(self, *, reason: str = "reason not set", due_to_sigint: bool = False, **_: object) -> None:
        self.reason = reason
        self.due_to_sigint = due_to_sigint


class ReadyToTest(Event):
    """The system is ready for its tests."""

    name = "launch_testing.events.ReadyToTest"


class TimerEvent(Event):
    """A timer has fired."""

    name = "launch.events.TimerEvent"

    def __init__(self, *, timer_action: object) -> None:
        self.timer_action = timer_action


class ExecutionComplete(Event):
    """An action is done: what it started has ended, or its time is over."""

    name = "launch.events.ExecutionComplete"

    def __init__(self, *, action: Any) -> None:
        self.action = action


class IncludeLaunchDescription(Event):
    """A launch description is to be evaluated."""

    name = "launch.events.IncludeLaunchDescription"

    def __init__(self, launch_description: LaunchDescriptionEntity) -> None:
        self.launch_description = launch_description


class ProcessEvent(Event):
    """About one executable: the `action` that started it, its label `process_name`, its command, folder and environment, its pid."""

    def __init__(
        self,
        *,
        action: Any,
        name: str,
        cmd: list[str],
        cwd: str | None = None,
        env: dict[str, str] | None = None,
        pid: int = 0,
    ) -> None:
        self.action = action
        self.process_name = name
        self.cmd, self.cwd, self.env, self.pid = cmd, cwd, env, pid


class ProcessStarted(ProcessEvent):
    """An executable has started. For a node of this framework `pid` is that of the launch itself."""

    name = "launch.events.process.ProcessStarted"


class ProcessExited(ProcessEvent):
    """An executable has ended, with `returncode`: 0 in order, negative for a signal. A node that failed has 1."""

    name = "launch.events.process.ProcessExited"

    def __init__(self, *, returncode: int, **about: Any) -> None:
        super().__init__(**about)
        self.returncode = returncode


class ProcessIO(ProcessEvent):
    """A line that a process has written, as bytes in `text`."""

    name = "launch.events.process.ProcessIO"
    from_stdout = False
    from_stderr = False
    from_stdin = False

    def __init__(self, *, text: bytes, **about: Any) -> None:
        super().__init__(**about)
        self.text = text


class ProcessStdout(ProcessIO):
    """A line on stdout."""

    name = "launch.events.process.ProcessStdout"
    from_stdout = True


class ProcessStderr(ProcessIO):
    """A line on stderr."""

    name = "launch.events.process.ProcessStderr"
    from_stderr = True


class ShutdownProcess(Event):
    """The executables that the matcher chooses are to end."""

    name = "launch.events.process.ShutdownProcess"

    def __init__(self, *, process_matcher: Matcher) -> None:
        self.process_matcher = process_matcher


class SignalProcess(ShutdownProcess):
    """The processes that the matcher chooses are to get a signal. A node of this framework takes any signal for a request to stop."""

    name = "launch.events.process.SignalProcess"

    def __init__(self, *, signal_number: int, process_matcher: Matcher) -> None:
        super().__init__(process_matcher=process_matcher)
        self.signal_number = signal_number


class ChangeState(Event):
    """A lifecycle transition is wanted of the lifecycle nodes that the matcher chooses; `transition_id` is that of lifecycle_msgs."""

    name = "launch_ros.events.lifecycle.ChangeState"

    def __init__(self, *, lifecycle_node_matcher: Matcher, transition_id: int) -> None:
        self.lifecycle_node_matcher = lifecycle_node_matcher
        self.transition_id = transition_id


class StateTransition(Event):
    """A lifecycle node has changed its state; `msg` is its TransitionEvent."""

    name = "launch_ros.events.lifecycle.StateTransition"

    def __init__(self, *, action: Any, msg: Any) -> None:
        self.action = action
        self.msg = msg
        self.transition = str(msg.transition.label)
        self.start_state = str(msg.start_state.label)
        self.goal_state = str(msg.goal_state.label)


def matches_action(action: object) -> Matcher:
    """Chooses what this action started."""
    return lambda other: other is action


def matches_name(name: str) -> Matcher:
    """Chooses by the name of an executable, with or without its number."""
    return lambda action: name in (known := _detail(action, "name", ""), known.rpartition("-")[0])


def matches_executable(executable: str) -> Matcher:
    """Chooses by the program."""
    return lambda action: _detail(action, "cmd", [""])[:1] == [executable]


def matches_pid(pid: int) -> Matcher:
    """Chooses by the process id."""
    return lambda action: _detail(action, "pid", 0) == pid


def matches_node_name(node_name: str) -> Matcher:
    """Chooses a lifecycle node by its full name."""
    return lambda action: f"/{getattr(action, 'node_name', '').lstrip('/')}" == f"/{node_name.lstrip('/')}"


def _detail(action: object, name: str, default: object) -> Any:
    """What is known of the process of an action; the default before its start."""
    details: Mapping[str, object] = getattr(action, "process_details", None) or {}
    return details.get(name, default)
