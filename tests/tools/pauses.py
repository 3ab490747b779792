"""Two processes, one of which stands still for a while: how soon does each hear the other again?

``python -m tests.tools.pauses [--seconds 0.5 1 3 10] [--wire zenoh router dds simulated] [--idle 0]`` prints a table. `router` is Zenoh with a router.
Each process publishes, serves and runs goals, and uses what the other one offers. With ``--idle`` both say nothing for so long before the stop, and
until its end. On `simulated`, nothing passes between the two for that time, and the clock is virtual.

A stop is SIGSTOP, as a debugger, swap and a suspended machine make it. The exit code is 1 if anything is heard again later than after 2 s.
"""

from __future__ import annotations

import argparse
import asyncio
import math
import os
import signal
import sys
from collections.abc import AsyncGenerator, Callable, Sequence
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from functools import partial

from actors import Action, ActorError, Child, Done, Node, Service, Steps, Topic, execute, publishes, run
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int32
from actors.testing.lab import Lab
from actors.transport.environment import transport_from_environment
from tests.actors.transport.zenoh.wires import free_port
from tests.wires import meeting_place

WIRES = ("zenoh", "router", "dds", "simulated")
WHAT = ("topic", "call", "goal")
SOON = 2.0
"""Seconds within which each has to be heard again."""
PATIENCE = 30.0
PERIOD = 0.05
OTHER = {"a": "b", "b": "a"}


class Peer(Node):
    """Publishes, serves and runs goals in its namespace, and uses all of the other one's. `heard` is called when something has come; with a time after
    which it was asked for."""

    out = publishes(Topic(Int32, "count"))

    def __init__(self, other: str, heard: Callable[[str, float], None], busy: asyncio.Event) -> None:
        super().__init__()
        self._count = Topic(Int32, f"/{other}/count")
        self._add = Service(AddTwoInts, f"/{other}/add")
        self._walk = Action(Fibonacci, f"/{other}/walk")
        self._heard, self._busy = heard, busy

    async def on_start(self) -> None:
        for using in (self._publish, self._listen, self._call, self._send):
            self.create_task(using())

    @Service(AddTwoInts, "add").serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=request.a + request.b)

    @Action(Fibonacci, "walk").serve(arrivals="parallel")
    async def walk(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        yield Fibonacci.Feedback(sequence=[0])
        yield Done(Fibonacci.Result(sequence=[0]))

    async def _publish(self) -> None:
        while await self._busy.wait():
            self.out(Int32())
            await self.clock.sleep(PERIOD)

    async def _listen(self) -> None:
        async with self.subscribe(self._count) as stream:
            async for _ in stream:
                self._heard("topic", self._now())

    async def _call(self) -> None:
        while await self._busy.wait():
            begun = self._now()
            with suppress(ActorError):
                await self.call(self._add, AddTwoInts.Request(a=1, b=2), timeout=1.0)
                self._heard("call", begun)
            await self.clock.sleep(PERIOD)

    async def _send(self) -> None:
        while await self._busy.wait():
            begun = self._now()
            with suppress(ActorError, TimeoutError):
                async with (
                    asyncio.timeout(1.0),
                    self.send_goal(self._walk, Fibonacci.Goal(order=1), timeout=1.0) as goal,
                ):
                    await goal
                self._heard("goal", begun)
            await self.clock.sleep(PERIOD)

    def _now(self) -> float:
        return asyncio.get_running_loop().time()


class Pair:
    """Two processes or hosts, and when each has heard what."""

    def __init__(self) -> None:
        self._heard: dict[tuple[str, str], float] = {}
        self._changed = asyncio.Event()

    def heard(self, who: str, what: str, at: float) -> None:
        self._heard[who, what] = max(at, self._heard.get((who, what), 0.0))
        self._changed.set()

    async def again(self, since: float) -> dict[tuple[str, str], float]:
        """Seconds from `since` until each has been heard; infinity for what is not within `PATIENCE`."""
        first: dict[tuple[str, str], float] = {}
        loop = asyncio.get_running_loop()
        with suppress(TimeoutError):
            async with asyncio.timeout(PATIENCE):
                while len(first) < 2 * len(WHAT):
                    self._changed.clear()
                    for key, at in self._heard.items():
                        if at > since:
                            first.setdefault(key, loop.time() - since)
                    await self._changed.wait()
        return {(who, what): first.get((who, what), math.inf) for who in OTHER for what in WHAT}


async def be_peer(name: str) -> None:
    """The program of one process: it writes what it hears, and is silent or busy as it reads."""
    busy = asyncio.Event()
    loop = asyncio.get_running_loop()

    def heard(what: str, at: float) -> None:
        os.write(1, f"{what} {at!r}\n".encode())

    def told() -> None:
        word = os.read(0, 1)
        busy.set() if word == b"+" else busy.clear()
        if not word:
            loop.remove_reader(0)

    loop.add_reader(0, told)
    node = Child(Peer, name="peer", namespace=f"/{name}", args=(OTHER[name], heard, busy))
    async with run(node, transport=transport_from_environment(os.environ), sinks=()) as system:
        await system.wait()


class Processes(Pair):
    """Real ones, on a wire."""

    def __init__(self, wire: str) -> None:
        super().__init__()
        self._wire = wire
        self._processes: dict[str, asyncio.subprocess.Process] = {}

    @asynccontextmanager
    async def open(self) -> AsyncGenerator[None]:
        environment = os.environ | meeting_place("dds" if self._wire == "dds" else "zenoh", free_port())
        async with AsyncExitStack() as ends:
            if self._wire == "router":
                endpoint = f"tcp/127.0.0.1:{free_port()}"
                await ends.enter_async_context(
                    _process("robot", "router", "--listen", endpoint, environment=environment)
                )
                environment["ZENOH_CONFIG_OVERRIDE"] = f'connect/endpoints=["{endpoint}"]'
            for name in OTHER:
                peer = _process("tests.tools.pauses", "--peer", name, environment=environment)
                self._processes[name] = await ends.enter_async_context(peer)
            async with asyncio.TaskGroup() as reading:
                for name, process in self._processes.items():
                    reading.create_task(self._read(name, process))
                yield
                for process in self._processes.values():
                    process.kill()

    async def _read(self, name: str, process: asyncio.subprocess.Process) -> None:
        assert process.stdout is not None
        async for line in process.stdout:
            what, at = line.split()
            self.heard(name, what.decode(), float(at))

    async def stand_still(self, name: str, seconds: float) -> None:
        self._processes[name].send_signal(signal.SIGSTOP)
        await asyncio.sleep(seconds)
        self._processes[name].send_signal(signal.SIGCONT)

    def be(self, busy: bool) -> None:
        for process in self._processes.values():
            assert process.stdin is not None
            process.stdin.write(b"+" if busy else b"-")


@asynccontextmanager
async def _process(module: str, *words: str, environment: dict[str, str]) -> AsyncGenerator[asyncio.subprocess.Process]:
    pipe = asyncio.subprocess.PIPE
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", module, *words, env=environment, stdin=pipe, stdout=pipe
    )
    try:
        yield process
    finally:
        with suppress(
            ProcessLookupError
        ):  # not `process.kill`: it takes the exit code of one that has just ended from the loop
            os.kill(process.pid, signal.SIGKILL)
        await process.wait()


