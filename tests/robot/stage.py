"""What the tests of the robot share: worlds and robots to start, a stand-in for its legs, and short words for what tests say often."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Coroutine
from typing import Any, TypeVar

from actors import Child, Node, Supervisor, every, publishes
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import (
    Point,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    Twist,
    TwistWithCovariance,
    Vector3,
)
from actors.interfaces.nav_msgs.msg import Odometry
from actors.interfaces.sensor_msgs.msg import BatteryState
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.std_srvs.srv import Trigger_Request, Trigger_Response
from actors.testing import Rig
from actors.tf2 import Buffer, TransformListener
from robot import Robot
from robot.contracts import (
    AUTONOMY_CMD,
    BATTERY_STATE,
    GAIT_STATUS,
    GET_BATTERY_STATUS,
    ODOMETRY,
    POSE,
    SIT,
    STAND,
    WALK,
)
from robot.geometry.messages import pose_stamped, to_pose
from robot.geometry.planar import Pose2, compose, inverse
from robot.hardware.sensors import Sensors
from robot.interfaces.nav2_msgs.action import NavigateToPose
from robot.interfaces.robactor_msgs.msg import GaitStatus
from robot.interfaces.tutorials.humanoid_control_interfaces.action import NavigateToGoal
from robot.interfaces.tutorials.my_robot_interfaces.action import MoveToPosition
from robot.interfaces.tutorials.my_robot_interfaces.srv import GetBatteryStatus, GetBatteryStatus_Response
from robot.interfaces.tutorials.your_package.action import HumanoidNav
from robot.model.modes import Mode
from robot.model.parameters import SIT_HEIGHT, STAND_HEIGHT
from robot.nodes.docking import Docking
from robot.nodes.lidar import Lidar
from robot.nodes.localizer import Localizer
from robot.nodes.map_server import MapServer
from robot.nodes.navigation import Navigation
from robot.nodes.tutorial_walks import TutorialWalks
from robot.planning.grid import Grid
from robot.run.tree_nodes import changed
from robot.scenes.dock import has_station, station
from robot.scenes.scene import Obstacle, Scene
from robot.scenes.worlds import get_world
from robot.sim.battery import Pack
from robot.sim.devices import SimulatedLidar
from robot.sim.kinematic import KinematicBody
from robot.sim.simulation import Simulation, Truth
from robot.tree import robot_tree

T = TypeVar("T")

# -- worlds -----------------------------------------------------------------------------------------------------------------------

KITCHEN = get_world("kitchen")
CUP = KITCHEN.things[0]
"""At (2, 1), in sight from the start; the box is known too, but behind the robot's back."""
ORIGIN = Pose2(0.0, 0.0)
OTHER_TABLE = Point(x=1.9, y=-1.0, z=0.4)


def floor(*obstacles: Obstacle, start: Pose2 = ORIGIN, half: float = 20.0) -> Scene:
    """A square floor from -`half` to `half` with these obstacles and no walls; the dock is at the origin."""
    return Scene("floor", (-half, -half, half, half), obstacles, start, ORIGIN)


def drop(body: KinematicBody, *obstacles: Obstacle) -> None:
    """Put obstacles into the body's world that its map does not show."""
    body.set_obstacles((*body.scene.obstacles, *obstacles))


def take_station_away(body: KinematicBody) -> None:
    """The charging station is gone; the map still shows it."""
    gone = station(body.scene.dock)
    body.set_obstacles([one for one in body.scene.obstacles if one != gone])


# -- robots -----------------------------------------------------------------------------------------------------------------------


def robot(world: str | Scene = "empty", *, percent: float = 90.0, seed: int = 1) -> Supervisor:
    """The robot's tree without a mission: it lies where the world has it begin, and waits to be asked."""
    return Robot(world, body="kinematic", battery=percent, seed=seed).tree


def robot_around(body: Simulation, *, percent: float = 90.0) -> Supervisor:
    """The same around a body that the test keeps hold of."""
    return robot_tree(body, Pack(percent), None)


def whole() -> Supervisor:
    """With its mission, an arm, real sensors and sight: every node that the robot can have."""
    return Robot(body="kinematic", mission="patrol", seed=1, arm=True, sensors=Sensors.real(), sight=True).tree


