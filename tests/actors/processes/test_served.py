"""What runs in a real process, run here: the order that is read from the channel, what is told over it, and the end of it."""

from __future__ import annotations

import asyncio
import ctypes
import os
import select
import signal
import socket
import sys
import threading
import time
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from functools import partial
from types import SimpleNamespace
from typing import Any

import pytest

from actors import Child, ExitReason, Node, every
from actors.logs import INFO
from actors.processes import main as mains
from actors.processes.channel import Channel, framed, read_frame
from actors.processes.main import main, serve
from actors.processes.messages import BEAT, Line, NodeFacts, Nodes, Order, Over, Ready, StopAsked
from actors.processes.preparation import preparation
from actors.processes.signals import PARENT, end_with_parent, leave_to_parent
from actors.supervision import Failed, Stopped
from actors.transport.zenoh import ZenohConfig, ZenohTransport
from tests.actors.processes.kit import until

_PR_SET_PDEATHSIG, _PR_GET_PDEATHSIG = 1, 2

PRIVATE = partial(ZenohTransport, ZenohConfig(gossip_port=0))


class Busy(Node):
    """Blocks its loop for a moment now and then, and logs what cannot be copied."""

    @every(hz=20)
    def tick(self) -> None:
        time.sleep(0.01)
        self.log.info("odd", what=self.tick)

    async def on_stop(self, reason: ExitReason) -> None:
        self.log.info("stopping", why=str(reason))


def order(child: Child, **options: Any) -> Order:
    return Order(child, ("top", child.name), 0, INFO, None, PRIVATE, 0, **options)


class Parent:
    """The parent's end of the channel."""

    def __init__(self, notes: int) -> None:
        self.events: list[Any] = []
        self.notes = notes
        self.channel = Channel(self.events.append, lambda: self.events.append("lost"))

    def beats(self) -> int:
        """How many beats have come since it was asked last."""
        if not select.select([self.notes], [], [], 0)[0]:
            return 0
        return os.read(self.notes, 65536).count(BEAT)

    def lines(self, event: str) -> list[Line]:
        return [each for each in self.events if isinstance(each, Line) and each.event == event]


@asynccontextmanager
async def served(given: Order, maker: int | None = None) -> AsyncGenerator[Parent]:
    (ours, theirs), (notes, noting) = socket.socketpair(), os.pipe()
    parent = Parent(notes)
    await asyncio.get_running_loop().create_connection(lambda: parent.channel, sock=ours)
    run = asyncio.create_task(serve(given, theirs, noting, parent=maker))
    try:
        yield parent
        await run
    finally:
        asyncio.get_running_loop().remove_signal_handler(PARENT)
        os.close(notes)
        os.close(noting)


async def test_an_order_is_run_and_all_that_becomes_of_it_is_told() -> None:
    async with served(order(Child(Busy, process=True))) as parent:
        await until(lambda: Ready() in parent.events)
        await until(lambda: parent.lines("odd") and parent.beats())
        assert "Busy.tick" in parent.lines("odd")[0].fields["what"]
        parent.channel.send(StopAsked("enough"))
        await until(lambda: parent.events[-1] == "lost")
        assert parent.events[-2] == Over(Stopped("enough"))
        assert parent.lines("stopping")[0].fields == {"why": "it stopped: enough"}
        states = [facts.state for each in parent.events if isinstance(each, Nodes) for facts in each.changed]
        assert states[0] == "running" and states[-1] == "stopped"


