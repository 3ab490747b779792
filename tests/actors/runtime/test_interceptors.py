"""What stands between nodes and their world: every way leads through all interceptors, of which the first is the nearest to the node."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from actors import Done, Node, every, publishes, run
from actors.runtime.incarnation import incarnation_of
from actors.runtime.interceptor import Interceptor
from actors.services.server import Server
from actors.system import System
from actors.testing import Rig
from tests.stage import ADD, COUNT, NUMBERS, number, order, result, total, two


class Noting(Interceptor):
    """Writes into `story` what passes it."""

    def __init__(self, name: str, story: list[tuple[str, str]]) -> None:
        self._name, self._story = name, story

    def attach(self, system: System) -> None:
        system.runtime.intercept(self)

    def _passing(self, way: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def passed(*arguments: Any) -> Any:
            self._story.append((way, self._name))
            return function(*arguments)

        return passed

    def _all(self, prefix: str, ways: Any) -> Any:
        return ways._make(self._passing(f"{prefix} {name}", way) for name, way in ways._asdict().items())

    def life(self, path: tuple[str, ...], make: Callable[[], Any], /) -> Any:
        self._story.append(("life", self._name))
        return make()

    def creating_task(self, node: Any, work: Any, name: str) -> Any:
        self._story.append(("task", self._name))
        return work

    def entering(self, node: Any, what: str, enter: Callable[..., Any]) -> Callable[..., Any]:
        return self._passing(what, enter)

    def invoking(self, node: Any, label: str, handler: Callable[..., Any]) -> Callable[..., Any]:
        return self._passing(f"invoke {label}", handler)

    def calling(self, client: Any, submit: Any) -> Any:
        return self._passing("call", submit)

    def taking(self, server: Any, take: Any) -> Any:
        return self._passing("request", take)

    def handling(self, server: Any, handle: Any) -> Any:
        return self._passing("handle", handle)

    def sending_goals(self, node: Any, entry: Any, ways: Any) -> Any:
        return self._all("send", ways)

    def serving_goals(self, server: Any, ways: Any) -> Any:
        return self._all("serve", ways)

    def ticking(self, timer: Any, tick: Any) -> Any:
        return self._passing("tick", tick)

    def drawing(self, node: Any, draw: Any) -> Any:
        return self._passing("id", draw)

    def tapping(self, publisher: Any) -> Any:
        return self._passing("tap", lambda message: None) if publisher.entry.name == "/numbers" else None

    def publishing(self, publisher: Any, targets: tuple[Any, ...]) -> tuple[Any, ...]:
        def publish(message: Any) -> None:
            for target in targets:
                target(message)

        return (self._passing("publish", publish),) if publisher.entry.name == "/numbers" else targets

    def delivering(self, publisher: Any, subscription: Any, target: Any) -> Any:
        return self._passing("deliver", target) if publisher.entry.name == "/numbers" else target


class All(Node):
    """Has one of everything."""

    out = publishes(NUMBERS)
    ticks = 0

    @every(hz=1)
    def tick(self) -> None:
        self.ticks += 1

    @NUMBERS.on()
    def take(self, message: Any) -> None: ...

    @ADD.serve()
    async def add(self, request: Any) -> Any:
        return total(request.a + request.b)

    @COUNT.serve()
    async def count(self, goal: Any) -> Any:
        yield Done(result(goal.order))


class User(Node):
    pass


OUT, IN = ["near", "far"], ["far", "near"]


@pytest.mark.parametrize("plain", [False, True])
async def test_each_way_leads_through_all_from_the_node_outwards_or_back(plain: bool) -> None:
    """One that overrides nothing lets everything pass."""
    story: list[tuple[str, str]] = []
    near, far = Noting("near", story), Noting("far", story)
    between = Interceptor()

    class Between:
        def attach(self, system: System) -> None:
            system.runtime.intercept(between)

    def heard(way: str) -> list[str]:
        found = [name for each, name in story if each == way]
        story[:] = [(each, name) for each, name in story if each != way]
        return found

    observers: tuple[Any, ...] = (near, Between(), far) if plain else (near, far)
    async with run(All, User, observers=observers, sinks=()) as system:
        assert heard("life") == [*IN, *IN]
        node, user = system.node(All), system.node(User)
        node.out(number(1))
        assert (heard("publish"), heard("deliver"), heard("tap")) == (OUT, IN, OUT)
        assert (await user.call(ADD, two(1, 2))).sum == 3
        assert (heard("call"), heard("request"), heard("handle")) == (OUT, IN, IN)
        assert (heard("invoke All.take"), heard("invoke All.add")) == (IN, IN)
        async with user.send_goal(COUNT, order(3)) as goal:
            assert tuple((await goal).sequence) == (3,)
        assert (heard("id"), heard("send submit"), heard("serve submit"), heard("serve run")) == (OUT, OUT, IN, IN)
        assert (heard("task"), heard("serve ended")) == (OUT, IN)
        assert node.set_parameter("use_sim_time", False).successful
        assert heard("parameters") == IN
        system.crash(All, RuntimeError("struck"))
        assert heard("crash") == IN


async def test_a_tick_comes_from_the_clock_to_the_node() -> None:
    story: list[tuple[str, str]] = []
    async with run(All, observers=tuple(Noting(name, story) for name in OUT), sinks=()) as system:
        await system.clock.sleep(2.5)
        assert [name for way, name in story if way == "tick"] == [*IN, *IN]
        assert [name for way, name in story if way == "invoke All.tick"] == [*IN, *IN]
        assert system.node(All).ticks == 2


class Waiting(Node):
    @COUNT.serve()
    async def count(self, goal: Any) -> Any:
        await self.clock.sleep(10.0)
        yield Done(result())


async def test_a_cancellation_goes_out_of_one_node_and_into_the_other() -> None:
    story: list[tuple[str, str]] = []
    async with run(Waiting, User, observers=tuple(Noting(name, story) for name in OUT), sinks=()) as system:
        async with system.node(User).send_goal(COUNT, order(1)) as goal:
            await goal.cancel()
    assert [way for way in story if way[0].endswith("cancel")] == [
        ("send cancel", "near"), ("send cancel", "far"), ("serve cancel", "far"), ("serve cancel", "near"),
    ]  # fmt: skip


async def test_one_that_is_added_first_is_nearest_and_one_that_is_added_late_has_the_taps(rig: Rig) -> None:
    await rig.start(All)
    story: list[tuple[str, str]] = []
    Noting("far", story).attach(rig.system)
    rig.system.runtime.intercept(Noting("near", story), first=True)
    rig.node(All).out(number(1))
    assert [name for way, name in story if way == "tap"] == ["far", "near"], "in the order in which they came"
    assert [name for way, name in story if way == "publish"] == OUT


class Lives(Interceptor):
    """Is asked about lives only, as a journal is of which no node has been named."""

    def life(self, path: tuple[str, ...], make: Callable[[], Any], /) -> Any:
        return make()


async def test_a_call_passes_nobody_where_nobody_intercepts_calls() -> None:
    class Watching:
        def attach(self, system: System) -> None:
            system.runtime.intercept(Lives())

    async with run(All, User, observers=(Watching(),), sinks=()) as system:
        assert (await system.node(User).call(ADD, two(1, 2))).sum == 3
        assert type(system.graph.service("/add").local) is Server
        clients = incarnation_of(system.node(User)).endpoints.clients
        assert [client.submit for client in clients.values()] == [None]
