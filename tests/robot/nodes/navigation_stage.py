"""The whole robot on the kinematic body in a world that may change behind the map's back."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from actors import Child, Node, every, publishes
from actors.interfaces.geometry_msgs.msg import PoseStamped, PoseWithCovariance, Twist, TwistWithCovariance, Vector3
from actors.interfaces.nav_msgs.msg import Odometry
from actors.interfaces.sensor_msgs.msg import BatteryState
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.std_srvs.srv import Trigger_Request, Trigger_Response
from actors.testing import Rig
from robot.contracts import AUTONOMY_CMD, BATTERY_STATE, GAIT_STATUS, ODOMETRY, POSE, SIT, STAND, WALK
from robot.geometry.messages import to_pose
from robot.geometry.planar import Pose2, compose, inverse
from robot.geometry.vectors import Vector
from robot.hardware.body import Truth
from robot.interfaces.humanoid_control_interfaces.action import NavigateToGoal
from robot.interfaces.my_robot_interfaces.action import MoveToPosition
from robot.interfaces.robactor_msgs.msg import GaitStatus
from robot.interfaces.your_package.action import HumanoidNav
from robot.model.parameters import SIT_HEIGHT, STAND_HEIGHT
from robot.nodes.docking import Docking
from robot.nodes.lidar import Lidar
from robot.nodes.localizer import Localizer
from robot.nodes.map_server import MapServer
from robot.nodes.navigation import Navigation
from robot.planning.grid import Grid
from robot.scenes.dock import has_station, station
from robot.scenes.scene import Obstacle, Scene
from robot.scenes.worlds import get_world
from robot.sim.battery import Pack
from robot.sim.kinematic import KinematicBody, Mode
from robot.sim.touch import Outline
from robot.tree import robot_tree

if TYPE_CHECKING:
    from actors import Supervisor

__all__ = ["ChangingBody", "humanoid", "move", "navigate", "speed", "standing_robot", "true_pose", "whole_robot"]

LEFT_OUT = ("patrol", "camera", "detector", "calibration", "frames", "robot_status")
"""What no scenario of navigation needs."""


class ChangingBody(KinematicBody):
    """A kinematic body among things that come and go: `extra(time)` says what stands there besides the mapped scene."""

    def __init__(self, scene: Scene, *, seed: int = 1) -> None:
        super().__init__(scene, seed=seed)
        self.mapped, self.mapped_start = scene, scene.start
        self.extra: Callable[[float], tuple[Obstacle, ...]] = lambda time: ()
        self.charger_works = True
        self.hidden: Callable[[float], bool] = lambda time: False
        """Whether the charging station is away."""
        self.touched: set[str] = set()
        self._shown: tuple[Obstacle, ...] = scene.obstacles

    def lidar(self, beams: int = 360, max_range: float = 10.0) -> Vector:
        self._show()
        return super().lidar(beams, max_range)

    def truth(self) -> Truth:
        self._show()
        truth = super().truth()
        self.touched.update(truth.touching)
        return truth

    def _show(self) -> None:
        away = station(self.mapped.dock) if self.hidden(self.time) else None
        shown = (*(thing for thing in self.mapped.obstacles if thing != away), *self.extra(self.time))
        if shown != self._shown:
            self._shown = shown
            self._scene = dataclasses.replace(self.mapped, obstacles=shown)
            self._outline = Outline(self._scene)


def true_pose(body: KinematicBody) -> Pose2:
    """Where the body really is."""
    truth = body.truth()
    return Pose2(float(truth.position[0]), float(truth.position[1]), truth.yaw)


def speed(body: KinematicBody) -> float:
    """Of the true body over the floor, m/s."""
    truth = body.truth()
    return math.hypot(float(truth.velocity[0]), float(truth.velocity[1]))


class Legs(Node):
    """Stands in for motors, sensors of the legs, gait and arbiter, at a tenth of their cost: obeys velocities, knows how far it went."""

    odometry = publishes(ODOMETRY)
    status = publishes(GAIT_STATUS)
    battery = publishes(BATTERY_STATE)

    def __init__(self, body: ChangingBody) -> None:
        self._body = body
        self._mode: Mode = "stand"
        self._command, self._heard = (0.0, 0.0, 0.0), 0.0

    @AUTONOMY_CMD.on()
    def command(self, message: Twist) -> None:
        self._command, self._heard = (message.linear.x, message.linear.y, message.angular.z), self.clock.now()

    @every(hz=50)
    def step(self) -> None:
        body, now = self._body, self.clock.now()
        body.advance(now)
        vx, vy, wz = self._command if now - self._heard < 0.5 else (0.0, 0.0, 0.0)
        body.drive(vx, vy, wz, SIT_HEIGHT if self._mode == "sit" else STAND_HEIGHT, self._mode)
        truth, here = body.truth(), true_pose(body)
        c, s = math.cos(here.yaw), math.sin(here.yaw)
        world_x, world_y, _ = truth.velocity.tolist()
        twist = Twist(
            linear=Vector3(x=c * world_x + s * world_y, y=c * world_y - s * world_x),
            angular=Vector3(z=float(truth.angular_velocity[2])),
        )
        self.odometry(
            Odometry(
                header=Header(stamp=self.clock.stamp(), frame_id="odom"),
                pose=PoseWithCovariance(pose=to_pose(compose(inverse(body.mapped_start), here))),
                twist=TwistWithCovariance(twist=twist),
            )
        )
        self.status(GaitStatus(stamp=self.clock.stamp(), mode=self._mode, goal=self._mode))

    @every(hz=2)
    def charge(self) -> None:
        """The charger works when the body lies on the dock, unless it is out of order."""
        charging = self._body.charger_works and self._body.charger
        state = BatteryState.POWER_SUPPLY_STATUS_CHARGING if charging else BatteryState.POWER_SUPPLY_STATUS_DISCHARGING
        self.battery(BatteryState(percentage=0.9, power_supply_status=state))

    @WALK.serve()
    async def walk(self, request: Trigger_Request) -> Trigger_Response:
        return self._ask("walk")

    @STAND.serve()
    async def stand(self, request: Trigger_Request) -> Trigger_Response:
        return self._ask("stand")

    @SIT.serve()
    async def sit(self, request: Trigger_Request) -> Trigger_Response:
        return self._ask("sit")

    def _ask(self, mode: Mode) -> Trigger_Response:
        self._mode = mode
        return Trigger_Response(success=True)


async def standing_robot(rig: Rig, world: str | Scene = "warehouse") -> ChangingBody:
    """Start LiDAR, map, localizer and navigation on legs that need no control, standing, and wait until the robot knows where it is."""
    scene = get_world(world) if isinstance(world, str) else world
    body, grid = ChangingBody(scene), Grid.from_scene(scene)
    await rig.start(
        Child(Legs, args=(body,)),
        Child(Lidar, args=(body,)),
        Child(MapServer, args=(grid, scene.places)),
        Child(Localizer, args=(grid, scene.start)),
        Child(Navigation, args=(grid,)),
        Child(Docking, args=(scene.dock, has_station(scene))),
    )
    await _known(rig)
    await rig.advance(2.0)  # until it has risen
    return body


async def whole_robot(rig: Rig, world: str | Scene = "warehouse", *, percent: float = 90.0) -> ChangingBody:
    """Start all of the robot but its mission, and wait until it knows where it is; it sits."""
    scene = get_world(world) if isinstance(world, str) else world
    body = ChangingBody(scene)
    tree: Supervisor = robot_tree(body, Pack(percent), [])
    children: list[Child | Supervisor] = [child for child in tree.children if child.name not in LEFT_OUT]  # type: ignore[misc]
    await rig.start(tree.replace(children=children))
    await _known(rig)
    return body


async def _known(rig: Rig) -> None:
    poses = rig.probe(POSE)
    await rig.until(lambda: len(poses) > 0)


def navigate(x: float, y: float, yaw: float = 0.0, frame: str = "map") -> NavigateToGoal.Goal:
    target = PoseStamped(header=Header(frame_id=frame), pose=to_pose(Pose2(x, y, yaw)))
    return NavigateToGoal.Goal(target_pose=target)


def move(x: float, y: float, yaw: float = 0.0) -> MoveToPosition.Goal:
    return MoveToPosition.Goal(target_x=x, target_y=y, target_theta=yaw)


def humanoid(x: float, y: float, yaw: float = 0.0, *, avoid: bool = True) -> HumanoidNav.Goal:
    return HumanoidNav.Goal(target_position=[x, y, yaw], avoid_obstacles=avoid)
