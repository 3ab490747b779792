"""Starting and ending a program in this very process: its signals, its streams of blame, and what is left when it is broken off."""

from __future__ import annotations

import asyncio
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import Future
from typing import Any

import pytest

from actors import Child, Node, Supervisor, blocking, open_node, run
from actors.checks import create
from actors.errors import NotRunning
from actors.running.signals import interrupt
from actors.system import System, system_of

SIGNALS = [(signal.SIGINT, KeyboardInterrupt, 130), (signal.SIGTERM, SystemExit, 143), (signal.SIGHUP, SystemExit, 129)]


class Part(Node):
    """Notes its end."""

    async def on_stop(self, reason: object) -> None:
        story.append(f"stop {self.name}")


story: list[str] = []


@pytest.fixture(autouse=True)
def _signals_as_they_were() -> Iterator[None]:
    """Every test begins with an empty story and the handlers that Python has by itself, and leaves those behind."""
    story.clear()
    before = {number: signal.getsignal(number) for number, _, _ in SIGNALS}
    yield
    assert {number: signal.getsignal(number) for number, _, _ in SIGNALS} == before


def tree(*more: Child) -> Supervisor:
    return Supervisor("system", children=[Child(Part, name="a"), Child(Part, name="b"), *more])


async def for_ever() -> None:
    await asyncio.get_running_loop().create_future()


@pytest.mark.parametrize(("number", "error", "code"), SIGNALS)
def test_who_waits_for_the_system_sees_a_signal_as_its_orderly_end(
    number: signal.Signals, error: type[BaseException], code: int
) -> None:
    async def main() -> int:
        async with run(tree(), sinks=()) as system:
            asyncio.get_running_loop().call_soon(signal.raise_signal, number)
            await system.wait()
            story.append(f"{system.runtime.tree.signal!r}")
        return system.exit_code

    assert asyncio.run(main()) == code
    assert story == ["stop b", "stop a", repr(number)]


@pytest.mark.parametrize(("number", "error", "code"), SIGNALS)
def test_who_does_something_else_is_interrupted_as_the_signal_would_have_done(
    number: signal.Signals, error: type[BaseException], code: int
) -> None:
    async def main() -> None:
        async with run(tree(), sinks=()):
            asyncio.get_running_loop().call_soon(signal.raise_signal, number)
            await for_ever()

    with pytest.raises(error) as ended:
        asyncio.run(main())
    assert story == ["stop b", "stop a"]
    assert isinstance(ended.value, KeyboardInterrupt) or ended.value.args == (code,)


def test_a_signal_while_the_tree_starts_takes_the_start_back() -> None:
    class Slow(Node):
        async def on_start(self) -> None:
            signal.raise_signal(signal.SIGTERM)
            await for_ever()

    async def main() -> None:
        async with run(tree(Child(Slow)), sinks=()):
            story.append("never")

    with pytest.raises(SystemExit) as ended:
        asyncio.run(main())
    assert ended.value.code == 143
    assert story == ["stop b", "stop a"]


def test_a_second_signal_kills_what_does_not_stop() -> None:
    class Stuck(Node):
        async def on_stop(self, reason: object) -> None:
            story.append("stuck")
            for later in (0.0, 0.6):  # the first is the same signal as the one that stops the tree
                asyncio.get_running_loop().call_later(later, signal.raise_signal, signal.SIGINT)
            await for_ever()

    async def main() -> int:
        async with run(tree(Child(Stuck, stop=3600.0)), sinks=()) as system:
            asyncio.get_running_loop().call_soon(signal.raise_signal, signal.SIGINT)
            await system.wait()
        return system.exit_code

    assert asyncio.run(main()) == 130
    assert story == ["stuck"]


def test_a_start_that_somebody_else_takes_back_says_so() -> None:
    class Turncoat(Node):
        async def on_start(self) -> None:
            self.stopping = asyncio.create_task(system_of(self).stop("changed my mind"))
            await for_ever()

    async def main() -> None:
        async with run(tree(Child(Turncoat)), sinks=()):
            story.append("never")

    with pytest.raises(NotRunning, match="was stopped while it started: changed my mind"):
        asyncio.run(main())


