"""The options of one run, which add to the tree: parameters, remapping rules and log levels; and the identity of a node under both.

The sources are those of ROS 2. For a parameter the last source that sets it counts, in this order: the default, the arguments of the
program (`argv`), the declaration of the node (`Child(parameters=)`), the start of the run (`run(parameters=)`). For remapping the first
rule that matches counts; the rules of one node (`Child(remap=)`) come before those of the program.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

from actors.names.identity import Identity
from actors.names.names import fully_qualified, normalize_namespace, validate_node_name

if TYPE_CHECKING:
    from actors.logs.levels import LevelTree
    from actors.names.remapping import Rule
    from actors.parameters.files import ParameterOverrides
    from actors.supervision.child import Child


class RunOptions(NamedTuple):
    """The options that apply to all nodes of a run. A value; `actors.running.options` makes and checks it."""

    arguments: ParameterOverrides
    """The parameters of the command line."""
    parameters: ParameterOverrides
    """The parameters that the program gives to `run`."""
    rules: tuple[Rule, ...]
    """The remapping rules of the command line."""
    levels: LevelTree
    stdout_logs: bool
    argv: tuple[str, ...]
    """The arguments of the command line that are not for ROS."""

    def overrides(self, fqn: str, own: Mapping[str, object]) -> dict[str, object]:
        """The parameters with which the node `fqn` starts. `own` are those of its declaration."""
        return {**self.arguments.for_node(fqn), **own, **self.parameters.for_node(fqn)}

    def optional(self, fqn: str, own: Mapping[str, object]) -> frozenset[str]:
        """The names in `overrides` that only patterns such as ``/**`` set. They do not apply to a node without such a parameter."""
        by_name = own.keys() | self.arguments.named(fqn) | self.parameters.named(fqn)
        return frozenset(self.overrides(fqn, own).keys() - by_name)


def identity_of(child: Child, path: tuple[str, ...], options: RunOptions | None = None) -> Identity:
    """The identity of the node of `child` at `path` in the tree, in a run with these options. Raises `InvalidName`."""
    remapping = None
    if child.remap or (options is not None and options.rules):
        from actors.names.remapping import Remapping, Rule  # imported here because few trees remap

        own = [Rule.parse(f"{old}:={new}") for old, new in child.remap.items()]
        remapping = Remapping(own, () if options is None else options.rules)
    name, namespace = child.name, normalize_namespace(child.namespace or "")
    validate_node_name(name)
    if remapping is not None:
        name, namespace = remapping.identity(name, namespace)
    if options is None:
        return Identity(name, namespace, path, child.parameters, remapping)
    fqn, given = fully_qualified(namespace, name), child.parameters
    return Identity(name, namespace, path, options.overrides(fqn, given), remapping, options.optional(fqn, given))
