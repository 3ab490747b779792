"""The three-node lab on three hosts whose network breaks in every way, and what has to hold when it is whole again.

``python -m tests.robot.tutorials.lab_on_hosts [--seeds 500] [--first 0] [--replay TRIAL]`` tries so many seeds and prints how many failed, and the
line that replays the first failure.

Beside the nodes of the lab each host has nodes that count what is sent and what arrives, and that keep calls and goals open.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import time
import traceback
from collections.abc import Sequence
from dataclasses import dataclass, field

from actors import ActorError, Child, Done, GoalFailed, Node, Steps, Topic, background, every, publishes, qos
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.geometry_msgs.msg import Point
from actors.interfaces.std_msgs.msg import Int32
from actors.testing import Lab
from actors.testing.faults import NETWORK, draw
from actors.testing.simulation.search import shrink
from actors.testing.simulation.trial import Scenario, Trial
from robot.interfaces.tutorials.humanoid_control_interfaces.srv import PlanTrajectory
from robot.tutorials.humanoid_lab import MOTOR_COMMANDS, PLAN_TRAJECTORY, MotorController, Planner, SensorSimulator
from tests.stage import COUNT, NUMBERS, order, result, step

MODE = Topic(Int32, "mode", qos.LATCHED)
FOREVER = 1e6
"""The timeout of a call that is to be ended by its answer, or because its server is lost; seconds."""
PATIENCE = 8.0
"""How long a call or a goal may be open in a network that is whole, seconds. A goal takes 2 s."""
STORM, SETTLING, WATCHED, REST = 20.0, 3.0, 6.0, 1.3
"""Seconds: with faults, until the network counts as whole, in which what is sent must arrive, and in which it still may."""


@dataclass
class Ledger:
    """What was sent, what has arrived where, and what is open."""

    sent: list[tuple[float, int]] = field(default_factory=list[tuple[float, int]])
    received: dict[str, list[int]] = field(default_factory=dict[str, list[int]])
    """By node, since its start."""
    mode: int = 0
    """The newest mode that was published."""
    modes: dict[str, list[int]] = field(default_factory=dict[str, list[int]])
    """By node, since its start."""
    open: dict[int, tuple[str, float]] = field(default_factory=dict[int, tuple[str, float]])
    """The calls and goals that have not ended: what each is, and since when."""
    ended: dict[str, int] = field(default_factory=dict[str, int])
    """How many calls and goals have ended well or badly."""
    driven: list[float] = field(default_factory=list[float])
    """When motor commands arrived at the sensor's host."""
    numbers: itertools.count[int] = field(default_factory=lambda: itertools.count(1))

    def end(self, key: int, how: str) -> None:
        self.open.pop(key, None)
        self.ended[how] = self.ended.get(how, 0) + 1


class _Counted(Node):
    def __init__(self, ledger: Ledger) -> None:
        self.ledger = ledger

    def time(self) -> float:
        """The time on the loop, which is the same on all hosts."""
        return self.clock.loop_time(self.clock.now())


class Speaker(_Counted):
    """Publishes numbers that only increase, also over its lives, and at its start and now and then during the faults a mode."""

    numbers = publishes(NUMBERS)
    mode = publishes(MODE)

    async def on_start(self) -> None:
        self.set_mode()

    @every(hz=10)
    def count(self) -> None:
        number = next(self.ledger.numbers)
        self.ledger.sent.append((self.time(), number))
        self.numbers(Int32(data=number))

    @every(hz=0.4)
    def change_mode(self) -> None:
        if self.time() < STORM:  # so that the last one has to be kept for those who are cut off
            self.set_mode()

    def set_mode(self) -> None:
        self.ledger.mode = number = next(self.ledger.numbers)
        self.mode(Int32(data=number))


class Listener(_Counted):
    async def on_start(self) -> None:
        self.ledger.received[self.name] = self.received = []
        self.ledger.modes[self.name] = self.modes = []

    @NUMBERS.on()
    def hear(self, message: Int32) -> None:
        assert not self.received or self.received[-1] < message.data, (
            f"{self.name} heard {message.data} after {self.received[-1]}: again, or out of order"
        )
        self.received.append(message.data)

    @MODE.on()
    def hear_mode(self, message: Int32) -> None:
        assert not self.modes or self.modes[-1] <= message.data, f"{self.name} heard an old mode after a newer one"
        self.modes.append(message.data)


class Driven(_Counted):
    @MOTOR_COMMANDS.on()
    def hear(self, message: object) -> None:
        self.ledger.driven.append(self.time())


class Worker(Node):
    """Takes a second for each unit of a goal."""

    @COUNT.serve(arrivals="parallel")
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        for number in range(goal.order):
            yield step(number)
            await self.clock.sleep(1.0)
        yield Done(result(goal.order))


