"""One walk through a hall without a map, in physics and with the robot's own nodes: how far from the truth odometry then is."""

from __future__ import annotations

from itertools import pairwise
from math import hypot

from actors import Child, Node, execute, publishes, run
from actors.interfaces.geometry_msgs.msg import Twist, Vector3
from actors.interfaces.nav_msgs.msg import Odometry
from actors.interfaces.std_srvs.srv import Trigger
from robot.contracts import CMD_VEL, GAIT_STATUS, ODOMETRY, STAND, WALK
from robot.geometry.messages import from_pose
from robot.geometry.planar import Pose2
from robot.interfaces.robactor_msgs.msg import GaitStatus
from robot.model.modes import Mode
from robot.run.tree_nodes import only
from robot.sim.battery import Pack
from robot.sim.physics import PhysicsBody
from robot.sim.simulation import Simulation
from robot.tree import robot_tree
from tests.figures.fidelity import Fidelity
from tests.figures.odometry_worlds import Hall, flat_hall, rough_hall
from tests.figures.walk_measures import off

COMMAND_PERIOD = 0.2
"""s: the gait forgets a command after 0.5."""
SWAY = 25
"""Odometry messages from one place to the next that count as walking: half a second, which leaves sway out."""


def astray(seed: int, delay: float, fidelity: Fidelity, distance: float, *, rough: bool, scans: bool = True) -> float:
    """Error of odometry's end point, per cent of the way; infinite for a robot that falls, or gives up the walk. Without `scans` legs and IMU are alone."""
    hall = rough_hall(seed) if rough else flat_hall(seed)
    body = PhysicsBody(hall.scene, seed=seed, delay=delay, sensors=fidelity.errors, actuators=fidelity.drives)
    names = ["motors", "proprioception", "gait", *(("lidar", "heading") if scans else ())]
    if scans and fidelity.errors.lidar.sweep > 0.0:
        names.append("scan_correction")
    tree = only(robot_tree(body, Pack(90.0), None, motor_delay=delay), names)
    found: list[float] = []

    async def main() -> None:
        async with run(tree, seed=seed, sinks=()) as system:
            await system.join(Child(_Walker, name="walker", args=(body, hall)))
            walker = system.node("walker")
            assert isinstance(walker, _Walker)
            found.append(await walker.walk(distance))

    execute(main, clock="virtual")
    return found[0]


class _Walker(Node):
    """Walks a course, and compares odometry with the truth."""

    commands = publishes(CMD_VEL)

    def __init__(self, body: Simulation, hall: Hall) -> None:
        self._body, self._hall = body, hall
        self._mode = ""
        self._told = Pose2(0.0, 0.0)
        self._heard = 0
        self._way: list[tuple[float, float]] = []

    @GAIT_STATUS.on()
    def gait(self, message: GaitStatus) -> None:
        self._mode = message.mode

    @ODOMETRY.on()
    def odometry(self, message: Odometry) -> None:
        self._told = from_pose(message.pose.pose)
        self._heard += 1
        if self._heard % SWAY == 0:
            x, y, _ = self._true()
            self._way.append((x, y))

    async def walk(self, distance: float) -> float:
        """Stand up, and walk at least so far, m. Returns the error, per cent, or infinity."""
        await self.wait_for(STAND, WALK)
        await self.call(STAND, Trigger.Request())
        await self._until(Mode.STAND)
        start, first = self._true(), self._told
        self._way = [start[:2]]
        await self.call(WALK, Trigger.Request())
        await self._until(Mode.WALK)
        while self._walked < distance:
            vx, vy, wz = self._hall.course(self._true())
            for _ in range(round(self._hall.stretch / COMMAND_PERIOD)):
                self.commands(Twist(linear=Vector3(x=vx, y=vy), angular=Vector3(z=wz)))
                await self.clock.sleep(COMMAND_PERIOD)
            if self._body.truth().fallen or self._mode != Mode.WALK:
                return float("inf")
        end, thought = self._true(), self._told
        believed = (first.x, first.y, first.yaw), (thought.x, thought.y, thought.yaw)
        return 100.0 * off((start, end), believed) / self._walked

    @property
    def _walked(self) -> float:
        """m."""
        return sum(hypot(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(self._way))

    def _true(self) -> tuple[float, float, float]:
        """x, y and yaw now."""
        self._body.advance(self.clock.now())
        truth = self._body.truth()
        return float(truth.position[0]), float(truth.position[1]), truth.yaw

    async def _until(self, mode: Mode) -> None:
        while self._mode != mode:
            await self.clock.sleep(0.05)