def without(tree: Supervisor, *names: str) -> Supervisor:
    """The tree but for some of its nodes."""
    return changed(tree, lambda child: None if child.name in names else child)


async def awake(rig: Rig, body: Simulation) -> Simulation:
    """Start the whole robot around `body` and let it find out where it is."""
    await rig.start(robot_around(body))
    await rig.advance(1.0)
    return body


async def localized_robot(rig: Rig, world: str = "warehouse") -> KinematicBody:
    """Start what a walk to a goal needs of the robot's own tree, and wait until it knows where it is; it sits."""
    body = KinematicBody(get_world(world), seed=1)
    left_out = ("camera", "detector", "calibration", "frames", "robot_status")
    await rig.start(without(robot_around(body), *left_out))
    await _known(rig)
    return body


async def standing_robot(rig: Rig, world: str | Scene = "warehouse", *, lidar: type[Lidar] = Lidar) -> KinematicBody:
    """Start LiDAR, map, localizer, navigation and docking on `Legs`, standing, and wait until the robot knows where it is."""
    scene = get_world(world) if isinstance(world, str) else world
    body, grid = KinematicBody(scene, seed=1), Grid.from_scene(scene)
    await rig.start(
        Child(Legs, args=(body,)),
        Child(lidar, args=(SimulatedLidar(body),)),
        Child(MapServer, args=(grid, scene.places)),
        Child(Localizer, args=(grid, scene.start)),
        Child(Navigation, args=(grid,)),
        Child(TutorialWalks),
        Child(Docking, args=(scene.dock, has_station(scene))),
    )
    await _known(rig)
    await rig.advance(2.0)  # until it has risen
    return body


async def _known(rig: Rig) -> None:
    poses = rig.probe(POSE)
    await rig.until(lambda: len(poses) > 0)


class Legs(Node):
    """Stands in for motors, sensors of the legs, gait, battery and arbiter, at a tenth of their cost.

    It obeys velocities and tells how far it went. `touched` are the obstacles that the body has touched so far. The charger works when
    the body lies on the dock, unless `charger_works` is false.
    """

    odometry = publishes(ODOMETRY)
    status = publishes(GAIT_STATUS)
    battery = publishes(BATTERY_STATE)

    def __init__(self, body: KinematicBody) -> None:
        self._body = body
        self._mode = Mode.STAND
        self._command, self._heard = Twist(), 0.0
        self.touched: set[str] = set()
        self.charger_works = True

    @AUTONOMY_CMD.on()
    def command(self, message: Twist) -> None:
        self._command, self._heard = message, self.clock.now()

    @every(hz=50)
    def step(self) -> None:
        body, now = self._body, self.clock.now()
        body.advance(now)
        truth = body.truth()
        self.touched.update(truth.touching)
        told = self._command if now - self._heard < 0.5 else Twist()
        height = SIT_HEIGHT if self._mode == Mode.SIT else STAND_HEIGHT
        body.drive(told.linear.x, told.linear.y, told.angular.z, height, self._mode)
        self.odometry(_odometry(truth, body.scene.start, self.clock.stamp()))
        self.status(GaitStatus(stamp=self.clock.stamp(), mode=self._mode, goal=self._mode))

    @every(hz=2)
    def charge(self) -> None:
        charging = self.charger_works and self._body.charger
        state = BatteryState.POWER_SUPPLY_STATUS_CHARGING if charging else BatteryState.POWER_SUPPLY_STATUS_DISCHARGING
        self.battery(BatteryState(percentage=0.9, power_supply_status=state))

    @WALK.serve()
    async def walk(self, request: Trigger_Request) -> Trigger_Response:
        return self._ask(Mode.WALK)

    @STAND.serve()
    async def stand(self, request: Trigger_Request) -> Trigger_Response:
        return self._ask(Mode.STAND)

    @SIT.serve()
    async def sit(self, request: Trigger_Request) -> Trigger_Response:
        return self._ask(Mode.SIT)

    def _ask(self, mode: Mode) -> Trigger_Response:
        self._mode = mode
        return Trigger_Response(success=True)


