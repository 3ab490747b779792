"""Real processes over Zenoh: how they find each other, and how their loss is noticed. The figures are printed: pytest -m realtime -s."""

from __future__ import annotations

import asyncio
import json
import signal
import sys
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

from actors.transport.protocol import NoAnswer
from actors.transport.zenoh import ZenohConfig
from actors.transport.zenoh.transport import ZenohKeys
from tests.actors.transport.contract.parties import Changes, Happened, Party
from tests.actors.transport.zenoh.peer import long_token
from tests.actors.transport.zenoh.wires import free_port

pytestmark = pytest.mark.realtime


class Peer:
    """A process of `tests.actors.transport.zenoh.peer`, and all that it has written."""

    def __init__(self, name: str, process: asyncio.subprocess.Process) -> None:
        self.name = name
        self.process = process
        self.lines: list[dict[str, Any]] = []
        self._changes = Changes()
        self._reading = asyncio.create_task(self._read())

    @classmethod
    async def start(cls, port: int, name: str) -> Peer:
        program = (sys.executable, "-m", "tests.actors.transport.zenoh.peer", str(port), name)
        pipe = asyncio.subprocess.PIPE
        return cls(name, await asyncio.create_subprocess_exec(*program, stdin=pipe, stdout=pipe))

    async def _read(self) -> None:
        assert self.process.stdout is not None
        async for line in self.process.stdout:
            self.lines.append(json.loads(line))
            self._changes.note()

    async def until(self, kind: str, **more: object) -> dict[str, Any]:
        """The newest line of that kind and content; waits for the first one."""

        def found() -> list[dict[str, Any]]:
            return [line for line in self.lines if line["kind"] == kind and more.items() <= line.items()]

        await self._changes.until(found, f"{self.name} says {kind} {more}")
        return found()[-1]

    async def session(self) -> str:
        return str((await self.until("ready"))["of"])

    def tell(self, line: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(line.encode() + b"\n")

    async def ended(self) -> int:
        code = await self.process.wait()
        await self._reading
        return code

    async def kill(self) -> None:
        if self.process.returncode is None:
            self.process.kill()
        await self.ended()


@pytest.fixture
async def start() -> AsyncIterator[Callable[..., Any]]:
    """Starts a peer, and ends it after the test."""
    peers: list[Peer] = []

    async def one(port: int, name: str) -> Peer:
        peers.append(await Peer.start(port, name))
        return peers[-1]

    yield one
    for peer in peers:
        await peer.kill()


@asynccontextmanager
async def party(port: int) -> AsyncIterator[Party]:
    """A transport in this process."""
    one = Party(ZenohKeys(ZenohConfig(gossip_port=port)), Changes())
    await one.open()
    try:
        yield one
    finally:
        await one.transport.close()


def of_server(peer: Peer, session: str) -> str:
    return f"@ros2_lv/7/{session}/0/1/SS/%/%/{peer.name}/%{peer.name}/a::srv::dds_::B_/H/::,10:,:,:,,"


async def lost_after(a: Party, session: str, began: float, what: str) -> float:
    await a.until(lambda: a.has("down", session), "it is lost")
    seconds = time.monotonic() - began
    print(f"{what}: lost after {seconds:.3f} s")
    return seconds


async def test_a_killed_process_is_lost_at_once_and_its_questions_end(start: Callable[..., Any]) -> None:
    port = free_port()
    async with party(port) as a:
        b = await start(port, "b")
        session = await b.session()
        await a.until(lambda: a.has("appeared", of_server(b, session)), "its server appears")
        answers, _ = a.ask("7/b/a::srv::dds_::B_/H")

        b.process.kill()
        seconds = await lost_after(a, session, time.monotonic(), "SIGKILL")
        await a.until(lambda: answers, "the question ends")

        assert a.log[-3:] == [
            Happened("down", session),
            Happened("vanished", of_server(b, session)),
            Happened("answered", NoAnswer(timed_out=False)),
        ]
        assert seconds < 1


async def test_a_stopped_process_is_lost_after_its_lease(start: Callable[..., Any]) -> None:
    port = free_port()
    async with party(port) as a:
        b = await start(port, "b")
        session = await b.session()
        await a.until(lambda: a.has("appeared", of_server(b, session)), "its server appears")

        b.process.send_signal(signal.SIGSTOP)
        assert 1 < await lost_after(a, session, time.monotonic(), "SIGSTOP") < 4
        b.process.send_signal(signal.SIGCONT)
        await a.until(lambda: a.is_linked(session), "it is found again")
        await a.until(
            lambda: len([one for one in a.log if one == ("appeared", of_server(b, session))]) == 2, "and its server"
        )


async def test_a_process_whose_loop_hangs_is_lost_and_found_again_when_it_runs(start: Callable[..., Any]) -> None:
    port = free_port()
    async with party(port) as a:
        b = await start(port, "b")
        session = await b.session()
        await a.until(lambda: a.has("appeared", of_server(b, session)), "its server appears")
        answers, _ = a.ask("7/b/a::srv::dds_::B_/H")
        before = len(a.log)

        b.tell("hang 5")
        seconds = await lost_after(a, session, time.monotonic(), "a loop that hangs")
        await a.until(lambda: a.is_linked(session) and a.log[-1].kind == "appeared", "it is found again")

        assert a.log[before:] == [
            Happened("down", session),
            Happened("vanished", of_server(b, session)),
            Happened("answered", NoAnswer(timed_out=False)),
            Happened("up", session),
            Happened("appeared", of_server(b, session)),
        ]
        assert answers == [NoAnswer(timed_out=False)]
        assert 1.4 < seconds < 4


async def test_a_loop_that_hangs_here_does_not_make_others_look_lost(start: Callable[..., Any]) -> None:
    port = free_port()
    async with party(port) as a:
        b = await start(port, "b")
        session = await b.session()
        await a.until(lambda: a.is_linked(session), "it is found")

        time.sleep(4)  # noqa: ASYNC251  # the loop is to hang
        await b.until("up", of=a.session)
        a.transport.announce("@ros2_lv/7/still_there")
        await b.until("appeared", of="@ros2_lv/7/still_there")

        assert a.told("down") == []


async def test_processes_find_each_other_in_any_order_and_after_the_first_has_gone(start: Callable[..., Any]) -> None:
    port = free_port()
    a, b = await start(port, "a"), await start(port, "b")  # both at once
    await a.until("up", of=await b.session())
    await b.until("up", of=await a.session())
    holder, other = (a, b) if _holds(a, port) else (b, a)

    await holder.kill()
    began = time.monotonic()
    await other.until("down", of=await holder.session())
    while not _holds(other, port):
        await asyncio.sleep(0.01)
    seconds = time.monotonic() - began
    print(f"the gossip point is taken over after {seconds:.3f} s")
    late = await start(port, "late")

    await late.until("up", of=await other.session())
    await other.until("up", of=await late.session())
    assert seconds < 1


def _holds(peer: Peer, port: int) -> bool:
    """Whether a process listens at a port."""
    rows = (line.split() for line in Path("/proc/net/tcp").read_text().splitlines())
    listening = {row[9] for row in rows if row[1].endswith(f":{port:04X}") and row[3] == "0A"}
    files = Path(f"/proc/{peer.process.pid}/fd").iterdir()
    return any(f"socket:[{inode}]" == str(file.readlink()) for file in files for inode in listening)


async def test_a_router_that_runs_is_used(start: Callable[..., Any]) -> None:
    port = free_port()
    config = f'{{mode: "router", listen: {{endpoints: ["tcp/127.0.0.1:{port}"]}}, scouting: {{multicast: {{enabled: false}}}}}}'
    program = (
        f"import zenoh, sys\ns = zenoh.open(zenoh.Config.from_json5({config!r}))\nprint(flush=True)\nsys.stdin.read()"
    )
    pipe = asyncio.subprocess.PIPE
    router = await asyncio.create_subprocess_exec(sys.executable, "-c", program, stdin=pipe, stdout=pipe)
    try:
        assert router.stdout is not None
        await router.stdout.readline()
        a, b = await start(port, "a"), await start(port, "b")

        await a.until("up", of=await b.session())
        await b.until("up", of=await a.session())

        assert not _holds(a, port) and not _holds(b, port)
    finally:
        router.kill()
        await router.wait()


async def test_a_process_with_the_endpoints_of_21_nodes_has_at_most_8_threads(start: Callable[..., Any]) -> None:
    port = free_port()
    peers = [await start(port, name) for name in ("a", "b", "c")]
    for peer in peers:
        for other in peers:
            if other is not peer:
                await peer.until("up", of=await other.session())
    numbers = []
    for peer in peers:
        peer.tell("threads")
        numbers.append((await peer.until("threads"))["number"])

    print("threads:", numbers)
    assert max(numbers) <= 8


async def test_a_newcomer_sees_all_of_a_process_whose_tokens_fill_the_queue_of_a_link_many_times(
    start: Callable[..., Any],
) -> None:
    """A megabyte, where a link's queue for declarations takes two times 64 kB."""
    port = free_port()
    first = await start(port, "first")
    first.tell("announce 4000")
    await first.until("announced")
    expected = {long_token(await first.session(), number) for number in range(4000)}

    async with party(port) as newcomer:
        await newcomer.until(
            lambda: expected <= {one.of for one in newcomer.log if one.kind == "appeared"}, "it has seen all"
        )


async def test_a_process_that_closes_leaves_no_socket_and_ends(start: Callable[..., Any]) -> None:
    port = free_port()
    a, b = await start(port, "a"), await start(port, "b")
    await a.until("up", of=await b.session())

    b.tell("sockets")
    assert (await b.until("sockets"))["more"] > 0
    b.tell("close")
    await b.until("closed")
    await a.until("down", of=await b.session())
    b.tell("sockets")
    await b.until("sockets", more=0)
    b.tell("leave")
    assert await b.ended() == 0


async def test_to_close_publishers_that_keep_samples_never_hangs() -> None:
    """Zenoh waits for its own thread then, with Python's lock held, which that thread may be waiting for."""
    program = (sys.executable, "-m", "tests.actors.transport.zenoh.closing", str(free_port()))
    process = await asyncio.create_subprocess_exec(*program)
    try:
        async with asyncio.timeout(60):
            assert await process.wait() == 0
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()


async def test_a_process_that_ends_without_closing_ends(start: Callable[..., Any]) -> None:
    port = free_port()
    a, b = await start(port, "a"), await start(port, "b")
    await a.until("up", of=await b.session())

    b.tell("leave")

    assert await b.ended() == 0
    await a.until("down", of=await b.session())
