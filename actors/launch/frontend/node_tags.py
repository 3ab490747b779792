"""The tags of launch files that start something, with their parameters, remappings and environment."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Final, cast

from actors.launch.actions.composition import ComposableNode, ComposableNodeContainer, LoadComposableNodes
from actors.launch.actions.events import Shutdown
from actors.launch.actions.nodes import LifecycleNode, Node
from actors.launch.actions.processes import ExecuteProcess
from actors.launch.conditions import IfCondition, UnlessCondition
from actors.launch.context import LaunchContext
from actors.launch.entity import Action
from actors.launch.frontend.element import Element, Unquoted, plain
from actors.launch.parameters import ParameterFile, ParameterValue
from actors.launch.substitution import Substitution, TextSubstitution, yaml_value
from actors.launch.substitutions.grammar import parse_command_line, parse_substitution
from actors.parameters.files import plain_scalar
from actors.suggest import did_you_mean

TYPES: Final[Mapping[str, object]] = MappingProxyType(
    {
        "bool": bool,
        "int": int,
        "float": float,
        "str": str,
        "list_of_bool": list[bool],
        "list_of_int": list[int],
        "list_of_float": list[float],
        "list_of_str": list[str],
    }
)
"""What the attribute `type` of a parameter may be."""


class Joined(Substitution):
    """Several parts as one substitution, so that their joined text is typed as a whole."""

    def __init__(self, parts: list[Substitution]) -> None:
        self.parts = parts

    def perform(self, context: LaunchContext) -> str:
        return "".join(part.perform(context) for part in self.parts)

    def describe(self) -> str:
        return " + ".join(part.describe() for part in self.parts)


def _process_options(element: Element) -> dict[str, Any]:
    """The options that all tags have which start something."""
    options: dict[str, object] = {}
    for attribute, option in (
        ("launch-prefix", "prefix"),
        ("cwd", "cwd"),
        ("output", "output"),
        ("respawn", "respawn"),
        ("respawn_delay", "respawn_delay"),
        ("sigterm_timeout", "sigterm_timeout"),
        ("sigkill_timeout", "sigkill_timeout"),
        ("shell", "shell"),
        ("emulate_tty", "emulate_tty"),
    ):
        if (text := element.text(attribute)) is not None:
            options[option] = text
    if (retries := element.value("respawn_max_retries")) is not None:
        options["respawn_max_retries"] = int(plain(retries))
    if (on_exit := element.value("on_exit")) is not None:
        if on_exit != "shutdown":
            raise element.error(f"on_exit is 'shutdown' or nothing, not {on_exit!r}")
        options["on_exit"] = Shutdown(reason=f"<{element.tag}> has ended")
    pairs = {tuple(one.need("name")): one.need("value") for one in element.parts("env")}
    if pairs:
        options["additional_env"] = pairs
    return options


def _node_options(element: Element) -> dict[str, Any]:
    options = _process_options(element)
    for attribute, option in (("pkg", "package"), ("namespace", "namespace"), ("exec_name", "exec_name")):
        if (text := element.text(attribute)) is not None:
            options[option] = text
    for attribute, option in (("args", "arguments"), ("ros_args", "ros_arguments")):
        if (value := element.value(attribute)) is not None:
            options[option] = parse_command_line(plain(value))
    options["parameters"] = [_parameter(one) for one in element.parts("param")]
    options["remappings"] = _remappings(element)
    return options


def _node(element: Element) -> Action:
    options = _node_options(element)
    name = element.text("name")
    return Node(executable=element.need("exec"), name=name, **options)


def _lifecycle_node(element: Element) -> Action:
    options = _node_options(element)
    autostart = element.text("autostart")
    return LifecycleNode(
        executable=element.need("exec"),
        name=element.need("name"),
        autostart=False if autostart is None else autostart,
        **options,
    )


def _executable(element: Element) -> Action:
    options = _process_options(element)
    return ExecuteProcess(cmd=parse_command_line(element.word("cmd")), name=element.text("name"), **options)


def _container(element: Element) -> Action:
    options = _node_options(element)
    return ComposableNodeContainer(
        executable=element.need("exec"),
        name=element.need("name"),
        composable_node_descriptions=_components(element),
        **options,
    )


def _load(element: Element) -> Action:
    return LoadComposableNodes(
        target_container=element.need("target"), composable_node_descriptions=_components(element)
    )


def _components(element: Element) -> list[ComposableNode]:
    found: list[ComposableNode] = []
    for one in element.parts("composable_node", "composable_lifecycle_node"):
        positive, negative = one.text("if"), one.text("unless")
        condition = None if positive is None else IfCondition(positive)
        autostart = one.text("autostart")
        component = ComposableNode(
            package=one.need("pkg"),
            plugin=one.need("plugin"),
            name=one.text("name"),
            namespace=one.text("namespace"),
            parameters=[_parameter(each) for each in one.parts("param")],
            remappings=_remappings(one),
            extra_arguments=[{tuple(e.need("name")): Joined(e.need("value"))} for e in one.parts("extra_arg")],
            autostart=False if autostart is None else autostart,
            condition=condition if negative is None else UnlessCondition(negative),
        )
        component.line = one.line
        one.done()
        found.append(component)
    return found


def _remappings(element: Element) -> list[tuple[list[Substitution], list[Substitution]]]:
    found: list[tuple[list[Substitution], list[Substitution]]] = []
    for one in element.parts("remap"):
        found.append((one.need("from"), one.need("to")))
        one.done()
    return found


def _parameter(element: Element) -> Any:
    """A parameter file, or a dictionary with one parameter, which may hold others."""
    source = element.text("from")
    if source is not None:
        allowed = element.text("allow_substs")
        element.done()
        return ParameterFile(source, allow_substs=False if allowed is None else allowed)
    name = element.word("name")
    nested = element.parts("param")
    if nested:
        values: dict[object, object] = {}
        for one in nested:
            values |= _parameter(one)
        element.done()
        return {tuple(parse_substitution(name)): values}
    value = _value(element)
    element.done()
    return {tuple(parse_substitution(name)): value}


def _value(element: Element) -> object:
    given, separator, kind = element.value("value"), element.value("value-sep"), element.value("type")
    if given is None:
        element.need("value")
    if kind is not None and kind not in TYPES:
        near = did_you_mean(str(kind), TYPES) or f"; there are: {', '.join(TYPES)}"
        raise element.error(f"there is no type {kind!r}{near}")
    if separator is not None:
        items = [yaml_value(item) for item in str(given).split(str(separator))]
        return ParameterValue(items if kind is None else str(items), value_type=None if kind is None else TYPES[kind])
    if isinstance(given, str):
        parts = parse_substitution(given)
        if kind is None and element.typed and not isinstance(given, Unquoted) and _is_plain(parts):
            return ParameterValue(parts, value_type=str)
        return ParameterValue(Joined(parts), value_type=None if kind is None else TYPES[kind])
    if isinstance(given, list):
        items = cast("list[object]", given)
        return [_list_item(item) if isinstance(item, str) else item for item in items]
    return given if kind is None else ParameterValue(plain(given), value_type=TYPES[kind])


def _list_item(text: str) -> object:
    parts = parse_substitution(text)
    if isinstance(text, Unquoted) and _is_plain(parts):
        return plain_scalar(text)
    return "".join(part.text for part in parts if isinstance(part, TextSubstitution)) if _is_plain(parts) else parts


def _is_plain(parts: list[Substitution]) -> bool:
    return all(isinstance(part, TextSubstitution) for part in parts)


NODE_TAGS: Final[Mapping[str, Callable[[Element], Action]]] = MappingProxyType(
    {
        "executable": _executable,
        "lifecycle_node": _lifecycle_node,
        "load_composable_node": _load,
        "node": _node,
        "node_container": _container,
    }
)
"""The tags that start something."""
