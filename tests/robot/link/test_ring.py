"""The ring of records in shared memory: what a reader gets is whole, whatever the writer does meanwhile, and however it ends."""

from __future__ import annotations

import struct
import threading
import time
from collections.abc import Iterator
from multiprocessing import get_context
from multiprocessing.shared_memory import SharedMemory

import numpy as np
import pytest

from robot.link.ring import Ring

SLOTS, WIDTH = 4, 3


@pytest.fixture
def ring() -> Ring:
    return Ring(memoryview(bytearray(Ring.size(SLOTS, WIDTH))), 0, SLOTS, WIDTH)


def numbers(found: Iterator[tuple[int, np.ndarray]]) -> list[int]:
    return [number for number, _ in found]


def test_memory_that_is_all_zero_is_a_ring_without_records(ring: Ring) -> None:
    assert ring.written == 0
    assert ring.latest() is None
    assert list(ring.after(0)) == []


def test_records_come_back_as_they_were_written_numbered_from_one(ring: Ring) -> None:
    assert ring.write((1.5, -2.0, 1e-300)) == 1
    assert ring.write((np.inf, 0.0, 7.0)) == 2
    assert [(number, record.tolist()) for number, record in ring.after(0)] == [
        (1, [1.5, -2.0, 1e-300]),
        (2, [np.inf, 0.0, 7.0]),
    ]
    latest = ring.latest()
    assert latest is not None
    assert latest.tolist() == [np.inf, 0.0, 7.0]


def test_a_slow_reader_gets_the_newest_records_that_are_still_there_and_no_others(ring: Ring) -> None:
    for value in range(10):
        ring.write((value, value, value))
    assert [(number, record[0]) for number, record in ring.after(2)] == [(7, 6.0), (8, 7.0), (9, 8.0), (10, 9.0)]
    assert numbers(ring.after(9)) == [10]
    assert numbers(ring.after(10)) == []


def test_a_record_of_another_size_is_refused(ring: Ring) -> None:
    with pytest.raises(ValueError, match=r"a record of this ring has 3 numbers, not the shape \(2,\)"):
        ring.write((1.0, 2.0))
    assert ring.written == 0


def test_the_next_writer_goes_on_where_the_last_one_stopped() -> None:
    memory = memoryview(bytearray(Ring.size(SLOTS, WIDTH)))
    Ring(memory, 0, SLOTS, WIDTH).write((1.0, 1.0, 1.0))
    assert Ring(memory, 0, SLOTS, WIDTH).write((2.0, 2.0, 2.0)) == 2


@pytest.mark.parametrize("done", range(0, 16 + 8 * WIDTH, 3))
def test_a_writer_that_is_killed_at_any_byte_leaves_the_last_whole_record(done: int) -> None:
    """The bytes of a fifth record are copied into its slot as far as the killed writer had come, the count not at all."""
    memory, other = bytearray(Ring.size(SLOTS, WIDTH)), bytearray(Ring.size(SLOTS, WIDTH))
    ring, ahead = Ring(memoryview(memory), 0, SLOTS, WIDTH), Ring(memoryview(other), 0, SLOTS, WIDTH)
    for value in range(4):
        ring.write((value, value, value))
        ahead.write((value, value, value))
    ahead.write((4.0, 4.0, 4.0))
    at = 8 + (5 % SLOTS) * (16 + 8 * WIDTH)
    memory[at : at + done] = other[at : at + done]
    latest = ring.latest()
    assert latest is not None
    assert latest.tolist() == [3.0, 3.0, 3.0]
    assert {number for number, _ in ring.after(0)} <= {1, 2, 3, 4}
    assert all(record.tolist() == [number - 1.0] * 3 for number, record in ring.after(0))


def test_a_count_that_runs_ahead_of_its_record_is_not_believed(ring: Ring) -> None:
    """As on a processor that reorders writes: the count is there, the record not yet."""
    memory = bytearray(Ring.size(SLOTS, WIDTH))
    ring = Ring(memoryview(memory), 0, SLOTS, WIDTH)
    ring.write((1.0, 2.0, 3.0))
    struct.pack_into("<Q", memory, 0, 2)
    latest = ring.latest()
    assert latest is not None
    assert latest.tolist() == [1.0, 2.0, 3.0]
    assert numbers(ring.after(0)) == [1]


@pytest.mark.parametrize("kept", range(WIDTH))
def test_a_record_whose_last_numbers_have_not_arrived_is_not_believed_whatever_its_head_says(kept: int) -> None:
    """As on a processor that reorders writes: count, number and checksum are there, and the first `kept` of three numbers."""
    memory, other = bytearray(Ring.size(SLOTS, WIDTH)), bytearray(Ring.size(SLOTS, WIDTH))
    ring, ahead = Ring(memoryview(memory), 0, SLOTS, WIDTH), Ring(memoryview(other), 0, SLOTS, WIDTH)
    for one in (ring, ahead):
        one.write((1.0, 2.0, 3.0))
    ahead.write((4.0, 5.0, 6.0))
    at, width = 8 + 2 * (16 + 8 * WIDTH), 16 + 8 * kept
    memory[:8], memory[at : at + width] = other[:8], other[at : at + width]
    assert ring.written == 2
    latest = ring.latest()
    assert latest is not None
    assert latest.tolist() == [1.0, 2.0, 3.0]
    assert numbers(ring.after(0)) == [1]


def _write_for_ever(name: str) -> None:
    memory = SharedMemory(name)
    ring = Ring(memory.buf, 0, SLOTS, WIDTH)
    value = 0.0
    while True:
        value += 1.0
        ring.write((value, 2.0 * value, -value))


def test_a_reader_never_sees_a_torn_record_while_another_process_writes_and_is_killed() -> None:
    memory = SharedMemory(create=True, size=Ring.size(SLOTS, WIDTH))
    try:
        ring = Ring(memory.buf, 0, SLOTS, WIDTH)
        writer = get_context("spawn").Process(target=_write_for_ever, args=(memory.name,), daemon=True)
        writer.start()
        seen, before = 0, 0.0
        while writer.is_alive():
            if seen == 500:
                threading.Timer(0.01, writer.kill).start()  # at some instant of some record
            record = ring.latest()
            if record is None:
                continue
            a, b, c = record.tolist()
            assert (b, c) == (2.0 * a, -a)
            assert a >= before
            seen, before = seen + (a > before), a
        assert seen >= 500
        last = ring.latest()
        assert last is not None
        assert last[1] == 2.0 * last[0] == -2.0 * last[2]
    finally:
        memory.unlink()
        memory.close()


@pytest.mark.slow(reason="a thousand writers are killed")
def test_a_writer_that_is_killed_at_any_instant_leaves_a_whole_record() -> None:
    for number in range(1000):
        memory = SharedMemory(create=True, size=Ring.size(SLOTS, WIDTH))
        try:
            ring = Ring(memory.buf, 0, SLOTS, WIDTH)
            writer = get_context("fork").Process(target=_write_for_ever, args=(memory.name,), daemon=True)
            writer.start()
            while ring.written < 100:
                pass
            time.sleep(number % 10 * 4e-4)
            writer.kill()
            writer.join()
            assert ring.latest() is not None, ring.written
        finally:
            memory.unlink()
            memory.close()
