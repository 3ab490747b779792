"""What the benchmarks of communication share: the clock they measure with, and how each contestant is brought to life.

Rates are per second of the processor, all threads of this process together: what other programs do meanwhile does not count. All
event loops are those of `actors.time.real_loop.new_event_loop`, so that contestants differ in what they do on it only.
"""

from __future__ import annotations

import asyncio
import functools
import importlib
import time
from collections.abc import AsyncGenerator, Callable, Coroutine, Generator
from contextlib import asynccontextmanager, contextmanager
from typing import Any, TypeVar

from actors import Node, run
from actors.supervision.declarations import Spec
from actors.system import System
from actors.time.real_loop import new_event_loop

T = TypeVar("T")
N = TypeVar("N", bound=Node)

clock = time.process_time


class Span:
    """Seconds of the processor since it was made."""

    def __init__(self) -> None:
        self._begin = clock()

    @property
    def seconds(self) -> float:
        return clock() - self._begin

    def rate(self, events: int) -> tuple[float]:
        return (events / self.seconds,)


def on_loop(main: Callable[[], Coroutine[Any, Any, T]]) -> T:
    """Run `main()` in an event loop of its own."""
    with asyncio.Runner(loop_factory=new_event_loop) as runner:
        return runner.run(main())


@asynccontextmanager
async def living(tree: Spec) -> AsyncGenerator[System]:
    """A running system without sinks for its log."""
    async with run(tree, signals=False, sinks=()) as system:
        yield system


def node_of(system: System, kind: type[N], name: str) -> N:
    """The running node with this full name."""
    core = system.runtime.directory.find(name)
    assert core is not None
    assert isinstance(core.node, kind)
    return core.node


@functools.cache
def actor_class(library: str, base: str, method: Callable[..., Any]) -> type[Any]:
    """An actor of a peer with one method of its own: these libraries may be absent, so the class is made when it is needed."""
    name = f"{library.title()}_{method.__name__.strip('_')}"
    made = type(
        name, (getattr(importlib.import_module(library), base),), {method.__name__: method, "__module__": __name__}
    )
    globals()[name] = made  # where a peer that pickles its classes finds it
    return made


@contextmanager
def pykka_actors(count: int, method: Callable[..., Any]) -> Generator[list[Any]]:
    """Pykka's actors, each with its thread."""
    references = [actor_class("pykka", "ThreadingActor", method).start() for _ in range(count)]
    try:
        yield references
    finally:
        for reference in references:
            reference.stop()


@asynccontextmanager
async def xoscar_pool(count: int, method: Callable[..., Any]) -> AsyncGenerator[tuple[Any, str, list[Any]]]:
    """Xoscar, its pool's address, and actors in this very process, by references that call them without a channel."""
    xoscar: Any = importlib.import_module("xoscar")
    pool: Any = await xoscar.create_actor_pool("127.0.0.1", n_process=0)
    async with pool:
        address: str = pool.external_address
        kind = actor_class("xoscar", "Actor", method)
        made = [await xoscar.create_actor(kind, address=address, uid=f"actor-{index}") for index in range(count)]
        yield xoscar, address, [await xoscar.actor_ref(one) for one in made]
