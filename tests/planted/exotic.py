"""Healthy systems with unusual parts: nobody may be blamed, whatever the order and the faults."""

from __future__ import annotations

import asyncio

import anyio

from actors import (
    Action,
    ActorError,
    Child,
    Done,
    DynamicSupervisor,
    Node,
    Parameter,
    Service,
    Steps,
    Supervisor,
    Topic,
    background,
    every,
    parameter,
    publishes,
    temporary,
)
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.rcl_interfaces.srv import SetParameters
from actors.interfaces.std_msgs.msg import Int32
from actors.interfaces.std_srvs.srv import Trigger
from actors.parameters.messages import to_parameter
from actors.system import system_of
from tests.planted.kit import ok, turns

ASK, CLIMB = Service(Trigger, "ask"), Action(Fibonacci, "climb")
NUMBERS = Topic(Int32, "numbers", 10)
SET = Service(SetParameters, "/tuned/set_parameters")


class Counter(Node):
    out = publishes(NUMBERS)

    @every(hz=5)
    def count(self) -> None:
        self.out(Int32(data=1))

    @ASK.serve(concurrent=3)
    async def answer(self, request: Trigger.Request) -> Trigger.Response:
        async with asyncio.TaskGroup() as group:
            group.create_task(asyncio.sleep(0.01))
            group.create_task(turns(3))
        return ok()


class Groups(Node):
    """Task groups, scopes, queues and locks in its handlers."""

    async def on_start(self) -> None:
        self.lock, self.queue = anyio.Lock(), asyncio.Queue[int](maxsize=3)
        self.inside = 0

    @NUMBERS.on(concurrent=3)
    async def group(self, message: Int32) -> None:
        with anyio.move_on_after(0.2):
            async with anyio.create_task_group() as group:
                for _ in range(3):
                    group.start_soon(self.alone)

    async def alone(self) -> None:
        async with self.lock:
            self.inside += 1
            assert self.inside == 1, "two have the lock"
            try:
                await asyncio.sleep(0.001)
            finally:
                self.inside -= 1

    @NUMBERS.on()
    async def ask(self, message: Int32) -> None:
        answers = await asyncio.gather(
            *(self.call(ASK, Trigger.Request(), timeout=0.5) for _ in range(3)), return_exceptions=True
        )
        assert all(isinstance(answer, (Trigger.Response, ActorError)) for answer in answers), answers

    @background
    async def produce(self) -> None:
        while True:
            await self.queue.put(1)
            await self.clock.sleep(0.05)

    @background
    async def consume(self) -> None:
        while True:
            await self.queue.get()
            await turns(2)


def groups() -> Supervisor:
    return Supervisor("groups", children=[Child(Counter), Child(Groups)])


class Climber(Node):
    """A goal with a scope and a task group around its yields."""

    @CLIMB.serve(arrivals="preempt")
    async def climb(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        async with asyncio.TaskGroup() as group:
            rope = group.create_task(asyncio.sleep(0.3))
            with anyio.move_on_after(0.5):
                for step in range(goal.order):
                    await self.clock.sleep(0.1)
                    yield Fibonacci.Feedback(sequence=[step])
            rope.cancel()
        yield Done(Fibonacci.Result())


class Guide(Node):
    @every(hz=1)
    async def lead(self) -> None:
        try:
            async with self.send_goal(CLIMB, Fibonacci.Goal(order=9)) as goal:
                async for feedback in goal:
                    if feedback.sequence[0] == 3:
                        await goal.cancel()
        except ActorError as error:
            self.log.warning("not climbed", why=str(error))


def climbers() -> Supervisor:
    return Supervisor("climbers", children=[Child(Climber), Child(Guide), Child(Guide, name="other")])


class Tuned(Node):
    gain = parameter(1.0, ge=0.0, le=10.0)

    @every(hz=10)
    def control(self) -> None:
        assert 0.0 <= self.gain <= 10.0


class Tuner(Node):
    @every(hz=2)
    async def tune(self) -> None:
        for value in (5.0, 50.0):
            wanted = [to_parameter(Parameter("gain", value))]
            try:
                answer = await self.call(SET, SetParameters.Request(parameters=wanted), timeout=1.0)
            except ActorError as error:
                self.log.warning("not tuned", why=str(error))
            else:
                assert answer.results[0].successful is (value == 5.0)


def tuned() -> Supervisor:
    return Supervisor("tuning", children=[Child(Tuned), Child(Tuner)])


class Job(Node):
    @background
    async def work(self) -> None:
        await self.clock.sleep(0.3)


class Hirer(Node):
    """Starts children while it runs, and stops them again."""

    @every(hz=1)
    async def hire(self) -> None:
        pool = system_of(self).supervisor
        assert pool is not None
        jobs = pool.life("jobs")
        try:
            ref = await jobs.spawn() if jobs is not None else None  # type: ignore[attr-defined]
            await self.clock.sleep(0.2)
            if ref is not None:
                await jobs.terminate_child(ref)  # type: ignore[union-attr]
        except ActorError as error:
            self.log.warning("no job", why=str(error))


def hirers() -> Supervisor:
    pool = DynamicSupervisor("jobs", template=Child(Job, restart=temporary))
    return Supervisor("hirers", children=[pool, Child(Hirer)])
