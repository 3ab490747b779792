"""Ends that come at an awkward moment: out of a node, during a clean-up, while a block is being left."""

from __future__ import annotations

import asyncio
import gc
import os
import signal
import sys
from typing import ClassVar

import pytest

from actors import Action, Child, Done, Node, Steps, Supervisor, background, every, execute, open_node, run
from actors.errors import NotRunning
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.std_msgs.msg import Int32
from actors.logs import LogRecord
from actors.running.run import Run
from actors.supervision.reasons import ExitReason
from actors.system import system_of
from tests.stage import NUMBERS, number

COUNT = Action(Fibonacci, "count")
posix = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")


def silent(_: LogRecord) -> None:
    """A sink for tests that do not look at the log."""


def quiet_run(*children: Child) -> Run:
    return run(Supervisor("system", children=children), sinks=(silent,))


class Ender(Node):
    """Stops its own system out of the place that `where` names."""

    where: ClassVar[str] = ""
    story: ClassVar[list[str]] = []

    async def end(self, place: str) -> None:
        if place == self.where:
            await system_of(self).stop(place)

    async def on_start(self) -> None:
        await self.end("on_start")

    @NUMBERS.on()
    async def take(self, message: Int32) -> None:
        await self.end("handler")

    @NUMBERS.on(concurrent=2)
    async def take_beside(self, message: Int32) -> None:
        await self.end("concurrent handler")

    @COUNT.serve()
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        await self.end("goal")
        yield Done(Fibonacci.Result())

    @background
    async def work(self) -> None:
        await self.clock.sleep(0.5)
        await self.end("background")

    async def on_stop(self, reason: ExitReason) -> None:
        self.story.append("on_stop")
        await self.end("on_stop")


@pytest.mark.parametrize("where", ["handler", "concurrent handler", "goal", "background", "on_start", "on_stop"])
def test_a_node_that_stops_its_system_does_not_wait_for_its_own_end(where: str) -> None:
    Ender.where, Ender.story = where, []

    async def program() -> float:
        loop = asyncio.get_running_loop()
        try:
            async with quiet_run(Child(Ender)) as system, open_node("me") as me:
                me.publisher(NUMBERS)(number(1))
                if where == "goal":
                    await me.send_goal(COUNT, Fibonacci.Goal()).send()
                if where != "on_stop":
                    await system.wait()
        except NotRunning:
            assert where == "on_start"
        assert [task for task in asyncio.all_tasks() if task is not asyncio.current_task()] == []
        return loop.time()

    assert execute(program, clock="virtual") <= 0.5
    assert Ender.story == ["on_stop"]


def test_a_guest_that_stops_the_system_ends_with_it() -> None:
    async def program() -> float:
        async with quiet_run(Child(Node, name="one")), open_node("me") as me:
            me.create_task(system_of(me).stop("enough"))
            await me.clock.sleep(0.1)
        return asyncio.get_running_loop().time()

    assert execute(program, clock="virtual") == pytest.approx(0.1)


class Unlucky(Node):
    """Fails, and then fails to start; its clean-up takes a second."""

    story: ClassVar[list[str]] = []

    async def on_start(self) -> None:
        if self.incarnation > 1:
            raise OSError("no such device")

    @every(hz=10)
    def read(self) -> None:
        raise OSError("bus error")

    async def on_stop(self, reason: ExitReason) -> None:
        await self.clock.sleep(1.0)
        self.story.append(str(reason))


def test_a_stop_does_not_cut_the_clean_up_after_a_failed_start_short() -> None:
    Unlucky.story = []

    async def program() -> None:
        async with quiet_run(Child(Unlucky)) as system:
            await asyncio.sleep(1.6)
            assert system.nodes["system", "unlucky"].incarnation == 2

    execute(program, clock="virtual")
    assert Unlucky.story == ["it raised OSError: bus error", "it raised OSError: no such device"]


class Stuck(Node):
    @every(hz=1)
    def read(self) -> None:
        if self.incarnation == 1:
            raise OSError("bus error")

    async def on_stop(self, reason: ExitReason) -> None:
        if self.incarnation == 1:
            await asyncio.sleep(3600.0)


def test_a_failing_node_without_a_stop_timeout_is_restarted_though_its_clean_up_hangs() -> None:
    async def program() -> int:
        async with quiet_run(Child(Stuck, stop="kill")) as system:
            await asyncio.sleep(10.0)
            return system.nodes["system", "stuck"].incarnation

    assert execute(program, clock="virtual") == 2


class Undecided(Node):
    @COUNT.serve()
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        await self.clock.sleep(3600.0)
        yield Done(Fibonacci.Result())

    @COUNT.cancels
    async def may(self, goal: Fibonacci.Goal) -> bool:
        await self.clock.sleep(1800.0)
        return True


def test_a_goals_block_is_left_in_time_though_the_cancels_hook_hangs() -> None:
    async def program() -> float:
        async with quiet_run(Child(Undecided)), open_node("me") as me:
            async with me.send_goal(COUNT, Fibonacci.Goal()):
                begun = me.clock.now()
            return me.clock.now() - begun

    assert execute(program, clock="virtual") == pytest.approx(5.0)


class Broken(Node):
    async def on_start(self) -> None:
        raise OSError("no such device")


class Part(Node):
    async def on_stop(self, reason: ExitReason) -> None:
        await self.clock.sleep(1.0)


def test_a_start_that_fails_and_is_canceled_leaves_no_error_to_the_loop() -> None:
    async def program() -> list[str]:
        told: list[str] = []
        asyncio.get_running_loop().set_exception_handler(lambda loop, context: told.append(str(context["message"])))

        async def start() -> None:
            async with quiet_run(Child(Part), Child(Broken)):
                pytest.fail("it has started")

        starting = asyncio.create_task(start())
        await asyncio.sleep(0.5)
        starting.cancel()
        await asyncio.wait([starting])
        assert starting.cancelled()
        gc.collect()
        return told

    assert execute(program, clock="virtual") == []


class Leaver(Node):
    @NUMBERS.on()
    async def take(self, message: Int32) -> None:
        raise BaseExceptionGroup("tasks", [ValueError("one"), BaseExceptionGroup("more", [SystemExit(7)])])


def test_an_exit_in_a_group_ends_the_program_too() -> None:
    async def program() -> None:
        async with quiet_run(Child(Leaver)) as system, open_node("me") as me:
            me.publisher(NUMBERS)(number(1))
            await asyncio.sleep(10.0)
            pytest.fail(f"it goes on: {system.nodes}")

    with pytest.raises(SystemExit) as caught:
        execute(program, clock="virtual")
    assert caught.value.code == 7


class Slow(Node):
    async def on_stop(self, reason: ExitReason) -> None:
        os.kill(os.getpid(), signal.SIGTERM)
        await asyncio.sleep(0.05)


@posix
def test_a_signal_that_comes_while_the_block_is_left_ends_the_program() -> None:
    async def program() -> None:
        async with quiet_run(Child(Slow)):
            pass
        pytest.fail("the signal is lost")

    with pytest.raises(SystemExit) as caught:
        asyncio.run(program())
    assert caught.value.code == 143


@posix
def test_a_program_has_its_own_signal_handler_back_after_the_block() -> None:
    async def program() -> list[int]:
        heard: list[int] = []
        asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, heard.append, 1)
        async with quiet_run(Child(Node, name="one")):
            pass
        os.kill(os.getpid(), signal.SIGTERM)
        await asyncio.sleep(0.05)
        return heard

    assert asyncio.run(program()) == [1]