def test_a_run_inside_a_run_gives_the_signals_back_to_the_program() -> None:
    async def main() -> None:
        async with run(tree(), sinks=()):
            async with run(Supervisor("inner", children=[Child(Part)]), sinks=()):
                pass

    asyncio.run(main())
    assert story == ["stop part", "stop b", "stop a"]


def test_a_loop_without_signal_handlers_runs_a_tree_all_the_same() -> None:
    class Elsewhere(asyncio.SelectorEventLoop):
        """As the event loops of Windows are."""

        def add_signal_handler(self, *arguments: Any) -> None:  # type: ignore[override]
            raise NotImplementedError

    async def main() -> bool:
        async with run(tree(), sinks=()) as system:
            return system.running

    with asyncio.Runner(loop_factory=Elsewhere) as runner:
        assert runner.run(main())
    assert story == ["stop b", "stop a"]


async def test_a_system_that_open_node_may_find_can_still_get_its_tree() -> None:
    system = create(System, sinks=())
    system.open()
    await system.start(tree())
    async with open_node("visitor", sinks=()) as node:
        assert system_of(node) is system
    await system.stop()


class Reluctant(Node):
    """Is told to stop, and takes its time."""

    async def on_stop(self, reason: object) -> None:
        story.append("asked")
        try:
            await for_ever()
        finally:
            story.append("killed")


async def test_D2_a_stop_that_is_canceled_again_and_again_is_carried_to_its_end() -> None:
    class Slow(Node):
        async def on_stop(self, reason: object) -> None:
            story.append(f"asked {self.name}")
            for _ in range(20):
                await asyncio.sleep(0)
            story.append(f"stopped {self.name}")

    system = create(System, sinks=())
    await system.start(tree(Child(Slow, name="mule")))
    await system.join(Child(Slow, name="guest"))
    stopping = asyncio.create_task(system.stop())
    for _ in range(5):
        await asyncio.sleep(0)
        stopping.cancel()
    await asyncio.wait([stopping])
    assert stopping.cancelled()
    assert story == ["asked guest", "stopped guest", "asked mule", "stopped mule", "stop b", "stop a"]
    assert not system.running
    assert asyncio.all_tasks() == {asyncio.current_task()}


@pytest.mark.parametrize("place", ["guest", "tree"])
async def test_a_stop_is_cut_short_by_kill_and_leaves_nothing(place: str) -> None:
    system = create(System, sinks=())
    mule = Child(Reluctant, name="mule", stop=3600.0)
    await system.start(tree(*([mule] if place == "tree" else [])))
    await system.join(Child(Part, name="first"))
    if place == "guest":
        await system.join(mule)
    stopping = asyncio.create_task(system.stop())
    while "asked" not in story:
        await asyncio.sleep(0)
    system.kill()
    await stopping
    assert story == (["stop first", "asked", "killed"] if place == "tree" else ["asked", "killed"])
    assert not system.running
    assert asyncio.all_tasks() == {asyncio.current_task()}


def test_ctrl_c_while_a_blocking_node_opens_closes_what_has_begun() -> None:
    class Interrupted(Future[Any]):
        def result(self, timeout: float | None = None) -> Any:
            super().result(timeout)
            raise KeyboardInterrupt

    before = set(threading.enumerate())
    opening = blocking.open_node("script", tree=tree())
    opening._ready = Interrupted()
    with pytest.raises(KeyboardInterrupt), opening:
        story.append("never")
    assert story == ["stop b", "stop a"]
    assert set(threading.enumerate()) == before


async def test_a_signal_that_reaches_a_system_without_a_tree_is_noted() -> None:
    system = create(System, sinks=())
    interrupt(system, signal.SIGTERM)
    assert (system.stop_reason, system.exit_code) == ("SIGTERM", 143)
    with pytest.raises(NotRunning, match="SIGTERM"):
        await system.join(Child(Part))
