"""The motors follow one life of who commands them: the newest. And they end when the robot sits."""

from __future__ import annotations

import numpy as np
import pytest

from actors import Child, Supervisor
from actors.logs import WARN
from actors.runtime.placement import Placement
from actors.testing import Rig
from robot.contracts import BODY_DRIVE, MOTOR_POWER, MOTOR_TARGETS
from robot.hardware import body as hardware
from robot.interfaces.robactor_msgs.msg import BodyDrive, MotorTargets
from robot.nodes.gait import Gait
from robot.nodes.motors import Motors
from robot.nodes.proprioception import Proprioception
from robot.sim.kinematic import KinematicBody
from tests.robot.nodes.test_sensors import ROOM

OLD, NEW = Placement(1, 1).token(9), Placement(1, 2).token(1)
"""Of the ninth life on one machine, and of the first one on the next."""


class Noting(KinematicBody):
    """A body that notes the stiffness of what it is commanded, and the speed with which it is driven."""

    def __init__(self) -> None:
        super().__init__(ROOM, seed=1)
        self.commanded: list[float] = []
        self.driven: list[float] = []

    def command(self, targets: hardware.MotorTargets) -> None:
        self.commanded.append(float(targets.kp[0]))
        super().command(targets)

    def drive(self, vx: float, vy: float, wz: float, height: float, mode: str) -> None:
        self.driven.append(vx)
        super().drive(vx, vy, wz, height, mode)


def targets(fence: int, stiffness: float) -> MotorTargets:
    return MotorTargets(fence=fence, kp=np.full(12, stiffness))


async def motors(rig: Rig) -> Noting:
    body = Noting()
    await rig.start(Supervisor("robot", children=[Child(Motors, args=(body,))]))
    return body


async def test_a_late_command_of_an_old_incarnation_is_refused_counted_and_reported_once(rig: Rig) -> None:
    body = await motors(rig)
    power = rig.probe(MOTOR_POWER)

    for fence, stiffness in ((OLD, 1.0), (NEW, 2.0), (OLD, 3.0), (OLD, 4.0), (NEW, 5.0)):
        rig.publish(MOTOR_TARGETS, targets(fence, stiffness))
        await rig.quiet()
    await rig.advance(0.2)

    assert body.commanded[:3] == [1.0, 2.0, 5.0]
    assert power[-1].refused == 2
    warned = [line.fields for line in rig.logs if line.level == WARN and "refused" in line.event]
    assert warned == [{"token": "10000100009", "newest": "10000200001"}]


async def test_a_body_that_steps_by_itself_is_not_driven_by_an_old_incarnation(rig: Rig) -> None:
    body = await motors(rig)

    for fence, speed in ((NEW, 0.1), (OLD, 0.2), (NEW, 0.3)):
        rig.publish(BODY_DRIVE, BodyDrive(fence=fence, vx=speed, height=0.5, mode="stand"))
        await rig.quiet()

    assert body.driven[:2] == [0.1, 0.3]


async def test_commands_that_are_refused_do_not_hold_up_the_safe_stop(rig: Rig) -> None:
    await motors(rig)
    rig.publish(MOTOR_TARGETS, targets(NEW, 1.0))
    await rig.quiet()

    for _ in range(30):
        rig.publish(MOTOR_TARGETS, targets(OLD, 1.0))
        await rig.advance(0.01)

    assert [line.event for line in rig.logs if "sitting down" in line.event] == ["no motor targets: sitting down"]


async def test_the_next_life_of_the_motors_knows_whom_to_refuse(rig: Rig) -> None:
    body = await motors(rig)
    rig.publish(MOTOR_TARGETS, targets(NEW, 1.0))
    await rig.quiet()
    rig.crash("motors")
    await rig.settled()

    rig.publish(MOTOR_TARGETS, targets(OLD, 2.0))
    rig.publish(MOTOR_TARGETS, targets(NEW, 3.0))
    await rig.quiet()

    assert rig.incarnation("motors") == 2
    assert 2.0 not in body.commanded
    assert 3.0 in body.commanded


@pytest.mark.parametrize("commands", ["motor_targets", "body_drive"])
async def test_the_gait_says_with_each_command_which_life_of_it_gives_it(rig: Rig, commands: str) -> None:
    body = KinematicBody(ROOM, seed=1)
    children = [
        Child(Motors, args=(body,)),
        Child(Proprioception, args=(body,)),
        Child(Gait, parameters={"commands": commands}),
    ]
    await rig.start(Supervisor("robot", children=children))
    told = rig.probe(MOTOR_TARGETS if commands == "motor_targets" else BODY_DRIVE)
    await rig.advance(0.1)
    first = {message.fence for message in told}
    rig.crash("gait")
    await rig.advance(0.2)

    assert first == {1}
    assert {message.fence for message in told} == {1, 2}


@pytest.mark.parametrize(
    "wrong",
    [
        {"position": np.full(12, np.nan)},
        {"effort": np.full(12, np.inf)},
        {"velocity": np.full(12, 1e30)},
        {"kp": np.full(12, -250.0)},
    ],
)
async def test_targets_that_no_drive_can_follow_are_dropped_reported_once_and_count_as_silence(
    rig: Rig, wrong: dict[str, np.ndarray]
) -> None:
    body = await motors(rig)
    rig.publish(MOTOR_TARGETS, targets(NEW, 1.0))
    await rig.quiet()
    for _ in range(30):
        rig.publish(MOTOR_TARGETS, MotorTargets(fence=2**64 - 1, **wrong))  # its fence counts for nothing either
        await rig.advance(0.005)
    assert rig.incarnation("motors") == 1
    assert sum("no drive can follow" in line.event for line in rig.logs) == 1
    assert [line.event for line in rig.logs if "sitting down" in line.event] == ["no motor targets: sitting down"]
    rig.publish(MOTOR_TARGETS, targets(NEW, 7.0))
    await rig.quiet()
    assert 7.0 in body.commanded


async def test_a_drive_with_a_mode_or_a_speed_that_cannot_be_is_dropped(rig: Rig) -> None:
    body = await motors(rig)
    for speed, mode in ((0.1, "stand"), (np.nan, "stand"), (np.inf, "walk"), (0.2, "fly"), (0.3, "walk")):
        rig.publish(BODY_DRIVE, BodyDrive(fence=NEW, vx=float(speed), height=0.5, mode=mode))
        await rig.quiet()
    assert body.driven[:2] == [0.1, 0.3]
    assert rig.incarnation("motors") == 1


@pytest.mark.parametrize(("mode", "least", "most"), [("sit", 0.0, 0.1), ("stand", 0.5, 2.4)])
async def test_a_stop_ends_as_soon_as_the_robot_sits(rig: Rig, mode: str, least: float, most: float) -> None:
    body = Noting()
    system = await rig.start(Supervisor("robot", children=[]))
    motors = await system.join(Child(Motors, args=(body,)))
    height = {"sit": body.model.sit_height, "stand": body.model.stand_height}[mode]
    for _ in range(100):
        rig.publish(BODY_DRIVE, BodyDrive(fence=NEW, height=height, mode=mode))
        await rig.advance(0.02)
    assert (body.truth().position[2] > 0.4) == (mode == "stand")
    begun = rig.now
    await system.leave(motors)
    assert least <= rig.now - begun <= most
    assert body.truth().position[2] < 0.22
