"""Peers that lie: names that are no text, payloads that are no messages, packets that are no protocol."""

from __future__ import annotations

import ctypes
import logging
import random
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import pytest

pytest.importorskip("cyclonedds")

from actors.transport.dds import endpoints, library
from actors.transport.dds.format.qos import EndpointQos
from tests.actors.transport.dds.peers import HELLO, Peer, matched, two_peers, until
from tests.hostile.dds import attack, findings
from tests.hostile.doors import mutated

KEPT = EndpointQos(keep_all=True)


def entity(peer: Peer) -> int:
    within = peer.participant._within
    assert within is not None
    return within.participant


def topic_of_bytes(peer: Peer, name: bytes, type_name: bytes) -> int:
    """A topic whose names no library of ours would write."""
    described = library.the_descriptor("")
    described.name = type_name
    topic: int = library.load().dds_create_topic(entity(peer), ctypes.byref(described), name, None, None)
    assert topic > 0
    return topic


async def test_names_that_are_no_text_appear_with_replaced_characters() -> None:
    async with two_peers() as (one, other):
        topic = topic_of_bytes(one, b"rt/a%s\\x", b"\xff\xfe\n\x00")
        assert library.load().dds_create_writer(entity(one), topic, None, None) > 0
        await until(lambda: other.endpoints)
        (endpoint,) = other.endpoints.values()
        assert (endpoint.topic, endpoint.type) == ("rt/a%s\\x", "\ufffd\ufffd\n")


async def test_names_without_an_end_are_dropped_and_reported_once(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.WARNING)
    async with two_peers() as (one, other):
        for number in range(3):
            topic = topic_of_bytes(one, b"rt/%d" % number, b"x" * 5000)
            assert library.load().dds_create_reader(entity(one), topic, None, None) > 0
        one.reader("rt/fine", KEPT)
        await until(lambda: other.endpoints and other.participant.unreadable == 3)
        assert [endpoint.topic for endpoint in other.endpoints.values()] == ["rt/fine"]
        assert len([line for line in caplog.messages if "5000 bytes" in line]) == 1
    assert other.participant.unreadable == 3


@contextmanager
def plain_writer(peer: Peer) -> Iterator[Any]:
    """A function that writes any bytes on rt/a, by the Python binding, whose type is as large as the bytes are."""
    from cyclonedds import _clayer
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.idl import IdlStruct
    from cyclonedds.idl.annotations import appendable
    from cyclonedds.pub import DataWriter
    from cyclonedds.qos import Policy, Qos
    from cyclonedds.topic import Topic

    @dataclass
    @appendable
    class Anything(IdlStruct, typename="std_msgs.msg.dds_.String_"):  # type: ignore[call-arg,misc]
        pass

    participant = DomainParticipant(peer.participant._config.domain)
    qos = Qos(
        Policy.Reliability.Reliable(10**9),
        Policy.History.KeepAll,
        Policy.DataRepresentation(use_cdrv0_representation=True),
    )
    writer = DataWriter(participant, Topic(participant, "rt/a", Anything), qos)
    reference = writer._ref
    yield lambda payload: _clayer.ddspy_write(reference, payload)
    del writer, participant


async def test_payloads_that_are_no_messages_disturb_nobody() -> None:
    async with two_peers() as (one, other):
        reader = other.reader("rt/a", KEPT)
        with plain_writer(one) as write:
            await until(lambda: reader.matched)
            for payload in (
                b"\0\1\0\0",
                b"\0\3\0\0" + bytes(8),
                b"\0\x0b\0\0" + bytes(8),
                b"\xff\xff\xff\xff" + bytes(8),
            ):
                write(payload)
            writer = one.writer("rt/a", KEPT)  # the other one is never acknowledged again
            await until(lambda: reader.matched == 2 and writer.matched)
            writer.put(HELLO)
            await until(lambda: HELLO in other.payloads)
            assert other.payloads == [HELLO]


async def test_a_payload_that_is_too_large_is_dropped_and_reported_once(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(endpoints, "MOST_PAYLOAD", 100_000)
    async with two_peers() as (one, other):
        writer, reader = one.writer("rt/a", KEPT), other.reader("rt/a", KEPT)
        await matched(writer, reader)
        writer.put(b"\0\1\0\0" + bytes(200_000))
        writer.put(b"\0\1\0\0" + bytes(200_000))
        writer.put(HELLO)
        await until(lambda: other.samples)
        assert other.payloads == [HELLO]
        assert other.participant.unreadable == 2
        assert len([line for line in caplog.messages if "a sample of 200004 bytes on rt/a" in line]) == 1


async def test_a_fault_in_the_reading_thread_is_counted_and_the_thread_goes_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with two_peers() as (one, other):
        writer, reader = one.writer("rt/a", KEPT), other.reader("rt/a", KEPT)
        await matched(writer, reader)

        def fail(_: object) -> bytes:
            raise LookupError("unforeseen")

        with monkeypatch.context() as patched:
            patched.setattr(reader, "_payload", fail)
            writer.put(HELLO)
            await until(lambda: other.participant.unreadable == 1)
        writer.put(HELLO)
        await until(lambda: other.samples)


async def test_packets_that_are_no_protocol_disturb_nobody() -> None:
    chance = random.Random(7)
    async with two_peers() as (one, other):
        writer, reader = one.writer("rt/a", KEPT), other.reader("rt/a", KEPT)
        await matched(writer, reader)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            for index in range(4):
                for port in (7400 + 250 * 77 + 10 + 2 * index, 7400 + 250 * 77 + 11 + 2 * index):
                    for _ in range(100):
                        noise = chance.randbytes(chance.randrange(200))
                        header = b"RTPS\2\5\1\x10" + one.participant.guid[:12]
                        submessage = bytes([chance.randrange(256), 1]) + len(noise).to_bytes(2, "little")
                        out.sendto(
                            chance.choice([noise, header + noise, header + submessage + noise]), ("127.0.0.1", port)
                        )
        writer.put(HELLO)
        await until(lambda: other.samples)
        assert other.payloads == [HELLO]


async def test_hostile_samples_and_endpoints_lose_nothing_of_honest_nodes_and_fill_no_log() -> None:
    outcome = await attack(2000, 3, mutated)
    assert findings(outcome) == []
    assert (len(outcome.heard), outcome.answers["right"]) == (10, 10)
    assert outcome.logs.unreadable > 200
