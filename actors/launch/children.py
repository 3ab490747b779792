"""Jobs as supervisors: an executable is a supervisor whose nodes live and die together."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from actors.launch.errors import LaunchError
from actors.launch.executables import Running
from actors.launch.packages import NodeTarget
from actors.launch.parameters import effective
from actors.launch.plan import Job, NodeSpec, Process, Scope
from actors.launch.program import Output, ProgramNode, ros_arguments
from actors.names.names import fully_qualified
from actors.qos.policies import QOS_OVERRIDES
from actors.running.options import with_arguments, with_own_arguments
from actors.running.target import Unusable, find, grown
from actors.runtime.members import has_fixed_parameters
from actors.runtime.node import Node
from actors.supervision.child import Child
from actors.supervision.declarations import DynamicSupervisor, Spec, Supervisor
from actors.supervision.policy import Backoff, Intensity, any_significant, one_for_all, permanent, temporary

Warn = Callable[[str], None]
"""Takes a sentence for the log."""

WITHOUT_LIMIT = Intensity(10**9, within=1e9)
"""The restarts of an executable that is respawned without limit."""


def scope_supervisor(scope: Scope) -> Supervisor:
    """The supervisor of a launch file or a group, with those inside it; it has no executables yet.

    It ends when a significant executable in it has ended, and then so does the one around it, up to the root.
    """
    inner = [scope_supervisor(item) for item in scope.items if isinstance(item, Scope)]
    return Supervisor(scope.name, children=inner, auto_shutdown=any_significant, restart=temporary, significant=True)


def job_supervisor(job: Job, children: Sequence[Spec]) -> Supervisor:
    """The supervisor of an executable. When one of its nodes ends, all of it ends, or is started anew if the job is to be respawned."""
    if not job.respawn:
        return Supervisor(
            job.label,
            children=[child.replace(restart=temporary, significant=True) for child in children],
            auto_shutdown=any_significant,
            restart=temporary,
            significant=job.required,
        )
    delay = job.respawn_delay
    backoff = Backoff(delay, delay, factor=1.0, jitter=0.0) if delay > 0 else None
    limit = WITHOUT_LIMIT if job.respawn_max_retries < 0 else Intensity(job.respawn_max_retries, within=1e9)
    return Supervisor(
        job.label,
        children=[child.replace(restart=permanent, significant=False, backoff=backoff) for child in children],
        strategy=one_for_all,
        intensity=limit,
        restart=temporary,
        significant=job.required,
    )


async def nodes_of(job: Job, node: NodeSpec, warn: Warn) -> list[Spec]:
    """The nodes of an executable of this framework, or what stands in for one that is not here. Raises `LaunchError`."""
    if not isinstance(node.found, NodeTarget):
        return [named(Child(StandIn, name=node.name or _node_name(job.label)), node, warn)]
    try:
        trees = await grown(find(node.found.target))
    except Unusable as error:
        raise LaunchError(str(error), job.line) from error
    specs: list[Spec] = [Child(tree) if isinstance(tree, type) else tree for tree in trees]
    while len(specs) == 1 and isinstance(specs[0], Supervisor):
        specs = list(specs[0].children)
    if len(specs) > 1 and node.name is not None:
        warn(f"{job.label}: its {len(specs)} nodes keep their names; only a single one can be called {node.name!r}")
        node = replace(node, name=None)
    return [named(spec, node, warn) for spec in specs]


def program_of(running: Running, process: Process, output: Output, folder: Path) -> Child:
    """The process of an executable."""
    node = running.job.node
    cmd = [*process.cmd, *(ros_arguments(node, folder) if node is not None else ())]
    whole = replace(process, cmd=cmd)
    stop = process.sigterm_timeout + process.sigkill_timeout + 1.0
    return Child(ProgramNode, name=f"_{_node_name(running.job.label)}", args=(whole, output, running), stop=stop)


def named(spec: Spec, node: NodeSpec, warn: Warn) -> Spec:
    """A node with the name, namespace, parameters and remappings of the launch file; a supervisor with all of its nodes so."""
    if isinstance(spec, DynamicSupervisor):
        return spec
    if isinstance(spec, Supervisor):
        inner = replace(node, name=None)
        return spec.replace(children=[named(child, inner, warn) for child in spec.children])
    name = node.name or spec.name
    namespace = node.namespace or spec.namespace
    fqn = fully_qualified(namespace or "/", name)
    given = effective(fqn, node.layers)
    told = spec.replace(
        name=name,
        namespace=namespace,
        parameters={**spec.parameters, **known_parameters(spec, given, fqn, warn)},
        remap=_first(*node.remaps, *spec.remap.items()),
    )
    arguments = [*node.arguments, *(["--ros-args", *node.ros_arguments] if node.ros_arguments else [])]
    if not arguments:
        return told
    try:
        return with_arguments(with_own_arguments(told, arguments), arguments)[0]
    except ValueError as error:
        raise LaunchError(str(error)) from error


def known_parameters(child: Child, given: Mapping[str, object], fqn: str, warn: Warn) -> dict[str, object]:
    """The parameters that the node has; a warning names the others, which a node of ROS 2 ignores without a word."""
    kind = child.factory
    if not (isinstance(kind, type) and issubclass(kind, Node) and has_fixed_parameters(kind)):
        return dict(given)
    table = kind.declarations.table
    overrides = QOS_OVERRIDES if kind.declarations.overridable else ()
    unknown = [name for name in given if name not in table.values and not name.startswith(overrides)]
    if unknown:
        from actors.suggest import did_you_mean

        near = did_you_mean(unknown[0], table.values)
        warn(f"{fqn} has no parameter {', '.join(map(repr, unknown))}{near or '; it is left out'}")
    return {name: value for name, value in given.items() if name not in unknown}


def _first(*rules: tuple[str, str]) -> dict[str, str]:
    """The rules in their order; of several for one name, the first."""
    found: dict[str, str] = {}
    for old, new in rules:
        found.setdefault(old, new)
    return found


def _node_name(text: str) -> str:
    return "".join(letter if letter.isalnum() else "_" for letter in text).strip("_") or "node"


class StandIn(Node):
    """Stands in for a node that is not here: it has its name and its parameters, whatever these are, and does nothing."""

    allow_undeclared_parameters = True
