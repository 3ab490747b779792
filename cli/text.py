"""Messages as YAML, in the form in which `ros2 topic echo` prints them."""

from __future__ import annotations

from typing import Any, cast

from actors.interfaces import Message

__all__ = ["TRUNCATED", "message_yaml", "plain"]

TRUNCATED = 128
"""How many items of an array and characters of a text are printed, if nothing else is asked for."""

_WIDE = 2**31
"""No line is wrapped."""


def message_yaml(message: Message, truncate: int | None = TRUNCATED, flow: bool = False) -> str:
    """The message in block style (or on one line), fields in the order of their definition, ending with a line break.

    Arrays and texts longer than `truncate` are cut there and end in ``...``; None prints them whole.
    """
    import yaml

    dump: Any = yaml.safe_dump  # its stubs do not type it
    return str(
        dump(plain(message, truncate), default_flow_style=flow, sort_keys=False, allow_unicode=True, width=_WIDE)
    )


def plain(value: Any, truncate: int | None = None) -> Any:
    """A message as dicts, lists, numbers and texts. Arrays are cut before they are converted, so that a picture costs no more than a line."""
    if isinstance(value, Message):
        return {field.name: plain(getattr(value, field.name), truncate) for field in value.__ros_fields__}
    if isinstance(value, str):
        return value if truncate is None or len(value) <= truncate else value[:truncate] + "..."
    if isinstance(value, tuple) or hasattr(value, "dtype"):
        items = cast(Any, value)
        cut = truncate is not None and len(items) > truncate
        if cut:
            items = items[:truncate]
        listed: list[Any] = items.tolist() if hasattr(items, "dtype") else [plain(item, truncate) for item in items]
        return [*listed, "..."] if cut else listed
    return value