def _odometry(truth: Truth, start: Pose2, stamp: Time) -> Odometry:
    """Without drift: the true way from the start, and the true velocity in the body's axes."""
    here = _pose(truth)
    c, s = math.cos(here.yaw), math.sin(here.yaw)
    world_x, world_y, _ = truth.velocity.tolist()
    velocity = twist(c * world_x + s * world_y, c * world_y - s * world_x, wz=float(truth.angular_velocity[2]))
    return Odometry(
        header=Header(stamp=stamp, frame_id="odom"),
        pose=PoseWithCovariance(pose=to_pose(compose(inverse(start), here))),
        twist=TwistWithCovariance(twist=velocity),
    )


class Eyes(Node):
    """Somebody who listens to the frames that the robot publishes."""

    async def on_start(self) -> None:
        self.tf = Buffer()
        TransformListener(self.tf, self)


# -- where it truly is ------------------------------------------------------------------------------------------------------------


def true_pose(body: Simulation) -> Pose2:
    """Where the body really is."""
    return _pose(body.truth())


def _pose(truth: Truth) -> Pose2:
    return Pose2(float(truth.position[0]), float(truth.position[1]), truth.yaw)


def speed(body: Simulation) -> float:
    """Of the true body over the floor, m/s."""
    vx, vy, _ = body.truth().velocity.tolist()
    return math.hypot(vx, vy)


def apart(a: Pose2, b: Pose2) -> float:
    """Distance of two places, m."""
    return math.hypot(a.x - b.x, a.y - b.y)


# -- messages ---------------------------------------------------------------------------------------------------------------------


def twist(vx: float = 0.0, vy: float = 0.0, *, wz: float = 0.0) -> Twist:
    return Twist(linear=Vector3(x=vx, y=vy), angular=Vector3(z=wz))


def at(x: float, y: float, yaw: float = 0.0, frame: str = "map") -> PoseStamped:
    """A pose without a stamp."""
    return pose_stamped(Pose2(x, y, yaw), Time(), frame)


def upon(point: Point) -> PoseStamped:
    return PoseStamped(header=Header(frame_id="map"), pose=Pose(position=point))


def ahead(world: str, metres: float) -> PoseStamped:
    """The place so far in front of where the robot begins."""
    there = compose(get_world(world).start, Pose2(metres, 0.0))
    return pose_stamped(there, Time())


def to_place(x: float, y: float, yaw: float = 0.0, frame: str = "map", behavior_tree: str = "") -> NavigateToPose.Goal:
    return NavigateToPose.Goal(pose=at(x, y, yaw, frame), behavior_tree=behavior_tree)


def navigate(x: float, y: float, yaw: float = 0.0, frame: str = "map") -> NavigateToGoal.Goal:
    return NavigateToGoal.Goal(target_pose=at(x, y, yaw, frame))


def move(x: float, y: float, yaw: float = 0.0) -> MoveToPosition.Goal:
    return MoveToPosition.Goal(target_x=x, target_y=y, target_theta=yaw)


def humanoid(x: float, y: float, yaw: float = 0.0, *, avoid: bool = True) -> HumanoidNav.Goal:
    return HumanoidNav.Goal(target_position=[x, y, yaw], avoid_obstacles=avoid)


# -- asking and listening ---------------------------------------------------------------------------------------------------------


async def done(rig: Rig, call: Coroutine[Any, Any, T], within: float = 8.0) -> T:
    """What a call gives that takes simulated time."""
    task = asyncio.ensure_future(call)
    await rig.until(task.done, within=within)
    return await task


async def battery_status(rig: Rig, robot_id: str = "robot_01") -> GetBatteryStatus_Response:
    """The answer of the tutorials' battery service."""
    return await rig.call(GET_BATTERY_STATUS, GetBatteryStatus.Request(robot_id=robot_id))


def said(rig: Rig, node: str) -> list[str]:
    """What a node has logged, in order."""
    return [record.event for record in rig.logs if record.node == f"/{node}"]


def warnings(rig: Rig, node: str) -> list[str]:
    """The same, warnings and errors only."""
    return [record.event for record in rig.logs if record.node == f"/{node}" and record.level >= 30]
