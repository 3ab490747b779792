"""One run of a scenario with one seed, order of events and set of faults, under constant observation."""

from __future__ import annotations

import asyncio
import functools
import math
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from actors.errors import ActorError, CallCycle, WrongThread, WrongType
from actors.places import place_of
from actors.supervision.errors import StartFailed, SupervisorGaveUp
from actors.supervision.reasons import cause_of
from actors.system import System
from actors.testing.failures import UnexpectedFailure
from actors.testing.faults import Fault, Profile, parse
from actors.testing.fuzz import FuzzLoop
from actors.testing.lab import Lab
from actors.testing.rig import Rig
from actors.testing.simulation.invariants import PATIENCE, Invariant, InvariantBroken, Watch
from actors.testing.simulation.lives import InjectedCrash, Simulation
from actors.time.virtual_loop import VirtualLoop

CLEAN_UP_SECONDS = 60.0
"""How many seconds the rest of a canceled trial has to end."""

Body: TypeAlias = Callable[[Any], Awaitable[None]]
"""The body of a scenario: it makes things happen with its `Rig` or `Lab`, and asserts the results."""
Stage: TypeAlias = "Rig | Lab"


@dataclass(frozen=True, slots=True)
class Trial:
    """All that is needed to run a scenario repeatably. Its text consists of the seed, ``fifo`` if events are in plain order, and the
    faults."""

    seed: int
    shuffled: bool = True
    faults: tuple[Fault, ...] = ()

    def __str__(self) -> str:
        return " ".join([str(self.seed), *([] if self.shuffled else ["fifo"]), *map(str, self.faults)])

    @classmethod
    def parse(cls, text: str) -> Trial:
        """Parse the text of a trial. Raises `ValueError`."""
        seed, *rest = text.split() or [""]
        if not seed.isdigit():
            raise ValueError(
                f"{text!r} is no trial: write its seed, then `fifo` if it was not shuffled, then its faults"
            )
        shuffled = rest[:1] != ["fifo"]
        return cls(int(seed), shuffled, parse(" ".join(rest if shuffled else rest[1:])))


@dataclass(frozen=True, slots=True)
class Outcome:
    """The end of a trial: its error, if any, with the profile and the log."""

    trial: Trial
    error: BaseException | None
    profile: Profile
    timeline: str
    signature: tuple[str, str]
    """The kind and place of origin of the failure; empty without an error. Trials with the same signature failed in the same way."""


@dataclass(frozen=True, slots=True)
class Scenario:
    """A body, and the invariants of the system that must hold while it runs."""

    body: Body
    invariants: tuple[Invariant, ...] = ()
    patience: float = PATIENCE
    observers: tuple[Callable[[System], object], ...] = ()
    """Called with each system before its tree starts."""
    limit: float = math.inf
    """How many virtual seconds a body may take, including the start and stop of its system, before the trial counts as endless."""
    on_hosts: bool = False
    """Whether the body is given a `Lab` instead of a `Rig`."""

    def run(self, seed: int, *, shuffled: bool = True, faults: Sequence[Fault] = ()) -> Outcome:
        """Play the trial with this seed, order and faults."""
        return self.play(Trial(seed, shuffled, tuple(faults)))

    def play(self, trial: Trial) -> Outcome:
        """Play one trial, from an empty event loop to the leak check. The same trial has the same outcome."""
        profile = Profile()
        stages: list[Stage] = []
        loop = FuzzLoop(trial.seed) if trial.shuffled else VirtualLoop()
        error: BaseException | None = None
        timeline = ""
        try:
            with asyncio.Runner(loop_factory=lambda: loop) as runner:
                try:
                    runner.run(self._live(loop, trial, profile, stages))
                except BaseException as caught:
                    error = caught
                    # Taken before the cancellations, whose log lines explain nothing.
                    timeline = stages[0].timeline() if stages else ""
                    if isinstance(error, (KeyboardInterrupt, SystemExit)):
                        raise
                loop.watch = functools.partial(_demand_end, loop, loop.time() + CLEAN_UP_SECONDS)
        except (KeyboardInterrupt, SystemExit):
            raise
        except InvariantBroken as caught:
            error = error or caught
        return Outcome(trial, error, profile, timeline or (stages[0].timeline() if stages else ""), _signature(error))

    async def _live(self, loop: VirtualLoop, trial: Trial, profile: Profile, stages: list[Stage]) -> None:
        def look() -> None:
            for watch in watches:
                watch()

        def make(**options: Any) -> System:
            options["seed"] += 0 if self.on_hosts else trial.seed
            simulation = Simulation(trial.faults, profile, **options)
            simulations.append(simulation)
            systems.append(simulation.system)
            watches.append(Watch(simulation, self.invariants, self.patience, self.limit, systems))
            loop.watch = look
            for observe in self.observers:
                observe(simulation.system)
            return simulation.system

        simulations: list[Simulation] = []
        systems: list[System] = []
        watches: list[Watch] = []
        stage = self._stage(trial, make)
        stages.append(stage)
        problems: list[BaseException] = []
        loop.set_exception_handler(lambda _, context: problems.append(_problem(context)))
        try:
            await self.body(stage)
            _measure(stage, profile, loop.time())
            for watch in watches:
                watch.look(loop.time())
            if any(simulation.deaths or simulation.system.killed for simulation in simulations):
                stage.forgive_threads()
        except BaseException as error:
            await _close_after(stage, error)
            raise
        await stage.close()
        for simulation in simulations:
            if not simulation.system.killed:
                _demand_orderly_ends(simulation)
        if problems:
            raise problems[0]

    def _stage(self, trial: Trial, make: Callable[..., System]) -> Stage:
        def excused(error: BaseException) -> bool:
            return _is_excused(error, trial.faults)

        if not self.on_hosts:
            return Rig(make, excused)
        return Lab(seed=trial.seed, make_system=make, excused=excused, faults=trial.faults)


