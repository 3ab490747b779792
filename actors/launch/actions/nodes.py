"""`Node` and `LifecycleNode`: the executables of packages."""

from __future__ import annotations

import inspect
from collections.abc import Iterable
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

from actors.launch.actions.configuration import joined_namespace
from actors.launch.actions.processes import ExecuteProcess
from actors.launch.entity import Action
from actors.launch.errors import LaunchError
from actors.launch.packages import Executable, NodeTarget, Program
from actors.launch.parameters import layers_of
from actors.launch.plan import NodeSpec, Scope, Transitions
from actors.launch.substitution import Text, Truth, as_bool, normalized, perform
from actors.names.names import fully_qualified, normalize_namespace, validate_node_name
from actors.suggest import did_you_mean

if TYPE_CHECKING:
    from actors.launch.conditions import Condition
    from actors.launch.context import LaunchContext

_OPTIONS: Final = inspect.signature(ExecuteProcess).parameters.keys() - {"cmd", "name"}
CONTAINERS = "rclcpp_components"
"""The package of ROS 2's containers. Where it is not installed, a container of this framework takes their place."""


class Node(ExecuteProcess):
    """Starts an executable of a package: a node of this framework in this process, or a program as a process of its own.

    `parameters` is a list of files and dictionaries, of which a later one counts more; `remappings` are pairs of names. A relative
    `namespace` is below that of the group. Without `package`, `executable` is the path of a program.
    """

    container = False

    def __init__(
        self,
        *,
        executable: Text,
        package: Text | None = None,
        name: Text | None = None,
        namespace: Text | None = None,
        exec_name: Text | None = None,
        parameters: object = None,
        remappings: Iterable[tuple[Text, Text]] | None = None,
        ros_arguments: Iterable[Text] | None = None,
        arguments: Iterable[Text] | None = None,
        **options: Any,
    ) -> None:
        if unknown := options.keys() - _OPTIONS:
            word = min(unknown)
            hint = did_you_mean(word, {*_OPTIONS, *inspect.signature(Node).parameters} - {"options", "cmd"})
            raise TypeError(f"{type(self).__name__}() has no argument {word}{hint}")
        super().__init__(cmd=[executable], name=exec_name, **options)
        self.executable = normalized(executable)
        self.package = None if package is None else normalized(package)
        self.given_name = None if name is None else normalized(name)
        self.namespace = None if namespace is None else normalized(namespace)
        self.parameters: object = () if parameters is None else parameters
        self.remappings = list(remappings or ())
        self.ros_arguments = [normalized(one) for one in ros_arguments or ()]
        self.arguments = [normalized(one) for one in arguments or ()]
        self.node_name = ""
        """The full name of the node; known when the action has been evaluated, and only if it has been given a name."""

    @property
    def display_name(self) -> str:
        """The node as event handlers show it."""
        return self.node_name or " + ".join(one.describe() for one in self.executable)

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        executable = perform(context, self.executable)
        package = "" if self.package is None else perform(context, self.package)
        found, problem = self._find(context, package, executable)
        name = None if self.given_name is None else node_name_of(perform(context, self.given_name))
        namespace = namespace_of(context, self.namespace)
        self.node_name = fully_qualified(namespace or "/", name) if name else ""
        arguments = [perform(context, one) for one in self.arguments]
        if arguments and isinstance(found, NodeTarget):
            _check_arguments(context, found, arguments)
        spec = NodeSpec(
            package,
            executable,
            name,
            namespace,
            layers_of(context, self.parameters),
            [*context.scoped.remaps, *remaps_of(context, self.remappings)],
            arguments,
            [perform(context, one) for one in self.ros_arguments],
            found,
            problem,
            container=self._is_container(package),
            autostart=self._autostart(context),
        )
        shown = executable.rpartition("/")[2] if self.name is None else perform(context, self.name)
        cmd = [str(found.path)] if isinstance(found, Program) else None
        scope.items.append(self.job(context, shown, spec, cmd))

    def _autostart(self, context: LaunchContext) -> bool:
        return False

    def _is_container(self, package: str) -> bool:
        return self.container or package == CONTAINERS

    def _find(self, context: LaunchContext, package: str, executable: str) -> tuple[Executable | None, str]:
        """Where the executable is; or why it is not here, which is a problem of the whole unless it is stood in for."""
        if not package:
            import shutil
            from pathlib import Path

            path = shutil.which(executable, path=context.environment.get("PATH"))
            if path is not None:
                return Program("", executable, Path(path)), ""
            problem = f"there is no program {executable!r}"
        else:
            try:
                return context.packages.find(package, executable), ""
            except LookupError as error:
                problem = str(error.args[0])
        if not self._is_container(package) and not context.stand_ins:
            context.stand_in(LaunchError(problem), "")
        return None, problem


class LifecycleNode(Node):
    """Starts a lifecycle node. With `autostart` it is configured and activated when it has started."""

    def __init__(self, *, name: Text, namespace: Text = "", autostart: Truth = False, **options: Any) -> None:
        super().__init__(name=name, namespace=namespace, **options)
        self.autostart = autostart

    def _autostart(self, context: LaunchContext) -> bool:
        return as_bool(context, self.autostart)


class LifecycleTransition(Action):
    """Takes lifecycle nodes through transitions, one after another."""

    def __init__(
        self,
        *,
        lifecycle_node_names: Iterable[Text],
        transition_ids: Iterable[int | Text],
        condition: Condition | None = None,
    ) -> None:
        super().__init__(condition=condition)
        self.names = [normalized(name) for name in lifecycle_node_names]
        self.ids = list(transition_ids)

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        ids = [one if isinstance(one, int) else int(perform(context, one)) for one in self.ids]
        scope.items.append(Transitions([perform(context, name) for name in self.names], ids))


def _check_arguments(context: LaunchContext, found: NodeTarget, arguments: list[str]) -> None:
    """Note arguments that the class of a node does not take: it will not start, and the others do."""
    from importlib import import_module
    from operator import attrgetter

    from actors.running.arguments import parse

    module, _, name = found.target.partition(":")
    with suppress(ImportError, AttributeError):
        reader = getattr(attrgetter(name)(import_module(module)), "arguments_as_parameters", None)
        if reader is not None:
            try:
                reader(parse(arguments).user_args)
            except ValueError as error:
                context.note(LaunchError(str(error)))


def node_name_of(name: str) -> str | None:
    """The name of a node; None for an empty text. Raises `LaunchError` for one that ROS does not take."""
    if not name:
        return None
    try:
        validate_node_name(name)
    except ValueError as error:
        raise LaunchError(str(error)) from None
    return name


def namespace_of(context: LaunchContext, namespace: Text | None) -> str:
    """The namespace of a node, below that of its group; empty if none is given, not even an empty one. Raises `LaunchError`."""
    base = context.launch_configurations.get("ros_namespace")
    if namespace is None and base is None:
        return ""
    whole = joined_namespace(base or "", "" if namespace is None else perform(context, namespace)) or "/"
    try:
        normalize_namespace(whole)
    except ValueError as error:
        raise LaunchError(str(error)) from None
    return whole


def remaps_of(context: LaunchContext, remappings: Iterable[tuple[Text, Text]]) -> list[tuple[str, str]]:
    """Pairs of names. Raises `LaunchError` for what is no pair."""
    found: list[tuple[str, str]] = []
    for pair in remappings:
        try:
            old, new = pair
        except (TypeError, ValueError):
            raise LaunchError(f"a remapping is a pair ('from', 'to'), not {pair!r:.60}") from None
        found.append((perform(context, old), perform(context, new)))
    return found
