"""A small run of the fuzzer, and a check that the fuzzer would notice. The long run: `python -m tests.properties.fuzz_cdr`."""

from __future__ import annotations

import random
import sys

import pytest

from actors.interfaces import Message, decode, encode
from actors.interfaces.sensor_msgs.msg import JointState
from tests.properties import fuzz_cdr


@pytest.mark.skipif(sys.gettrace() is not None, reason="the memory of a tracer is counted, too")
def test_mutated_messages_of_every_type_are_read_or_refused_within_bounded_memory(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(fuzz_cdr, "TIME_LIMIT", float("inf"))  # a test asserts behavior; the long run measures time
    report = fuzz_cdr.run(4_000, seed=7, seeds=2, most=3, traced=10)
    assert report.failures == []
    assert len(report.per_type) >= 100
    assert report.past_first > report.mutations / 2
    assert report.decoded > 0
    assert report.refused > 0


@pytest.mark.parametrize("mutation", fuzz_cdr.MUTATIONS, ids=lambda mutation: mutation.__name__)
def test_every_kind_of_mutation_changes_some_bytes(mutation: object) -> None:
    data = encode(JointState(name=["a", "b"], position=[1.0, 2.0]))
    results = set()
    for seed in range(20):
        changed = bytearray(data)
        mutation(changed, random.Random(seed))  # type: ignore[operator]
        results.add(bytes(changed))
    assert len(results - {data}) > 1


def test_the_fuzzer_notices_an_error_of_another_sort_and_too_much_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    def greedy(cls: type[Message], data: bytes) -> Message:
        hoard = bytes(100 * len(data) + 2 * fuzz_cdr.ALLOWANCE)
        if hoard and data[:2] != b"\0\1":
            raise MemoryError
        return decode(cls, data)

    monkeypatch.setattr(fuzz_cdr, "decode", greedy)
    report = fuzz_cdr.run(500, seed=1, seeds=1, traced=1)
    assert any("MemoryError" in failure for failure in report.failures)
    assert any("bytes of memory" in failure for failure in report.failures)
