"""Samples between two participants: bytes, order, quality of service, and who wrote them."""

from __future__ import annotations

import asyncio
import os
import time
from functools import partial
from pathlib import Path

import pytest

pytest.importorskip("cyclonedds")

from actors.transport.dds import endpoints
from actors.transport.dds.endpoints import Sample, Writer
from actors.transport.dds.format.qos import EndpointQos
from tests.actors.transport.dds.peers import HELLO, STRING, matched, numbered, two_peers, until

RELIABLE = EndpointQos(keep_all=True)


def put_slowly(writer: Writer, count: int) -> None:
    """Put samples while the loop stands still, so that the reading thread takes them one by one."""
    for number in range(count):
        writer.put(numbered(number))
        time.sleep(0.0005)


@pytest.mark.parametrize("second", [7, 8], ids=["within a process", "by the network"])
async def test_a_sample_arrives_as_it_was_written_and_tells_who_wrote_it_and_when(second: int) -> None:
    async with two_peers(second) as (one, other):
        writer, reader = one.writer("rt/chatter", RELIABLE), other.reader("rt/chatter", RELIABLE)
        await matched(writer, reader)
        before = time.time_ns()
        writer.put(HELLO)
        await until(lambda: other.samples)
        (sample,) = other.samples
        assert sample.payload == HELLO
        assert sample.writer == writer.guid
        assert before - 1e9 < sample.stamp < time.time_ns() + 1e9
        assert sample.publication == other.endpoints[writer.guid].handle
        assert writer.matched_guids() == {reader.guid}
        assert reader.matched_guids() == {writer.guid}


async def test_samples_are_padded_and_may_be_large_and_all_arrive_in_order() -> None:
    async with two_peers() as (one, other):
        writer, reader = one.writer("rt/a", RELIABLE), other.reader("rt/a", RELIABLE)
        await matched(writer, reader)
        sizes = [1, 2, 3, 4, 100_000, 5, 16 * 1024, 16 * 1024 - 4, 1_000_000, 6, 40_000]
        for number, size in enumerate(sizes):
            writer.put(b"\0\1\0\0" + bytes([number]) * size)
        await until(lambda: len(other.samples) == len(sizes))
        assert [payload[4] for payload in other.payloads] == list(range(len(sizes)))
        assert [payload[4 : 4 + size] for payload, size in zip(other.payloads, sizes, strict=True)] == [
            bytes([number]) * size for number, size in enumerate(sizes)
        ]


async def test_large_samples_leave_no_memory_behind() -> None:
    def resident() -> int:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    async with two_peers() as (one, other):
        writer, reader = one.writer("rt/a", RELIABLE), other.reader("rt/a", RELIABLE)
        await matched(writer, reader)
        before, size = 0, 4_000_000
        for number in range(40):
            if number == 10:
                before = resident()
            writer.put(b"\0\1\0\0" + bytes(size))
            await until(lambda: bool(other.samples))
            other.batches.clear()
        assert resident() - before < 15 * size
        assert reader.matched_guids() == {writer.guid}


async def test_samples_come_in_batches_and_in_order() -> None:
    async with two_peers() as (one, other):
        writer, reader = one.writer("rt/a", RELIABLE), other.reader("rt/a", RELIABLE)
        await matched(writer, reader)
        for number in range(3000):
            writer.put(numbered(number))
        await until(lambda: len(other.samples) == 3000)
        assert other.payloads == [numbered(number) for number in range(3000)]
        assert max(map(len, other.batches)) <= 32
        assert len(other.batches) < 2000


async def test_nothing_of_a_participants_own_comes_back_to_it() -> None:
    async with two_peers() as (one, other):
        own, reader = one.reader("rt/a", RELIABLE), other.reader("rt/a", RELIABLE)
        writer = one.writer("rt/a", RELIABLE)
        await matched(writer, reader)
        writer.put(HELLO)
        await until(lambda: other.samples)
        assert one.samples == [] and own.matched == 0
        assert all(endpoint.participant == other.participant.guid for endpoint in one.endpoints.values())


