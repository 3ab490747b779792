"""Texts in fragments: a text that is too long for a client is sent, or comes, as several."""

from __future__ import annotations

from itertools import count
from typing import Any, Final

from cli.web.clients.conversion import write_json
from cli.web.clients.errors import BadRequest
from cli.web.clients.fields import number, text

MOST_CHARACTERS: Final = 4 * 1024 * 1024
"""The longest text that may come in fragments, and the room for all that are not complete."""
MOST_FRAGMENTS: Final = 4096
SMALLEST: Final = 256
"""The least characters of a fragment, whatever a client asks for: a picture is some 5,000 of them."""

_numbers = count(1)


def fragments_of(whole: str, size: int | None) -> tuple[str, ...]:
    """The text as one frame, or as fragments of at most `size` characters of it."""
    if size is None or len(whole) <= max(size, SMALLEST):
        return (whole,)
    size, id = max(size, SMALLEST), str(next(_numbers))
    parts = [whole[begin : begin + size] for begin in range(0, len(whole), size)]
    return tuple(
        write_json({"op": "fragment", "id": id, "data": part, "num": index, "total": len(parts)})
        for index, part in enumerate(parts)
    )


class Fragments:
    """The fragments of one client that wait for others.

    Invariant: they have at most `MOST_CHARACTERS` characters and `MOST_FRAGMENTS` parts together; what would be more is refused, and what is
    there is forgotten.
    """

    def __init__(self) -> None:
        self._parts: dict[str, dict[int, str]] = {}
        self._characters = 0

    def add(self, request: dict[str, Any]) -> str | None:
        """The whole text, once its last fragment is here; fragments may come in any order. Raises `BadRequest`."""
        id = str(request.get("id"))
        data, index, total = text(request, "data"), number(request, "num"), number(request, "total")
        if not 0 < total <= MOST_FRAGMENTS or index >= total:
            raise BadRequest(f"fragment {index} of {total}: there are 1 to {MOST_FRAGMENTS}, counted from 0")
        parts = self._parts.setdefault(id, {})
        self._characters += len(data) - len(parts.get(index, ""))
        parts[index] = data
        if self._characters > MOST_CHARACTERS or sum(map(len, self._parts.values())) > MOST_FRAGMENTS:
            self._parts.clear()
            self._characters = 0
            raise BadRequest(
                f"more than {MOST_CHARACTERS} characters or {MOST_FRAGMENTS} fragments wait for the rest of their text"
            )
        if any(index not in parts for index in range(total)):
            return None
        del self._parts[id]
        self._characters -= sum(map(len, parts.values()))
        return "".join(parts[index] for index in range(total))
