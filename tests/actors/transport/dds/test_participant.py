"""Opening, discovery and closing of participants."""

from __future__ import annotations

import asyncio
import gc
import os
import sys
import threading
import time
from pathlib import Path

import pytest

pytest.importorskip("cyclonedds")

from actors.transport.dds.config import DdsConfig
from actors.transport.dds.format.qos import EndpointQos
from actors.transport.dds.participant import Participant
from actors.transport.protocol import WireUnavailable
from tests.actors.transport.dds.peers import HELLO, STRING, Peer, matched, settings, two_peers, until

QOS = EndpointQos(
    transient_local=True, keep_all=True, deadline=1.5, lifespan=2.5, manual_liveliness=True, lease=0.5, user_data=b"typehash=\0\xff;"
)  # fmt: skip


def threads() -> list[str]:
    return [thread.name for thread in threading.enumerate() if thread.name.startswith("dds")]


async def test_participants_see_each_other_and_their_endpoints_come_and_go() -> None:
    async with two_peers() as (one, other):
        await until(lambda: one.participants and other.participants)
        (seen,) = other.participants.values()
        assert (seen.guid, seen.user_data, seen.process) == (one.participant.guid, b"enclave=/;", os.getpid())
        assert seen.host
        writer, reader = one.writer("rt/a", QOS), other.reader("rt/a", EndpointQos(depth=7))
        await until(lambda: other.endpoints and one.endpoints)
        (published,), (subscribed,) = other.endpoints.values(), one.endpoints.values()
        assert (published.guid, published.participant) == (writer.guid, one.participant.guid)
        assert (published.writes, published.topic, published.type) == (True, "rt/a", STRING)
        assert published.qos == QOS
        assert (subscribed.guid, subscribed.writes) == (reader.guid, False)
        assert subscribed.qos == EndpointQos(depth=7)
        writer.close()
        await until(lambda: not other.endpoints)
        await other.participant.close()
        await until(lambda: not one.participants)
        assert one.log == ["participant appeared", "rt/a appeared", "rt/a vanished", "participant vanished"]


async def test_participants_of_one_domain_in_a_process_see_each_other_and_never_themselves() -> None:
    async with two_peers(7) as (one, other):
        writer, reader = one.writer("rt/a", EndpointQos()), other.reader("rt/a", EndpointQos())
        await matched(writer, reader)
        await until(lambda: one.endpoints and other.endpoints)
        assert set(one.participants) == {other.participant.guid}
        assert set(one.endpoints) == {reader.guid} and set(other.endpoints) == {writer.guid}


async def test_many_endpoints_all_come_and_go() -> None:
    async with two_peers() as (one, other):
        writers = [one.writer(f"rt/t{number}", EndpointQos()) for number in range(300)]
        readers = [one.reader(f"rt/t{number}", EndpointQos()) for number in range(300)]
        await until(lambda: len(other.endpoints) == 600)
        assert {endpoint.topic for endpoint in other.endpoints.values()} == {f"rt/t{number}" for number in range(300)}
        for endpoint in (*writers, *readers):
            endpoint.close()
        await until(lambda: not other.endpoints)


async def test_nothing_is_called_after_the_close_and_nothing_is_left() -> None:
    async with two_peers() as (one, other):
        writer, reader = (
            one.writer("rt/a", EndpointQos(keep_all=True)),
            other.reader("rt/a", EndpointQos(keep_all=True)),
        )
        await matched(writer, reader)
        for _ in range(100):
            writer.put(HELLO)
        await other.participant.close()
        told = len(other.batches), len(other.log), len(other.statuses)
        await one.participant.close()
        assert (len(other.batches), len(other.log), len(other.statuses)) == told
        await one.participant.close()
        writer.put(HELLO)
        with pytest.raises(RuntimeError, match="not open"):
            one.participant.writer("rt/a", STRING, EndpointQos())
    await until(lambda: not threads())


