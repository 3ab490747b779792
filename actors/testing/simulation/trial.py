"""One run of a scenario: with a seed, in some order of events, with some faults, watched all the time."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from actors.errors import ActorError, place_of
from actors.testing.faults import Fault, Profile
from actors.testing.fuzz import FuzzLoop
from actors.testing.loop import VirtualLoop
from actors.testing.rig import Rig
from actors.testing.simulation.invariants import PATIENCE, Invariant, InvariantBroken, Watch
from actors.testing.simulation.lives import InjectedCrash, SimulatedSystem

__all__ = ["Body", "Outcome", "Scenario"]

Body = Callable[[Rig], Awaitable[None]]
"""What happens in a scenario, and what has to come of it."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a trial ended."""

    seed: int
    shuffled: bool
    faults: tuple[Fault, ...]
    error: BaseException | None
    profile: Profile
    timeline: str = ""

    @property
    def signature(self) -> tuple[str, str]:
        """What kind of failure it is: two trials with the same one have failed in the same way."""
        return (type(self.error).__name__, place_of(self.error)) if self.error is not None else ("", "")


@dataclass(frozen=True, slots=True)
class Scenario:
    """A body, and what is demanded of the system in it at all times."""

    body: Body
    invariants: tuple[Invariant, ...] = ()
    patience: float = PATIENCE
    observers: tuple[Callable[[SimulatedSystem], object], ...] = field(default=())
    """Called with each system before its tree starts."""

    def run(self, seed: int, *, shuffled: bool = True, faults: Sequence[Fault] = ()) -> Outcome:
        """One trial, from an empty event loop to the leak check. The same arguments give the same outcome."""
        profile = Profile()
        rigs: list[Rig] = []
        loop = FuzzLoop(seed) if shuffled else VirtualLoop()
        error: BaseException | None = None
        try:
            with asyncio.Runner(loop_factory=lambda: loop) as runner:
                runner.run(self._live(loop, seed, tuple(faults), profile, rigs))
        except (KeyboardInterrupt, SystemExit):
            raise
        except BaseException as caught:
            error = caught
        return Outcome(seed, shuffled, tuple(faults), error, profile, rigs[0].timeline() if rigs else "")

    async def _live(
        self, loop: VirtualLoop, seed: int, faults: tuple[Fault, ...], profile: Profile, rigs: list[Rig]
    ) -> None:
        def make(**options: Any) -> SimulatedSystem:
            options["seed"] += seed
            system = SimulatedSystem(faults, profile, **options)
            systems.append(system)
            loop.watch = Watch(system, self.invariants, self.patience)
            for observe in self.observers:
                observe(system)
            return system

        systems: list[SimulatedSystem] = []
        rig = Rig(
            make, lambda error: isinstance(error, InjectedCrash) or (bool(faults) and isinstance(error, ActorError))
        )
        rigs.append(rig)
        problems: list[BaseException] = []
        loop.set_exception_handler(lambda _, context: problems.append(_problem(context)))
        try:
            await self.body(rig)
            profile.seconds = loop.time()
        finally:
            await rig.close()
        for report in (report for system in systems for report in system.reports):
            if report.context == "shutdown_error":
                raise InvariantBroken(f"{'/'.join(report.child.path)} did not end as it was asked to: {report.reason}")
        if problems:
            raise problems[0]


def _problem(context: dict[str, Any]) -> BaseException:
    """What the event loop would only have logged: an error that nobody has taken notice of."""
    error = context.get("exception")
    return error if isinstance(error, BaseException) else RuntimeError(str(context.get("message", context)))