async def test_a_late_reader_gets_what_a_transient_local_writer_keeps() -> None:
    async with two_peers() as (one, other):
        writer = one.writer("rt/map", EndpointQos(transient_local=True, depth=2))
        for number in range(5):
            writer.put(numbered(number))
        other.reader("rt/map", EndpointQos(transient_local=True, depth=10))
        await until(lambda: len(other.samples) == 2)
        assert other.payloads == [numbered(3), numbered(4)]


async def test_a_loop_that_is_behind_drops_the_oldest_of_a_keep_last_reader_and_counts_them() -> None:
    async with two_peers() as (one, other):
        writer, reader = one.writer("rt/a", RELIABLE), other.reader("rt/a", EndpointQos(depth=3))
        await matched(writer, reader)
        put_slowly(writer, 500)
        await until(lambda: numbered(499) in other.payloads)
        assert len(other.samples) + reader.dropped <= 500
        assert reader.dropped > 0
        assert [one.dropped for one in other.participant.report()] == [reader.dropped]


async def test_a_keep_all_reader_drops_only_what_is_above_its_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(endpoints, "KEEP_ALL", 1000)
    async with two_peers() as (one, other):
        writer, reader = one.writer("rt/a", RELIABLE), other.reader("rt/a", RELIABLE)
        await matched(writer, reader)
        put_slowly(writer, 500)
        await until(lambda: reader.dropped + len(other.samples) == 500)
        assert reader.dropped > 0
        assert [one.dropped for one in other.participant.report()] == [reader.dropped]
        assert other.payloads[:100] == [numbered(number) for number in range(100)]


async def test_samples_that_may_wait_wake_the_loop_once_in_a_while() -> None:
    async with two_peers() as (one, other):
        writer, reader = one.writer("rt/a", RELIABLE), other.reader("rt/a", RELIABLE, patience=0.05)
        await matched(writer, reader)
        writer.put(HELLO)
        await until(lambda: other.samples)
        reader.close()


async def test_peers_that_do_not_fit_are_told_with_the_policy() -> None:
    async with two_peers() as (one, other):
        one.writer("rt/a", EndpointQos(reliable=False))
        other.reader("rt/a", EndpointQos())
        one.writer("rt/b", EndpointQos(deadline=2.0))
        other.reader("rt/b", EndpointQos(deadline=1.0))
        one.writer("rt/c", EndpointQos())
        other.reader("rt/c", EndpointQos(transient_local=True))
        one.writer("rt/d", EndpointQos(lease=2.0))
        other.reader("rt/d", EndpointQos(lease=1.0))
        expected = {"RELIABILITY", "DEADLINE", "DURABILITY", "LIVELINESS"}
        for peer in (one, other):
            await until(lambda peer=peer: {status.policy for status in peer.statuses} >= expected)  # type: ignore[misc]
            assert all(status.kind == "incompatible_qos" for status in peer.statuses)


async def test_missed_deadlines_are_told_on_both_sides() -> None:
    qos = EndpointQos(deadline=0.1)
    async with two_peers() as (one, other):
        writer, reader = one.writer("rt/a", qos), other.reader("rt/a", qos)
        await matched(writer, reader)
        writer.put(HELLO)
        for peer in (one, other):
            await until(lambda peer=peer: "deadline_missed" in [status.kind for status in peer.statuses])  # type: ignore[misc]


async def test_a_writer_that_does_not_assert_its_liveliness_is_told_to_be_lost_until_it_writes() -> None:
    qos = EndpointQos(manual_liveliness=True, lease=0.5)
    async with two_peers() as (one, other):
        writer, reader = one.writer("rt/a", qos), other.reader("rt/a", qos)
        await matched(writer, reader)

        def alive() -> int:
            return [status.total for status in other.statuses if status.kind == "liveliness_changed"][-1]

        writer.put(HELLO)
        begin = time.monotonic()
        while time.monotonic() < begin + 0.7 and alive():
            writer.assert_liveliness()
            await asyncio.sleep(0.02)
        assert alive() == 1
        await until(lambda: alive() == 0)
        await until(lambda: "liveliness_lost" in [status.kind for status in one.statuses])
        writer.put(HELLO)
        await until(lambda: alive() == 1)
        writer.close()
        writer.assert_liveliness()  # harmless


