"""Containers, and the nodes that are loaded into them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from actors.launch.actions.nodes import Node, namespace_of, node_name_of, remaps_of
from actors.launch.conditions import Condition
from actors.launch.context import LaunchContext
from actors.launch.entity import Action
from actors.launch.errors import LaunchError, user_line
from actors.launch.parameters import effective, layers_of, own_layers
from actors.launch.plan import Component, Load, Scope
from actors.launch.substitution import Text, Truth, as_bool, normalized, perform


class ComposableNode:
    """The description of a node to be loaded into a container: `plugin` is its class, ``package::Class``."""

    def __init__(
        self,
        *,
        package: Text,
        plugin: Text,
        name: Text | None = None,
        namespace: Text | None = None,
        parameters: object = None,
        remappings: Iterable[tuple[Text, Text]] | None = None,
        extra_arguments: object = None,
        autostart: Truth = False,
        condition: Condition | None = None,
    ) -> None:
        self.package, self.plugin = normalized(package), normalized(plugin)
        self.name = None if name is None else normalized(name)
        self.namespace = None if namespace is None else normalized(namespace)
        self.parameters: object = parameters or ()
        self.remappings = list(remappings or ())
        self.extra_arguments: object = extra_arguments or ()
        self.autostart = autostart
        self.condition = condition
        self.line = user_line()

    def component(self, context: LaunchContext) -> Component:
        """The component in this context. Raises `LaunchError`."""
        context.line = self.line or context.line
        extra = [layer for layer in own_layers(context, self.extra_arguments) if layer.text is None]
        return Component(
            perform(context, self.package),
            perform(context, self.plugin),
            None if self.name is None else node_name_of(perform(context, self.name)),
            namespace_of(context, self.namespace),
            layers_of(context, self.parameters, flat=True),
            [*context.scoped.remaps, *remaps_of(context, self.remappings)],
            effective("/extra", extra),
            as_bool(context, self.autostart),
            self.line,
        )


class ComposableLifecycleNode(ComposableNode):
    """The description of a lifecycle node to be loaded into a container."""


class ComposableNodeContainer(Node):
    """Starts a container and loads nodes into it. If its executable is not here, a container of this framework takes its place."""

    container = True

    def __init__(
        self,
        *,
        name: Text,
        namespace: Text = "",
        executable: Text = "component_container",
        package: Text = "rclcpp_components",
        composable_node_descriptions: Iterable[ComposableNode] | None = None,
        **options: Any,
    ) -> None:
        super().__init__(name=name, namespace=namespace, executable=executable, package=package, **options)
        self.descriptions = list(composable_node_descriptions or ())

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        super().plan(context, scope)
        components = _components(context, self.descriptions)
        if components:
            scope.items.append(Load(self.node_name, components, self.line))


class LoadComposableNodes(Action):
    """Loads nodes into a container that this launch, or another one, has started."""

    def __init__(
        self,
        *,
        composable_node_descriptions: Iterable[ComposableNode],
        target_container: ComposableNodeContainer | Text,
        condition: Condition | None = None,
    ) -> None:
        super().__init__(condition=condition)
        self.descriptions = list(composable_node_descriptions)
        self.target = target_container

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        if isinstance(self.target, ComposableNodeContainer):
            container = self.target.node_name
        else:
            container = perform(context, self.target)
            if not container.startswith("/"):
                container = f"/{container}"  # relative to the node of the launch, not to the namespace of the group
        if container in ("", "/"):
            raise LaunchError("the container into which nodes are loaded has no name")
        scope.items.append(Load(container, _components(context, self.descriptions), self.line))


def _components(context: LaunchContext, descriptions: Iterable[ComposableNode]) -> list[Component]:
    return [one.component(context) for one in descriptions if one.condition is None or one.condition.evaluate(context)]