@pytest.mark.skipif(not hasattr(os, "pidfd_open"), reason="this system has no process descriptors")
async def test_a_forked_process_ends_in_order_when_its_parent_has_ended_though_the_channel_is_held_open() -> None:
    maker = await asyncio.create_subprocess_exec("sleep", "1000")
    descriptor = os.pidfd_open(maker.pid)
    async with served(order(Child(Busy, process=True)), descriptor) as parent:
        await until(lambda: Ready() in parent.events)
        os.kill(os.getpid(), PARENT)  # only the parent sends it
        await until(lambda: parent.lines("stopping"))
        assert parent.lines("stopping")[0].fields == {"why": "it stopped: terminated"}
        await until(lambda: parent.events[-1] == "lost")
    async with served(order(Child(Busy, process=True)), descriptor) as parent:
        await until(lambda: Ready() in parent.events)
        maker.kill()
        await until(lambda: parent.lines("stopping"))
        assert parent.lines("stopping")[0].fields == {"why": "it stopped: its parent process is gone"}
        await until(lambda: parent.events[-1] == "lost")
    os.close(descriptor)
    await maker.wait()


async def test_what_earlier_lives_have_left_is_known() -> None:
    facts = NodeFacts(("top", "busy"), Child(Busy), "stopped", 6)
    async with served(order(Child(Busy, process=True), nodes=(facts,))) as parent:
        await until(lambda: parent.lines("odd"))
        assert parent.lines("odd")[0].incarnation == 7
        parent.channel.send(StopAsked("enough"))
        await until(lambda: parent.events[-1] == "lost")


async def test_a_child_that_must_not_hang_for_long_beats_more_often_than_it_tells_of_its_nodes() -> None:
    async with served(order(Child(Busy, process=True, hang=0.1))) as parent:
        await until(lambda: Ready() in parent.events)
        parent.beats()
        begun = time.monotonic()
        await asyncio.sleep(0.5)
        assert parent.beats() <= (time.monotonic() - begun) / 0.02 + 1
        for _ in range(7):
            await until(parent.beats)
        parent.channel.send(StopAsked("enough"))
        await until(lambda: parent.events[-1] == "lost")


def test_a_beat_that_is_due_tells_of_the_nodes() -> None:
    period, most = 0.05, mains.MOST_BEAT_SECONDS
    told: list[float] = []
    for now in (0.0, most - 0.5 * period, most):
        one: Any = SimpleNamespace(
            _loop=SimpleNamespace(time=lambda now=now: now, call_at=lambda *_: None), _period=period, _beat=None, _told=0.0, _notes=-1,
            _watchdog=SimpleNamespace(turned=lambda: None), _hosted=SimpleNamespace(tell_nodes=lambda now=now: told.append(now)),
            _tell_lost=lambda: None,
        )  # fmt: skip
        mains.Served._beat(one)
    assert told == [most - 0.5 * period, most]  # a beat that comes half a period early is due


