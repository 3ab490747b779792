"""The supervisor against a model of it."""

from __future__ import annotations

import asyncio
from typing import Any

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from actors.supervision.child_task import ChildTask
from actors.supervision.declarations import Supervisor
from actors.supervision.errors import (
    AlreadyPresent,
    AlreadyStarted,
    NotFound,
    Running,
    StartFailed,
    SupervisorDown,
    SupervisorGaveUp,
)
from actors.supervision.policy import (
    Intensity,
    Restart,
    Strategy,
    one_for_all,
    one_for_one,
    permanent,
    rest_for_one,
    temporary,
    transient,
)
from actors.supervision.reasons import Stop
from actors.time.virtual_loop import VirtualLoop
from tests.actors.supervision.kit import Script, ScriptedLife, World, child, launch, node, settle

NAMES = ["a", "b", "c", "d", "e"]
ids = st.sampled_from(NAMES)
restarts = st.sampled_from([permanent, transient, temporary])
strategies = st.sampled_from([one_for_one, one_for_all, rest_for_one])
ends = st.sampled_from(["return", "stop", "raise"])
intensities = st.builds(Intensity, st.integers(0, 6), st.sampled_from([0.5, 2.0, 100.0]))


class GaveUp(Exception):
    """The model has given up."""


class Known:
    """What the model knows of one child."""

    def __init__(self, name: str, restart: Restart) -> None:
        self.name = name
        self.restart = restart
        self.running = False
        self.parked = False
        self.number = 0


class Model:
    """OTP's rules for children that start and stop in no time, as plain loops over lists.

    `log` is what the world must have noted; `refusals` how many more starts of a child will fail.
    """

    def __init__(self, strategy: Strategy, intensity: Intensity, known: list[Known]) -> None:
        self.strategy = strategy
        self.intensity = intensity
        self.known = known
        self.refusals = dict.fromkeys(NAMES, 0)
        self.times: list[float] = []
        self.log: list[tuple[str, str]] = []
        self.over = False

    def find(self, name: str) -> Known | None:
        return next((each for each in self.known if each.name == name), None)

    def start(self, each: Known) -> bool:
        each.number += 1
        self.log.append(("start", each.name))
        if self.refusals[each.name]:
            self.refusals[each.name] -= 1
            return False
        self.log.append(("ready", each.name))
        each.running = True
        return True

    def stop(self, each: Known) -> None:
        self.log += [("stop", each.name), ("end", each.name)]
        each.running = False

    def stop_all(self) -> None:
        for each in reversed(self.known):
            if each.running:
                self.stop(each)
        self.over = True

    def ends(self, each: Known, how: str, now: float) -> None:
        self.log.append(("end", each.name))
        each.running = False
        if each.restart == permanent or (each.restart == transient and how == "raise"):
            self.restart(each, now)
        elif each.restart == temporary:
            self.known.remove(each)

    def restart(self, failed: Known, now: float) -> None:
        """Restart until it holds; each attempt counts."""
        due: Known | None = failed
        waiting: list[Known] = [failed]
        while due is not None:
            self.times.append(now)
            recent = [time for time in self.times if round(now - time, 9) <= self.intensity.within]
            if len(recent) > self.intensity.restarts:
                self.stop_all()
                return
            waiting = self.regroup(due, waiting)
            due = None
            while waiting:
                if not self.start(waiting[0]):
                    due = waiting[0]
                    break
                waiting.pop(0)

    def regroup(self, failed: Known, waiting: list[Known]) -> list[Known]:
        """Stop whom the strategy says; who is to be started then, in order."""
        if self.strategy == one_for_one:
            return [failed]
        place = self.known.index(failed)
        group = self.known if self.strategy == one_for_all else self.known[place:]
        due = [each for each in self.known if each in waiting]
        for each in reversed(list(group)):
            if each.running:
                self.stop(each)
                if each.restart == temporary:
                    self.known.remove(each)
                else:
                    due.append(each)
            elif each not in due and not each.parked:
                due.append(each)
        return [each for each in self.known if each in due]


class MachineWorld(World):
    """Starts are refused as often as the model says."""

    model: Model

    def life(self, task: ChildTask) -> ScriptedLife:
        id = task.ref.id
        refused = self.refusals[id] > 0
        self.refusals[id] -= refused
        self.scripts[id] = Script(refuse=OSError("refused")) if refused else Script()
        return super().life(task)

    def __init__(self) -> None:
        super().__init__()
        self.refusals = dict.fromkeys(NAMES, 0)


