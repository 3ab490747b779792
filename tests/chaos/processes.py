"""Each process of the robot in turn is killed with -9 at a random time of a patrol in physics. What must hold is checked, and told line by line:

- the robot never falls because of a process that is not control;
- when control dies, the drives have taken over within 300 ms, and the robot sits;
- every process is started again, and the patrol reaches a goal afterwards, or says why it does not;
- nothing is left running, and no shared memory.
"""

from __future__ import annotations

import asyncio
import os
import random
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from actors import ActorError, Child, Node, System, execute, run
from actors.interfaces.std_srvs.srv import SetBool, SetBool_Response
from robot.assembly import Robot
from robot.contracts import EMERGENCY_STOP, GAIT_STATUS, GOAL_REPORT, SAFETY_STATE
from robot.interfaces.robactor_msgs.msg import GaitStatus, GoalReport, SafetyState
from robot.link.remote import LinkedBody
from robot.link.segment import PREFIX
from tests.figures.load import family

CONCERNS = ("control", "perception", "safety", "navigation", "mission")
SAFE = 0.3
"""Within so many seconds of control's death the drives must act by themselves."""
PATIENCE = 60.0
"""For anything else to come about, s, on a machine that does other things, too."""
SITS = 0.25
"""A body whose middle is lower than this sits, m."""
GOALS_WITHIN = 90.0


@dataclass(frozen=True, slots=True)
class Kill:
    """What came of one kill; times in s from the kill on."""

    concern: str
    restarted: float | None
    fell: bool
    safe: float | None = None
    sat: float | None = None

    def faults(self) -> list[str]:
        found: list[str] = []
        if self.restarted is None:
            found.append("was not restarted")
        if self.fell and self.concern != "control":
            found.append("the robot fell")
        if self.concern == "control" and (self.safe is None or self.safe > SAFE):
            found.append(f"the drives had not taken over within {SAFE:g} s")
        if self.concern == "control" and self.sat is None:
            found.append("the robot did not sit")
        return [f"{self.concern}: {fault}" for fault in found]

    def __str__(self) -> str:
        parts = [f"{self.concern:<11}"]
        if self.concern == "control":
            parts.append(f"drives took over after {_ms(self.safe)}, sat after {_s(self.sat)}")
        parts.append(f"restarted after {_s(self.restarted)}")
        parts.append("FELL" if self.fell else "stayed on its feet" if self.concern != "control" else "did not fall")
        return ", ".join(parts)


@dataclass(slots=True)
class Notes:
    """What the witness has heard."""

    goals: list[GoalReport] = field(default_factory=lambda: [])
    gait: GaitStatus | None = None
    safety: SafetyState | None = None


class Witness(Node):
    """Listens, and clears the safety stop, as a person beside the robot does."""

    def __init__(self, notes: Notes) -> None:
        self._notes = notes

    @GOAL_REPORT.on()
    def goal(self, message: GoalReport) -> None:
        self._notes.goals.append(message)

    @GAIT_STATUS.on()
    def gait(self, message: GaitStatus) -> None:
        self._notes.gait = message

    @SAFETY_STATE.on()
    def safety(self, message: SafetyState) -> None:
        self._notes.safety = message

    async def clear(self) -> SetBool_Response:
        return await self.call(EMERGENCY_STOP, SetBool.Request(data=False), timeout=2.0)


