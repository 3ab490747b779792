"""Names: validity, expansion to full names, and the names derived from others.

There are four kinds, as in ROS 2: node names, namespaces, names as users write them (relative, ``~/private``, ``{substitution}``), and full
names of topics and services. A failed check raises ``InvalidName`` with a code, the index of the invalid character and the text. ``expand``
is cached, so each name is checked once.
"""

import re
from collections.abc import Mapping
from functools import lru_cache
from typing import Final, Literal, NamedTuple

from actors.errors import reduce_error

MAX_NODE_NAME: Final = 255
MAX_NAMESPACE: Final = 245
MAX_FULL_NAME: Final = 247

Kind = Literal["node name", "namespace", "name", "full name"]

_NODE_NAME: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")
_FULL_NAME: Final = re.compile(r"(?:/[A-Za-z_][A-Za-z0-9_]*)+\Z")
_PLAIN_NAME: Final = re.compile(r"(?:~?/)?[A-Za-z_][A-Za-z0-9_]*(?:/[A-Za-z_][A-Za-z0-9_]*)*\Z")
# Patterns that only unusual names need are compiled on demand, which keeps the import fast.
_NOT_IN_NODE_NAME: Final = r"[^A-Za-z0-9_]"
_NOT_IN_FULL_NAME: Final = r"[^A-Za-z0-9_/]"
_SLASH_THEN: Final = r"/(?=[0-9/])"
_SLASH_DIGIT: Final = r"/(?=[0-9])"
_SUBSTITUTION: Final = r"\{([^{}]*)\}"
_DIGITS: Final = frozenset("0123456789")
_WORD: Final = frozenset("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_")

_REMEDIES: Final = {
    "empty": "it is empty",
    "not_absolute": "it must start with a slash",
    "ends_with_slash": "it must not end with a slash",
    "repeated_slash": "there is a second slash in a row",
    "unallowed_characters": "only letters, digits and underscores are allowed",
    "starts_with_number": "it must not start with a digit",
    "token_starts_with_number": "no part between slashes may start with a digit",
    "too_long": "it is too long",
    "unmatched_curly_brace": "a curly brace has no partner",
    "misplaced_tilde": "a tilde may only be the first character",
    "tilde_not_followed_by_slash": "a tilde must stand alone or be followed by a slash",
    "substitution_unallowed_characters": "only letters, digits and underscores are allowed within {}",
    "substitution_starts_with_number": "a substitution within {} must not start with a digit",
    "unknown_substitution": "no value is known for this substitution; {node}, {ns} and {namespace} are",
}


class InvalidName(ValueError):
    """A name that ROS 2 refuses.

    ``code`` is the reason (``unallowed_characters``, ``too_long``, ...). ``index`` is the offset of the invalid character in ``text``: 0
    for an empty text, the maximum - 1 for a text that is too long. ``kind`` is the kind of name that was expected.
    """

    code: str
    index: int
    text: str
    kind: Kind

    __reduce__ = reduce_error

    def __init__(self, kind: Kind, code: str, index: int, text: str) -> None:
        self.kind = kind
        self.code = code
        self.index = index
        self.text = text
        where = "" if code == "empty" else f" (at {index}: {text[index : index + 1]!r})"
        super().__init__(f"{text!r} is not a valid {kind}: {_REMEDIES[code]}{where}")


# Checks -------------------------------------------------------------------------------------------------------------


def validate_node_name(name: str) -> None:
    """Raise ``InvalidName`` unless ``name`` is a node name: ``[A-Za-z_][A-Za-z0-9_]*``, at most 255 characters."""
    if _NODE_NAME.match(name) and len(name) <= MAX_NODE_NAME:
        return
    if not name:
        raise InvalidName("node name", "empty", 0, name)
    if bad := re.search(_NOT_IN_NODE_NAME, name):
        raise InvalidName("node name", "unallowed_characters", bad.start(), name)
    if name[0] in _DIGITS:
        raise InvalidName("node name", "starts_with_number", 0, name)
    raise InvalidName("node name", "too_long", MAX_NODE_NAME - 1, name)


def validate_namespace(namespace: str) -> None:
    """Raise ``InvalidName`` unless ``namespace`` is normalised: absolute, at most 245 characters; ``/`` alone is the root."""
    if namespace != "/":
        _validate_absolute("namespace", namespace, MAX_NAMESPACE)


def validate_full_name(name: str) -> None:
    """Raise ``InvalidName`` unless ``name`` is a full topic or service name: absolute, at most 247 characters, not ``/``."""
    _validate_absolute("full name", name, MAX_FULL_NAME)


