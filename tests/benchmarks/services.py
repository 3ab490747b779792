"""Services: one call after another, and a hundred callers at once.

The floor is a deque of requests, each with the future of its caller, and one task that answers them.
"""

from __future__ import annotations

import asyncio
import importlib
from collections import deque
from collections.abc import Awaitable, Callable
from functools import partial
from typing import Any

from actors import Child, Node, Service, Supervisor
from actors.interfaces.example_interfaces.srv import AddTwoInts
from tests.benchmarks import Contestant, Row, contest
from tests.benchmarks._peers import Span, living, node_of, on_loop, pykka_actors, xoscar_pool

ADD = Service(AddTwoInts, "add")
REQUEST = AddTwoInts.Request(a=1, b=2)
CALLS = 2_000
"""Of each round; Pykka does a tenth."""
ROUNDS = 15
"""Short and many: a machine that changes its speed on the way then does so for all contestants."""
AT_ONCE = 100


def run() -> list[Row]:
    rows: list[Row] = []
    for callers, how in ((1, "one after another"), (AT_ONCE, f"{AT_ONCE} in flight")):
        contestants = [
            _contestant("node to node", "ours", _nodes, callers),
            _contestant("deque and futures", "floor", _bare, callers),
            _contestant("asyncio.Queue and futures", "peer", _queue, callers),
            _contestant("anyio memory streams", "peer", _streams, callers, needs="anyio"),
            _contestant("xoscar, local reference", "peer", _xoscar, callers, needs="xoscar"),
            _contestant("pykka, ask", "peer", _pykka, callers, needs="pykka", share=10),
        ]
        rows += contest(f"service, {how}", ["calls per CPU second"], contestants, rounds=ROUNDS)
    return rows


def _contestant(
    name: str, kind: Any, measure: Callable[[int, int], tuple[float]], callers: int, *, needs: str = "", share: int = 1
) -> Contestant:
    return Contestant(name, kind, lambda: measure(callers, CALLS // share), needs)


def answer(request: AddTwoInts.Request) -> AddTwoInts.Response:
    return AddTwoInts.Response(sum=request.a + request.b)


async def _drive(call: Callable[[], Awaitable[AddTwoInts.Response]], callers: int, calls: int) -> tuple[float]:
    """So many callers, each of which calls again as soon as it has its answer."""

    async def work() -> None:
        for _ in range(calls // callers):
            assert (await call()).sum == 3

    span = Span()
    await asyncio.gather(*(work() for _ in range(callers)))
    return span.rate(calls)


class _Adder(Node):
    @ADD.serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return answer(request)


class _Asker(Node):
    pass


def _nodes(callers: int, calls: int) -> tuple[float]:
    async def main() -> tuple[float]:
        tree = Supervisor("services", children=[Child(_Adder, name="adder"), Child(_Asker, name="asker")])
        async with living(tree) as system:
            asker = node_of(system, _Asker, "/asker")
            return await _drive(partial(asker.call, ADD, REQUEST), callers, calls)

    return on_loop(main)


def _bare(callers: int, calls: int) -> tuple[float]:
    async def main() -> tuple[float]:
        loop = asyncio.get_running_loop()
        requests: deque[tuple[AddTwoInts.Request, asyncio.Future[AddTwoInts.Response]]] = deque()
        wake: asyncio.Future[None] | None = None

        async def serve() -> None:
            nonlocal wake
            while True:
                while requests:
                    request, future = requests.popleft()
                    future.set_result(answer(request))
                wake = waiter = loop.create_future()
                await waiter

        async def call() -> AddTwoInts.Response:
            nonlocal wake
            future: asyncio.Future[AddTwoInts.Response] = loop.create_future()
            requests.append((REQUEST, future))
            if wake is not None:
                wake.set_result(None)
                wake = None
            return await future

        server = asyncio.ensure_future(serve())
        await asyncio.sleep(0)
        return await _and_end(server, call, callers, calls)

    return on_loop(main)


async def _and_end(
    server: asyncio.Future[None], call: Callable[[], Awaitable[AddTwoInts.Response]], callers: int, calls: int
) -> tuple[float]:
    try:
        return await _drive(call, callers, calls)
    finally:
        server.cancel()
        await asyncio.gather(server, return_exceptions=True)


def _queue(callers: int, calls: int) -> tuple[float]:
    async def main() -> tuple[float]:
        loop = asyncio.get_running_loop()
        requests: asyncio.Queue[tuple[AddTwoInts.Request, asyncio.Future[AddTwoInts.Response]]] = asyncio.Queue()

        async def serve() -> None:
            while True:
                request, future = await requests.get()
                future.set_result(answer(request))

        async def call() -> AddTwoInts.Response:
            future: asyncio.Future[AddTwoInts.Response] = loop.create_future()
            requests.put_nowait((REQUEST, future))
            return await future

        return await _and_end(asyncio.ensure_future(serve()), call, callers, calls)

    return on_loop(main)


def _streams(callers: int, calls: int) -> tuple[float]:
    anyio: Any = importlib.import_module("anyio")

    async def main() -> tuple[float]:
        sender, receiver = anyio.create_memory_object_stream(AT_ONCE)

        async def serve() -> None:
            async for request, reply in receiver:
                reply.send_nowait(answer(request))

        async def call() -> AddTwoInts.Response:
            reply, replied = anyio.create_memory_object_stream(1)
            with reply, replied:
                await sender.send((REQUEST, reply))
                response: AddTwoInts.Response = await replied.receive()
                return response

        with sender, receiver:
            return await _and_end(asyncio.ensure_future(serve()), call, callers, calls)

    return on_loop(main)


def add(self: Any, request: AddTwoInts.Request) -> AddTwoInts.Response:
    """The one method of xoscar's actor."""
    return answer(request)


def _xoscar(callers: int, calls: int) -> tuple[float]:
    async def main() -> tuple[float]:
        async with xoscar_pool(1, add) as (_, _, (actor,)):
            return await _drive(lambda: actor.add(REQUEST), callers, calls)

    return on_loop(main)


def _pykka(callers: int, calls: int) -> tuple[float]:
    with pykka_actors(1, on_receive) as (actor,):
        span = Span()
        for _ in range(calls // callers):
            for future in [actor.ask(REQUEST, block=False) for _ in range(callers)]:
                assert future.get().sum == 3
        return span.rate(calls)


def on_receive(self: Any, message: AddTwoInts.Request) -> AddTwoInts.Response:
    """The handler of Pykka's actor."""
    return answer(message)
