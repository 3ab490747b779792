"""Messages as text: as YAML and comma-separated, as `ros2 topic echo` prints them, and as `topic pub` shows what it sends."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final, NamedTuple, cast

from actors.interfaces import Field, Message, to_plain
from actors.interfaces.fields import STRINGS
from cli.parsing import TRUNCATED

_WIDE = 2**31
"""No line is wrapped."""

_IDL: Final = {"float32": "float", "float64": "double", "bool": "boolean", "byte": "octet", "char": "uint8"}
"""What ROS 2 calls the types of elements where it leaves out an array."""


class Style(NamedTuple):
    """How much of a message is printed."""

    truncate: int | None = TRUNCATED
    """Arrays and texts longer than this are cut there and end in ``...``; None prints them whole."""
    no_arr: bool = False
    """Print the type and the length of an array instead of its items."""
    no_str: bool = False
    """Print the length of a text instead of it."""


WHOLE: Final = Style(None)


def message_yaml(message: Message, truncate: int | None = TRUNCATED, flow: bool = False) -> str:
    """The message in block style (or on one line), fields in the order of their definition, ending with a line break.

    Arrays and texts longer than `truncate` are cut there and end in ``...``; None prints them whole.
    """
    return yaml_of(plain(message, truncate), flow)


def yaml_of(value: Any, flow: bool = False) -> str:
    """Plain data as YAML, as ROS 2 writes it, ending with a line break."""
    import yaml

    dump: Any = yaml.safe_dump  # its stubs do not type it
    return str(dump(value, default_flow_style=flow, sort_keys=False, allow_unicode=True, width=_WIDE))


def plain(value: Any, truncate: int | None = None, no_arr: bool = False, no_str: bool = False) -> Any:
    """A message as dicts, lists, numbers and texts, with the parts of a `Style`.

    Arrays are cut before they are converted, so that a picture costs no more than a line.
    """
    if isinstance(value, Message):
        style = Style(truncate, no_arr, no_str)
        return {field.name: _field(field, getattr(value, field.name), style) for field in value.__ros_fields__}
    if isinstance(value, str):
        return value if truncate is None or len(value) <= truncate else value[:truncate] + "..."
    if isinstance(value, tuple) or hasattr(value, "dtype"):
        items = cast(Any, value)
        cut = truncate is not None and len(items) > truncate
        if cut:
            items = items[:truncate]
        whole = hasattr(items, "dtype")
        listed: list[Any] = items.tolist() if whole else [plain(item, truncate, no_arr, no_str) for item in items]
        return [*listed, "..."] if cut else listed
    return value


def _field(field: Field, value: Any, style: Style) -> Any:
    if style.no_arr and field.type.is_array:
        return array_summary(field, value)
    if style.no_str and field.type.base in STRINGS and not field.type.is_array:
        return f"<string length: <{len(value)}>>"
    return plain(value, *style)


def array_summary(field: Field, value: Any) -> str:
    """What is printed instead of an array: ``<sequence type: double, length: 3>``."""
    base = _IDL.get(field.type.base, field.type.base)
    if field.type.array == "fixed":
        return f"<array type: {base}[{field.type.size}]>"
    bound = f"[{field.type.size}]" if field.type.array == "bounded" else ""
    return f"<sequence type: {base}{bound}, length: {len(value)}>"


def message_csv(message: Any, style: Style = WHOLE) -> str:
    """All values of a message, or those of one of its fields, separated by commas."""
    return ",".join(_flat(plain(message, *style)))


def _flat(value: Any) -> Iterator[str]:
    if isinstance(value, dict):
        for each in cast("dict[str, Any]", value).values():
            yield from _flat(each)
    elif isinstance(value, list):
        listed = cast(Any, value)
        if not listed:
            yield ""  # so that a column stays in its place
        for each in listed:
            yield from _flat(each)
    else:
        yield str(value)


def message_json(value: Any) -> Any:
    """A message, or the value of a field, as data for JSON, whole."""
    return to_plain(value) if isinstance(value, Message) else plain(value)


def message_repr(value: Any) -> str:
    """A message as the classes of ROS 2 show themselves: ``std_msgs.msg.String(data='hi')``."""
    if isinstance(value, Message):
        fields = (f"{field.name}={_repr_of(field, getattr(value, field.name))}" for field in value.__ros_fields__)
        return f"{value.__ros_type__.replace('/', '.')}({', '.join(fields)})"
    if isinstance(value, tuple):
        items = cast(Any, value)
        return f"[{', '.join(message_repr(each) for each in items)}]"
    return repr(value)


def _repr_of(field: Field, value: Any) -> str:
    if field.type.base == "byte":
        octets = cast("list[int]", value.tolist() if field.type.is_array else [value])
        shown = [repr(bytes([octet])) for octet in octets]
        return f"[{', '.join(shown)}]" if field.type.is_array else shown[0]
    if field.type.is_numeric_array and field.type.array != "fixed":
        return repr(value.tolist())
    return message_repr(value)