class Chaos:
    """One run with `kills` kills."""

    def __init__(self, system: System, body: LinkedBody, seed: int) -> None:
        self._system, self._body, self._rng = system, body, random.Random(seed)
        self._notes = Notes()
        self.kills: list[Kill] = []
        self.faults: list[str] = []

    async def run(self, kills: int) -> None:
        await self._system.join(Child(Witness, args=(self._notes,)))
        for number in range(kills):
            await self._walking()
            await asyncio.sleep(self._rng.uniform(0.5, 4.0))
            kill = await self._kill(CONCERNS[number % len(CONCERNS)])
            self.kills.append(kill)
            self.faults += kill.faults()
            print(f"{self._system.clock.now():7.1f} s  kill {number + 1:>2}: {kill}", flush=True)
        await self._walking()
        reached = len(self._reached())
        if not await self._until(lambda: len(self._reached()) > reached, GOALS_WITHIN):
            reasons = [goal.reason for goal in self._notes.goals[-3:] if goal.outcome != "succeeded"]
            print(f"no goal was reached after the last kill: {reasons or 'no reason was told'}")
            if not reasons:
                self.faults.append("the patrol neither went on nor said why")
        outcomes = [
            f"{goal.name} {goal.outcome}" + (f" ({goal.reason})" if goal.reason else "") for goal in self._notes.goals
        ]
        print("goals: " + "; ".join(outcomes))

    def _reached(self) -> list[GoalReport]:
        return [goal for goal in self._notes.goals if goal.outcome == "succeeded"]

    async def _walking(self) -> None:
        """Until the robot walks; a safety stop is cleared as soon as its causes are gone."""

        def walks() -> bool:
            speed = self._body.truth().velocity
            return abs(float(speed[0])) + abs(float(speed[1])) > 0.3

        deadline = time.monotonic() + PATIENCE
        while not walks():
            if time.monotonic() > deadline:
                said = self._notes.safety.reasons if self._notes.safety is not None else ()
                self.faults.append(
                    f"the robot did not walk on within {PATIENCE:g} s: {'; '.join(said) or 'no reason was told'}"
                )
                return
            await self._clear()
            await asyncio.sleep(0.1)

    async def _until(self, true: Callable[[], bool], seconds: float) -> bool:
        deadline = time.monotonic() + seconds
        while not true() and time.monotonic() < deadline:
            await self._clear()
            await asyncio.sleep(0.1)
        return true()

    async def _clear(self) -> None:
        """End a safety stop whose causes are gone."""
        if self._notes.safety is None or not self._notes.safety.stopped or self._notes.safety.present:
            return
        witness = self._system.node("witness")
        assert isinstance(witness, Witness)
        try:
            await witness.clear()
        except ActorError as error:
            print(f"           the safety monitor does not answer: {error}")

    async def _kill(self, concern: str) -> Kill:
        """Kill the process of a concern, and watch what becomes of the robot until that is there again."""
        pid = self._process(concern)
        assert pid is not None
        os.kill(pid, signal.SIGKILL)
        at = time.monotonic()
        fell, safe, sat, restarted = False, None, None, None
        while time.monotonic() - at < PATIENCE:
            state = self._body.state()
            passed = time.monotonic() - at
            fell = fell or state.truth.fallen
            if safe is None and state.stopping:
                safe = state.at - at
            if sat is None and float(state.truth.position[2]) < SITS:
                sat = passed
            if restarted is None and self._process(concern) not in (None, pid) and self._runs(concern):
                restarted = passed
            if restarted is not None and (concern != "control" or sat is not None):
                break
            await asyncio.sleep(0.005)
        if concern != "control":
            return Kill(concern, restarted, fell)
        return Kill(concern, restarted, fell, safe, sat)

    def _process(self, concern: str) -> int | None:
        return next((record.process for record in self._records(concern) if record.process), None)

    def _runs(self, concern: str) -> bool:
        return all(record.state == "running" for record in self._records(concern))

    def _records(self, concern: str) -> list[Any]:
        return [record for record in self._system.nodes.values() if record.path[1:2] == (concern,)]


def run_kills(kills: int, seed: int) -> int:
    """Do it; 0 if everything held."""
    faults: list[str] = []

    async def main() -> None:
        robot = Robot("warehouse", mission="patrol", seed=seed, processes=True)
        try:
            assert robot.process is not None
            robot.process.ready()
            async with run(robot.tree, seed=seed, sinks=()) as system:
                print(f"{len(family(os.getpid()))} processes; load average {os.getloadavg()[0]:.1f}", flush=True)
                chaos = Chaos(system, robot.process.body, seed)
                try:
                    await chaos.run(kills)
                finally:
                    faults.extend(chaos.faults)
                _summary(chaos.kills)
        finally:
            robot.close()

    before = family(os.getpid())
    execute(main)
    faults += _left(before)
    for fault in faults:
        print(f"DID NOT HOLD: {fault}")
    if not faults:
        print(f"{kills} kills: everything held")
    return 1 if faults else 0


def _summary(kills: list[Kill]) -> None:
    for concern in CONCERNS:
        times = sorted(kill.restarted for kill in kills if kill.concern == concern and kill.restarted is not None)
        if times:
            print(f"restart of {concern:<11} {times[0]:.2f} .. {times[-1]:.2f} s")
    safe = [kill.safe for kill in kills if kill.safe is not None]
    if safe:
        print(f"drives took over after at most {_ms(max(safe))}; falls: {sum(kill.fell for kill in kills)}")


def _left(before: set[int]) -> list[str]:
    """What is still there that was not there before."""
    deadline = time.monotonic() + 5.0
    while family(os.getpid()) - before and time.monotonic() < deadline:
        time.sleep(0.05)
    left = [f"process {one} is left: {_command(one)}" for one in family(os.getpid()) - before]
    return left + [f"{path} is left" for path in Path("/dev/shm").glob(f"{PREFIX}{os.getpid()}-*")]


def _command(process: int) -> str:
    try:
        return Path(f"/proc/{process}/cmdline").read_text(encoding="utf-8").replace("\0", " ")
    except OSError:
        return ""


def _ms(seconds: float | None) -> str:
    return "never" if seconds is None else f"{1e3 * seconds:.0f} ms"


def _s(seconds: float | None) -> str:
    return "never" if seconds is None else f"{seconds:.2f} s"