def _validate_absolute(kind: Kind, name: str, longest: int) -> None:
    if _FULL_NAME.match(name) and len(name) <= longest:
        return
    if not name:
        raise InvalidName(kind, "empty", 0, name)
    if name[0] != "/":
        raise InvalidName(kind, "not_absolute", 0, name)
    if name[-1] == "/":
        raise InvalidName(kind, "ends_with_slash", len(name) - 1, name)
    if bad := re.search(_NOT_IN_FULL_NAME, name):
        raise InvalidName(kind, "unallowed_characters", bad.start(), name)
    if bad := re.search(_SLASH_THEN, name):
        code = "repeated_slash" if name[bad.end()] == "/" else "token_starts_with_number"
        raise InvalidName(kind, code, bad.end(), name)
    raise InvalidName(kind, "too_long", longest - 1, name)


def validate_name(name: str) -> None:
    """Raise ``InvalidName`` unless ``name`` is a topic or service name as users write it: relative, absolute, ``~/private``, ``{node}``.

    As in ROS 2, ``a//b``, ``{}`` and ``~x`` are accepted here; ``expand`` refuses them.
    """
    if _PLAIN_NAME.match(name):
        return
    if not name:
        raise InvalidName("name", "empty", 0, name)
    if name[0] in _DIGITS:
        raise InvalidName("name", "token_starts_with_number", 0, name)
    if name[-1] == "/":
        raise InvalidName("name", "ends_with_slash", len(name) - 1, name)
    _validate_characters(name)
    if name[0] == "~" and len(name) > 2 and name[1] != "/":
        raise InvalidName("name", "tilde_not_followed_by_slash", 1, name)
    if bad := re.search(_SLASH_DIGIT, name):
        raise InvalidName("name", "token_starts_with_number", bad.end(), name)


def _validate_characters(name: str) -> None:
    opened = -1  # index of the open brace, -1 if there is none
    for index, character in enumerate(name):
        if character in _WORD:
            if opened == index - 1 >= 0 and character in _DIGITS:
                raise InvalidName("name", "substitution_starts_with_number", index, name)
        elif character == "}":
            if opened < 0:
                raise InvalidName("name", "unmatched_curly_brace", index, name)
            opened = -1
        elif character == "~":
            if index > 0:
                raise InvalidName("name", "misplaced_tilde", index, name)
        elif opened >= 0:
            raise InvalidName("name", "substitution_unallowed_characters", index, name)
        elif character == "{":
            opened = index
        elif character != "/":
            raise InvalidName("name", "unallowed_characters", index, name)
    if opened >= 0:
        raise InvalidName("name", "unmatched_curly_brace", opened, name)


# Namespaces and nodes -----------------------------------------------------------------------------------------------


@lru_cache(maxsize=1024)
def normalize_namespace(namespace: str) -> str:
    """Normalise and check the namespace passed to the constructor of a node: ``''`` -> ``/``, ``'ns'`` -> ``/ns``."""
    absolute = namespace if namespace.startswith("/") else f"/{namespace}"
    validate_namespace(absolute)
    return absolute


def fully_qualified(namespace: str, name: str) -> str:
    """The fully qualified name of a node: ``('/ns', 'node')`` -> ``/ns/node``. The parts are not checked."""
    return f"/{name}" if namespace in ("/", "") else f"{namespace}/{name}"


def logger_name(full: str) -> str:
    """The logger name of a node with this fully qualified name: ``/ns/node`` -> ``ns.node``."""
    return full.removeprefix("/").replace("/", ".")


def child_logger_name(parent: str, child: str) -> str:
    """The name of a child logger: ``('ns.node', 'driver')`` -> ``ns.node.driver``. Raises ValueError for an empty child."""
    if not child:
        raise ValueError(f"a child of logger {parent!r} needs a name; it was empty")
    return f"{parent}.{child}" if parent else child


# Expansion ----------------------------------------------------------------------------------------------------------


def expand(name: str, node: str, namespace: str, substitutions: Mapping[str, str] | None = None) -> str:
    """Expand a name used by a node to the full name, checked and not yet remapped.

    ``expand("~/scan", "lidar", "/front")`` is ``/front/lidar/scan``. ``namespace`` must be normalised (``/`` or ``/ns``). Raises
    ``InvalidName`` for an invalid name, node, namespace or result.
    """
    if substitutions is None and (shared := expand_shared(name, namespace)) is not None:
        validate_node_name(node)
        return shared
    full = expand_only(name, node, namespace, substitutions)
    validate_full_name(full)
    return full


