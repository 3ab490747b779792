"""The values of a message as YAML, checked against its type.

A text field takes the words as they are written, so that ``{data: on}`` and ``{data: 007}`` mean these letters. ``now`` in a time, and
``auto`` in a header, stand for the instant at which the message is sent.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Generic, TypeVar, cast

from actors.interfaces import Field, Message, MessageTypeError, MessageValueError, from_plain
from actors.interfaces.fields import FLOATS, INTEGER_RANGES, STRINGS
from actors.yaml_bounds import check_yaml, safe_loader
from cli.command import CommandFailed

if TYPE_CHECKING:
    from actors.interfaces.builtin_interfaces.msg import Time

M = TypeVar("M", bound=Message)

TIME, HEADER = "builtin_interfaces/msg/Time", "std_msgs/msg/Header"


class _Now:
    """Stands for the instant of sending, where a message has a time or a header."""


_NOW = _Now()


class Values(Generic[M]):
    """What a message is to contain: always the same, but for the instant at which it is sent."""

    def __init__(self, kind: type[M], plain: dict[str, Any]) -> None:
        from actors.interfaces.builtin_interfaces.msg import Time

        self._kind = kind
        self._plain = plain
        self._message = self._built(Time())

    @property
    def stamped(self) -> bool:
        """Whether the message contains the instant of sending."""
        return _stamped(self._plain)

    def message(self, now: Time) -> M:
        """The message that is sent now."""
        return self._built(now) if self.stamped else self._message

    def _built(self, now: Time) -> M:
        try:
            return from_plain(self._kind, _with(self._plain, now))
        except (MessageTypeError, MessageValueError) as error:
            raise CommandFailed(f"Failed to populate field: {error}") from None


def read_values(text: str, kind: type[M]) -> Values[M]:
    """The values that a YAML text gives. Raises `CommandFailed`: it is no YAML, no mapping, or does not fit the type."""
    documents = list(_composed(text, "the values"))
    if len(documents) > 1:
        raise CommandFailed(f"one message was expected, not {len(documents)}, separated by ---")
    return Values(kind, _mapping(documents[0] if documents else None, kind))


def read_documents(path: str, kind: type[M]) -> Iterator[Values[M]]:
    """The values in a YAML file, such as one that `topic echo` has written: one message for each document."""
    try:
        with open(path, encoding="utf-8") as file:
            text = file.read()
    except (OSError, UnicodeDecodeError) as error:
        raise CommandFailed(f"{path} cannot be read: {error}") from None
    for node in _composed(text, path):
        yield Values(kind, _mapping(node, kind))


def read_stdin() -> str:
    """All that comes from the standard input."""
    return sys.stdin.read()


def _composed(text: str, where: str) -> Iterator[Any]:
    import yaml

    library: Any = yaml  # its stubs leave much open
    try:
        check_yaml(text)
        for node in library.compose_all(text, Loader=safe_loader()):
            if node.value != "":  # the empty document after the last ---
                yield node
    except yaml.YAMLError as error:
        mark: Any = getattr(error, "problem_mark", None)
        place = f" (line {mark.line + 1}, column {mark.column + 1})" if mark is not None else ""
        problem = getattr(error, "problem", None) or str(error)
        raise CommandFailed(f"{where} are no YAML{place}: {problem}" if where == "the values" else
                            f"{where} is no YAML{place}: {problem}") from None  # fmt: skip


def _mapping(node: Any, kind: type[Message]) -> dict[str, Any]:
    import yaml

    if not isinstance(node, yaml.MappingNode):
        names = ", ".join(field.name for field in kind.__ros_fields__)
        form = f"{{{names.partition(',')[0]}: ...}}" if names else "{}"
        raise CommandFailed(f"The passed value needs to be a dictionary in YAML format, such as {form}")
    plain: dict[str, Any] = _message(node, kind)
    return plain


def _message(node: Any, kind: type[Message]) -> Any:
    """A node for a message: a dict by the names as they are written; anything else is left for the check against the type."""
    import yaml

    if isinstance(node, yaml.ScalarNode) and (node.value, kind.__ros_type__) == ("now", TIME):
        return _NOW
    if isinstance(node, yaml.ScalarNode) and (node.value, kind.__ros_type__) == ("auto", HEADER):
        return {"stamp": _NOW}
    if not isinstance(node, yaml.MappingNode):
        return _constructed(node)
    fields = {field.name: field for field in kind.__ros_fields__}
    pairs = cast("list[tuple[Any, Any]]", node.value)
    if not all(isinstance(key, yaml.ScalarNode) for key, _ in pairs):
        raise CommandFailed("Failed to populate field: the name of a field is no list and no map")
    return {key.value: _field(value, fields.get(key.value)) for key, value in pairs}


def _field(node: Any, field: Field | None) -> Any:
    import yaml

    if field is None:
        return _constructed(node)
    if field.type.is_array and isinstance(node, yaml.SequenceNode):
        return [_element(item, field) for item in cast("list[Any]", node.value)]
    return _constructed(node) if field.type.is_array else _element(node, field)


def _element(node: Any, field: Field) -> Any:
    import yaml

    if field.message is not None:
        return _message(node, field.message)
    base = field.type.base
    if base in STRINGS and isinstance(node, yaml.ScalarNode):
        return node.value
    value = _constructed(node)
    if base in FLOATS and isinstance(value, str):
        return _number(value)
    if base in INTEGER_RANGES and isinstance(value, float) and value.is_integer():
        return int(value)
    if base == "bool" and type(value) is int and value in (0, 1):
        return bool(value)
    return value


def _number(text: str) -> float | str:
    """``1e3``, ``inf`` and ``nan``, which YAML 1.1 takes for text; other text as it is."""
    try:
        return float(text)
    except ValueError:
        return text


def _constructed(node: Any) -> Any:
    import yaml

    loader = safe_loader()("")
    try:
        return loader.construct_document(node)
    except yaml.YAMLError as error:
        raise CommandFailed(f"Failed to populate field: {' '.join(str(error).split())}") from None
    finally:
        loader.dispose()


def _stamped(plain: Any) -> bool:
    if isinstance(plain, (dict, list)):
        within = cast(Any, plain)
        return any(_stamped(each) for each in (within.values() if hasattr(within, "values") else within))
    return isinstance(plain, _Now)


def _with(plain: Any, now: Time) -> Any:
    if isinstance(plain, dict):
        fields = cast(Any, plain)
        return {name: _with(each, now) for name, each in fields.items()}
    if isinstance(plain, list):
        items = cast(Any, plain)
        return [_with(each, now) for each in items]
    return now if isinstance(plain, _Now) else plain
