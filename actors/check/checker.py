"""Static checks of nodes and trees: what will not work or may surprise, each finding with its remedy.

Declarations that cannot work are refused when the class is created. The checks here involve several classes: a subscription without
publisher, a call without server, two servers of one name, profiles that do not match. They also report legal but unwise declarations.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from typing import Any, Literal

import msgspec

from actors.contracts.contracts import Topic
from actors.names.names import lint_name, lint_node_name
from actors.parameters.declare import OPTIONAL_PARAMETERS
from actors.qos import compatible
from actors.qos.policies import QoS
from actors.runtime.node import Node
from actors.runtime.options import identity_of
from actors.suggest import did_you_mean
from actors.supervision.child import Child
from actors.supervision.declarations import Spec, Supervisor


class Finding(msgspec.Struct, frozen=True, order=True):
    """One finding: `where` it is, `what` it is, and its `remedy`. A warning works but may surprise; an error does not work.

    It has no public constructor: `check_tree` and `check_node` give them.
    """

    where: str
    what: str
    remedy: str
    level: Literal["warning", "error"] = "warning"

    def __str__(self) -> str:
        return f"{self.level}: {self.where}: {self.what}; {self.remedy}"


def check_node(node: type[Node]) -> tuple[Finding, ...]:
    """Check one node class by itself."""
    declarations, found = node.declarations, list[Finding]()
    if not (node.__doc__ or "").strip():
        found.append(Finding(node.__name__, "it has no docstring", "say what it does, publishes, takes and serves"))
    for attribute, contract in _contracts(node):
        for advice in lint_name(contract):
            found.append(Finding(f"{node.__name__}.{attribute}", f"{contract!r}: {advice}", "rename the contract"))
    for published in declarations.publishers:
        for handler in declarations.topics:
            if published.topic is handler.topic:
                found.append(
                    Finding(
                        f"{node.__name__}.{handler.attribute}",
                        f"the node takes {handler.topic.name!r}, which it publishes itself",
                        "call the method directly, or make sure that this does not go round for ever",
                    )
                )
    return tuple(sorted(found))


def check_tree(tree: Spec, *, external: Iterable[str] = (), each_node: bool = True) -> tuple[Finding, ...]:
    """Check a tree before it runs, and each of its classes by `check_node` unless `each_node` is False.

    `external` lists the full names of topics, services and actions that other programs provide.
    """
    view = _Tree(set(external), each_node)
    view.add(tree, (tree.name,))
    return tuple(sorted(set(view.findings())))


class _Tree:
    """The publishers, subscriptions, servers and clients of a tree, by full name."""

    def __init__(self, external: set[str], each_node: bool) -> None:
        self.external = external
        self.each_node = each_node
        self.publishers: dict[str, list[tuple[str, Topic[Any], QoS]]] = defaultdict(list)
        self.subscriptions: dict[str, list[tuple[str, Topic[Any], QoS]]] = defaultdict(list)
        self.servers: dict[str, list[str]] = defaultdict(list)
        self.names: dict[str, list[str]] = defaultdict(list)
        self.found: list[Finding] = []

    def add(self, spec: Spec, path: tuple[str, ...]) -> None:
        if isinstance(spec, Child):
            self._add_child(spec, path)
        elif isinstance(spec, Supervisor):
            for child in spec.children:
                self.add(child, (*path, child.name))
        else:
            self._add_child(spec.template, (*path, spec.template.name))

    def _add_child(self, child: Child, path: tuple[str, ...]) -> None:
        where, node = "/".join(path), child.factory
        if not (isinstance(node, type) and issubclass(node, Node)):
            return  # a factory function: its class is known only when it runs
        if self.each_node:
            self.found += check_node(node)
        identity = identity_of(child, path)
        for advice in lint_node_name(identity.name):
            self.found.append(Finding(where, advice, "rename the node: Child(..., name=...)"))
        self.names[identity.fqn].append(where)
        declarations = node.declarations
        for published in declarations.publishers:
            self.publishers[identity.topic(published.topic.name)].append((where, published.topic, published.qos))
        taken = [(handler.topic, handler.qos) for handler in declarations.topics]
        taken += [(stream.topic, stream.qos) for stream in declarations.streams]
        for topic, qos in taken:
            self.subscriptions[identity.topic(topic.name)].append((where, topic, qos))
        for service in declarations.services:
            self.servers[identity.service(service.service.name)].append(where)
        for action in declarations.actions:
            self.servers[identity.service(action.action.name)].append(where)
        known = declarations.table.values
        for name in sorted(child.parameters.keys() - known.keys() - OPTIONAL_PARAMETERS.keys()):
            self.found.append(
                Finding(
                    where,
                    f"it is given a parameter {name!r} that {node.__name__} does not declare",
                    f"declare it, or take it away{did_you_mean(name, known)}",
                )
            )

    def findings(self) -> list[Finding]:
        found = list(self.found)
        for fqn, places in self.names.items():
            if len(places) > 1:
                found.append(
                    Finding(
                        places[1],
                        f"it is the second node named {fqn}, after {places[0]}",
                        "give it another name= or namespace=",
                        "error",
                    )
                )
        for name, places in self.servers.items():
            if len(places) > 1:
                found.append(
                    Finding(
                        places[1],
                        f"it would be the second server of {name}, after {places[0]}",
                        "serve it once",
                        "error",
                    )
                )
        for name, readers in self.subscriptions.items():
            writers = self.publishers.get(name, [])
            for where, topic, wanted in readers:
                if not writers and name not in self.external:
                    found.append(
                        Finding(
                            where,
                            f"it takes {name}, which nobody publishes",
                            f"publish it, remap it, or name it as external{did_you_mean(name, self.publishers)}",
                        )
                    )
                for other, offered_topic, offered in writers:
                    found += self._pair(name, where, topic, wanted, other, offered_topic, offered)
        return found

    @staticmethod
    def _pair(
        name: str, where: str, topic: Topic[Any], wanted: QoS, other: str, offered_topic: Topic[Any], offered: QoS
    ) -> Iterable[Finding]:
        if topic.type is not offered_topic.type:
            ours, theirs = topic.type.__ros_type__, offered_topic.type.__ros_type__
            yield Finding(
                where,
                f"it takes {name} as {ours}, but {other} publishes it as {theirs}",
                "one topic has one type",
                "error",
            )
        verdict = compatible(offered, wanted)
        if verdict.level == "error":
            yield Finding(where, f"{name} from {other}: {verdict.reason}", "give both ends the same profile", "error")


def _contracts(node: type[Node]) -> Iterable[tuple[str, str]]:
    declarations = node.declarations
    for published in declarations.publishers:
        yield published.attribute, published.topic.name
    for stream in declarations.streams:
        yield stream.attribute, stream.topic.name
    for handler in declarations.topics:
        yield handler.attribute, handler.topic.name
    for service in declarations.services:
        yield service.attribute, service.service.name
    for action in declarations.actions:
        yield action.attribute, action.action.name