def expand_for(name: str, node: str, namespace: str) -> str:
    """As `expand`, for a node whose name and namespace have been checked, and a name that depends on the node: see `expand_shared`."""
    if (own := _below_node(name)) is not None:
        full = fully_qualified(namespace, node) + own
        if len(full) <= MAX_FULL_NAME:
            return full
    return expand(name, node, namespace)


@lru_cache(maxsize=4096)
def _below_node(name: str) -> str | None:
    """``/scan`` of ``~/scan``: what follows the full name of the node; None for a name of another form, and an invalid one."""
    if not name.startswith("~/") or not _PLAIN_NAME.match(name):
        return None
    own = name[1:]
    return own if _FULL_NAME.match(own) else None


@lru_cache(maxsize=4096)
def expand_shared(name: str, namespace: str) -> str | None:
    """The full name of `name` for every node of a namespace; None if it depends on the node.

    It is cached, so that a thousand nodes of one class check their names once.
    """
    if name.startswith("~") or "{" in name:
        return None
    full = expand_only(name, "node", namespace)
    validate_full_name(full)
    return full


def expand_only(name: str, node: str, namespace: str, substitutions: Mapping[str, str] | None = None) -> str:
    """Expand as ``expand`` does, without checking the result: ``a//b`` and ``/x/{ns}`` expand to invalid names.

    ROS 2 accepts the two-character form ``~x`` and appends it to the node's name; it is refused here.
    """
    validate_name(name)
    validate_node_name(node)
    validate_namespace(namespace)
    full = name
    if name[0] == "~":
        if len(name) == 2:
            raise InvalidName("name", "tilde_not_followed_by_slash", 1, name)
        full = fully_qualified(namespace, node) + name[1:]
    if "{" in name:
        values = {**(substitutions or {}), "node": node, "ns": namespace, "namespace": namespace}

        def value(match: re.Match[str]) -> str:
            if match[1] not in values:
                raise InvalidName("name", "unknown_substitution", name.index(match[0]), name)
            return values[match[1]]

        full = re.sub(_SUBSTITUTION, value, full)
    return full if full.startswith("/") else fully_qualified(namespace, full)


# Derived names ------------------------------------------------------------------------------------------------------


class ActionNames(NamedTuple):
    """The three services and two topics of an action."""

    send_goal: str
    cancel_goal: str
    get_result: str
    feedback: str
    status: str


@lru_cache(maxsize=512)
def action_names(full: str) -> ActionNames:
    """The five names of the action with this full name."""
    return ActionNames(*(f"{full}/_action/{part}" for part in ActionNames._fields))


def service_event_topic(service: str) -> str:
    """The topic on which the service with this full name publishes its events."""
    return f"{service}/_service_event"


def is_hidden(name: str) -> bool:
    """Whether tools hide this topic, service or action: a part of its name starts with an underscore."""
    return name.startswith("_") or "/_" in name


# Style --------------------------------------------------------------------------------------------------------------

_VAGUE_TOPICS: Final = frozenset(
    {"commands", "command", "data", "topic", "msg", "message", "messages", "output", "input"}
)
_VAGUE_NODES: Final = frozenset({"node", "my_node", "test", "temp", "foo", "bar"})
_NUMBERED_NODE: Final = r"(?:my_?)?node_?[0-9]+\Z"


def lint_name(name: str) -> tuple[str, ...]:
    """Hints on the style of a valid topic, service or action name; empty if there are none. Never raises."""
    hints: list[str] = []
    if name != name.lower():
        hints.append(f"{name!r} has capital letters; ROS names are lower case with underscores: {_snake(name)!r}")
    last = name.rpartition("/")[2].lower()
    if last in _VAGUE_TOPICS:
        hints.append(f"{name!r} does not say what it carries; prefer a name like 'left_arm_joint_commands'")
    return tuple(hints)


def lint_node_name(name: str) -> tuple[str, ...]:
    """Hints on the style of a valid node name; empty if there are none. Never raises."""
    hints: list[str] = []
    if name != name.lower():
        hints.append(f"{name!r} has capital letters; ROS names are lower case with underscores: {_snake(name)!r}")
    if name.lower() in _VAGUE_NODES or re.match(_NUMBERED_NODE, name.lower()):
        hints.append(f"{name!r} does not say what the node does; prefer a name like 'camera_driver'")
    return tuple(hints)


def _snake(name: str) -> str:
    """``CameraRGB`` -> ``camera_rgb``."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()
