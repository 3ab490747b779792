"""Large payloads by shared memory, none of which is left behind."""

from __future__ import annotations

import asyncio
import ctypes
import fcntl
import os
import secrets
import subprocess
import sys
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
import zenoh

from actors.transport.zenoh import ZenohConfig
from actors.transport.zenoh.memory import SharedMemory, give_back, leave_no_segments
from actors.transport.zenoh.transport import ZenohKeys
from tests.actors.transport.contract.parties import Changes, Party
from tests.actors.transport.zenoh.sharing import IMAGE
from tests.actors.transport.zenoh.wires import free_port

on_linux = pytest.mark.skipif(not Path("/dev/shm").is_dir(), reason="segments are files of /dev/shm on Linux only")


class Process:
    """One of `tests.actors.transport.zenoh.sharing`."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self._process = process

    @classmethod
    async def start(cls, port: int, what: str, memory: int) -> Process:
        program = (sys.executable, "-m", "tests.actors.transport.zenoh.sharing", what)
        own = {"ROBACTOR_GOSSIP_PORT": str(port), "ROBACTOR_SHARED_MEMORY": str(memory)}
        pipe = asyncio.subprocess.PIPE
        return cls(await asyncio.create_subprocess_exec(*program, stdin=pipe, stdout=pipe, env={**os.environ, **own}))

    async def says(self) -> str:
        assert self._process.stdout is not None
        async with asyncio.timeout(30):
            return (await self._process.stdout.readline()).decode().strip()

    def segments(self) -> set[Path]:
        """The segments that it uses."""
        found: set[Path] = set()
        for link in Path(f"/proc/{self._process.pid}/fd").iterdir():
            with suppress(OSError):
                found.add(link.readlink())
        return {path for path in found if path.parent == Path("/dev/shm")}

    async def stop(self) -> int:
        async with asyncio.timeout(30):
            await self._process.communicate(b"")
        assert self._process.returncode is not None
        return self._process.returncode

    async def kill(self) -> None:
        if self._process.returncode is None:
            self._process.kill()
        await self._process.wait()


@asynccontextmanager
async def two_that_share(memory: int = 16) -> AsyncIterator[tuple[Process, Process, set[Path]]]:
    """A process that has put an image, one that has got it, and their segments. They are killed in the end, unless they have ended."""
    port = free_port()
    taker = await Process.start(port, "take", memory)
    putter = await Process.start(port, "put", memory)
    try:
        assert [await taker.says(), await putter.says(), await taker.says()] == ["listens", "put", "complete"]
        yield putter, taker, putter.segments() | taker.segments()
    finally:
        await putter.kill()
        await taker.kill()


def there(segments: set[Path]) -> list[str]:
    return sorted(f"{path.name}, {path.stat().st_size} bytes" for path in segments if path.exists())


@on_linux
@pytest.mark.realtime
@pytest.mark.parametrize(("memory", "shared"), [(16, True), (0, False)])
async def test_a_picture_of_921600_bytes_comes_by_shared_memory_if_the_environment_says_so(
    memory: int, shared: bool
) -> None:
    async with two_that_share(memory) as (putter, taker, _):
        assert bool(putter.segments() & taker.segments()) is shared


@on_linux
@pytest.mark.realtime
async def test_a_large_payload_comes_by_shared_memory_and_no_segment_is_left_by_processes_that_stop() -> None:
    async with two_that_share() as (putter, taker, segments):
        sizes = [path.stat().st_size for path in segments]
        assert putter.segments() & taker.segments()
        assert max(sizes) == 16 * 2**20

        assert (await putter.stop(), await taker.stop()) == (0, 0)

        assert there(segments) == []


@on_linux
@pytest.mark.realtime
async def test_no_segment_of_a_killed_process_is_left_when_the_others_have_stopped() -> None:
    async with two_that_share() as (putter, taker, segments):
        await putter.kill()

        assert await taker.stop() == 0

        assert there(segments) == []


@on_linux
@pytest.mark.realtime
async def test_what_is_left_when_all_are_killed_is_removed_by_the_next_process_that_uses_shared_memory() -> None:
    async with two_that_share() as (putter, taker, segments):
        await putter.kill()
        await taker.kill()
        assert there(segments) != []

    async with two_that_share():
        assert there(segments) == []


@on_linux
def test_a_payload_for_which_there_is_no_room_stays_as_it_is_until_others_have_been_read() -> None:
    memory = SharedMemory(2 * 2**20)
    shared = [memory.shared(IMAGE) for _ in range(3)]
    assert [one is IMAGE for one in shared] == [False, False, True]

    shared.clear()
    assert bytes(zenoh.ZBytes(memory.shared(IMAGE))) == IMAGE

    memory.close()
    assert memory.shared(IMAGE) is IMAGE


@on_linux
def test_a_system_that_has_no_such_memory_copies_payloads() -> None:
    assert SharedMemory(2**60).shared(IMAGE) is IMAGE


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder in place of /dev/shm."""
    monkeypatch.setattr("actors.transport.zenoh.memory._SEGMENTS", tmp_path)
    return tmp_path


