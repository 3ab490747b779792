"""Streams that nobody refers to any more, collected in whichever thread the garbage collector runs."""

from __future__ import annotations

import asyncio
import gc
import subprocess
import sys
import threading
from collections.abc import Callable
from typing import Any

import pytest

from actors import QoS, Topic, open_node
from actors.interfaces.std_msgs.msg import Int32
from actors.topics.endpoint import close_forgotten

TIMED = Topic(Int32, "timed", QoS(depth=5, deadline=0.2))


class Ring:
    """Refers to itself, so that only the collector finds it; it holds a stream and its events."""

    def __init__(self, **held: object) -> None:
        self.held = held
        self.me = self


def collected_elsewhere() -> None:
    thread = threading.Thread(target=gc.collect)
    thread.start()
    thread.join()


async def told_to_close(make: Callable[[Any], Ring], changes: list[int]) -> tuple[list[str], list[str]]:
    """What a node still listens to after a foreign thread has collected the ring, and after the loop's next turn."""
    async with open_node("listener") as node:
        entry = node.publisher(TIMED).entry
        graph = entry.graph
        gc.disable()
        try:
            ring = make(node)
            graph.on_change(lambda: changes.append(threading.get_ident()))
            del ring
            collected_elsewhere()
            at_once = [repr(one) for one in entry.subscriptions]
            await asyncio.sleep(0)
            return at_once, [repr(one) for one in entry.subscriptions]
        finally:
            gc.enable()


def test_a_stream_collected_in_a_foreign_thread_leaves_in_its_own() -> None:
    changes: list[int] = []
    at_once, later = asyncio.run(told_to_close(lambda node: Ring(stream=node.subscribe(TIMED)), changes), debug=True)
    assert len(at_once) == 1
    assert later == []
    assert set(changes) == {threading.get_ident()}


async def test_events_collected_in_a_foreign_thread_leave_the_timer_to_the_loop() -> None:
    asyncio.get_running_loop().set_debug(True)  # so that the loop refuses timers from a foreign thread
    async with open_node("listener") as node:
        stream = node.subscribe(TIMED)
        node.publisher(TIMED)(Int32(data=1))
        met = stream.events()._events
        gc.disable()
        try:
            ring = Ring(events=stream.events(), again=stream.events())
            gc.collect()
            assert len(met.listeners) == 2
            del ring
            collected_elsewhere()
            assert len(met.listeners) == 2
            await asyncio.sleep(0)
            assert met.listeners == []
            assert met._timer is None
        finally:
            gc.enable()


def test_with_the_loop_closed_nothing_is_done_and_nothing_raised() -> None:
    called: list[str] = []
    loop = asyncio.new_event_loop()
    close_forgotten(loop, threading.get_ident(), lambda: called.append("open"))
    assert called == ["open"]
    loop.close()
    for thread in (threading.get_ident(), 0):
        close_forgotten(loop, thread, lambda: called.append("closed"))
    assert called == ["open"]


def test_a_loop_that_is_closed_meanwhile_is_no_error(monkeypatch: pytest.MonkeyPatch) -> None:
    loop = asyncio.new_event_loop()
    loop.close()
    monkeypatch.setattr(loop, "is_closed", lambda: False)
    close_forgotten(loop, 0, lambda: pytest.fail("called in a foreign thread"))


AT_EXIT = """
import asyncio
from actors import QoS, Topic, open_node
from actors.interfaces.std_msgs.msg import Int32

T = Topic(Int32, "t", QoS(depth=5, deadline=0.2))
kept = []

async def main():
    global node, kept
    context = open_node("left open")
    node = await context.__aenter__()
    stream = node.subscribe(T)
    kept = [context, stream, stream.events(), node.publisher(T).events()]
    kept.append(kept)

loop = asyncio.new_event_loop()
loop.run_until_complete(main())
CLOSE
"""


@pytest.mark.parametrize("close", ["loop.close()", ""])
def test_what_is_left_at_the_interpreter_s_exit_says_nothing(close: str) -> None:
    program = AT_EXIT.replace("CLOSE", close).replace("left open", "left_open")
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=False)
    said = [line for line in done.stderr.splitlines() if "__del__" in line or "Error" in line]
    assert (done.returncode, done.stdout, said) == (0, "", [])
