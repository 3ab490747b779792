"""What a replayed node did, beside what it did in the recording: the first difference, by name, time and field."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final, cast

import numpy as np

from actors.interfaces.message import Message

ABSENT: Final = "nothing"
"""Stands for what was not sent."""

WIDTH: Final = 200
"""How many characters of a value are shown."""


@dataclass(frozen=True, slots=True)
class Difference:
    """The first thing that a replayed node did otherwise.

    `kind` is what it did (publish, call, goal, answer, log ...), `name` of which topic, service or action, `number` which one of these it
    was, from 0. `time` is in seconds on the system's clock.
    """

    kind: str
    name: str
    number: int
    time: float
    field: str
    recorded: object
    replayed: object

    def __str__(self) -> str:
        where = f"{self.kind} {self.name}[{self.number}]".replace(" [", "[")
        what = f", field {self.field}" if self.field else ""
        return f"{where} at {self.time:.6f} s{what}: recorded {shown(self.recorded)}, replayed {shown(self.replayed)}"


def shown(value: object) -> str:
    """A value in few characters."""
    text = value if value is ABSENT else repr(value)
    return text if len(text) <= WIDTH else text[: WIDTH - 3] + "..."


def first_difference(recorded: Any, replayed: Any, field: str = "") -> tuple[str, object, object] | None:
    """The first field in which two values differ, with its two values; None if they are bit for bit the same.

    A NaN equals itself, and -0.0 is not 0.0.
    """
    if type(recorded) is not type(replayed):
        return (field, recorded, replayed)
    if isinstance(recorded, Message):
        for name in recorded.__struct_fields__:
            inner = f"{field}.{name}" if field else name
            found = first_difference(getattr(recorded, name), getattr(replayed, name), inner)
            if found is not None:
                return found
        return None
    if isinstance(recorded, np.ndarray):
        return _in_array(recorded, replayed, field)
    if isinstance(recorded, (tuple, list)):
        return _in_sequence(list(cast("Iterable[Any]", recorded)), list(replayed), field)
    alike = recorded.hex() == replayed.hex() if isinstance(recorded, float) else recorded == replayed
    return None if alike else (field, recorded, replayed)


def _in_array(recorded: Any, replayed: Any, field: str) -> tuple[str, object, object] | None:
    if recorded.shape != replayed.shape:
        return (f"shape({field})", recorded.shape, replayed.shape)
    if recorded.dtype != replayed.dtype:
        return (f"dtype({field})", str(recorded.dtype), str(replayed.dtype))
    if recorded.tobytes() == replayed.tobytes():
        return None
    pairs = zip(recorded.ravel(), replayed.ravel(), strict=True)
    place = next(number for number, (one, other) in enumerate(pairs) if one.tobytes() != other.tobytes())
    return (f"{field}[{place}]", recorded.ravel()[place].item(), replayed.ravel()[place].item())


def _in_sequence(recorded: list[object], replayed: list[object], field: str) -> tuple[str, object, object] | None:
    if len(recorded) != len(replayed):
        return (f"len({field})", len(recorded), len(replayed))
    for index, (one, other) in enumerate(zip(recorded, replayed, strict=True)):
        if (found := first_difference(one, other, f"{field}[{index}]")) is not None:
            return found
    return None
