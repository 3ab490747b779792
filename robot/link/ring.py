"""A ring of records in shared memory: one process writes, any number read, and nobody waits for anybody.

Each record carries its number and a checksum over both. A reader copies a slot once and believes the copy only if number and checksum are
right, so a record that is written meanwhile, or that a killed writer left half done, is never taken for a whole one, on processors that
reorder writes, too.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from zlib import crc32

import numpy as np

from robot.geometry.vectors import Vector

_COUNT = 8
"""Bytes of the count of records."""
_HEAD = struct.Struct("<QQ")
"""Of a slot: number, checksum."""
_TRIES = 8


class Ring:
    """`slots` records of `width` numbers each, at `offset` in `memory`; memory that is all zero is a ring without records.

    Invariants:

    - Record n, counted from 1, lies in slot n modulo `slots`; the count of records is written after the record is complete.
    - There is one writer at a time. Its successor goes on at the count that it finds, so a writer may be killed at any instant.
    """

    __slots__ = ("_memory", "_offset", "_slot", "_slots", "_width")

    def __init__(self, memory: memoryview, offset: int, slots: int, width: int) -> None:
        self._memory, self._offset, self._slots, self._width = memory, offset, slots, width
        self._slot = _HEAD.size + 8 * width

    @staticmethod
    def size(slots: int, width: int) -> int:
        """Bytes that a ring takes."""
        return _COUNT + slots * (_HEAD.size + 8 * width)

    @property
    def written(self) -> int:
        """How many records have been written, by all writers so far."""
        return self._count()[0]

    def write(self, values: Sequence[float] | Vector) -> int:
        """Add a record and return its number. Raises `ValueError` unless it has `width` numbers."""
        payload = np.asarray(values, dtype=np.float64)
        if payload.shape != (self._width,):
            raise ValueError(f"a record of this ring has {self._width} numbers, not the shape {payload.shape}")
        number, data = self.written + 1, payload.tobytes()
        at = self._place(number)
        _HEAD.pack_into(self._memory, at, number, _checksum(number, data))
        self._memory[at + _HEAD.size : at + self._slot] = data
        self._count()[0] = number
        return number

    def latest(self) -> Vector | None:
        """The newest whole record, read-only; `None` before the first."""
        for _ in range(_TRIES):
            number = self.written
            if number == 0:
                return None
            record = self._read(number)
            if record is not None:
                return record
        older = max(1, self.written - 1)
        return self._read(older)

    def after(self, number: int) -> Iterator[tuple[int, Vector]]:
        """The records newer than `number`, with their numbers, oldest first, as far as they are still there."""
        last = self.written
        for one in range(max(number, last - self._slots) + 1, last + 1):
            record = self._read(one)
            if record is not None:
                yield one, record

    def _count(self) -> memoryview[int]:
        """The count, read and written by one instruction: `struct` goes byte by byte, and a writer may be killed between two of them."""
        return self._memory[self._offset : self._offset + _COUNT].cast("Q")

    def _place(self, number: int) -> int:
        return self._offset + _COUNT + (number % self._slots) * self._slot

    def _read(self, number: int) -> Vector | None:
        at = self._place(number)
        copy = bytes(self._memory[at : at + self._slot])
        found, checksum = _HEAD.unpack_from(copy)
        if found != number or checksum != _checksum(number, copy[_HEAD.size :]):
            return None
        record: Vector = np.frombuffer(copy, dtype=np.float64, offset=_HEAD.size)
        return record


def _checksum(number: int, data: bytes) -> int:
    return crc32(data, number & 0xFFFFFFFF)