@pytest.mark.skipif(sys.platform != "linux", reason="counts in /proc")
async def test_opening_and_closing_again_and_again_leaves_nothing() -> None:
    def left() -> tuple[int, int, int]:
        gc.collect()
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        return len(os.listdir("/proc/self/fd")), len(os.listdir("/proc/self/task")), pages * 4

    before = 0, 0, 0
    for cycle in range(60):
        peer = Peer(7, "cycles")
        await peer.participant.open(peer)
        peer.reader("rt/a", EndpointQos())
        peer.writer("rt/a", EndpointQos()).put(HELLO)
        await peer.participant.close()
        await until(lambda: not threads())
        if cycle == 20:
            before = left()
    files, tasks, kibibytes = left()
    assert (files, tasks) == before[:2]
    assert kibibytes < before[2] + 2000


async def test_an_opening_that_is_cancelled_leaves_nothing() -> None:
    peer = Peer(7, "cancelled")
    opening = asyncio.create_task(peer.participant.open(peer))
    await asyncio.sleep(0)  # it has begun
    assert threads()
    opening.cancel()
    with pytest.raises(asyncio.CancelledError):
        await opening
    await until(lambda: not threads())
    another = Peer(7, "another")  # it could not enter a domain that somebody has entered by other settings
    await another.participant.open(another)
    await another.participant.close()


async def test_two_settings_for_one_domain_of_a_process_are_refused_in_one_line() -> None:
    async with two_peers():
        with pytest.raises(WireUnavailable, match="domain 7 with another") as refused:
            await Participant(DdsConfig(domain=7)).open(Peer(7, ""))
        assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    "uri", ["<Nonsense/>", "file:///nowhere.xml", "<CycloneDDS><Domain><Foo>1</Foo></Domain></CycloneDDS>"]
)
async def test_a_configuration_that_is_none_is_refused_in_one_line_and_can_be_mended(
    uri: str, capfd: pytest.CaptureFixture[str]
) -> None:
    peer = Peer(7, "")
    with pytest.raises(WireUnavailable, match="cannot open domain 7") as refused:
        await Participant(DdsConfig(domain=7, discovery_range="LOCALHOST", uri=uri)).open(peer)
    assert "\n" not in str(refused.value)
    await peer.participant.open(peer)
    await peer.participant.close()
    await until(lambda: not threads())


async def test_a_host_with_too_many_participants_is_told_in_one_line() -> None:
    full = settings("full").replace("</Discovery>", "<ParticipantIndex>3</ParticipantIndex></Discovery>")
    first = Participant(DdsConfig(domain=7, discovery_range="LOCALHOST", uri=full))
    await first.open(Peer(7, ""))
    try:
        with pytest.raises(WireUnavailable, match="more than 32 participants"):
            await Participant(DdsConfig(domain=8, discovery_range="LOCALHOST", uri=full)).open(Peer(8, ""))
    finally:
        await first.close()


CHILD = """
import asyncio, sys
from actors.transport.dds.format.qos import EndpointQos
from tests.actors.transport.dds.peers import Peer
async def main():
    peer = Peer(int(sys.argv[1]), sys.argv[2])
    await peer.participant.open(peer)
    peer.writer("rt/there", EndpointQos())
    await asyncio.sleep(100)
asyncio.run(main())
"""


async def test_a_process_that_is_killed_is_noticed_by_its_lease() -> None:
    async with two_peers() as (one, _):
        tag = one.participant._config.uri.split("<Tag>")[1].split("</Tag>")[0]
        child = await asyncio.create_subprocess_exec(sys.executable, "-c", CHILD, "9", tag)
        await until(lambda: "rt/there appeared" in one.log, 30)
        begin = time.monotonic()
        child.kill()
        await child.wait()
        await until(lambda: one.log[-1] == "participant vanished", 20)
        assert one.log[-2] == "rt/there vanished"
        print(f"a killed process was noticed after {time.monotonic() - begin:.1f} s; its lease is 3 s")