class Customer(_Counted):
    """Has always a call and a goal open, with no limit of time."""

    async def on_start(self) -> None:
        self.keys = itertools.count(id(self))

    @background
    async def ask(self) -> None:
        while True:
            key = self.begin("a call of /plan_trajectory")
            try:
                request = PlanTrajectory.Request(goal=Point(x=2.0, y=1.0))
                answer = await self.call(PLAN_TRAJECTORY, request, timeout=FOREVER)
                assert answer.success
                how = "answered"
            except ActorError as error:
                how = type(error).__name__
            finally:
                self.ledger.open.pop(key, None)
            self.ledger.end(key, how)
            await self.clock.sleep(0.3)

    @background
    async def work(self) -> None:
        for number in itertools.count():
            key = self.begin("a goal of /count")
            try:
                async with self.send_goal(COUNT, order(2), timeout=FOREVER) as goal:
                    if number % 3 == 2:
                        await self.clock.sleep(0.4)
                        await goal.cancel()
                    await goal
                how = "reached"
            except (GoalFailed, ActorError) as error:
                how = type(error).__name__
            finally:
                self.ledger.open.pop(key, None)
            self.ledger.end(key, how)
            await self.clock.sleep(0.3)

    def begin(self, what: str) -> int:
        key = next(self.keys)
        self.ledger.open[key] = what, self.time()
        return key


async def start_lab(lab: Lab, ledger: Ledger) -> None:
    """The lab on three hosts: the sensor's has the router, by which the motor's host reaches the others."""
    counted = (ledger,)
    await lab.start("sensor", SensorSimulator, Child(Speaker, args=counted), Child(Driven, args=counted), router=True)
    await lab.start("planner", Planner, Worker, Child(Listener, name="near", args=counted))
    customer, listener = Child(Customer, args=counted), Child(Listener, name="far", args=counted)
    await lab.start("motor", MotorController, customer, listener, mode="client")


async def keeps_its_promises(lab: Lab) -> None:
    """Whatever happens to the network for 20 s: when it is whole again, all that is sent arrives, and no call or goal stays open."""
    ledger = Ledger()
    await start_lab(lab, ledger)
    await lab.advance(STORM)
    await lab.recover()
    await lab.advance(SETTLING)
    whole = lab.loop.time()
    await lab.advance(WATCHED)
    until = lab.loop.time()
    await lab.advance(REST)

    due = [number for time, number in ledger.sent if whole <= time < until]
    assert len(due) >= 55, f"only {len(due)} numbers were sent"
    for node, received in ledger.received.items():
        missing = sorted(set(due) - set(received))
        assert not missing, f"{node} has not heard {missing} of {due[0]} to {due[-1]}"
    for node, modes in ledger.modes.items():
        assert modes[-1:] == [ledger.mode], f"{node} takes the mode for {modes[-1:]}, and it is {ledger.mode}"
    assert [time for time in ledger.driven if time > whole], "the motors stand still"
    now = lab.loop.time()
    overdue = [f"{what} since t={since:.3f} s" for what, since in ledger.open.values() if now - since > PATIENCE]
    assert not overdue, f"still open at t={now:.3f} s: {', '.join(overdue)}"
    _agree(lab)


def _agree(lab: Lab) -> None:
    """All hosts have the same picture of who is there: nobody is missing, and nobody who is gone."""
    pictures = {
        host: sorted(view.name for view in lab[host].system.snapshot().nodes if view.name != "/rig")
        for host in lab.hosts
    }
    for host, picture in pictures.items():
        assert picture == pictures["sensor"], f"{host} sees {picture}, and sensor {pictures['sensor']}"
        topic = lab[host].system.graph.topic("/numbers")
        assert (len(topic.publishers), len(topic.subscriptions)) == (1, 2), f"on {host}: {topic!r}"


SCENARIO = Scenario(keeps_its_promises, on_hosts=True)


def main(argv: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m tests.robot.tutorials.lab_on_hosts", description="Break the lab's network."
    )
    parser.add_argument("--seeds", type=int, default=500)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--replay", metavar="TRIAL")
    options = parser.parse_args(argv)
    if options.replay is not None:
        outcome = SCENARIO.play(Trial.parse(options.replay))
        print(outcome.timeline if outcome.error else "this trial passes")
        traceback.print_exception(outcome.error)
        return outcome.error is not None
    begun = time.perf_counter()
    plain = SCENARIO.play(Trial(0, shuffled=False))
    outcomes = [plain] if plain.error else []
    for seed in range(options.first, options.first + options.seeds):
        outcome = SCENARIO.play(Trial(seed, faults=draw(NETWORK, seed, plain.profile)))
        if outcome.error is not None:
            outcomes.append(outcome)
            print(f"seed {seed}: {type(outcome.error).__name__}: {str(outcome.error).splitlines()[0]}", flush=True)
    took = time.perf_counter() - begun
    print(f"{options.seeds} seeds in {took:.1f} s ({options.seeds / took:.1f} a second), {len(outcomes)} failed")
    if outcomes:
        smallest, _ = shrink(SCENARIO, outcomes[0])
        print(f"replay: python -m tests.robot.tutorials.lab_on_hosts --replay '{smallest.trial}'")
    return bool(outcomes)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
