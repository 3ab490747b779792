"""What happens rarely: lives that follow each other too fast, endpoints that go while they are looked at, libraries that lack something."""

from __future__ import annotations

import asyncio
import builtins
import ctypes
from collections import deque
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("cyclonedds")

from actors.transport.dds import endpoints, library
from actors.transport.dds.discovery import Discovery
from actors.transport.dds.format.qos import EndpointQos
from actors.transport.dds.qos import read_property, read_qos, read_user_data
from actors.transport.dds.reading import Report
from actors.transport.protocol import WireUnavailable
from tests.actors.transport.dds.peers import HELLO, STRING, Peer, matched, two_peers, until

OWN, OTHER, ENDPOINT = b"o" * 16, b"p" * 16, b"p" * 12 + b"\0\0\1\3"
KEPT = EndpointQos(keep_all=True)


class Looks:
    """A discovery that takes what a test says."""

    def __init__(self) -> None:
        self.peer = Peer(7, "")
        self.guids: dict[int, bytes] = {}
        made = SimpleNamespace(dds_create_reader=lambda *_: 1, dds_set_status_mask=lambda *_: 0)

        def post(call: Callable[[Any], None], argument: Any) -> None:
            call(argument)

        self.discovery = Discovery(made, 1, OWN, self.peer, post, self.guids, Report())  # type: ignore[arg-type]

    def participant(self, alive: bool, life: int = 0) -> tuple[bytes, int, int, object]:
        return OTHER, life, 1, (b"enclave=/;", "host", 7) if alive else None

    def endpoint(
        self,
        alive: bool,
        life: int = 0,
        handle: int = 2,
        depth: int = 1,
        guid: bytes = ENDPOINT,
        participant: bytes = OTHER,
    ) -> tuple[bytes, int, int, object]:
        return guid, life, handle, (participant, "rt/a", STRING, EndpointQos(depth=depth)) if alive else None

    def look(self, participants: list[Any] | None = None, writers: list[Any] | None = None) -> None:
        taken = {0x7FFF0001: participants or [], 0x7FFF0003: writers or [], 0x7FFF0004: []}
        self.discovery._taken = lambda topic, *_: iter(taken[topic])  # type: ignore[method-assign,assignment]
        assert self.discovery._look() is False


def test_a_life_that_ended_unseen_is_told_before_the_next_one() -> None:
    looks = Looks()
    looks.look([looks.participant(True)], [looks.endpoint(True)])
    looks.look([looks.participant(True)], [looks.endpoint(True)])
    assert looks.peer.log == ["participant appeared", "rt/a appeared"]
    looks.look([], [looks.endpoint(True, life=1)])
    assert looks.peer.log[2:] == ["rt/a vanished", "rt/a appeared"]
    looks.look([looks.participant(True, life=1)], [])
    assert looks.peer.log[4:] == ["rt/a vanished", "participant vanished", "participant appeared"]


def test_another_quality_of_service_of_an_endpoint_is_told() -> None:
    looks = Looks()
    looks.look([looks.participant(True)], [looks.endpoint(True)])
    looks.look([], [looks.endpoint(True, depth=5)])
    assert looks.peer.log[2:] == ["rt/a changed"]
    assert looks.peer.endpoints[ENDPOINT].qos.depth == 5


def test_endpoints_of_participants_that_have_gone_do_not_appear() -> None:
    looks = Looks()
    looks.look([looks.participant(False)], [looks.endpoint(True), looks.endpoint(False)])
    assert looks.peer.log == []


def test_the_guids_of_endpoints_that_have_gone_are_forgotten_in_the_end() -> None:
    looks = Looks()
    looks.look([looks.participant(True)], [looks.endpoint(True)])
    for number in range(1000, 11_000):
        guid = b"p" * 12 + number.to_bytes(4, "big")
        looks.look([], [looks.endpoint(True, handle=10 + number, guid=guid), looks.endpoint(False, guid=guid)])
    assert len(looks.guids) < 5000
    assert looks.guids[2] == ENDPOINT


async def test_a_writer_that_discovery_has_not_yet_told_is_looked_up() -> None:
    async with two_peers() as (one, other):
        writer, reader = one.writer("rt/a", KEPT), other.reader("rt/a", KEPT)
        await matched(writer, reader)
        within = other.participant._within
        assert within is not None
        within.guids.clear()
        writer.put(HELLO)
        await until(lambda: other.samples)
        assert other.samples[0].writer == writer.guid
        assert reader._guid_of(12345) == bytes(16)


async def test_an_endpoint_that_is_deleted_while_it_is_looked_at_has_nothing() -> None:
    async with two_peers() as (one, other):
        writer, reader = one.writer("rt/a", KEPT), other.reader("rt/a", KEPT)
        await matched(writer, reader)
        calls = library.load()
        for endpoint in (writer, reader):
            calls.dds_delete(endpoint._entity)
            endpoint._look()
        assert reader._taken() is False
        assert reader.matched_guids() == frozenset()


async def test_a_status_that_has_gone_meanwhile_is_not_told(monkeypatch: pytest.MonkeyPatch) -> None:
    async with two_peers() as (one, other):
        monkeypatch.setattr(one.participant._within.library, "dds_get_publication_matched_status", lambda *_: -1)  # type: ignore[union-attr]
        one.writer("rt/a", KEPT)
        reader = other.reader("rt/a", KEPT)
        await until(lambda: reader.matched)
        assert one.statuses == []


