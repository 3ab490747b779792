"""Nodes: what one costs that has a publisher, a subscription, a service, a timer and a parameter, to start, to stop and to keep.

Starting and stopping is what a dynamic supervisor does: names checked, endpoints in the graph, `on_start` run, timers running; and
the reverse. Actors of peers have none of these: they are an object with an inbox. Memory is what `tracemalloc` sees, in a run of its
own. The floor is a task that waits on a deque's future.
"""

from __future__ import annotations

import asyncio
import gc
import tracemalloc
from collections import deque
from collections.abc import Awaitable, Callable
from typing import Any, TypeAlias

from actors import Child, DynamicSupervisor, Node, Service, Topic, every, parameter, publishes
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int32
from tests.benchmarks import Contestant, Row, contest
from tests.benchmarks._peers import actor_class, clock, living, on_loop, xoscar_pool

NODES = 200
"""Of each round, alive at once."""
SHARED_OUT, SHARED_IN, OWN_OUT, OWN_IN = (
    Topic(Int32, name, 10) for name in ("state", "command", "~/state", "~/command")
)
ADD = Service(AddTwoInts, "~/add")

Figures: TypeAlias = tuple[float, float, float, float]


def run() -> list[Row]:
    contestants = [
        Contestant(
            "node with five endpoints, shared topics",
            "ours",
            lambda: on_loop(lambda: _nodes(_node(SHARED_OUT, SHARED_IN))),
        ),
        Contestant(
            "node with five endpoints, own topics", "ours", lambda: on_loop(lambda: _nodes(_node(OWN_OUT, OWN_IN)))
        ),
        Contestant("node without endpoints", "ours", lambda: on_loop(lambda: _nodes(_Empty))),
        Contestant("task with a deque", "floor", lambda: on_loop(_tasks)),
        Contestant("xoscar actor", "peer", lambda: on_loop(_xoscar), needs="xoscar"),
        Contestant("pykka actor", "peer", lambda: on_loop(_pykka), needs="pykka"),
    ]
    units = ["us of CPU to start", "us of CPU to stop", "bytes while it lives", "bytes left of it"]
    return contest(f"{NODES} actors at once", units, contestants, rounds=3)


async def _measured(start: Callable[[], Awaitable[Any]], stop: Callable[[Any], Awaitable[None]]) -> Figures:
    """Start all, stop all; once to warm up, as the interpreter specialises code that runs often, once for the time, once for the memory."""
    for one in [await start() for _ in range(NODES)]:
        await stop(one)
    begin = clock()
    alive = [await start() for _ in range(NODES)]
    started = clock()
    for one in alive:
        await stop(one)
    stopped = clock()
    del alive[:]
    gc.collect()
    tracemalloc.start()
    try:
        for _ in range(NODES):
            alive.append(await start())
        gc.collect()
        living_bytes, _ = tracemalloc.get_traced_memory()
        while alive:
            await stop(alive.pop())
        gc.collect()
        left, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    micro = 1e6 / NODES
    return (started - begin) * micro, (stopped - started) * micro, living_bytes / NODES, left / NODES


def _node(out: Topic[Int32], into: Topic[Int32]) -> type[Node]:
    """A node with the five endpoints."""

    class Worker(Node):
        state = publishes(out)
        speed = parameter(0.5, unit="m/s", ge=0.0, le=2.0)

        @into.on()
        def take(self, message: Int32) -> None: ...

        @ADD.serve()
        async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            return AddTwoInts.Response(sum=request.a + request.b)

        @every(hz=1)
        def tick(self) -> None: ...

    return Worker


class _Empty(Node):
    pass


async def _nodes(kind: type[Node]) -> Figures:
    async with living(DynamicSupervisor("workers", Child(kind, name="worker"))) as system:
        supervisor = system.supervisor
        assert supervisor is not None
        return await _measured(supervisor.spawn, supervisor.terminate_child)


async def _tasks() -> Figures:
    async def work() -> None:
        messages: deque[int] = deque()
        while not messages:
            await asyncio.get_running_loop().create_future()

    async def start() -> asyncio.Task[None]:
        task = asyncio.ensure_future(work())
        await asyncio.sleep(0)
        return task

    async def stop(task: asyncio.Task[None]) -> None:
        task.cancel()
        await asyncio.wait([task])

    return await _measured(start, stop)


def take(self: Any, message: object) -> None:
    """The one method of the actors of peers."""


def on_receive(self: Any, message: object) -> None:
    """The handler of Pykka's actors."""


async def _xoscar() -> Figures:
    async with xoscar_pool(0, take) as (xoscar, address, _):
        made = 0
        kind = actor_class("xoscar", "Actor", take)

        async def start() -> Any:
            nonlocal made
            made += 1
            return await xoscar.create_actor(kind, address=address, uid=f"worker-{made}")

        async def stop(reference: Any) -> None:
            await xoscar.destroy_actor(reference)

        return await _measured(start, stop)


async def _pykka() -> Figures:
    kind = actor_class("pykka", "ThreadingActor", on_receive)

    async def start() -> Any:
        return kind.start()

    async def stop(reference: Any) -> None:
        reference.stop()

    return await _measured(start, stop)
