"""The robot's supervisor tree: its nodes by concern, their order, and what happens when one of them fails.

    robot         one_for_one   concerns reach each other by topics, services and actions only: none builds on another's state
      control       motors, proprioception, gait           one_for_one: drives, sensors and gait bridge a gap of 100 ms, and a restart is shorter
      safety        battery, safety_monitor,               one_for_one: each takes up what it knew; while one is away its silence stops the robot
                    robot_controller
      perception    lidar, scan_correction (with a LiDAR   one_for_one: each works from the next message that it hears
                    that turns), heading, map_server,
                    localizer, frames, robot_state_publisher, camera,
                    image_compressor, detector, calibration,
                    depth_cameras, elevation (with sight)
      navigation    navigation, docking                    one_for_one: a goal that the other had there ends by name, and is asked for again
      handling      arm, object_confirmation, fetch        one_for_one: the arm's state lives in the arm; a step that was lost fails by name
      mission       robot_status, diagnostics, markers,    one_for_one: they ask the others, and nobody asks them
                    patrol

So a node that fails is restarted alone. `handling` is there where the body has an arm; a `carrier` may stand in place of the `patrol`, and
without a mission there is neither. The first to start is the last to stop: the motors, which hold the safe stop. A node that fails more
often than the intensity of its concern allows (3 restarts within 5 s) ends the concern, and with it the whole tree: everything stops in
reverse order, and the motors sit the robot down.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from actors import Child, Intensity, Supervisor, one_for_one
from robot.concerns import ELSEWHERE, HERE
from robot.contracts import CAMERA_RGB
from robot.geometry.planar import Pose2
from robot.hardware.body import Body
from robot.model.actuators import MOTOR_DELAY
from robot.model.parameters import STAND_HEIGHT
from robot.nodes.battery import Battery
from robot.nodes.calibration import Calibration
from robot.nodes.camera import Camera
from robot.nodes.compressed import ImageCompressor
from robot.nodes.depth import DepthCameras
from robot.nodes.detector import Detector
from robot.nodes.diagnostics import Diagnostics
from robot.nodes.docking import Docking
from robot.nodes.elevation import Elevation
from robot.nodes.frames import Frames
from robot.nodes.gait import Gait
from robot.nodes.heading import Heading
from robot.nodes.lidar import Lidar, TurningLidar
from robot.nodes.localizer import Localizer
from robot.nodes.map_server import MapServer
from robot.nodes.markers import Markers
from robot.nodes.motors import Motors
from robot.nodes.navigation import Navigation
from robot.nodes.patrol import Patrol
from robot.nodes.process_care import ProcessCare
from robot.nodes.proprioception import Proprioception
from robot.nodes.robot_state_publisher import RobotStatePublisher
from robot.nodes.safety import SafetyMonitor
from robot.nodes.scan_correction import ScanCorrection
from robot.nodes.status import RobotStatus
from robot.nodes.teleop import RobotController
from robot.planning.grid import Grid
from robot.scenes.dock import has_station
from robot.scenes.scene import Scene
from robot.sim.battery import Pack
from robot.sim.urdf import write_urdf

if TYPE_CHECKING:
    from robot.nodes.carrier import Delivery

__all__ = ["in_sight", "robot_tree"]

CONTROL_HANG = 0.1
"""Seconds for which the event loop of the control process may stand still before it is killed."""
HANG = 5.0
"""The same for the others: whoever misses them stops the robot long before."""


def robot_tree(
    body: Body,
    pack: Pack,
    waypoints: Sequence[tuple[str, Pose2]] | None,
    *,
    laps: int = 0,
    motor_delay: float = MOTOR_DELAY,
    publish_clock: float | None = None,
    delivery: Delivery | None = None,
    processes: bool = False,
    hosts: Mapping[str, Sequence[str]] | None = None,
    grid: Grid | None = None,
    sight: bool = False,
) -> Supervisor:
    """The whole robot around `body`, walking `waypoints`; without any (`None`) it waits to be asked, and there is no node `patrol`.

    With a `delivery` its mission is that errand instead of the patrol: a node `carrier` in place of `patrol`; the body must have an arm.
    `robot.Robot` makes body, battery and tree in one line.

    With `processes` each concern runs in a process of its own, and `body` must be one that can cross to them, a `LinkedBody`. Its process is
    restarted when it dies, up to 3 times within 5 s; before its own nodes it has one more, `control_process` and so on.

    `hosts` names the machines on which a concern runs instead, the first choice first: perception, navigation and mission may. The sensors stay
    with the body then, as a concern ``sensors``. Raises `ValueError` for another concern.

    With `sight` it has depth cameras and an elevation map: it sees steps, holes and what is too low for the LiDAR, and walks no faster than
    it sees the floor.

    `grid` is the map that the robot is given; without one it is made of the body's scene. With `publish_clock`, a rate in Hz, it has one node
    more, the first: a `ClockPublisher`, so that time runs for all who follow it.
    """
    seen = Grid.from_scene(in_sight(body.scene)) if grid is None else grid
    grid = Grid.from_scene(body.scene) if grid is None else grid
    concerns = [
        _control(body, motor_delay),
        _safety(pack),
        _perception(body, grid, seen, sight),
        _navigation(body, grid, sight),
        *_handling(body),
        _mission(body, grid, waypoints, laps, delivery),
    ]
    near, away = _placed(concerns, body, hosts or {})
    return Supervisor(
        "robot",
        strategy=one_for_one,
        intensity=Intensity(3, within=5.0) if processes or away else Intensity(0, within=1.0),
        children=[*_clock(publish_clock), *(_split(one, body) if processes else one for one in near), *away],
    )


def _concern(name: str, *children: Child) -> Supervisor:
    return Supervisor(name, strategy=one_for_one, intensity=Intensity(3, within=5.0), children=children)


def _placed(
    concerns: Sequence[Supervisor], body: Body, hosts: Mapping[str, Sequence[str]]
) -> tuple[list[Supervisor], list[Supervisor]]:
    """The concerns on the robot, and those on other machines, which start last: what they hear and ask is there by then."""
    for name in hosts.keys() - set(ELSEWHERE):
        raise ValueError(
            f"hosts={{{name!r}: ...}}: {HERE.get(name) or 'what may run elsewhere is ' + ', '.join(ELSEWHERE)}"
        )
    near: list[Supervisor] = []
    away: list[Supervisor] = []
    for concern in concerns:
        names = tuple(hosts.get(concern.name, ()))
        if not names:
            near.append(concern)
            continue
        reading = [child for child in concern.children if isinstance(child, Child) and _reads(child, body)]
        if reading:
            near.append(_concern("sensors", *reading))
        away.append(
            concern.replace(hosts=names, hang=HANG, children=[one for one in concern.children if one not in reading])
        )
    return near, away


def _reads(child: Child, body: Body) -> bool:
    """Whether a node needs the body itself, or makes less of what a sensor sends before it goes over a network."""
    return any(one is body for one in child.args) or child.factory is ImageCompressor


def _split(concern: Supervisor, body: Body) -> Supervisor:
    """The concern in a process of its own, whose clock goes with the body's.

    Control may hang for 0.1 s: by then the drives have begun to sit the robot down.
    """
    care = Child(ProcessCare, name=f"{concern.name}_process", args=(concern.name, body))
    hang = CONTROL_HANG if concern.name == "control" else HANG
    return concern.replace(process=True, hang=hang, children=(care, *concern.children))


def _control(body: Body, motor_delay: float) -> Supervisor:
    """The guard: what keeps the robot on its feet, and sits it down when all else has failed."""
    return _concern(
        "control",
        Child(Motors, args=(body,), stop=3.0),
        Child(Proprioception, args=(body,)),
        # Its estimator learns the gyro's bias by itself, all the time: it takes the samples that no calibration has touched.
        Child(
            Gait,
            remap={"/imu/data": "/imu/data_raw"},
            parameters={"backend": body.backend, "motor_delay": motor_delay},
        ),
    )


def _safety(pack: Pack) -> Supervisor:
    return _concern(
        "safety",
        Child(Battery, args=(pack,)),
        Child(SafetyMonitor),
        Child(RobotController, parameters={"enabled": True, "safety_timeout": 0.3}),
    )


def in_sight(scene: Scene) -> Scene:
    """The scene without what the LiDAR of a standing robot looks over or under: scans are not to be held against that."""
    return replace(scene, obstacles=tuple(one for one in scene.obstacles if one.bottom < STAND_HEIGHT < one.height))


def _perception(body: Body, grid: Grid, seen: Grid, sight: bool) -> Supervisor:
    seeing = (Child(DepthCameras, args=(body,)), Child(Elevation)) if sight else ()
    return _concern(
        "perception",
        *_lidar(body),
        Child(Heading),
        Child(MapServer, args=(grid, dict(body.scene.places))),
        Child(Localizer, args=(seen, body.scene.start), parameters={"range_bias": body.sensors.lidar.bias}),
        Child(Frames),
        Child(RobotStatePublisher, args=(write_urdf(arm=body.arm is not None),)),
        Child(Camera, args=(body,)),
        Child(ImageCompressor, args=(CAMERA_RGB,)),
        Child(Detector),
        Child(Calibration),
        *seeing,
    )


def _lidar(body: Body) -> list[Child]:
    """The driver of the LiDAR that it has; what one that turns sees in a moving body is corrected."""
    if body.sensors.lidar.sweep == 0.0:
        return [Child(Lidar, args=(body,))]
    return [Child(TurningLidar, name="lidar", args=(body,)), Child(ScanCorrection)]


def _navigation(body: Body, grid: Grid, sight: bool) -> Supervisor:
    return _concern(
        "navigation",
        Child(Navigation, args=(grid, body.scene.dock, sight)),
        Child(Docking, args=(body.scene.dock, has_station(body.scene))),
    )


def _clock(rate: float | None) -> list[Child]:
    """The clock publisher at `rate` Hz; none without a rate."""
    if rate is None:
        return []
    from actors.nodes import ClockPublisher

    return [Child(ClockPublisher, args=(rate,))]


def _handling(body: Body) -> list[Supervisor]:
    """What a robot with an arm has more than one without."""
    if body.arm is None:
        return []
    from robot.nodes.arm import ArmDriver
    from robot.nodes.confirm import ObjectConfirmation
    from robot.nodes.fetch import Fetch
    from robot.scenes.objects import looks_of

    looks = looks_of(body.scene.things)
    return [
        _concern(
            "handling",
            Child(ArmDriver, name="arm", args=(body,)),
            Child(ObjectConfirmation, args=(looks,)),
            Child(Fetch, args=(looks,)),
        )
    ]


def _mission(
    body: Body,
    grid: Grid,
    waypoints: Sequence[tuple[str, Pose2]] | None,
    laps: int,
    delivery: Delivery | None,
) -> Supervisor:
    """Who gives the robot its goals, the carrier, the patrol or nobody, and who tells how it is."""
    told = (Child(RobotStatus), Child(Diagnostics), Child(Markers))
    return _concern("mission", *told, *_errand(body, grid, waypoints, laps, delivery))


def _errand(
    body: Body,
    grid: Grid,
    waypoints: Sequence[tuple[str, Pose2]] | None,
    laps: int,
    delivery: Delivery | None,
) -> list[Child]:
    if delivery is not None:
        from robot.nodes.carrier import Carrier

        return [Child(Carrier, args=(delivery,))]
    if waypoints is None:
        return []
    return [Child(Patrol, args=(waypoints, body.scene.dock, grid), parameters={"laps": laps})]
