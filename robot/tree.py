"""The robot's supervisor tree: who is in it, in which order, and what happens when one of them fails.

One supervisor, `rest_for_one`: a node that fails is restarted together with those that were started after it, because they build on it.
The first to start is the last to stop: the motors, which hold the safe stop.

    motors, proprioception, gait, battery, safety_monitor, robot_controller, lidar, map_server, localizer, frames, navigation,
    docking, [arm, object_confirmation, fetch,] robot_status, patrol, camera, detector, calibration

Those in brackets only where the body has an arm; without a mission there is no patrol. A node that fails more often than the intensity
allows (3 restarts within 5 s) ends the whole tree: everything stops in reverse order, and the motors sit the robot down.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from actors import Child, Intensity, Node, Supervisor, rest_for_one
from actors.suggest import did_you_mean
from robot.battery.model import Pack
from robot.battery.node import Battery
from robot.frames.node import Frames
from robot.gait.node import Gait
from robot.navigation.docking import Docking
from robot.navigation.grid import Grid
from robot.navigation.localizer import Localizer
from robot.navigation.map_server import MapServer
from robot.navigation.node import Navigation
from robot.safety.node import SafetyMonitor
from robot.sensors.calibration import Calibration
from robot.sensors.camera.node import Camera
from robot.sensors.detector import Detector
from robot.sensors.lidar import Lidar
from robot.sensors.proprioception import Proprioception
from robot.tasks.patrol import Patrol
from robot.teleop.node import RobotController
from robot.teleop.status import RobotStatus
from robot.world.body import Body
from robot.world.dock import has_station
from robot.world.motors import Motors
from robot.world.scene import Pose2

if TYPE_CHECKING:
    from actors.parameters.files import ParameterOverrides
    from robot.tasks.carrier import Delivery

__all__ = ["UnknownNode", "only", "robot_tree"]


class UnknownNode(LookupError):
    """A node was asked for that the tree does not have; the text is one line that names the closest ones."""


def only(tree: Supervisor, names: Sequence[str]) -> Supervisor:
    """The tree with just these nodes, in its own order. Raises `UnknownNode`."""
    known = [child.name for child in tree.children]
    wanted = {name.lstrip("/") for name in names}
    for name in sorted(wanted.difference(known)):
        near = did_you_mean(name, known, "did", most=3, cutoff=0.5, quoted=False)
        raise UnknownNode(f"there is no node {name!r}; {near or 'there are: ' + ', '.join(known)}")
    return tree.replace(children=[child for child in tree.children if child.name in wanted])


def robot_tree(
    body: Body,
    pack: Pack,
    waypoints: Sequence[tuple[str, Pose2]] | None,
    *,
    laps: int = 0,
    motor_delay: float = 0.004,
    overrides: ParameterOverrides | None = None,
    publish_clock: float | None = None,
    delivery: Delivery | None = None,
) -> Supervisor:
    """The whole robot around `body`, walking `waypoints`; without any (`None`) it waits to be asked, and there is no node `patrol`.

    `overrides` come from parameter files and apply by full node name. With a `delivery` its mission is that errand instead of the patrol:
    a node `carrier` in place of `patrol`; the body must have an arm. `robot.Robot` makes body, battery and tree in one line.

    With `publish_clock`, a rate in Hz, it has one node more, the first: a `ClockPublisher`, so that time runs for all who follow it.
    """

    def parameters(kind: type[Node], node: str, **own: Any) -> dict[str, Any]:
        """A pattern such as /** reaches nodes that lack what it sets; they go without."""
        found = overrides.for_node(f"/{node}") if overrides is not None else {}
        return own | {name: value for name, value in found.items() if name in kind.declarations.table.values}

    grid = Grid.from_scene(body.scene)
    clock: list[Child] = []
    if publish_clock is not None:
        from actors.nodes import ClockPublisher

        clock = [Child(ClockPublisher, args=(publish_clock,))]
    mission: list[Child] = []
    if delivery is not None:
        from robot.tasks.carrier import Carrier

        mission = [Child(Carrier, args=(delivery,), parameters=parameters(Carrier, "carrier"))]
    elif waypoints is not None:
        patrol = parameters(Patrol, "patrol", laps=laps)
        mission = [Child(Patrol, args=(waypoints, body.scene.dock, grid), parameters=patrol)]
    return Supervisor(
        "robot",
        strategy=rest_for_one,
        intensity=Intensity(3, within=5.0),
        children=[
            *clock,
            Child(Motors, args=(body,), parameters=parameters(Motors, "motors"), stop=3.0),
            Child(Proprioception, args=(body,), parameters=parameters(Proprioception, "proprioception")),
            # Its estimator learns the gyro's bias by itself, all the time: it takes the samples that no calibration has touched.
            Child(
                Gait,
                remap={"/imu/data": "/imu/data_raw"},
                parameters=parameters(Gait, "gait", backend=body.backend, motor_delay=motor_delay),
            ),
            Child(Battery, args=(pack,), parameters=parameters(Battery, "battery")),
            Child(SafetyMonitor, parameters=parameters(SafetyMonitor, "safety_monitor")),
            Child(
                RobotController,
                parameters=parameters(RobotController, "robot_controller", enabled=True, safety_timeout=0.3),
            ),
            Child(Lidar, args=(body,), parameters=parameters(Lidar, "lidar")),
            Child(MapServer, args=(grid, body.scene.places), parameters=parameters(MapServer, "map_server")),
            Child(Localizer, args=(grid, body.scene.start), parameters=parameters(Localizer, "localizer")),
            Child(Frames, parameters=parameters(Frames, "frames")),
            Child(Navigation, args=(grid, body.scene.dock), parameters=parameters(Navigation, "navigation")),
            Child(Docking, args=(body.scene.dock, has_station(body.scene)), parameters=parameters(Docking, "docking")),
            *_handling(body, parameters),
            Child(RobotStatus, parameters=parameters(RobotStatus, "robot_status")),
            *mission,
            # Last, as nothing has to be started anew for their sake.
            Child(Camera, args=(body,), parameters=parameters(Camera, "camera")),
            Child(Detector, parameters=parameters(Detector, "detector")),
            Child(Calibration, parameters=parameters(Calibration, "calibration")),
        ],
    )


def _handling(body: Body, parameters: Callable[..., dict[str, Any]]) -> list[Child]:
    """What a robot with an arm has more than others."""
    if body.arm is None:
        return []
    from robot.arm.node import ArmDriver
    from robot.tasks.confirm import ObjectConfirmation
    from robot.tasks.fetch import Fetch
    from robot.tasks.objects import looks_of

    looks = looks_of(body.scene.things)
    return [
        Child(ArmDriver, name="arm", args=(body,), parameters=parameters(ArmDriver, "arm")),
        Child(ObjectConfirmation, args=(looks,), parameters=parameters(ObjectConfirmation, "object_confirmation")),
        Child(Fetch, args=(looks,), parameters=parameters(Fetch, "fetch")),
    ]
