"""One walk through one room: the whole robot on the virtual clock, and a body that writes down what touches what."""

from __future__ import annotations

from dataclasses import dataclass

from actors import Child, execute, run
from robot.hardware.sensors import SensorKind, Sensors
from robot.model.actuators import MOTOR_DELAY, ActuatorDesign
from robot.run.judge import Judge, Score
from robot.sim.battery import Pack
from robot.sim.ground import Ground
from robot.tree import robot_tree
from tests.figures.room_worlds import Room
from tests.figures.watched import WatchedBody

PATIENCE = 60.0
"""Seconds a goal; the way to it is some ten metres at most."""
RISING = 4.0
"""Seconds until the robot walks."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a walk went."""

    seed: int
    goals: int
    reached: int
    failures: list[str]
    """Why goals were not reached at once."""
    falls: int
    bumps: dict[str, float]
    """What any part but a foot touched while the robot was on its feet -> when, s."""
    seconds: float
    walked: float
    fastest: float
    """True speed over half a second, m/s."""

    def line(self, what: str) -> str:
        """It as a line; `what` it was a walk through."""
        bumps = "".join(f"; touched {name} at {at:g} s" for name, at in self.bumps.items())
        failures = "".join(f"; {reason}" for reason in self.failures)
        return f"{what} {self.seed}: {self.reached} of {self.goals} goals in {self.seconds:.0f} s, {self.falls} falls{bumps}{failures}"


def walk(
    room: Room,
    seed: int,
    speed: float,
    *,
    sight: bool = True,
    sensors: SensorKind = "ideal",
    ground: Ground | None = None,
    actuators: ActuatorDesign | None = None,
) -> Outcome:
    """Walk to all goals of a room, at up to `speed` m/s, on the `ground` and with the drives that are given."""
    body = WatchedBody(
        room.scene, seed=seed, delay=MOTOR_DELAY, ground=ground, actuators=actuators, sensors=Sensors.of(sensors)
    )
    waypoints = [(f"goal_{number}", pose) for number, pose in enumerate(room.goals, start=1)]
    tree = robot_tree(body, Pack(90.0), waypoints, laps=1, motor_delay=MOTOR_DELAY, sight=sight)
    score = Score()
    ended: list[float] = []

    async def main() -> None:
        async with run(tree, seed=seed, sinks=(), parameters={"/navigation": {"max_speed": speed}}) as system:
            await system.join(Child(Judge, args=(body, score)))
            body.watch(after=RISING)
            while system.clock.now() < RISING + PATIENCE * len(waypoints) and score.falls == 0:
                await system.clock.sleep(0.1)
                if sum(goal.succeeded for goal in score.goals) == len(waypoints):
                    break
            body.watch(after=float("inf"))
            ended.append(system.clock.now())

    execute(main, clock="virtual")
    return Outcome(
        seed, len(waypoints), sum(goal.succeeded for goal in score.goals),
        [goal.reason for goal in score.goals if not goal.succeeded], score.falls, dict(body.bumps), round(ended[0], 2),
        round(score.walked, 2), round(body.fastest, 3),
    )  # fmt: skip
