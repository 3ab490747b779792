"""Names as clients write them: without the first slash, types in two or three parts."""

from __future__ import annotations

from actors.interfaces import InterfaceError
from actors.interfaces.naming import full_name
from actors.names.names import InvalidName, validate_full_name
from cli.web.clients.errors import Refused


def absolute(name: str) -> str:
    """A name of a topic, service or action, from the root. Raises `Refused`."""
    full = name if name.startswith("/") else f"/{name}"
    try:
        validate_full_name(full)
    except InvalidName as error:
        raise Refused(str(error)) from None
    return full


def interface(name: str, kind: str) -> str:
    """The name of a type in three parts. Raises `Refused`."""
    try:
        return full_name(name, kind)  # type: ignore[arg-type]
    except InterfaceError as error:
        raise Refused(str(error)) from None
