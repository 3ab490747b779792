"""Writers whose readers do not acknowledge: the loop never waits, order is kept, and what is dropped is counted."""

from __future__ import annotations

import time

import pytest

pytest.importorskip("cyclonedds")

from actors.transport.dds import endpoints, sending
from actors.transport.dds.format.qos import EndpointQos
from tests.actors.transport.dds.peers import HELLO, deaf, matched, numbered, two_peers, until

KEPT = EndpointQos(keep_all=True)
LARGE = bytes(100_000)


async def test_a_full_writer_neither_waits_nor_loses_anything_with_keep_all() -> None:
    async with two_peers() as (one, other):
        writer, reader = one.writer("rt/a", KEPT), other.reader("rt/a", KEPT)
        await matched(writer, reader)
        deaf(other.participant, True)
        longest = 0.0
        payloads = [numbered(number) + bytes(1000) for number in range(3000)]
        for payload in payloads:
            begin = time.thread_time()
            writer.put(payload)
            longest = max(longest, time.thread_time() - begin)
        assert longest < 0.02
        assert writer.waiting > 1000
        deaf(other.participant, False)
        await until(lambda: len(other.samples) == len(payloads))
        assert other.payloads == payloads
        assert (writer.unsent, writer.waiting) == (0, 0)


async def test_a_full_writer_lets_the_others_of_its_participant_pass() -> None:
    async with two_peers() as (one, other):
        writer, reader = one.writer("rt/a", KEPT), other.reader("rt/a", KEPT)
        await matched(writer, reader)
        deaf(other.participant, True)
        for _ in range(20):
            writer.put(b"\0\1\0\0" + LARGE)
        await until(lambda: writer.waiting)
        passing = one.writer("rt/b", KEPT)
        passing.put(b"\0\1\0\0" + LARGE)
        passing.put(HELLO)
        await until(lambda: not passing.waiting)
        assert writer.waiting
        deaf(other.participant, False)
        await until(lambda: len(other.samples) == 20)


async def test_a_full_writer_with_keep_last_drops_the_oldest_and_counts_them() -> None:
    async with two_peers() as (one, other):
        writer, reader = one.writer("rt/a", EndpointQos(depth=10)), other.reader("rt/a", EndpointQos(depth=10))
        await matched(writer, reader)
        deaf(other.participant, True)
        for number in range(100):
            writer.put(numbered(number) + LARGE)
        await until(lambda: writer.waiting <= 11)
        assert writer.waiting > 0
        unsent = writer.unsent
        assert unsent > 0
        deaf(other.participant, False)
        await until(lambda: any(payload[4] == 99 for payload in other.payloads))
        arrived = [payload[4] for payload in other.payloads]
        assert arrived == sorted(arrived)
        assert writer.unsent == unsent
        assert [one.dropped for one in one.participant.report()] == [unsent], "it is counted for whom they were"
        reader.close()
        await until(lambda: not writer.matched)
        assert [one.dropped for one in one.participant.report()] == [unsent]


async def test_a_full_writer_with_keep_all_holds_only_so_many_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(endpoints, "KEEP_ALL", 1_000_000)
    async with two_peers() as (one, other):
        writer, reader = one.writer("rt/a", KEPT), other.reader("rt/a", KEPT)
        await matched(writer, reader)
        deaf(other.participant, True)
        for number in range(50):
            writer.put(numbered(number) + LARGE)
        assert writer.unsent > 0
        deaf(other.participant, False)
        await until(lambda: len(other.samples) == 50 - writer.unsent)
        assert [payload[4] for payload in other.payloads[:10]] == list(range(10))


async def test_a_writer_that_is_closed_still_writes_what_waits() -> None:
    async with two_peers() as (one, other):
        writer, reader = one.writer("rt/a", KEPT), other.reader("rt/a", KEPT)
        await matched(writer, reader)
        for number in range(30):
            writer.put(numbered(number) + LARGE)
        writer.close()
        await until(lambda: len(other.samples) == 30)


async def test_a_writer_that_is_closed_gives_up_after_a_moment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sending, "LINGERS", 0.1)
    async with two_peers() as (one, other):
        writer, reader = one.writer("rt/a", KEPT), other.reader("rt/a", KEPT)
        await matched(writer, reader)
        deaf(other.participant, True)
        for number in range(30):
            writer.put(numbered(number) + LARGE)
        await one.participant.close()
        assert writer.waiting == 0
        assert writer.unsent > 0


async def test_who_is_silent_for_longer_than_its_lease_has_vanished_and_appears_again() -> None:
    async with two_peers() as (one, other):
        writer, reader = one.writer("rt/a", KEPT), other.reader("rt/a", KEPT)
        await matched(writer, reader)
        deaf(other.participant, True)
        await until(lambda: other.log[-1] == "participant vanished")
        assert other.log == ["participant appeared", "rt/a appeared", "rt/a vanished", "participant vanished"]
        deaf(other.participant, False)
        await until(lambda: other.log[4:] == ["participant appeared", "rt/a appeared"], 20)
        await matched(writer, reader)
        writer.put(HELLO)
        await until(lambda: other.payloads == [HELLO])