@pytest.fixture
def at_exit(monkeypatch: pytest.MonkeyPatch) -> list[Callable[[], Any]]:
    """What is to be called at the end of the process."""
    calls: list[Callable[[], Any]] = []
    monkeypatch.setattr("atexit.register", calls.append)
    monkeypatch.setattr("atexit.unregister", lambda call: None)  # what this process itself has to do stays
    return calls


def test_segments_that_somebody_uses_and_other_files_stay(folder: Path, at_exit: list[Callable[[], Any]]) -> None:
    used, unused, other = (folder / name for name in ("1.zenoh", "2.zenoh", "3.other"))
    for path in (used, unused, other):
        path.touch()
    with used.open("r+") as user:
        fcntl.flock(user, fcntl.LOCK_SH)

        leave_no_segments()

        assert sorted(folder.iterdir()) == [used, other]


@contextmanager
def locked_elsewhere(path: Path) -> Iterator[None]:
    program = (
        "import fcntl, sys; file = open(sys.argv[1]); fcntl.flock(file, fcntl.LOCK_SH); print(flush=True); input()"
    )
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", program, str(path)], stdin=pipe, stdout=pipe) as process:
        assert process.stdout is not None
        process.stdout.readline()
        yield
        process.kill()


def test_at_the_end_of_the_process_its_own_segments_go_unless_another_uses_them(
    folder: Path, at_exit: list[Callable[[], Any]]
) -> None:
    own, shared, other = (folder / name for name in ("1.zenoh", "2.zenoh", "3.other"))
    with own.open("w+") as one, shared.open("w+") as two, other.open("w+") as three, locked_elsewhere(shared):
        for file in (one, two, three):
            fcntl.flock(file, fcntl.LOCK_SH)
        leave_no_segments()
        assert sorted(folder.iterdir()) == [own, shared, other]

        for call in at_exit:
            call()

        assert sorted(folder.iterdir()) == [shared, other]


@pytest.fixture
def left_over() -> Iterator[Path]:
    """A segment that nobody uses."""
    segment = Path("/dev/shm", f"test_{secrets.token_hex(8)}.zenoh")
    segment.touch()
    yield segment
    segment.unlink(missing_ok=True)


@on_linux
@pytest.mark.parametrize(("size", "left"), [(0, True), (1, False)])
async def test_who_opens_a_transport_with_shared_memory_removes_what_was_left(
    size: int, left: bool, left_over: Path
) -> None:
    party = Party(ZenohKeys(ZenohConfig(gossip_port=0, shared_memory=size)), Changes())

    await party.open()

    assert there({left_over}) == ([f"{left_over.name}, 0 bytes"] if left else [])
    await party.transport.close()


def test_without_such_a_folder_nothing_happens(folder: Path, at_exit: list[Callable[[], Any]]) -> None:
    folder.rmdir()

    leave_no_segments()
    for call in at_exit:
        call()


def resident() -> int:
    """MB of memory that this process has."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") >> 20


@pytest.mark.skipif(not hasattr(ctypes.CDLL(None), "malloc_trim"), reason="the C library is not glibc")
def test_memory_of_what_is_freed_is_given_back_although_something_above_it_is_in_use() -> None:
    blocks = [bytearray(1000) for _ in range(100_000)]
    above = bytearray(1000)
    del blocks
    before = resident()
    give_back()
    assert resident() < before - 50
    assert above


def test_with_another_c_library_nothing_happens(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ctypes, "CDLL", lambda _: object())
    give_back()
