"""Clients, and the block of `run` itself, canceled at every step they can be canceled at: nobody is left waiting, nothing is left running."""

from __future__ import annotations

import asyncio
import functools
import gc
import types
from collections.abc import Callable, Coroutine, Generator
from itertools import product
from random import Random
from typing import Any

import anyio

from actors import (
    Action,
    Child,
    Done,
    GoalCanceled,
    Node,
    Reject,
    Service,
    Steps,
    Supervisor,
    Topic,
    every,
    open_node,
    publishes,
    run,
)
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int32
from actors.runtime.incarnation import incarnation_of
from actors.runtime.retry import retry
from actors.system import System, system_here
from actors.testing import Rig
from actors.testing.fuzz import FuzzLoop
from actors.time.virtual_loop import VirtualLoop
from tests.properties.trials import check_trials, in_loop
from tests.stage import number, order, result, step, total, two

PLAIN, MANY = Service(AddTwoInts, "plain"), Service(AddTwoInts, "many")
COUNTS = Topic(Int32, "counts")
BY_POLICY = {policy: Action(Fibonacci, policy) for policy in ("reject", "preempt", "queue", "parallel")}
GUARDED = Action(Fibonacci, "guarded")

Body = Steps[Fibonacci.Feedback, Fibonacci.Result]
Client = Callable[[Rig], Coroutine[Any, Any, None]]


