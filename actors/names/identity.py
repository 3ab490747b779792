"""The identity of a node: its own name, and the full names of what it uses."""

from __future__ import annotations

from collections.abc import Mapping

from actors.names import names
from actors.names.remapping import Remapping


class Identity:
    """The identity of a node. It follows from the node's place in the tree and is the same for all its incarnations.

    `name` and the absolute `namespace` are those after remapping. `overrides` are the parameters with which the node starts; it need not
    declare those whose names are `optional`.

    It has no public constructor: `NodeRecord.identity` is one.
    """

    __slots__ = ("fqn", "name", "namespace", "optional", "overrides", "path", "remapping")

    def __init__(
        self,
        name: str,
        namespace: str,
        path: tuple[str, ...],
        overrides: Mapping[str, object],
        remapping: Remapping | None = None,
        optional: frozenset[str] = frozenset(),
    ) -> None:
        self.name = name
        self.namespace = namespace
        self.fqn = names.fully_qualified(namespace, name)
        self.path = path
        self.overrides = overrides
        self.remapping = remapping
        self.optional = optional

    def topic(self, name: str) -> str:
        """The full name of a topic for this node: expanded and remapped. Raises ``InvalidName``."""
        if self.remapping is not None:
            return self.remapping.resolve_topic(name, self.name, self.namespace)
        shared = names.expand_shared(name, self.namespace)
        return names.expand_for(name, self.name, self.namespace) if shared is None else shared

    def service(self, name: str) -> str:
        """The full name of a service, or of an action by its base name, for this node: expanded and remapped. Raises ``InvalidName``."""
        if self.remapping is not None:
            return self.remapping.resolve_service(name, self.name, self.namespace)
        shared = names.expand_shared(name, self.namespace)
        return names.expand_for(name, self.name, self.namespace) if shared is None else shared
