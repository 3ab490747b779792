"""Random trees under random operations, crashes and cancellations, stopped at a random moment while clients still talk to them."""

from __future__ import annotations

import asyncio
import gc
from collections.abc import Awaitable, Callable
from contextlib import aclosing
from random import Random
from typing import ClassVar

from actors import (
    Action,
    ActorError,
    Backoff,
    Child,
    Done,
    DynamicSupervisor,
    Intensity,
    LifecycleNode,
    Node,
    Reject,
    Service,
    StartFailed,
    Steps,
    Supervisor,
    SupervisorGaveUp,
    Topic,
    background,
    every,
    one_for_all,
    one_for_one,
    open_node,
    permanent,
    publishes,
    qos,
    rest_for_one,
    run,
    transient,
)
from actors.actions import parallel, queue
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int32
from actors.lifecycle import bring_down, bring_up  # fmt: skip
from actors.nodes.parameter_server import ParameterServer, get_global, set_global
from actors.runtime.retry import retry
from actors.supervision.errors import SupervisionError
from actors.supervision.running import RunningSupervisor
from actors.system import System, system_here, system_of
from actors.testing.fuzz import FuzzLoop
from tests.properties.trials import check_trials, in_loop
from tests.stage import number, order, result, step, total, two

TOPICS = [Topic(Int32, f"topic{index}", quality) for index, quality in enumerate((10, 1, qos.LATCHED, 5))]
SERVICES = [Service(AddTwoInts, f"service{index}") for index in range(4)]
ACTIONS = [Action(Fibonacci, f"action{index}") for index in range(4)]
ARRIVALS = ["reject", "preempt", queue(2), parallel(2)]
CLIENTS = 8
LONG = 120.0
"""Seconds after which who still waits is taken to wait for ever; every operation of a client has a limit far below."""