class Server(Node):
    """Serves everything a client may be waiting for, never without a suspension."""

    @PLAIN.serve()
    async def plain(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        await self.clock.sleep(0.01)
        await asyncio.sleep(0)
        return total(request.a + request.b)

    @MANY.serve(concurrent=2)
    async def many(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        await self.clock.sleep(0.01)
        return total(request.a + request.b)

    @BY_POLICY["reject"].serve(arrivals="reject")
    async def one(self, goal: Fibonacci.Goal) -> Body:
        try:
            for count in range(goal.order):
                await self.clock.sleep(0.01)
                yield step(count)
        finally:
            await self.clock.sleep(0.005)
        yield Done(result(goal.order))

    @BY_POLICY["preempt"].serve(arrivals="preempt")
    async def newest(self, goal: Fibonacci.Goal) -> Body:
        await self.clock.sleep(0.01)
        yield Done(result(goal.order))

    @BY_POLICY["queue"].serve(arrivals="queue")
    async def in_turn(self, goal: Fibonacci.Goal) -> Body:
        await self.clock.sleep(0.01)
        yield Done(result(goal.order))

    @BY_POLICY["parallel"].serve(arrivals="parallel")
    async def beside(self, goal: Fibonacci.Goal) -> Body:
        await self.clock.sleep(0.01)
        yield Done(result(goal.order))

    @GUARDED.serve(arrivals="reject")
    async def guarded(self, goal: Fibonacci.Goal) -> Body:
        for count in range(goal.order):
            await self.clock.sleep(0.01)
            yield step(count)
        yield Done(result(goal.order))

    @GUARDED.accepts
    async def may_begin(self, goal: Fibonacci.Goal) -> None:
        await self.clock.sleep(0.002)
        if goal.order < 0:
            raise Reject("counts up only")

    @GUARDED.cancels
    async def may_cancel(self, goal: Fibonacci.Goal) -> bool:
        await self.clock.sleep(0.002)
        return True


class Source(Node):
    out = publishes(COUNTS)
    count = 0

    @every(hz=200)
    def tick(self) -> None:
        self.count += 1
        self.out(number(self.count))


# -- the clients -----------------------------------------------------------------------------------------------------


async def calls(rig: Rig) -> None:
    assert await rig.me.call(PLAIN, two(1, 2)) == total(3)


async def calls_many(rig: Rig) -> None:
    assert await rig.me.call(MANY, two(1, 2)) == total(3)


async def follows_a_goal(rig: Rig) -> None:
    async with rig.me.send_goal(BY_POLICY["reject"], order(3)) as goal:
        assert [feedback async for feedback in goal] == [step(0), step(1), step(2)]
        assert await goal == result(3)


async def cancels_its_goal(rig: Rig) -> None:
    async with rig.me.send_goal(BY_POLICY["reject"], order(3)) as goal:
        await anext(goal)
        await goal.cancel()
        try:
            await goal
        except GoalCanceled:
            pass


async def leaves_a_guarded_goal(rig: Rig) -> None:
    async with rig.me.send_goal(GUARDED, order(1000)) as goal:  # ten seconds, if nobody cancels it
        await anext(goal)


async def awaits_a_guarded_goal(rig: Rig) -> None:
    async with rig.me.send_goal(GUARDED, order(3)) as goal:
        assert await goal == result(3)


async def starts_two(policy: str, rig: Rig) -> None:
    action = BY_POLICY[policy]
    async with rig.me.send_goal(action, order(1)) as first, rig.me.send_goal(action, order(2)) as second:
        await second.ended()
        await first.ended()


async def reads_a_stream(rig: Rig) -> None:
    async with rig.me.subscribe(COUNTS) as stream:
        first = await stream.next(timeout=1.0)
        async for message in stream:
            if message.data == first.data + 3:
                break


async def waits_for_servers(rig: Rig) -> None:
    await rig.me.wait_for(PLAIN, MANY, GUARDED)
    await calls(rig)


async def tries_again(rig: Rig) -> None:
    assert await retry(rig.me, PLAIN, two(1, 2), attempts=3) == total(3)


async def lingers(node: Node) -> None:
    try:
        await node.clock.sleep(3600.0)
    finally:
        await node.clock.sleep(0.01)


async def has_a_node_of_its_own(rig: Rig) -> None:
    async with open_node("guest", system=rig.system) as node:
        node.create_task(lingers(node))
        async with node.subscribe(COUNTS) as stream:
            await stream.next(timeout=1.0)
        await node.call(PLAIN, two(1, 2))
        async with node.send_goal(BY_POLICY["reject"], order(1)) as goal:
            await anext(goal)


async def awaits_a_task_of_its_node(rig: Rig) -> None:
    await rig.me.create_task(calls(rig))


CLIENTS: dict[str, Client] = {
    "calls": calls,
    "calls many": calls_many,
    "follows a goal": follows_a_goal,
    "cancels its goal": cancels_its_goal,
    "leaves a guarded goal": leaves_a_guarded_goal,
    "awaits a guarded goal": awaits_a_guarded_goal,
    **{f"starts two, {policy}": functools.partial(starts_two, policy) for policy in ("queue", "preempt", "parallel")},
    "reads a stream": reads_a_stream,
    "waits for servers": waits_for_servers,
    "tries again": tries_again,
    "has a node of its own": has_a_node_of_its_own,
    "awaits a task of its node": awaits_a_task_of_its_node,
}


# -- canceling at a step ---------------------------------------------------------------------------------------------


@types.coroutine
def counted(work: Coroutine[Any, Any, None], at: Callable[[int], None]) -> Generator[Any, Any, None]:
    """Await `work`, and call `at` with 1, 2, 3 ... whenever it is about to wait."""
    resume: Callable[[Any], Any] = work.send
    value: Any = None
    steps = 0
    while True:
        try:
            awaited = resume(value)
        except StopIteration:
            return
        steps += 1
        at(steps)
        try:
            value = yield awaited
            resume = work.send
        except BaseException as error:
            resume, value = work.throw, error


def cancel_now(task: asyncio.Task[Any]) -> None:
    """In the very step: whatever it is about to wait for is canceled, too."""
    task.cancel()


def cancel_soon(task: asyncio.Task[Any]) -> None:
    task.get_loop().call_soon(task.cancel)


def cancel_later(task: asyncio.Task[Any]) -> None:
    task.get_loop().call_later(0.004, task.cancel)


HOW = {"in the step": cancel_now, "just after": cancel_soon, "4 ms later": cancel_later}


def canceled_at(first: int, times: int, how: Callable[[asyncio.Task[Any]], None]) -> Callable[[int], None]:
    """What `counted` is to call so that the present task is canceled from its `first` step on, `times` times."""

    def at(steps: int) -> None:
        if first <= steps < first + times:
            task = asyncio.current_task()
            assert task is not None
            how(task)

    return at


def steps_of(client: Client) -> int:
    """How often a client that nobody cancels waits."""
    seen: list[int] = []
    assert in_loop(VirtualLoop(), play(client, seen.append)) == []
    return len(seen)


async def play(client: Client, at: Callable[[int], None]) -> list[str]:
    """One client beside a server; what is wrong when it is over."""
    rig = Rig()
    await rig.start(Server, Source)
    task = asyncio.create_task(driven(counted(client(rig), at)))
    await asyncio.wait([task], timeout=30.0)
    problems = [] if task.done() else [f"the client never ends: {task!r}"]
    if task.done() and not task.cancelled() and (error := task.exception()) is not None:
        problems.append(f"the client got {error!r}")
    await rig.advance(1.0)
    problems += what_is_open(rig)
    for again in CLIENTS.values():
        await asyncio.wait_for(again(rig), 10.0)
    await rig.close()
    return problems


async def driven(steps: Generator[Any, Any, None]) -> None:
    await steps


def what_is_open(rig: Rig) -> list[str]:
    """Whatever should be over a second after the client."""
    core, mine = rig.state(Server).running, incarnation_of(rig.me)
    if core is None:
        return ["the server has ended"]
    actions, services, inbox = core.record.actions.values(), core.record.services.values(), core.inbox
    problems = [repr(each) for each in actions if each.running or each.waiting or each.requests]
    problems += [repr(each) for each in services if each.open() or each.waiting]
    if inbox.items or inbox.control or inbox.current:
        problems.append(f"in the inbox: {inbox.current}, {list(inbox.control)}, {list(inbox.items)}")
    problems += [f"task {task.get_name()}" for task in (*core.tasks, *mine.tasks)]
    if mine.waits_for is not None:
        problems.append(f"the client's node waits for {mine.waits_for!r}")
    if counts_read(rig.system):
        gc.collect()  # a stream that an error's traceback holds
    problems += [f"a subscription: {each}" for each in counts_read(rig.system)]
    problems += [state.identity.fqn for state in rig.system.nodes.values() if state.identity.name == "guest"]
    return problems


def counts_read(system: System) -> list[str]:
    return [repr(each) for each in system.graph.topics["/counts"].subscriptions]


@functools.cache
def cells(client: str) -> list[tuple[int, str, int, bool]]:
    """Every way to cancel this client, in an order that mixes them: first step, when, how often, whether the order is shuffled."""
    every_way = list(product(range(1, steps_of(CLIENTS[client]) + 3), HOW, (1, 2, 5), (False, True)))
    Random(client).shuffle(every_way)
    return every_way


def cancel_a_client(seed: int) -> tuple[str, list[str]]:
    """The clients take turns, and each of them goes through all its ways before one comes again."""
    names = list(CLIENTS)
    name = names[seed % len(names)]
    ways = cells(name)
    first, how, times, shuffled = ways[seed // len(names) % len(ways)]
    loop = FuzzLoop(Random(f"order {seed}").getrandbits(30)) if shuffled else VirtualLoop()
    described = f"{name}, canceled {how} at its step {first}, {times} times{', shuffled' if shuffled else ''}"
    return described, in_loop(loop, play(CLIENTS[name], canceled_at(first, times, HOW[how])))


def test_chaos_a_client_canceled_at_any_step_leaves_nothing_behind() -> None:
    check_trials("a_client_canceled_at_any_step", cancel_a_client, usual=250)


# -- the block of run ------------------------------------------------------------------------------------------------


class Part(Node):
    """Takes its time to start and to stop, and keeps a diary of both."""

    out = publishes(COUNTS)

    def __init__(self, diary: list[str]) -> None:
        self.diary = diary

    async def on_start(self) -> None:
        self.diary.append(f"start {self.name}")
        await self.clock.sleep(0.01)

    @every(hz=100)
    def tick(self) -> None:
        self.out(number(1))

    async def on_stop(self, reason: object) -> None:
        await self.clock.sleep(0.02)
        self.diary.append(f"stop {self.name}")


async def program(diary: list[str], systems: list[System]) -> None:
    tree = Supervisor("system", children=[Child(Part, args=(diary,), name=name) for name in "abc"])
    async with run(tree, sinks=()) as system:
        systems.append(system)
        async with open_node("guest") as guest:
            await guest.subscribe(COUNTS).next(timeout=1.0)
            await asyncio.sleep(0.05)


async def in_a_scope(work: Coroutine[Any, Any, None], first: int) -> None:
    """As `counted`, within an anyio scope that is canceled at the step `first`."""
    with anyio.CancelScope() as scope:
        await driven(counted(work, lambda steps: scope.cancel() if steps == first else None))


async def play_a_program(first: int, times: int) -> list[str]:
    """A whole program, canceled at one or more steps, or (0 times) by its scope; what is wrong when it is over."""
    diary: list[str] = []
    systems: list[System] = []
    work = program(diary, systems)
    how = driven(counted(work, canceled_at(first, times, cancel_soon))) if times else in_a_scope(work, first)
    task = asyncio.create_task(how)
    await asyncio.wait([task], timeout=20.0)
    left = asyncio.all_tasks() - {asyncio.current_task()}
    problems = [f"left: {each.get_name()}" for each in left]
    if not task.cancelled() and (error := task.exception()) is not None:
        problems.append(f"the program ended with {error!r}")
    started = [line.removeprefix("start ") for line in diary if line.startswith("start ")]
    stopped = [line.removeprefix("stop ") for line in diary if line.startswith("stop ")]
    if stopped != started[::-1]:
        problems.append(f"started: {started}, stopped: {stopped}")
    if system_here() is not None:
        problems.append("a system is left")
    return problems + [
        f"in the books: {system.nodes}" for system in systems if system.running or len(system.master.joined)
    ]


def cancel_a_program(seed: int) -> tuple[str, list[str]]:
    ways = list(product(range(1, 9), range(5), (False, True)))
    Random("run").shuffle(ways)
    first, times, shuffled = ways[seed % len(ways)]
    loop = FuzzLoop(Random(f"order {seed}").getrandbits(30)) if shuffled else VirtualLoop()
    how = f"canceled {times} times" if times else "in a scope canceled"
    described = f"{how} from its step {first} on{', shuffled' if shuffled else ''}"
    return described, in_loop(loop, play_a_program(first, times))


def test_chaos_a_run_canceled_at_any_step_stops_its_tree_in_order() -> None:
    check_trials("a_run_canceled_at_any_step", cancel_a_program, usual=80)
