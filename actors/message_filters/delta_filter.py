"""`DeltaFilter`: messages that differ from the one before."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from operator import attrgetter
from typing import Any, TypeVar

from actors.message_filters.simple_filter import PassThrough, SimpleFilter

M = TypeVar("M")


def _differ(before: Any, after: Any) -> bool:
    """Whether two values are unequal; arrays, if they are of unequal shape or one of their elements is."""
    if hasattr(before, "shape") and hasattr(after, "shape"):
        return before.shape != after.shape or bool((before != after).any())
    return bool(before != after)


class DeltaFilter(PassThrough[M]):
    """Lets a message through if one of its `fields` differs from that of the last one that was let through; the first one always.

    A field is a path, such as ``"pose.position.x"``, or a function of the message. ``differs(before, after)`` says whether two values of it
    differ; by default any change counts. Raises ``AttributeError`` for a message that has no such field.
    """

    def __init__(
        self,
        fields: Iterable[str | Callable[[M], object]],
        source: SimpleFilter[M] | None = None,
        *,
        differs: Callable[[Any, Any], bool] = _differ,
    ) -> None:
        self._getters = [attrgetter(field) if isinstance(field, str) else field for field in fields]
        if not self._getters:
            raise ValueError("DeltaFilter: without a field no message differs; give at least one")
        self._differs = differs
        self._last: list[object] | None = None
        super().__init__(source)

    def __repr__(self) -> str:
        return f"<DeltaFilter of {len(self._getters)} fields>"

    def add(self, message: M) -> None:
        """Take in a message."""
        values = [getter(message) for getter in self._getters]
        if self._last is None or any(map(self._differs, self._last, values)):
            self._last = values
            self.signal_message(message)