class Hosts(Pair):
    """Two hosts of a simulated network. While one stands still, nothing passes between them."""

    def __init__(self) -> None:
        super().__init__()
        self._lab = Lab()
        self._busy = asyncio.Event()

    @asynccontextmanager
    async def open(self) -> AsyncGenerator[None]:
        try:
            for name, other in OTHER.items():
                args = other, partial(self.heard, name), self._busy
                await self._lab.start(name, Child(Peer, name="peer", namespace=f"/{name}", args=args))
            yield
        finally:
            await self._lab.close()

    async def stand_still(self, name: str, seconds: float) -> None:
        self._lab.cut(name, OTHER[name])
        await asyncio.sleep(seconds)
        self._lab.heal(name, OTHER[name])

    def be(self, busy: bool) -> None:
        self._busy.set() if busy else self._busy.clear()


async def measure(wire: str, seconds: Sequence[float], idle: float) -> list[str]:
    """Print the rows of one wire; what was late."""
    pair = Hosts() if wire == "simulated" else Processes(wire)
    late: list[str] = []
    loop = asyncio.get_running_loop()
    async with pair.open():
        pair.be(busy=True)
        await pair.again(0.0)
        for still in OTHER:
            for length in seconds:
                if idle:
                    pair.be(busy=False)
                await asyncio.sleep(idle or 1.0)
                await pair.stand_still(still, length)
                since = loop.time()
                pair.be(busy=True)
                again = await pair.again(since)
                times = "  ".join(f"{again[who, what]:6.2f}" for who in OTHER for what in WHAT)
                print(f"{wire:<10} {still:<5} {length:>6g}  {times}", flush=True)
                late += [
                    f"{wire}: {what} by {who} after {still} stood still for {length:g} s"
                    for (who, what), after in again.items()
                    if after > SOON
                ]
    return late


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.tools.pauses", description=__doc__)
    parser.add_argument(
        "--seconds", type=float, nargs="+", default=(0.5, 1.0, 3.0, 10.0), metavar="S", help="of the stops"
    )
    parser.add_argument("--wire", nargs="+", choices=WIRES, default=WIRES)
    parser.add_argument("--idle", type=float, default=0.0, metavar="S", help="both say nothing for so long before (0)")
    parser.add_argument("--peer", choices=OTHER, help=argparse.SUPPRESS)
    options = parser.parse_args(argv)
    if options.peer:
        execute(lambda: be_peer(options.peer))
        return 0
    print("seconds until each is heard again by a, and by b")
    print(f"{'wire':<10} stops {'s':>6}  " + "  ".join(f"{what:>6}" for what in (*WHAT, *WHAT)))
    late: list[str] = []
    for wire in options.wire:
        clock = "virtual" if wire == "simulated" else "real"
        late += execute(partial(measure, wire, options.seconds, options.idle), clock=clock)
    for line in late:
        print(f"LATE: {line}")
    return 1 if late else 0


if __name__ == "__main__":
    sys.exit(main())
