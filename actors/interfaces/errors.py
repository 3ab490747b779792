"""The errors of this room. Each is also the builtin error a reader would expect to catch."""

from __future__ import annotations


class InterfaceError(Exception):
    """Base of everything that can be wrong with a message, its type or its bytes."""


class MessageTypeError(InterfaceError, TypeError):
    """A field was given a value of the wrong Python type. The text names type and field."""


class MessageValueError(InterfaceError, ValueError):
    """A field was given a value out of its range, bound or fixed length. The text names type and field."""


class UnknownInterface(InterfaceError, LookupError):
    """No message, service or action type of that name is known here. The text gives the closest names."""


class BadDeclaration(InterfaceError, TypeError):
    """A message class, service type or action type was declared in a way that cannot work."""


class CdrError(InterfaceError, ValueError):
    """Bytes that are not a valid CDR encoding of the type (decoding), or a text CDR cannot carry (encoding)."""
