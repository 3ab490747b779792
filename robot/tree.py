"""The robot's supervisor tree: its nodes, their order, and what happens when one of them fails.

One supervisor, `rest_for_one`: a node that fails is restarted together with those that were started after it, because they build on it.
The first to start is the last to stop: the motors, which hold the safe stop.

    motors, proprioception, gait, battery, safety_monitor, robot_controller, lidar, map_server, localizer, frames, navigation,
    docking, [arm, object_confirmation, fetch,] robot_status, patrol, camera, detector, calibration

Those in brackets only where the body has an arm; without a mission there is no patrol. A node that fails more often than the intensity
allows (3 restarts within 5 s) ends the whole tree: everything stops in reverse order, and the motors sit the robot down.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from actors import Child, Intensity, Supervisor, rest_for_one
from robot.geometry.planar import Pose2
from robot.hardware.body import Body
from robot.nodes.battery import Battery
from robot.nodes.calibration import Calibration
from robot.nodes.camera import Camera
from robot.nodes.detector import Detector
from robot.nodes.docking import Docking
from robot.nodes.frames import Frames
from robot.nodes.gait import Gait
from robot.nodes.lidar import Lidar
from robot.nodes.localizer import Localizer
from robot.nodes.map_server import MapServer
from robot.nodes.motors import Motors
from robot.nodes.navigation import Navigation
from robot.nodes.patrol import Patrol
from robot.nodes.proprioception import Proprioception
from robot.nodes.safety import SafetyMonitor
from robot.nodes.status import RobotStatus
from robot.nodes.teleop import RobotController
from robot.planning.grid import Grid
from robot.scenes.dock import has_station
from robot.sim.battery import Pack

if TYPE_CHECKING:
    from robot.nodes.carrier import Delivery

__all__ = ["robot_tree"]


def robot_tree(
    body: Body,
    pack: Pack,
    waypoints: Sequence[tuple[str, Pose2]] | None,
    *,
    laps: int = 0,
    motor_delay: float = 0.004,
    publish_clock: float | None = None,
    delivery: Delivery | None = None,
) -> Supervisor:
    """The whole robot around `body`, walking `waypoints`; without any (`None`) it waits to be asked, and there is no node `patrol`.

    With a `delivery` its mission is that errand instead of the patrol: a node `carrier` in place of `patrol`; the body must have an arm.
    `robot.Robot` makes body, battery and tree in one line.

    With `publish_clock`, a rate in Hz, it has one node more, the first: a `ClockPublisher`, so that time runs for all who follow it.
    """
    grid = Grid.from_scene(body.scene)
    return Supervisor(
        "robot",
        strategy=rest_for_one,
        intensity=Intensity(3, within=5.0),
        children=[
            *_clock(publish_clock),
            Child(Motors, args=(body,), stop=3.0),
            Child(Proprioception, args=(body,)),
            # Its estimator learns the gyro's bias by itself, all the time: it takes the samples that no calibration has touched.
            Child(
                Gait,
                remap={"/imu/data": "/imu/data_raw"},
                parameters={"backend": body.backend, "motor_delay": motor_delay},
            ),
            Child(Battery, args=(pack,)),
            Child(SafetyMonitor),
            Child(RobotController, parameters={"enabled": True, "safety_timeout": 0.3}),
            Child(Lidar, args=(body,)),
            Child(MapServer, args=(grid, body.scene.places)),
            Child(Localizer, args=(grid, body.scene.start)),
            Child(Frames),
            Child(Navigation, args=(grid, body.scene.dock)),
            Child(Docking, args=(body.scene.dock, has_station(body.scene))),
            *_handling(body),
            Child(RobotStatus),
            *_mission(body, grid, waypoints, laps, delivery),
            # Last, as nothing has to be started anew for their sake.
            Child(Camera, args=(body,)),
            Child(Detector),
            Child(Calibration),
        ],
    )


def _clock(rate: float | None) -> list[Child]:
    """The clock publisher at `rate` Hz; none without a rate."""
    if rate is None:
        return []
    from actors.nodes import ClockPublisher

    return [Child(ClockPublisher, args=(rate,))]


def _mission(
    body: Body,
    grid: Grid,
    waypoints: Sequence[tuple[str, Pose2]] | None,
    laps: int,
    delivery: Delivery | None,
) -> list[Child]:
    """The node that gives the robot its goals: the carrier, the patrol, or none."""
    if delivery is not None:
        from robot.nodes.carrier import Carrier

        return [Child(Carrier, args=(delivery,))]
    if waypoints is None:
        return []
    return [Child(Patrol, args=(waypoints, body.scene.dock, grid), parameters={"laps": laps})]


def _handling(body: Body) -> list[Child]:
    """The nodes of a robot with an arm."""
    if body.arm is None:
        return []
    from robot.nodes.arm import ArmDriver
    from robot.nodes.confirm import ObjectConfirmation
    from robot.nodes.fetch import Fetch
    from robot.scenes.objects import looks_of

    looks = looks_of(body.scene.things)
    return [
        Child(ArmDriver, name="arm", args=(body,)),
        Child(ObjectConfirmation, args=(looks,)),
        Child(Fetch, args=(looks,)),
    ]
