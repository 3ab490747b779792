"""The tags of launch files in XML and YAML: each makes one action."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Final

from actors.launch.actions.configuration import (
    DeclareBooleanLaunchArgument,
    DeclareLaunchArgument,
    PushRosNamespace,
    ResetLaunchConfigurations,
    SetLaunchConfiguration,
    SetParameter,
    SetParametersFromFile,
    SetRemap,
    SetUseSimTime,
)
from actors.launch.actions.environment import (
    AppendEnvironmentVariable,
    ReplaceEnvironmentVariables,
    ResetEnvironment,
    SetEnvironmentVariable,
    SetROSLogDir,
    UnsetEnvironmentVariable,
)
from actors.launch.actions.events import Log, LogDebug, LogError, LogInfo, LogWarning, RosTimer, Shutdown, TimerAction
from actors.launch.actions.groups import ForEach, ForLoop, GroupAction
from actors.launch.conditions import Condition, IfCondition, UnlessCondition
from actors.launch.entity import Action, LaunchDescription
from actors.launch.errors import LaunchError
from actors.launch.frontend.element import Element
from actors.launch.frontend.node_tags import NODE_TAGS, Joined
from actors.launch.loading import IncludeLaunchDescription
from actors.launch.substitution import Text
from actors.suggest import did_you_mean


def description_of(root: Element) -> LaunchDescription:
    """The launch description below the root of a file. Raises `LaunchError`."""
    root.value("version")
    reason = root.value("deprecated")
    actions = [action_of(child) for child in root.all_children()]
    root.done()
    return LaunchDescription(actions, deprecated_reason=None if reason is None else str(reason))


def action_of(element: Element) -> Action:
    """The action of a tag. Raises `LaunchError` for a tag or an attribute that does not exist, with the nearest that does."""
    make = TAGS.get(element.tag.replace("-", "_"))
    if make is None:
        near = did_you_mean(element.tag, TAGS) or f"; there are: {', '.join(TAGS)}"
        raise element.error(f"there is no tag <{element.tag}>{near}")
    try:
        action = make(element)
        action.condition = _condition(element)
    except LaunchError as error:
        raise error.at(element.line) from None
    element.done()
    action.line = element.line
    return action


def _condition(element: Element) -> Condition | None:
    positive, negative = element.text("if"), element.text("unless")
    if positive is not None and negative is not None:
        raise element.error(f"<{element.tag}> has both 'if' and 'unless'; keep one of them")
    if positive is not None:
        return IfCondition(positive)
    return None if negative is None else UnlessCondition(negative)


def _children(element: Element) -> list[Action]:
    return [action_of(child) for child in element.all_children()]


def _argument(element: Element) -> Action:
    choices = [choice.word("value") for choice in element.parts("choice")]
    return DeclareLaunchArgument(
        element.word("name"),
        default_value=element.text("default"),
        description=element.word("description", "") or None,
        choices=choices or None,
    )


def _boolean_argument(element: Element) -> Action:
    return DeclareBooleanLaunchArgument(
        element.word("name"),
        default_value=element.text("default"),
        description=element.word("description", "") or None,
    )


def _group(element: Element) -> Action:
    kept: dict[Text, Text] = {one.word("name"): one.need("value") for one in element.parts("keep")}
    scoped, forwarding = element.text("scoped"), element.text("forwarding")
    inside = [child for child in element.all_children() if child.tag != "keep"]
    return GroupAction(
        [action_of(child) for child in inside],
        scoped=True if scoped is None else scoped,
        forwarding=True if forwarding is None else forwarding,
        launch_configurations=kept,
    )


def _include(element: Element) -> Action:
    arguments = [(one.need("name"), one.need("value")) for one in element.parts("arg", "let")]
    return IncludeLaunchDescription(element.need("file"), launch_arguments=arguments)


def _append(element: Element) -> Action:
    prepend, separator = element.text("prepend"), element.text("separator")
    given: dict[str, Any] = {} if separator is None else {"separator": separator}
    return AppendEnvironmentVariable(
        element.need("name"), element.need("value"), prepend=False if prepend is None else prepend, **given
    )


def _replace(element: Element) -> Action:
    pairs: dict[Text, Text] = {one.word("name"): one.need("value") for one in element.parts("env")}
    return ReplaceEnvironmentVariables(pairs)


def _reset(element: Element) -> Action:
    kept: dict[Text, Text] = {one.word("name"): one.need("value") for one in element.parts("keep")}
    return ResetLaunchConfigurations(kept)


def _timer(kind: type[TimerAction]) -> Callable[[Element], Action]:
    def make(element: Element) -> Action:
        period, cancel = element.need("period"), element.text("cancel_on_shutdown")
        return kind(period=period, actions=_children(element), cancel_on_shutdown=True if cancel is None else cancel)

    return make


def _log(element: Element) -> Action:
    return Log(msg=element.need("message"), level=element.text("level") or "info")


def _log_at(kind: Callable[..., Action]) -> Callable[[Element], Action]:
    return lambda element: kind(msg=element.need("message"))


def _shutdown(element: Element) -> Action:
    reason = element.text("reason")
    return Shutdown() if reason is None else Shutdown(reason=reason)


def _for_each(element: Element) -> Action:
    return ForEach(element.need("values"), function=_again(element))


def _for(element: Element) -> Action:
    return ForLoop(element.need("len"), name=element.word("name"), function=_again(element))


def _again(element: Element) -> Callable[..., list[Action]]:
    """The body of a loop: what it is called with, its actions find in the context. They are made anew for each round."""
    _children(element)  # what is wrong in it is an error also where there is no round

    def body(*_: object, **__: object) -> list[Action]:
        return _children(element)

    return body


TAGS: Final[Mapping[str, Callable[[Element], Action]]] = MappingProxyType(
    {
        "append_env": _append,
        "arg": _argument,
        "bool_arg": _boolean_argument,
        "for": _for,
        "for_each": _for_each,
        "group": _group,
        "include": _include,
        "let": lambda element: SetLaunchConfiguration(element.need("name"), element.need("value")),
        "log": _log,
        "log_debug": _log_at(LogDebug),
        "log_error": _log_at(LogError),
        "log_info": _log_at(LogInfo),
        "log_warning": _log_at(LogWarning),
        "push_ros_namespace": lambda element: PushRosNamespace(element.need("namespace")),
        "rep_env": _replace,
        "reset": _reset,
        "reset_env": lambda element: ResetEnvironment(),
        "ros_timer": _timer(RosTimer),
        "set_env": lambda element: SetEnvironmentVariable(element.need("name"), element.need("value")),
        "set_parameter": lambda element: SetParameter(element.need("name"), Joined(element.need("value"))),
        "set_parameters_from_file": lambda element: SetParametersFromFile(element.need("filename")),
        "set_remap": lambda element: SetRemap(element.need("from"), element.need("to")),
        "set_ros_log_dir": lambda element: SetROSLogDir(element.need("new_log_dir")),
        "set_use_sim_time": lambda element: SetUseSimTime(element.need("value")),
        "shutdown": _shutdown,
        "timer": _timer(TimerAction),
        "unset_env": lambda element: UnsetEnvironmentVariable(element.need("name")),
        **NODE_TAGS,
    }
)
"""The tags, with underscores; hyphens mean the same."""