def _measure(stage: Stage, profile: Profile, seconds: float) -> None:
    """Take down how long a body took, and on which network."""
    profile.seconds = seconds
    if isinstance(stage, Lab):
        profile.hosts, profile.router = stage.hosts, stage.has_router
        profile.faulty_seconds = seconds if stage.recovered_at is None else stage.recovered_at


def _demand_orderly_ends(simulation: Simulation) -> None:
    """Check that nodes ended when they were asked to. An end of the tree by itself and a simultaneous fault are allowed."""
    for report in simulation.system.reports:
        injected = report.reason is not None and isinstance(cause_of(report.reason), InjectedCrash)
        if report.context == "shutdown_error" and not injected:
            path = report.child.path
            where = "; ".join(filter(None, [str(report.reason), simulation.interrupted.get(path, "")]))
            raise InvariantBroken(f"{'/'.join(path)} did not end as it was asked to: {where}")


def _demand_end(loop: VirtualLoop, end: float) -> None:
    """Raise `InvariantBroken` if tasks of a finished trial, which have been canceled, still run at the loop time `end`."""
    if loop.time() > end:
        names = ", ".join(sorted(task.get_name() for task in asyncio.all_tasks(loop)))
        raise InvariantBroken(f"{CLEAN_UP_SECONDS:g} s after they were canceled these tasks go on: {names}")


async def _close_after(stage: Stage, error: BaseException) -> None:
    """Close the rig or the lab after a failure. Errors at the close are added to that failure as notes."""
    try:
        await stage.close()
    except AssertionError as more:
        error.add_note(f"and at the end {type(more).__name__}: {more}")


def _is_excused(error: BaseException, faults: Sequence[Fault]) -> bool:
    """Whether an error may be caused by faults alone, which supervisors are meant to handle. An error in the program is never excused.

    The end of the whole tree is excused only if the tree allows no restarts. A tree that allows them claims to survive such failures, and
    has not.
    """
    if isinstance(error, SupervisorGaveUp) and len(error.path) == 1:
        return error.restarts == 0 and isinstance(_origin(error), InjectedCrash)
    mistake = isinstance(error, (CallCycle, WrongThread, WrongType))
    return isinstance(error, InjectedCrash) or (bool(faults) and isinstance(error, ActorError) and not mistake)


def _origin(error: BaseException) -> BaseException:
    """The error of the node behind the errors that its supervisor and the rig raised because of it."""
    while isinstance(error, (UnexpectedFailure, StartFailed, SupervisorGaveUp)) and error.__cause__ is not None:
        error = error.__cause__
    return error


def _fault_of(error: BaseException) -> BaseException:
    """The error to fix: that of the node, or, if it was injected, that its supervisor gave up because of it."""
    origin = _origin(error)
    while isinstance(origin, InjectedCrash) and not isinstance(error, SupervisorGaveUp) and error.__cause__ is not None:
        error = error.__cause__
    return error if isinstance(origin, InjectedCrash) else origin


def _signature(error: BaseException | None) -> tuple[str, str]:
    if error is None:
        return "", ""
    fault = _fault_of(error)
    return type(fault).__name__, place_of(fault)


def _problem(context: dict[str, object]) -> BaseException:
    """The error in an exception context that the event loop would only have logged."""
    error = context.get("exception")
    return error if isinstance(error, BaseException) else RuntimeError(str(context.get("message", context)))