class SupervisorMachine(RuleBasedStateMachine):
    """Random failures and requests; after each of them supervisor and model agree on everything, order included."""

    @initialize(
        strategy=strategies,
        intensity=intensities,
        kinds=st.lists(restarts, min_size=1, max_size=4),
    )
    def begin(self, strategy: Strategy, intensity: Intensity, kinds: list[Restart]) -> None:
        self.runner = asyncio.Runner(loop_factory=VirtualLoop)
        self.model = Model(strategy, intensity, [Known(name, kind) for name, kind in zip(NAMES, kinds, strict=False)])
        children = [child(each.name, restart=each.restart) for each in self.model.known]
        self.world: MachineWorld = self.runner.run(make_world())
        self.supervisor = self.run(
            launch(self.world, Supervisor("root", strategy=strategy, intensity=intensity, children=children))
        )
        for each in self.model.known:
            self.model.start(each)

    def run(self, story: Any) -> Any:
        return self.runner.run(story)

    def request(self, story: Any) -> Any:
        """The result of a request, or the error with which it was refused."""

        async def ask() -> Any:
            try:
                return await story
            except Exception as error:
                return error
            finally:
                await settle()

        return self.run(ask())

    @property
    def now(self) -> float:
        return self.runner.get_loop().time()

    @precondition(lambda self: not self.model.over)
    @rule(name=ids, how=ends)
    def end(self, name: str, how: str) -> None:
        each = self.model.find(name)
        if each is None or not each.running:
            return

        async def end() -> None:
            self.world[name].end({"return": None, "stop": Stop("enough"), "raise": OSError("broken")}[how])
            await settle()

        self.run(end())
        self.model.ends(each, how, self.now)

    @precondition(lambda self: not self.model.over)
    @rule(name=ids, times=st.integers(1, 3))
    def refuse_to_start(self, name: str, times: int) -> None:
        self.world.refusals[name] = self.model.refusals[name] = times

    @rule(seconds=st.sampled_from([0.1, 0.5, 1.0, 3.0]))
    def wait(self, seconds: float) -> None:
        self.run(asyncio.sleep(seconds))

    @precondition(lambda self: not self.model.over)
    @rule(name=ids, kind=restarts)
    def start_child(self, name: str, kind: Restart) -> None:
        answer = self.request(self.supervisor.start_child(child(name, restart=kind)))
        known = self.model.find(name)
        if known is not None:
            assert isinstance(answer, AlreadyStarted if known.running else AlreadyPresent)
            return
        each = Known(name, kind)
        self.model.known.append(each)
        if not self.model.start(each):
            assert isinstance(answer, StartFailed)
            self.model.known.remove(each)

    @precondition(lambda self: not self.model.over)
    @rule(name=ids)
    def terminate_child(self, name: str) -> None:
        answer = self.request(self.supervisor.terminate_child(name))
        each = self.model.find(name)
        assert isinstance(answer, NotFound) if each is None else answer is None
        if each is not None:
            each.parked = True
            if each.running:
                self.model.stop(each)
            if each.restart == temporary:
                self.model.known.remove(each)

    @precondition(lambda self: not self.model.over)
    @rule(name=ids)
    def restart_child(self, name: str) -> None:
        answer = self.request(self.supervisor.restart_child(name))
        each = self.model.find(name)
        if each is None:
            assert isinstance(answer, NotFound)
        elif each.running:
            assert isinstance(answer, Running)
        else:
            each.parked = not self.model.start(each)
            assert isinstance(answer, StartFailed) is each.parked

    @precondition(lambda self: not self.model.over)
    @rule(name=ids)
    def delete_child(self, name: str) -> None:
        answer = self.request(self.supervisor.delete_child(name))
        each = self.model.find(name)
        if each is None or each.running:
            assert isinstance(answer, NotFound if each is None else Running)
        else:
            assert answer is None
            self.model.known.remove(each)

    @precondition(lambda self: not self.model.over)
    @rule(name=ids)
    def replace(self, name: str) -> None:
        answer = self.request(self.supervisor.replace(name, node))
        each = self.model.find(name)
        if each is None:
            assert isinstance(answer, NotFound)
        elif each.running:
            self.model.stop(each)
            if not self.model.start(each):
                assert isinstance(answer, StartFailed)
                each.parked = True
                if each.restart == temporary:
                    self.model.known.remove(each)

    @precondition(lambda self: self.model.over)
    @rule(name=ids)
    def ask_the_dead(self, name: str) -> None:
        assert isinstance(self.request(self.supervisor.restart_child(name)), SupervisorDown)
        assert isinstance(self.world.host.exception(), SupervisorGaveUp)

    @invariant()
    def supervisor_and_model_agree(self) -> None:
        if not hasattr(self, "model"):
            return
        assert self.world.log == self.model.log
        assert self.world.host.done() is self.model.over
        told = [(each.id, each.state, each.incarnation) for each in self.supervisor.children()]
        assert told == [(each.name, "running" if each.running else "stopped", each.number) for each in self.model.known]
        assert sorted(self.world.names()) == sorted(each.name for each in self.model.known if each.running)
        assert self.supervisor.counts().active == len(self.world.alive)

    def teardown(self) -> None:
        if not hasattr(self, "runner"):
            return
        if not self.model.over:
            self.model.stop_all()

            async def stop() -> None:
                self.supervisor.stop()
                await self.world.host

            self.run(stop())
            assert self.world.log == self.model.log
        else:
            assert isinstance(self.world.host.exception(), SupervisorGaveUp)
        self.runner.close()


async def make_world() -> MachineWorld:
    return MachineWorld()


SupervisorMachine.TestCase.settings = settings(stateful_step_count=40, deadline=None)
TestSupervisorMachine = SupervisorMachine.TestCase
