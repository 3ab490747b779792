"""The supervisor against chaos: children that take their time, die when they like, and are interfered with."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from actors.supervision.child import Child
from actors.supervision.declarations import Supervisor
from actors.supervision.errors import (
    StartFailed,
    SupervisionError,
    SupervisorGaveUp,
)
from actors.supervision.policy import (
    Backoff,
    Intensity,
    Strategy,
    one_for_all,
    one_for_one,
    permanent,
    rest_for_one,
    temporary,
    transient,
)
from actors.supervision.reasons import Stop
from actors.supervision.running import RunningSupervisor
from tests.actors.supervision.kit import Script, World, child, launch, node, run_virtual, settle

NAMES = ["a", "b", "c", "d", "e"]
ids = st.sampled_from(NAMES)
restarts = st.sampled_from([permanent, transient, temporary])
intensities = st.builds(Intensity, st.integers(0, 6), st.sampled_from([0.5, 2.0, 100.0]))


times = st.sampled_from([0.0, 0.0, 0.5, 1.0, 4.0])
scripts = st.builds(
    Script,
    start=times,
    cleanup=times,
    refuse=st.sampled_from([None, None, None, OSError("refused")]),
    after=st.sampled_from([None, None, 0.5, 2.0, 7.0]),
    end=st.sampled_from([None, Stop("enough"), OSError("broken")]),
)
children = st.builds(
    child,
    restart=restarts,
    stop=st.sampled_from([2.0, 5.0, "kill"]),
    backoff=st.sampled_from([None, Backoff(0.5, 3.0)]),
    name=ids,
)
acts = st.tuples(
    st.sampled_from([0.0, 0.1, 0.7, 2.0]),
    st.sampled_from(["crash", "terminate", "restart", "delete", "start", "replace"]),
    ids,
)


class Chaos:
    """A supervisor whose children take their time, die when they like, and are interfered with."""

    def __init__(self, spec: Supervisor, scripts: dict[str, list[Script]]) -> None:
        self.world = World(**scripts)
        self.spec = spec
        self.requests: list[asyncio.Task[object]] = []

    async def run(self, script: list[tuple[float, str, str]]) -> None:
        supervisor = await launch(self.world, self.spec)
        for seconds, act, name in script:
            await asyncio.sleep(seconds)
            await settle()
            self.check(supervisor)
            if act == "crash":
                for life in self.world.alive:
                    if life.name == name:
                        life.end(OSError("crashed"))
                        break
            else:
                self.requests.append(asyncio.ensure_future(self.ask(supervisor, act, name)))
        await asyncio.sleep(1)
        await settle()
        self.check(supervisor)
        await self.stop(supervisor)

    async def ask(self, supervisor: RunningSupervisor, act: str, name: str) -> object:
        requests: dict[str, Callable[[], Coroutine[Any, Any, object]]] = {
            "terminate": lambda: supervisor.terminate_child(name),
            "restart": lambda: supervisor.restart_child(name),
            "delete": lambda: supervisor.delete_child(name),
            "replace": lambda: supervisor.replace(name, node),
            "start": lambda: supervisor.start_child(child(name)),
        }
        try:
            return await requests[act]()
        except SupervisionError as error:
            return error

    def check(self, supervisor: RunningSupervisor) -> None:
        """What holds at any moment."""
        names = self.world.names()
        assert len(names) == len(set(names)), "two incarnations of one child"
        known = {each.id: each for each in supervisor.children()}
        assert set(names) <= set(known), "a child that nobody knows"
        for each in known.values():
            if each.state == "running":
                assert names.count(each.id) == 1
                assert self.world[each.id].incarnation == each.incarnation
            if each.state == "stopped":
                assert each.id not in names
        assert supervisor.counts().active == sum(each.state == "running" for each in known.values())

    async def stop(self, supervisor: RunningSupervisor) -> None:
        """Stopping ends everything, in reverse order, in bounded time, and answers everybody."""
        begin, alive = asyncio.get_running_loop().time(), [each.id for each in supervisor.children()]
        mark = len(self.world.times)
        supervisor.stop()
        await asyncio.wait([self.world.host])
        assert asyncio.get_running_loop().time() - begin <= 6.0 * len(NAMES)
        assert self.world.names() == []
        assert supervisor.leaked == []
        stops = [name for _, event, name in self.world.times[mark:] if event == "stop"]
        assert stops == [name for name in reversed(alive) if name in stops]
        if self.requests:
            done, late = await asyncio.wait(self.requests, timeout=0.001)
            assert not late, "somebody still waits for an answer"
            assert all(request.exception() is None for request in done), "refused otherwise than in words"
        assert asyncio.all_tasks() == {asyncio.current_task()}
        error = self.world.host.exception()
        assert error is None or isinstance(error, (SupervisorGaveUp, StartFailed))


@pytest.mark.parametrize("strategy", [one_for_one, one_for_all, rest_for_one])
@given(
    members=st.lists(children, min_size=1, max_size=5, unique_by=lambda each: each.name),
    intensity=intensities,
    scripts=st.fixed_dictionaries({name: st.lists(scripts, min_size=1, max_size=4) for name in NAMES}),
    script=st.lists(acts, max_size=25),
)
@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_chaos_never_breaks_what_always_holds(
    strategy: Strategy,
    members: list[Child],
    intensity: Intensity,
    scripts: dict[str, list[Script]],
    script: list[tuple[float, str, str]],
) -> None:
    async def story() -> None:
        await Chaos(Supervisor("root", strategy=strategy, intensity=intensity, children=members), scripts).run(script)

    run_virtual(story())
