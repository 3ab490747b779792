"""What is left after many sessions."""

from __future__ import annotations

import asyncio
import gc
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Coroutine

import pytest

from actors import Child, Node, run
from actors.qos import DEFAULT
from actors.transport.format.tokens import EndpointKind, EndpointToken, NodeToken, write_token
from actors.transport.keyed.protocol import Delivery, Sample
from actors.transport.zenoh import ZenohConfig
from actors.transport.zenoh.transport import ZenohKeys
from tests.actors.transport.contract.parties import Changes, Party, kept
from tests.actors.transport.zenoh.wires import PeerWire


def test_importing_the_framework_does_not_import_zenoh() -> None:
    program = "import sys, actors, actors.transport.zenoh; print('zenoh' in sys.modules)"

    assert subprocess.check_output([sys.executable, "-c", program], text=True) == "False\n"


def memory() -> int:
    """The resident bytes of this process."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.slow(reason="a thousand sessions of Zenoh")
async def test_a_thousand_sessions_leave_no_file_no_thread_and_no_object() -> None:
    wire = PeerWire()
    other = Party(wire.transport(), Changes())
    await other.open()

    async def once() -> None:
        one = Party(ZenohKeys(ZenohConfig(gossip_port=wire.port)), Changes())
        await one.open()
        one.listen("7/chatter/T/H")
        outlet = one.transport.outlet("7/chatter/T/H", kept(1))
        outlet.put(b"x", b"")
        one.transport.announce(f"@ros2_lv/7/{one.session}/0/0/NN")
        await other.until(lambda: other.is_linked(one.session), "they are linked")
        await one.transport.close()
        await other.until(lambda: not other.is_linked(one.session), "they have parted")

    for _ in range(100):
        await once()
    gc.collect()
    files, threads, before = len(os.listdir("/proc/self/fd")), threading.active_count(), memory()
    for _ in range(900):
        await once()
    other.log.clear()
    gc.collect()
    await asyncio.sleep(0.2)

    print(f"{(memory() - before) / 900:.0f} bytes a session")
    assert len(os.listdir("/proc/self/fd")) <= files
    assert threading.active_count() <= threads
    assert memory() - before < 900 * 60_000  # Zenoh itself keeps 5 to 45 kB for each session that it was linked with
    await other.transport.close()


@pytest.mark.slow(reason="1,300 nodes that come and go")
async def test_nodes_that_come_and_go_elsewhere_leave_nothing_in_the_graph_and_no_object() -> None:
    wire = PeerWire()
    other = wire.transport()
    await other.open("@ros2_lv/0/*/none", Party(other, Changes()))
    async with run(Child(Node, name="here"), transport=wire.transport(), signals=False, sinks=()) as system:
        graph = system.graph

        async def one(number: int) -> None:
            node = NodeToken(0, other.session, number, f"node_{number}", "/")
            end = EndpointToken(
                node, 1, EndpointKind.PUBLISHER, f"/topic_{number}", "std_msgs/msg/String", "RIHS01_0", DEFAULT, ()
            )
            handles = [other.announce(write_token(token)) for token in (node, end)]
            while f"/topic_{number}" not in graph.topics:
                await asyncio.sleep(0.001)
            for handle in handles:
                handle.close()
            while any(True for _ in graph.elsewhere()):
                await asyncio.sleep(0.001)

        for number in range(300):
            await one(number)
        gc.collect()
        before, resident, topics = len(gc.get_objects()), memory(), len(graph.topics)
        for number in range(300, 1300):
            await one(number)
        gc.collect()

        grown = len(gc.get_objects()) - before
        # Zenoh keeps memory for each key that it has ever seen, in each of the four sessions of this process: that is most of the second figure.
        print(f"{grown} objects of 1000 nodes; {(memory() - resident) / 1000:.0f} bytes a node in the whole process")
        assert len(graph.topics) == topics
        assert grown < 200
    await other.close()


@pytest.mark.slow(reason="thirteen thousand questions")
async def test_questions_that_have_been_answered_leave_nothing_once_their_time_is_over() -> None:
    wire = PeerWire()
    changes = Changes()
    here, there = Party(wire.transport(), changes), Party(wire.transport(), changes)
    for one in (here, there):
        await one.open()
    served = there.serve("7/add/T/H", lambda query: query.reply(b"", b""))
    await there.told_to(here)

    async def ask(times: int) -> None:
        for _ in range(times // 100):
            asked = [here.ask("7/add/T/H", timeout=0.5)[0] for _ in range(100)]
            await here.until(lambda asked=asked: all(asked), "all are answered")  # type: ignore[misc]
            for written in (here.log, there.log, served):
                written.clear()
        await asyncio.sleep(1.0)
        gc.collect()

    await ask(3000)
    before = memory()
    await ask(10_000)

    print(f"{(memory() - before) / 10_000:.0f} bytes a question")
    assert memory() - before < 10_000 * 300  # Zenoh keeps 900 until then
    for one in (here, there):
        await one.transport.close()


async def test_a_close_that_is_canceled_leaves_neither_session_nor_thread() -> None:
    wire = PeerWire()
    one, other = Party(wire.transport(), Changes()), Party(wire.transport(), Changes())
    await other.open()
    threads = threading.active_count()
    await one.open()
    await other.until(lambda: other.is_linked(one.session), "they are linked")

    closing = asyncio.create_task(one.transport.close())
    await asyncio.sleep(0)
    closing.cancel()
    with pytest.raises(asyncio.CancelledError):
        await closing

    await other.until(lambda: not other.is_linked(one.session), "they have parted")
    while threading.active_count() > threads:
        await asyncio.sleep(0.01)
    await other.transport.close()


async def test_a_subscription_that_waits_for_room_leaves_no_task_when_its_transport_is_closed() -> None:
    wire = PeerWire()
    one, other = Party(wire.transport(), Changes()), Party(wire.transport(), Changes())
    await one.open()
    await other.open()
    taken, keep_all = asyncio.Event(), Delivery(keep_all=True)

    async def room() -> None:
        await asyncio.get_running_loop().create_future()

    def take(sample: Sample) -> Callable[[], Coroutine[object, None, None]]:
        taken.set()
        return room

    one.transport.subscribe("7/chatter/T/H", keep_all, take)
    outlet = other.transport.outlet("7/chatter/T/H", keep_all)
    while not outlet.wanted:
        await asyncio.sleep(0.01)
    outlet.put(b"x", b"")
    await taken.wait()

    await one.transport.close()
    await other.transport.close()
    assert [task.get_name() for task in asyncio.all_tasks() if task is not asyncio.current_task()] == []
