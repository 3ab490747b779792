"""Remapping rules, ``[node:][rostopic://|rosservice://]from:=to``, and their application to names.

Full names are compared exactly. Both sides of a rule are expanded for the node, the first rule that matches applies, and its result is not
remapped again. The rules of a node come before those of its process. Grammar and order are those of rcl.
"""

import re
from collections.abc import Iterable
from typing import Final, Literal, NamedTuple

from actors.errors import reduce_error
from actors.names import names

RuleKind = Literal["topic", "service", "node_name", "namespace"]

# Rules are stricter than names in code: no token may contain two underscores in a row.
_TOKEN: Final = r"(?:[A-Za-z]|_(?!_))(?:[A-Za-z0-9]|_(?!_))*+"
_NAME: Final = rf"(?:~/|/)?{_TOKEN}(?:/{_TOKEN})*+"
_PREFIX: Final = re.compile(rf"({_TOKEN}):(?!=|//)")
_NODE_RULE: Final = re.compile(rf"(?:__node|__name):=({_TOKEN})\Z")
_NAMESPACE_RULE: Final = re.compile(rf"__ns:=(/(?:{_TOKEN}/)*+(?:{_TOKEN})?)\Z")
_NAME_RULE: Final = re.compile(rf"(rostopic://|rosservice://)?({_NAME}):=({_NAME})\Z")
_ACTION_PART: Final = re.compile(rf"/_action/(?:{'|'.join(names.ActionNames._fields)})\Z")

_SCHEMES: Final[dict[str | None, tuple[RuleKind, ...]]] = {
    None: ("topic", "service"),
    "rostopic://": ("topic",),
    "rosservice://": ("service",),
}


class InvalidRule(ValueError):
    """A text that is not a remapping rule. ``text`` holds it."""

    __reduce__ = reduce_error

    def __init__(self, text: str, why: str) -> None:
        super().__init__(f"{text!r} is not a remapping rule: {why}")
        self.text = text


class Rule(NamedTuple):
    """One remapping rule. ``node`` limits it to nodes of that name; ``match`` is None for ``__node`` and ``__ns``."""

    applies_to: tuple[RuleKind, ...]
    node: str | None
    match: str | None
    replacement: str

    @classmethod
    def parse(cls, text: str) -> "Rule":
        """Parse a rule such as ``chatter:=news``, ``talker:__ns:=/left`` or ``rostopic://scan:=~/scan``. Raises ``InvalidRule``."""
        prefix = _PREFIX.match(text)
        node = prefix[1] if prefix else None
        rest = text[prefix.end() :] if prefix else text
        if found := _NODE_RULE.match(rest):
            return cls(("node_name",), node, None, found[1])
        if found := _NAMESPACE_RULE.match(rest):
            return cls(("namespace",), node, None, found[1])
        if found := _NAME_RULE.match(rest):
            return cls(_SCHEMES[found[1]], node, found[2], found[3])
        raise InvalidRule(text, _diagnose(rest))

    def __str__(self) -> str:
        """The rule as written on a command line."""
        prefix = f"{self.node}:" if self.node else ""
        if self.match is None:
            return f"{prefix}{'__node' if 'node_name' in self.applies_to else '__ns'}:={self.replacement}"
        scheme = next(scheme for scheme, kinds in _SCHEMES.items() if kinds == self.applies_to)
        return f"{prefix}{scheme or ''}{self.match}:={self.replacement}"


def _diagnose(rest: str) -> str:
    match, separator, replacement = rest.partition(":=")
    if not separator:
        return "write from:=to"
    if ":=" in replacement:
        return "there is more than one ':='"
    if not match or not replacement:
        return "one side of ':=' is empty"
    if match == "__ns":
        return "a namespace must start with a slash, as in __ns:=/left"
    if match in ("__node", "__name"):
        return "a node's new name is a single word of letters, digits and underscores"
    if "*" in rest or "{" in rest or "\\" in rest:
        return "wildcards, substitutions and back-references are not supported in rules"
    return (
        "each side must be a name such as scan, /front/scan or ~/scan of letters, digits and single underscores, "
        "and only the left side may have a prefix node:, rostopic:// or rosservice://"
    )


class Remapping:
    """The rules for one node: its own first, then those of its process."""

    __slots__ = ("rules",)

    rules: tuple[Rule, ...]

    def __init__(self, local_rules: Iterable[Rule] | None = None, global_rules: Iterable[Rule] | None = None) -> None:
        self.rules = (*(local_rules or ()), *(global_rules or ()))

    def identity(self, node: str, namespace: str) -> tuple[str, str]:
        """The remapped name and namespace of a node. The name is remapped first, and ``__ns`` rules see the new one.

        Raises ``names.InvalidName`` if either result is invalid.
        """
        new_node = self.node_name(node)
        names.validate_node_name(new_node)
        return new_node, names.normalize_namespace(self.namespace(new_node, namespace))

    def node_name(self, node: str) -> str:
        """The remapped name of a node."""
        found = self.find("node_name", "", node, "/")
        return node if found is None else found

    def namespace(self, node: str, namespace: str) -> str:
        """The remapped namespace of a node; ``node`` is its new name."""
        found = self.find("namespace", "", node, namespace)
        return namespace if found is None else found

    def resolve_topic(self, name: str, node: str, namespace: str) -> str:
        """Expand, remap and check a topic name for this node. Raises ``names.InvalidName``."""
        return self._resolve("topic", name, node, namespace)

    def resolve_service(self, name: str, node: str, namespace: str) -> str:
        """Expand, remap and check a service name for this node. Raises ``names.InvalidName``."""
        return self._resolve("service", name, node, namespace)

    def _resolve(self, kind: RuleKind, name: str, node: str, namespace: str) -> str:
        full = names.expand(name, node, namespace)
        found = self.find(kind, full, node, namespace)
        if found is None:
            return full
        names.validate_full_name(found)
        return found

    def find(self, kind: RuleKind, full: str, node: str, namespace: str) -> str | None:
        """The result of the first matching rule; None if none matches. ``full`` is not used for node names and namespaces.

        The five names of an action also follow a rule for the action's base name (``fibonacci:=fib``), which rcl does not support. A rule
        for one of the five names takes precedence.
        """
        found = self._first(kind, full, node, namespace)
        if found is None and (action := _ACTION_PART.search(full)):
            moved = self._first(kind, full[: action.start()], node, namespace)
            return None if moved is None else moved + action[0]
        return found

    def _first(self, kind: RuleKind, full: str, node: str, namespace: str) -> str | None:
        for rule in self.rules:
            if kind not in rule.applies_to or (rule.node is not None and rule.node != node):
                continue
            if rule.match is None:
                return rule.replacement
            if names.expand_only(rule.match, node, namespace) == full:
                return names.expand_only(rule.replacement, node, namespace)
        return None

    def __bool__(self) -> bool:
        return bool(self.rules)

    def __repr__(self) -> str:
        return f"Remapping({', '.join(map(str, self.rules)) or 'no rules'})"