async def test_a_write_that_fails_is_counted_and_a_closed_writer_tells_nothing() -> None:
    async with two_peers() as (one, _):
        writer = one.writer("rt/a", KEPT)
        unref = library.load().ddsi_serdata_unref
        writer._write = lambda _, serialized: unref(serialized) or -1
        writer.put(HELLO)
        assert writer.unsent == 1
        writer.close()
        writer._tell(endpoints.Status("matched", 1, 1))
        assert writer.matched == 0 and one.statuses == []


async def test_without_a_listener_statuses_are_only_counted() -> None:
    async with two_peers() as (one, other):
        writer = one.participant.writer("rt/a", STRING, KEPT)
        reader = other.participant.reader("rt/a", STRING, KEPT, other.batches.append)
        await matched(writer, reader)
        reader._tell(endpoints.Status("sample_lost", 3, 3))
        assert reader.lost == 3


async def test_samples_taken_by_the_thread_while_the_reader_is_closed_are_let_go() -> None:
    async with two_peers() as (one, other):
        writer, reader = one.writer("rt/a", KEPT), other.reader("rt/a", KEPT)
        await matched(writer, reader)
        other.participant._within.reading.detach(reader._entity)  # type: ignore[union-attr]
        writer.put(HELLO)
        reader._closed = True
        async with asyncio.timeout(10):
            while reader._found[0] is None:
                assert reader._taken() is False
                await asyncio.sleep(0.005)
        reader._closed = False
        reader._deliver(None)
        assert other.samples == []


class Racing:
    """A queue that another thread has emptied, or filled, just now."""

    def __init__(self, items: list[Any], then: Callable[[], None]) -> None:
        self._items, self._then = items, then

    def __len__(self) -> int:
        return 10

    def popleft(self) -> Any:
        if self._items:
            return self._items.pop()
        self._then()
        raise IndexError

    def append(self, item: Any) -> None:
        self._items.append(item)


async def test_the_loop_and_the_thread_may_both_be_first(monkeypatch: pytest.MonkeyPatch) -> None:
    async with two_peers() as (one, other):
        writer, reader = one.writer("rt/a", EndpointQos()), other.reader("rt/a", EndpointQos())
        await matched(writer, reader)
        queue = writer._queue
        writer._queue = Racing([], lambda: None)  # type: ignore[assignment]
        writer._drop_oldest()
        assert writer.unsent == 0
        reader._queue = Racing([], lambda: None)  # type: ignore[assignment]
        reader._keep(endpoints.Sample(HELLO, OTHER, 0, 0, 0.0))
        assert reader.dropped == 0
        reader._queue = deque()

        def appended() -> None:
            writer._queue = queue
            queue.append(HELLO)

        writer._queue = Racing([], appended)  # type: ignore[assignment]
        assert writer.write_next(library.Vector()) is True
        assert not writer.waiting
        queue.append(b"\0\3\0\0large enough, and none")
        assert writer.write_next(library.Vector()) is True
        assert writer.unsent == 1


async def test_a_participant_that_the_library_refuses_is_told_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    peer = Peer(7, "refused")
    monkeypatch.setattr(library.load(), "dds_create_participant", lambda *_: -1)
    with pytest.raises(WireUnavailable, match="cannot enter domain 7"):
        await peer.participant.open(peer)
    monkeypatch.undo()
    await peer.participant.open(peer)
    monkeypatch.setattr(library.load(), "dds_create_participant", lambda *_: -1)
    another = Peer(7, "refused")
    with pytest.raises(WireUnavailable, match="cannot enter domain 7"):
        await another.participant.open(another)
    await peer.participant.close()


async def test_a_domain_that_another_library_of_the_process_has_opened_is_joined() -> None:
    from cyclonedds.domain import Domain

    from tests.actors.transport.dds.peers import settings

    domain = Domain(7, settings("theirs"))
    peer = Peer(7, "ours")
    await peer.participant.open(peer)
    await peer.participant.close()
    assert domain.get_participants() == []
    del domain


def test_a_package_that_is_not_there_is_told_with_the_command_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    original = builtins.__import__

    def refuse(name: str, *args: Any, **kwargs: Any) -> Any:
        if name.startswith("cyclonedds"):
            raise ImportError("No module named 'cyclonedds'")
        return original(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", refuse)
    library.load.cache_clear()
    with pytest.raises(WireUnavailable, match=r"pip install 'robactor\[dds\]'"):
        library.load()


def test_a_package_that_lacks_a_function_is_told_with_the_versions_that_have_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(library._FUNCTIONS, "dds_of_the_future", (None,))
    library.load.cache_clear()
    with pytest.raises(WireUnavailable, match="cyclonedds>=11,<12"):
        library.load()
    monkeypatch.undo()
    library.load()


def test_what_is_not_announced_is_as_by_default() -> None:
    calls = library.load()
    assert read_qos(calls, None) == EndpointQos(reliable=False)
    assert read_user_data(calls, None) == b""
    assert read_property(calls, None, b"__Pid") == ""
    qos = calls.dds_create_qos()
    assert read_user_data(calls, qos) == b"" and read_property(calls, qos, b"__Pid") == ""
    calls.dds_delete_qos(qos)
    assert ctypes.sizeof(library.SampleInfo) == 64