async def test_log_lines_are_counted_instead_of_sent_while_the_parent_does_not_read(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(mains, "MOST_UNSENT", -1)
    async with served(order(Child(Busy, process=True))) as parent:
        for _ in range(4):
            await until(parent.beats)
        assert parent.lines("odd") == []
        monkeypatch.setattr(mains, "MOST_UNSENT", 1_000_000)
        await until(lambda: parent.lines("log lines were lost"))
        (line,) = parent.lines("log lines were lost")
        assert line.fields["lines"] >= 1
        await until(lambda: parent.lines("odd"))
        parent.channel.send(StopAsked("enough"))
        await until(lambda: parent.events[-1] == "lost")


async def test_when_the_channel_closes_the_child_ends_in_order() -> None:
    async with served(order(Child(Busy, process=True))) as parent:
        await until(lambda: Ready() in parent.events)
        parent.channel.close()


@pytest.mark.parametrize(("ended", "why"), [(False, "terminated"), (True, mains.ORPHANED)])
async def test_the_signal_of_its_parent_ends_the_child_in_order(
    ended: bool, why: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with served(order(Child(Busy, process=True))) as parent:
        await until(lambda: Ready() in parent.events)
        if ended:
            monkeypatch.setattr(os, "getppid", lambda: 1)
        os.kill(os.getpid(), PARENT)
        await until(lambda: parent.events[-1] == "lost")
        assert parent.events[-2] == Over(Stopped(why))


async def test_what_a_loop_does_can_be_told_from_another_thread() -> None:
    ours, theirs = socket.socketpair()
    with ours, theirs:
        process = mains.Served(order(Child(Busy, process=True)), theirs, 0)
        said: list[str] = []
        thread = threading.Thread(target=lambda: said.append(process.where()))
        thread.start()
        thread.join()
        assert "Task-" in said[0] and "test_served.py" in said[0]
        await asyncio.to_thread(lambda: None)
        said.clear()
        asyncio.get_running_loop().call_soon(lambda: said.append(_from_a_thread(process.where)))
        await until(lambda: said)
        assert said[0].startswith("at ")


def _from_a_thread(function: Any) -> str:
    said: list[str] = []
    thread = threading.Thread(target=lambda: said.append(function()))
    thread.start()
    thread.join()
    return said[0]


class Unknown(Node):
    """Only this process can make it: what it is made of raises elsewhere."""

    def __reduce__(self) -> Any:
        raise TypeError


def run_main(frames: bytes, monkeypatch: pytest.MonkeyPatch) -> tuple[int, list[Any]]:
    """Run the program with these frames in its channel; its exit code, and what it tells."""
    monkeypatch.setattr("actors.processes.main.end_with_parent", lambda by: None)
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    ours, theirs = socket.socketpair()
    notes, noting = os.pipe()
    ours.sendall(frames)
    ours.shutdown(socket.SHUT_WR)
    try:
        code = main([str(theirs.detach()), str(noting), "top/busy"])
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        os.close(notes)
        os.close(noting)
    told: list[Any] = []
    with ours:
        while True:
            try:
                told.append(read_frame(ours))
            except (EOFError, ConnectionResetError):
                return code, told


def test_without_a_parent_there_is_nothing_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    assert run_main(b"", monkeypatch) == (1, [])
    assert run_main(framed(preparation(main=False))[:50], monkeypatch) == (1, [])


def test_an_order_that_cannot_be_read_is_the_failure_of_the_child(monkeypatch: pytest.MonkeyPatch) -> None:
    broken = framed("x").replace(b"x", b"\xff")
    code, (over,) = run_main(framed(preparation(main=False)) + broken, monkeypatch)
    assert code == 1
    assert isinstance(over, Over) and isinstance(over.reason, Failed)
    assert isinstance(over.reason.error, UnicodeDecodeError)


def note_call() -> None:
    os.environ["NOTED_CALL"] = "yes"


def test_in_place_of_an_order_a_function_is_called(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NOTED_CALL", "no")
    assert run_main(framed(preparation(main=False)) + framed(note_call), monkeypatch) == (0, [])
    assert os.environ["NOTED_CALL"] == "yes"


def test_a_parent_that_goes_at_once_gets_an_orderly_end(monkeypatch: pytest.MonkeyPatch) -> None:
    frames = framed(preparation(main=False)) + framed(order(Child(Busy, process=True)))
    code, told = run_main(frames, monkeypatch)
    assert code == 0
    assert all(isinstance(event, (Line, Nodes, Over)) for event in told)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells of a parent's end by a signal")
def test_the_system_is_asked_to_tell_of_the_parents_end(monkeypatch: pytest.MonkeyPatch) -> None:
    def asked() -> int:
        number = ctypes.c_int()
        assert ctypes.CDLL(None).prctl(_PR_GET_PDEATHSIG, ctypes.byref(number), 0, 0, 0) == 0
        return number.value

    before = asked()
    try:
        end_with_parent(PARENT)
        assert asked() == PARENT
    finally:
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, before, 0, 0, 0)
    monkeypatch.setattr(sys, "platform", "darwin")
    end_with_parent(PARENT)
    assert asked() == before


def test_a_process_of_nohup_keeps_SIGHUP_ignored() -> None:
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = [signal.getsignal(number) for number in numbers]
    try:
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
        leave_to_parent()
        assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
        for number in numbers:
            signal.raise_signal(number)  # and this process goes on
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)