async def test_after_the_close_nothing_is_written_and_nothing_is_called() -> None:
    async with two_peers() as (one, other):
        writer, reader = one.writer("rt/a", RELIABLE), other.reader("rt/a", RELIABLE)
        await matched(writer, reader)
        writer.put(HELLO)
        await until(lambda: other.samples)
        writer.close()
        writer.close()
        writer.put(HELLO)
        await until(lambda: not reader.matched)
        assert len(other.samples) == 1
        another = one.writer("rt/a", RELIABLE)
        await matched(another, reader)
        told = len(other.statuses)
        another.put(HELLO)
        reader.close()
        reader.close()
        await until(lambda: not another.matched)
        assert len(other.samples) == 1 and len(other.statuses) == told


async def test_what_has_been_exchanged_is_reported_for_each_participant() -> None:
    async with two_peers() as (one, other):
        writer = one.writer("rt/a", RELIABLE)
        writer.put(HELLO)  # for nobody
        reader = other.reader("rt/a", RELIABLE)
        await matched(writer, reader)
        writer.put(HELLO)
        await until(lambda: other.samples)
        (sent,) = one.participant.report()
        assert (sent.participant.guid, sent.sent_bytes, sent.received_bytes) == (other.participant.guid, len(HELLO), 0)
        (received,) = other.participant.report()
        assert (received.sent_bytes, received.received_bytes) == (0, len(HELLO))
        reader.close()
        await until(lambda: not writer.matched)
        assert one.participant.report()[0].sent_bytes == len(HELLO)
    assert one.participant.report() == ()


@pytest.mark.parametrize("topic", ["", "rt/with blank", "rt/a\0b", "rt/*", "DCPSTopic"])
async def test_a_name_that_is_no_topic_is_refused_in_one_line(topic: str) -> None:
    async with two_peers() as (one, _):
        with pytest.raises(ValueError, match="topic") as refused:
            one.writer(topic, EndpointQos())
        assert "\n" not in str(refused.value)
        with pytest.raises(ValueError, match="topic"):
            one.reader(topic, EndpointQos())


async def test_a_quality_of_service_that_contradicts_itself_is_refused_in_one_line() -> None:
    async with two_peers() as (one, _):
        with pytest.raises(ValueError, match="refuses an endpoint of rt/a"):
            one.writer("rt/a", EndpointQos(deadline=-1.0))


async def test_bytes_that_are_no_sample_are_not_sent_but_counted() -> None:
    async with two_peers() as (one, other):
        writer, reader = one.writer("rt/a", RELIABLE), other.reader("rt/a", RELIABLE)
        await matched(writer, reader)
        for payload in (b"", b"\0", b"\0\1\0\0", b"\0\3\0\0aaaa", b"\x99\1\0\0aaaa"):
            writer.put(payload)
        writer.put(HELLO)
        await until(lambda: other.samples)
        assert other.payloads == [HELLO]
        assert writer.unsent == 5


@pytest.mark.parametrize("first", ["feedback", "reply"])
async def test_a_reply_does_not_overtake_what_was_written_before_it_on_a_topic(first: str) -> None:
    got: list[tuple[str, int]] = []

    def take(name: str, batch: list[Sample]) -> None:
        got.extend((name, int.from_bytes(sample.payload[4:8], "little")) for sample in batch)

    async with two_peers() as (one, other):
        names = {"feedback": "rt/feedback", "reply": "rr/ask"}
        readers = [
            other.participant.reader(names[name], STRING, RELIABLE, partial(take, name), last=name == "reply")
            for name in (first, *(names.keys() - {first}))
        ]
        feedback, reply = one.writer("rt/feedback", RELIABLE), one.writer("rr/ask", RELIABLE)
        await until(lambda: all(end.matched for end in (feedback, reply, *readers)))
        # A reader takes nothing before a writer's first heartbeat; what came before is sent again then.
        for writer in (feedback, reply):
            writer.put(numbered(0))
        await until(lambda: len(got) == 2)
        got.clear()
        for number in range(200):
            for _ in range(3):
                feedback.put(numbered(number))
            reply.put(numbered(number))
            await until(lambda: len(got) == 4)
            assert got == [*3 * [("feedback", number)], ("reply", number)]
            got.clear()
