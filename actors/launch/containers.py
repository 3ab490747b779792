"""Containers: nodes into which others are loaded while they run, by the services of `composition_interfaces`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from actors.contracts.contracts import Service
from actors.errors import described
from actors.interfaces.composition_interfaces.srv import (
    ListNodes,
    ListNodes_Request,
    ListNodes_Response,
    LoadNode,
    LoadNode_Request,
    LoadNode_Response,
    UnloadNode,
    UnloadNode_Request,
    UnloadNode_Response,
)
from actors.launch.children import StandIn, known_parameters
from actors.launch.lifecycle import UP, take_through
from actors.launch.packages import NodeTarget, Packages
from actors.launch.parameters import effective
from actors.names.names import fully_qualified
from actors.parameters.messages import from_parameter, to_parameter
from actors.parameters.values import Parameter
from actors.running.target import find, grown
from actors.runtime.incarnation import incarnation_of
from actors.runtime.node import Node
from actors.supervision.child import Child
from actors.supervision.declarations import Spec, Supervisor
from actors.supervision.policy import temporary
from actors.supervision.running import RunningSupervisor
from actors.system import system_of

if TYPE_CHECKING:
    from actors.launch.plan import Component, Load

COMPONENTS: Final = "components"
"""The name of the supervisor of the nodes that have been loaded, beside their container."""

WAIT_SECONDS = 60.0
"""How long a container is waited for, and how long it may take to load a node."""


class ComponentContainer(Node):
    """Loads, lists and unloads nodes on request: ``~/_container/load_node``, ``list_nodes``, ``unload_node``.

    A node that was loaded is supervised beside the container. It is not restarted when it fails, and ends with the container.
    Invariant: `_loaded` maps the number of each node that was loaded and not unloaded to its id and its full name.
    """

    node_name = "component_container"
    allow_undeclared_parameters = True

    def __init__(self, packages: Packages, stand_ins: bool = False) -> None:
        self._packages = packages
        self._stand_ins = stand_ins
        self._loaded: dict[int, tuple[str, str]] = {}
        self._last = 0

    async def on_start(self) -> None:
        self.serve(Service(LoadNode, "~/_container/load_node"), self._load)
        self.serve(Service(UnloadNode, "~/_container/unload_node"), self._unload)
        self.serve(Service(ListNodes, "~/_container/list_nodes"), self._list)

    async def _load(self, request: LoadNode_Request) -> LoadNode_Response:
        try:
            child = await self._child(request)
            name = fully_qualified(child.namespace or "/", child.name)
            if any(name == known for _, known in self._loaded.values()):
                raise ValueError(f"{name} has been loaded already")
            self._last += 1
            await self._components.start_child(
                Supervisor(f"{child.name}-{self._last}", children=[child], restart=temporary)
            )
        except Exception as error:
            return LoadNode.Response(error_message=described(error.__cause__ or error))
        self._loaded[self._last] = (f"{child.name}-{self._last}", name)
        self.log.info(f"loaded {request.package_name} {request.plugin_name} as {name}")
        return LoadNode.Response(success=True, full_node_name=name, unique_id=self._last)

    async def _unload(self, request: UnloadNode_Request) -> UnloadNode_Response:
        if request.unique_id not in self._loaded:
            return UnloadNode.Response(error_message=f"no node with the id {request.unique_id} is loaded")
        id, _ = self._loaded.pop(request.unique_id)
        await self._components.terminate_child(id)
        return UnloadNode.Response(success=True)

    async def _list(self, request: ListNodes_Request) -> ListNodes_Response:
        names = tuple(name for _, name in self._loaded.values())
        return ListNodes.Response(full_node_names=names, unique_ids=list(self._loaded))

    async def _child(self, request: LoadNode_Request) -> Child:
        """The node that a request asks for. Raises `LookupError` if there is none."""
        spec = await component_of(self._packages, request.package_name, request.plugin_name, self._stand_ins)
        given = {one.name: one.value for one in map(from_parameter, request.parameters)}
        rules = {old: new for old, _, new in (rule.partition(":=") for rule in reversed(request.remap_rules))}
        name, namespace = request.node_name or spec.name, request.node_namespace or spec.namespace
        given = known_parameters(spec, given, fully_qualified(namespace or "/", name), self.log.warning)
        return spec.replace(
            name=name,
            namespace=namespace,
            parameters={**spec.parameters, **given},
            remap={**spec.remap, **rules},
        )

    @property
    def _components(self) -> RunningSupervisor:
        root = system_of(self).supervisor
        assert root is not None
        life = root.life((*incarnation_of(self).identity.path[1:-1], COMPONENTS))
        assert isinstance(life, RunningSupervisor)
        return life


async def component_of(packages: Packages, package: str, plugin: str, stand_ins: bool = False) -> Child:
    """The node behind a plugin, ``package::Class``: that of the package whose class has this name, or whose executable has.

    Raises `LookupError`, which names those that there are; with `stand_ins` an empty node takes the place.
    """
    name = plugin.replace("::", ".").rpartition(".")[2]
    try:
        known = {key: one for key, one in packages.executables(package).items() if isinstance(one, NodeTarget)}
        for executable, target in known.items():
            if target.target.rpartition(":")[2] == name or executable == plugin:
                (tree,) = await grown(find(target.target))
                return _single(Child(tree) if isinstance(tree, type) else tree)
        there = ", ".join(target.target.rpartition(":")[2] for target in known.values()) or "none"
        raise LookupError(f"package {package!r} has no component {plugin!r}; it has: {there}")
    except LookupError:
        if not stand_ins:
            raise
        return Child(StandIn, name="".join(letter if letter.isalnum() else "_" for letter in name))


def _single(spec: Spec) -> Child:
    while isinstance(spec, Supervisor) and len(spec.children) == 1:
        spec = spec.children[0]
    if not isinstance(spec, Child):
        raise LookupError(f"{spec.name} is several nodes, and a component is one")
    return spec


async def load(node: Node, item: Load) -> None:
    """Load components one after another; `node` asks. What the container refuses is logged as an error."""
    service: Service[LoadNode_Request, LoadNode_Response] = Service(LoadNode, f"{item.container}/_container/load_node")
    await node.wait_for(service, timeout=WAIT_SECONDS)
    for component in item.components:
        answer = await node.call(service, _request(component), timeout=WAIT_SECONDS)
        if not answer.success:
            node.log.error(f"{item.container} did not load {component.plugin}: {answer.error_message}")
        elif component.autostart:
            await take_through(node, answer.full_node_name, UP)


def _request(component: Component) -> LoadNode_Request:
    fqn = fully_qualified(component.namespace or "/", component.name or component.plugin.rpartition("::")[2])
    return LoadNode.Request(
        package_name=component.package,
        plugin_name=component.plugin,
        node_name=component.name or "",
        node_namespace=component.namespace,
        remap_rules=tuple(f"{old}:={new}" for old, new in component.remaps),
        parameters=_parameters(effective(fqn, component.layers)),
        extra_arguments=_parameters(component.extra),
    )


def _parameters(values: Any) -> tuple[Any, ...]:
    return tuple(to_parameter(Parameter(name, value)) for name, value in values.items() if value is not None)
