"""What one run says of its nodes besides what the tree says: parameters, remapping, log levels; and who a node is by both.

The sources are those of ROS 2. Of parameters the later one counts: the default, the arguments of the program (`argv`), those of one node
(`Child(parameters=)`), what the program itself says at the start (`run(parameters=)`). Of remapping rules the first that matches counts, and
those of one node (`Child(remap=)`) come before those of the program.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from actors.names.identity import Identity
from actors.names.names import fully_qualified, logger_name, normalize_namespace, validate_node_name

if TYPE_CHECKING:
    from actors.logs.levels import LevelTree
    from actors.names.remapping import Remapping, Rule
    from actors.parameters.files import ParameterOverrides
    from actors.supervision.declarations import Child

__all__ = ["RunOptions", "identity_of"]


class RunOptions(NamedTuple):
    """What holds for all nodes of a run. A value; `actors.running.options` reads and checks it."""

    arguments: ParameterOverrides
    """The parameters of the command line."""
    parameters: ParameterOverrides
    """Those that the program says itself."""
    rules: tuple[Rule, ...]
    """The remapping rules of the command line."""
    levels: LevelTree
    stdout_logs: bool
    argv: tuple[str, ...]
    """What is left of the command line for the program itself."""

    def overrides(self, fqn: str, own: Mapping[str, Any]) -> dict[str, Any]:
        """What the node with this full name, whose declaration has its `own` parameters, starts with."""
        return {**self.arguments.for_node(fqn), **own, **self.parameters.for_node(fqn)}

    def optional(self, fqn: str, own: Mapping[str, Any]) -> frozenset[str]:
        """The names among them that only patterns such as ``/**`` set: a node that has no such parameter goes without."""
        by_name = own.keys() | self.arguments.named(fqn) | self.parameters.named(fqn)
        return frozenset(self.overrides(fqn, own).keys() - by_name)

    def level(self, fqn: str) -> int:
        """The least level that the log of this node writes."""
        return self.levels.effective(logger_name(fqn))


def identity_of(child: Child, path: tuple[str, ...], options: RunOptions | None = None) -> Identity:
    """Who the node of `child` is at this place of the tree, in a run with these options. Raises `InvalidName`."""
    remapping = _remapping(child, () if options is None else options.rules)
    name, namespace = child.name, normalize_namespace(child.namespace or "")
    validate_node_name(name)
    if remapping is not None:
        name, namespace = remapping.identity(name, namespace)
    if options is None:
        return Identity(name, namespace, path, child.parameters, remapping)
    fqn, own = fully_qualified(namespace, name), child.parameters
    return Identity(name, namespace, path, options.overrides(fqn, own), remapping, options.optional(fqn, own))


def _remapping(child: Child, rules: tuple[Rule, ...]) -> Remapping | None:
    if not child.remap and not rules:
        return None
    from actors.names.remapping import Remapping, Rule  # late: few trees remap

    return Remapping([Rule.parse(f"{old}:={new}") for old, new in child.remap.items()], rules)
