"""A fast estimate of the memory that a message takes, used to limit a recording."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

from actors.interfaces.fields import STRINGS
from actors.interfaces.message import Message

OBJECT, SCALAR, TEXT, ARRAY, ELEMENT = 64, 32, 56, 112, 8
"""The bytes of a message object with its place in a recording, a boxed number, an empty text, an empty array, and a place in a tuple."""


@cache
def weight_of(cls: type[Message]) -> Callable[[Message], int]:
    """Return a function that estimates the size of a message of this type, in bytes. It is never less than the size of its arrays.

    The function is compiled from the fields, because it runs for every recorded message: for an Imu it is a sum of five numbers.
    """
    names: dict[str, object] = {}
    fixed, terms = _terms(cls, "message", names)
    weigh: Callable[[Message], int] = eval(f"lambda message: {' + '.join([str(fixed), *terms])}", names)
    return weigh


def _terms(cls: type[Message], path: str, names: dict[str, object]) -> tuple[int, list[str]]:
    """The bytes common to all messages of a type, and a term for each part whose size varies."""
    fixed, terms = OBJECT, list[str]()
    for field in cls.__ros_fields__:
        kind, value = field.type, f"{path}.{field.name}"
        if kind.is_numeric_array:
            fixed += ARRAY
            terms.append(f"{value}.nbytes")
        elif field.message is not None and not kind.is_array:
            inside, more = _terms(field.message, value, names)
            fixed += inside
            terms += more
        elif field.message is not None:
            weigh = f"weigh{len(names)}"
            names[weigh] = weight_of(field.message)
            terms.append(f"{ELEMENT} * len({value}) + sum(map({weigh}, {value}))")
        elif kind.base in STRINGS and kind.is_array:
            terms.append(f"{ELEMENT + TEXT} * len({value}) + sum(map(len, {value}))")
        elif kind.base in STRINGS:
            fixed += TEXT
            terms.append(f"len({value})")
        else:
            fixed += SCALAR
    return fixed, terms