class Unruly(Node):
    """Fails now and then in everything it does, and asserts that its plain handlers never overlap."""

    index: ClassVar[int]
    inside = False

    async def on_start(self) -> None:
        if self.rng.random() < 0.3:
            await self.clock.sleep(self.rng.random() * 0.2)
        if self.incarnation > 1 and self.rng.random() < 0.05:
            raise OSError("no start")

    async def on_stop(self, reason: object) -> None:
        if self.rng.random() < 0.5:
            await self.clock.sleep(self.rng.random() * 0.3)
        if self.rng.random() < 0.1:
            raise OSError("no clean stop")

    async def alone(self, work: Awaitable[object]) -> None:
        assert not self.inside, "two plain handlers at once"
        self.inside = True
        try:
            await work
        finally:
            self.inside = False

    async def dawdle(self) -> None:
        if self.rng.random() < 0.2:
            await asyncio.sleep(0)

    async def ask_around(self) -> None:
        await self.dawdle()
        if self.rng.random() < 0.05:
            try:
                await self.call(self.rng.choice(SERVICES), two(1, 2), timeout=0.2)
            except ActorError:
                pass
        if self.rng.random() < 0.01:
            raise ValueError("an unlucky tick")

    async def answer(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        if self.rng.random() < 0.3:
            await self.clock.sleep(0.05)
        if self.rng.random() < 0.1:
            raise KeyError("an unlucky request")
        return total(request.a + request.b)

    async def work(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        try:
            for count in range(goal.order):
                await self.clock.sleep(self.rng.random() * 0.05)
                yield step(count)
                if self.rng.random() < 0.03:
                    raise ValueError("an unlucky goal")
        finally:
            if self.rng.random() < 0.5:
                await self.clock.sleep(0.03)
        yield Done(result(goal.order))


def unruly(index: int) -> type[Unruly]:
    """The class of one node; two of the four have hooks that refuse now and then."""

    class One(Unruly):
        out = publishes(TOPICS[index])

        @every(hz=20)
        async def tick(self) -> None:
            await self.alone(self.ask_around())
            self.out(number(1))

        @TOPICS[(index + 1) % 4].on()
        async def take(self, message: Int32) -> None:
            await self.alone(self.dawdle())

        @TOPICS[(index + 2) % 4].on(concurrent=2)
        async def take_beside(self, message: Int32) -> None:
            await self.clock.sleep(0.01)

        @SERVICES[index].serve(concurrent=0 if index % 2 else 2)
        async def serve_it(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
            return await self.answer(request)

        @ACTIONS[index].serve(arrivals=ARRIVALS[index], result_timeout=1.0)
        async def do_it(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
            async with aclosing(
                self.work(goal)
            ) as steps:  # else its clean-up is the loop's business, at some later time
                async for item in steps:
                    yield item

        @background
        async def listen(self) -> None:
            async with self.subscribe(TOPICS[0]) as stream:
                async for _ in stream:
                    if self.rng.random() < 0.003:
                        raise OSError("an unlucky listener")

    class Guarded(One):
        @ACTIONS[index].accepts
        async def may_begin(self, goal: Fibonacci.Goal) -> None:
            await asyncio.sleep(0)
            if self.rng.random() < 0.2:
                raise Reject("not now")

        @ACTIONS[index].cancels
        async def may_cancel(self, goal: Fibonacci.Goal) -> bool:
            await asyncio.sleep(0)
            return self.rng.random() < 0.8

    return Guarded if index % 2 else One


UNRULY = [unruly(index) for index in range(4)]


class Camera(LifecycleNode):
    autostart = "active"
    out = publishes(TOPICS[0])

    async def on_configure(self, previous: object) -> None:
        await self.clock.sleep(0.02)

    @every(hz=10)
    def shoot(self) -> None:
        self.out(number(5))


class Visitor(Node):
    out = publishes(TOPICS[1])

    @every(hz=10)
    def say(self) -> None:
        self.out(number(1))


def tree(rng: Random) -> Supervisor:
    members = [
        Child(
            kind,
            name=f"unruly{index}",
            restart=rng.choice([permanent, transient]),
            stop=rng.choice([5.0, 0.1, "kill"]),
            backoff=rng.choice([None, Backoff(0.05, 0.2)]),
        )
        for index, kind in enumerate(UNRULY)
    ]
    rng.shuffle(members)
    much = Intensity(1000, within=5.0)
    strategy = rng.choice([one_for_one, one_for_all, rest_for_one])
    return Supervisor(
        "system",
        intensity=Intensity(rng.choice([3, 1000]), within=5.0),
        children=[
            Supervisor("core", strategy=strategy, intensity=much, children=members),
            Child(Camera),
            DynamicSupervisor("pool", Child(Visitor, restart=transient), intensity=much),
            Child(ParameterServer),
        ],
    )


# -- what clients do -------------------------------------------------------------------------------------------------

Operation = Callable[[Node, Random], Awaitable[object]]


def supervisor(node: Node, name: str) -> RunningSupervisor:
    """A supervisor in the tree. Raises `NotFound` when it has ended."""
    root = system_of(node).supervisor
    assert root is not None
    found = root.life((name,))
    if not isinstance(found, RunningSupervisor):
        raise SupervisionError(f"{name} does not run now")
    return found


async def call(node: Node, rng: Random) -> None:
    await node.call(rng.choice(SERVICES), two(1, 2), timeout=rng.choice([0.01, 0.5, 2.0]))


async def call_all(node: Node, rng: Random) -> None:
    await asyncio.gather(*(node.call(each, two(1, 2), timeout=0.3) for each in SERVICES), return_exceptions=True)


async def follow_a_goal(node: Node, rng: Random) -> None:
    async with node.send_goal(rng.choice(ACTIONS), order(rng.randint(1, 8)), timeout=1.0) as goal:
        enough = rng.randint(1, 8)
        async for _ in goal:
            if goal.feedback_count >= enough:
                if rng.random() < 0.5:
                    await goal.cancel()
                break
        if rng.random() < 0.5:
            await goal


async def read(node: Node, rng: Random) -> None:
    async with node.subscribe(rng.choice(TOPICS)) as stream:
        await stream.next(timeout=0.3)


async def come_and_go(node: Node, rng: Random) -> None:
    pool = supervisor(node, "pool")
    ref = await pool.spawn()
    await node.clock.sleep(rng.random() * 0.3)
    if ref is not None:
        await pool.terminate_child(ref)


async def end_one(node: Node, rng: Random) -> None:
    await supervisor(node, "core").terminate_child(f"unruly{rng.randrange(4)}")


async def start_one(node: Node, rng: Random) -> None:
    await supervisor(node, "core").restart_child(f"unruly{rng.randrange(4)}")


async def change_states(node: Node, rng: Random) -> None:
    try:
        await (bring_down if rng.random() < 0.5 else bring_up)(system_of(node))
    except RuntimeError as error:  # another client has changed them meanwhile
        if not str(error).startswith("/camera: "):
            raise


async def try_again(node: Node, rng: Random) -> None:
    await retry(node, rng.choice(SERVICES), two(1, 2), attempts=2)


async def share_a_value(node: Node, rng: Random) -> None:
    await set_global(node, "value", rng.random())
    await get_global(node, "value")


async def wait_for_all(node: Node, rng: Random) -> None:
    await node.wait_for(*SERVICES, *ACTIONS, timeout=0.2)


OPERATIONS: list[Operation] = [
    call, call_all, follow_a_goal, follow_a_goal, read, come_and_go, end_one, start_one, change_states, try_again, share_a_value, wait_for_all,
]  # fmt: skip


async def client(system: System, rng: Random, index: int) -> None:
    async with open_node(f"client{index}", system=system) as node:
        for _ in range(rng.randint(1, 6)):
            try:
                await rng.choice(OPERATIONS)(node, rng)
            except (ActorError, SupervisionError, TimeoutError):
                pass
            await system.clock.sleep(rng.random() * 0.1)


# -- one trial -------------------------------------------------------------------------------------------------------


async def interfere(system: System, rng: Random, clients: list[asyncio.Task[None]]) -> None:
    """Cancel clients, once or twice, and crash nodes, until a random moment or until all clients have ended."""
    end = rng.uniform(0.2, 3.0)
    while system.clock.now() < end and not all(task.done() for task in clients):
        await asyncio.sleep(rng.random() * 0.2)
        roll = rng.random()
        if roll < 0.3:
            task = rng.choice(clients)
            task.cancel()
            if rng.random() < 0.5:
                system.loop.call_later(rng.random() * 0.02, task.cancel)
        elif roll < 0.6:
            state = rng.choice(list(system.nodes.values()))
            if state.running is not None and system.runtime.tree.holds(state.path):
                state.running.fail(OSError("chaos"), "chaos", decided=True)


class Story:
    """A tree, clients, chaos, and an end that races them all."""

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self.rng = Random(f"chaos {seed}")
        self.system: System | None = None
        self.clients: list[asyncio.Task[None]] = []

    async def program(self) -> None:
        rng = self.rng
        async with run(tree(rng), sinks=(), seed=self.seed, signals=False) as system:
            self.system = system
            for index in range(CLIENTS):
                work = client(system, rng, index)
                self.clients.append(asyncio.create_task(work, name=f"client {index}"))
            await interfere(system, rng, self.clients)

    async def play(self) -> list[str]:
        program = asyncio.create_task(self.program(), name="program")
        if self.rng.random() < 0.3:
            asyncio.get_running_loop().call_later(self.rng.random() * 3.0, program.cancel)
        await asyncio.wait([program], timeout=LONG)
        _, late = await asyncio.wait([program, *self.clients], timeout=LONG)
        problems = [f"never ends: {task!r}" for task in late]
        for task in {program, *self.clients} - late:
            error = None if task.cancelled() else task.exception()
            if error is not None and not self.may_raise(task is program, error):
                problems.append(f"{task.get_name()}: {error!r}")
        return [*problems, *left_by(self.system)]

    def may_raise(self, program: bool, error: BaseException) -> bool:
        """A client hears of a node or of a system that is not there; the program, that its tree has given up, or could not start."""
        if not program:
            return isinstance(error, ActorError)
        return isinstance(error, SupervisorGaveUp) or (isinstance(error, StartFailed) and "no start" in str(error))


def left_by(system: System | None) -> list[str]:
    """What is left after the end, at once: nothing may take another moment."""
    left = [f"left: {task!r}" for task in asyncio.all_tasks() if task is not asyncio.current_task()]
    if system_here() is not None:
        left.append(f"left: {system_here()!r}")
    if system is None:
        return left
    if system.running or len(system.master.joined):
        left.append(f"left: {system.supervisor!r}, {len(system.master.joined)} nodes beside it")
    gc.collect()  # a stream that an error's traceback holds
    for entry in system.graph.topics.values():
        left += [f"left: {endpoint!r}" for endpoint in (*entry.publishers, *entry.subscriptions)]
    for state in system.nodes.values():
        servers = state.actions.values()
        left += [f"left: {each!r}" for each in servers if each.running or each.waiting or each.arriving]
    return left


def chaos(seed: int) -> tuple[str, list[str]]:
    loop = FuzzLoop(seed)
    return f"on {loop!r}", in_loop(loop, Story(seed).play())


def test_chaos_no_client_waits_for_ever_and_nothing_is_left() -> None:
    check_trials("no_client_waits_for_ever", chaos, usual=40)
