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
      navigation    navigation, docking, tutorial_walks    one_for_one: a goal that the other had there ends by name, and is asked for again
      handling      arm, object_confirmation, fetch        one_for_one: the arm's state lives in the arm; a step that was lost fails by name
      mission       robot_status, diagnostics, markers,    one_for_one: they ask the others, and nobody asks them
                    patrol

So a node that fails is restarted alone. `handling` is there where the robot has an arm; a `carrier` may stand in place of the `patrol`, and
without a mission there is neither. The first to start is the last to stop: the motors, which hold the safe stop. A node that fails more
often than the intensity of its concern allows (3 restarts within 5 s) ends the concern, and with it the whole tree: everything stops in
reverse order, and the motors sit the robot down.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from actors import Child, Intensity, Supervisor, one_for_one
from robot.concerns import ELSEWHERE, HERE
from robot.contracts import CAMERA_RGB
from robot.geometry.planar import Pose2
from robot.hardware.body import Hardware
from robot.hardware.devices import BatteryDevice, CameraDevice, DepthDevice, Equipment, LidarDevice
from robot.model.actuators import MOTOR_DELAY
from robot.model.robot import SPOT, RobotModel
from robot.nodes.arm import ArmDriver
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
from robot.nodes.tutorial_walks import TutorialWalks
from robot.nodes.twist_mux import RobotController
from robot.planning.grid import Grid
from robot.scenes.dock import has_station
from robot.scenes.objects import Look, looks_of
from robot.scenes.scene import Scene
from robot.sim.devices import simulated
from robot.sim.simulation import Simulation
from robot.urdf import write_urdf

if TYPE_CHECKING:
    from robot.nodes.carrier import Delivery

CONTROL_HANG = 0.1
"""Seconds for which the event loop of the control process may stand still before it is killed."""
HANG = 5.0
"""The same for the others: the nodes that need them stop the robot long before."""


DRIVERS = frozenset((Motors, Proprioception, Lidar, TurningLidar, Camera, DepthCameras, ArmDriver, ImageCompressor))
"""Nodes that stay on the robot wherever their concern runs: they hold its hardware, or make less of what a sensor sends before it goes over a
network."""


@dataclass(frozen=True, slots=True)
class Site:
    """What a robot knows of the place where it works. Poses are on the map."""

    grid: Grid
    """The map that it plans on."""
    start: Pose2
    """Where it is put down, roughly."""
    dock: Pose2
    """Where it is when it hangs on its charger."""
    station: bool = False
    """Whether the charging station stands there for the LiDAR to see."""
    places: Mapping[str, Pose2] = field(default_factory=dict[str, Pose2])
    """Those that have names."""
    looks: Mapping[str, Look] = field(default_factory=dict[str, Look])
    """Of the things that it may be sent for."""
    scanned: Grid | None = None
    """The map in the LiDAR's plane, if that shows other things than `grid` does."""

    @classmethod
    def of(cls, scene: Scene, grid: Grid | None = None, model: RobotModel = SPOT) -> Site:
        """That of a simulated scene, with a map of its own or, without `grid`, the one made of the scene."""
        return cls(
            Grid.from_scene(scene) if grid is None else grid,
            scene.start,
            scene.dock,
            has_station(scene),
            dict(scene.places),
            looks_of(scene.things),
            Grid.from_scene(in_sight(scene, model)) if grid is None else grid,
        )


def robot_tree(
    body: Simulation,
    battery: BatteryDevice,
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
    seed: int = 0,
) -> Supervisor:
    """The whole robot around a simulated `body`, with the devices that it has there, in its scene: `tree_of` says the rest.

    With `sight` it has depth cameras and an elevation map: it sees steps, holes and what is too low for the LiDAR, and walks no faster than
    it sees the floor; `seed` is that of the cameras' noise. `grid` is the map that the robot is given; without one it is made of the scene.
    `robot.Robot` makes body, battery and tree in one line.
    """
    return tree_of(
        simulated(body, battery, sight=sight, seed=seed),
        Site.of(body.scene, grid, body.model),
        waypoints,
        laps=laps,
        motor_delay=motor_delay,
        publish_clock=publish_clock,
        delivery=delivery,
        processes=processes,
        hosts=hosts,
    )


def tree_of(
    robot: Equipment,
    site: Site | None = None,
    waypoints: Sequence[tuple[str, Pose2]] | None = None,
    *,
    laps: int = 0,
    motor_delay: float = MOTOR_DELAY,
    publish_clock: float | None = None,
    delivery: Delivery | None = None,
    processes: bool = False,
    hosts: Mapping[str, Sequence[str]] | None = None,
) -> Supervisor:
    """The tree of any robot, real or simulated, walking `waypoints`; without any (`None`) it waits to be asked, and there is no node `patrol`.

    It has the nodes of the devices that the robot has. Without a `site` or without a LiDAR it does not know where it is: it walks by velocity commands,
    and there is no concern ``navigation``.

    With a `delivery` its mission is that task instead of the patrol: a node `carrier` in place of `patrol`; the robot must have an arm.

    With `processes` each concern runs in a process of its own, and the hardware must be one that can cross to them, as a `LinkedBody` can. Its
    process is restarted when it dies, up to 3 times within 5 s; before its own nodes it has one more, `control_process` and so on.

    `hosts` names the machines on which a concern runs instead, the first choice first: perception, navigation and mission may. The sensors stay
    with the robot then, as a concern ``sensors``. With `publish_clock`, a rate in Hz, it has one node more, the first: a `ClockPublisher`, so
    that time runs for all who follow it.

    Raises `ValueError` for `hosts` of another concern, and for waypoints or a delivery of a robot that cannot find its way.
    """
    navigates = site is not None and robot.lidar is not None
    if not navigates and (waypoints or delivery):
        raise ValueError("waypoints or a delivery need a robot that finds its way: give it a site and a LiDAR")
    concerns = [
        _control(robot, motor_delay),
        _safety(robot),
        _perception(robot, site),
        *(_navigation(site, robot) if site is not None and navigates else ()),
        *_handling(robot, site),
        _mission(site, waypoints, laps, delivery),
    ]
    near, away = _placed(concerns, hosts or {})
    return Supervisor(
        "robot",
        strategy=one_for_one,
        intensity=Intensity(3, within=5.0) if processes or away else Intensity(0, within=1.0),
        children=[
            *_clock(publish_clock), *(_split(one, robot.hardware) if processes else one for one in near), *away
        ],
    )  # fmt: skip


def _concern(name: str, *children: Child) -> Supervisor:
    return Supervisor(name, strategy=one_for_one, intensity=Intensity(3, within=5.0), children=children)


def _placed(
    concerns: Sequence[Supervisor], hosts: Mapping[str, Sequence[str]]
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
        reading = [child for child in concern.children if isinstance(child, Child) and child.factory in DRIVERS]
        if reading:
            near.append(_concern("sensors", *reading))
        away.append(
            concern.replace(hosts=names, hang=HANG, children=[one for one in concern.children if one not in reading])
        )
    return near, away


def _split(concern: Supervisor, body: Hardware) -> Supervisor:
    """The concern in a process of its own, whose clock goes with the body's.

    Control may hang for 0.1 s: by then the drives have begun to sit the robot down.
    """
    care = Child(ProcessCare, name=f"{concern.name}_process", args=(concern.name, body))
    hang = CONTROL_HANG if concern.name == "control" else HANG
    return concern.replace(process=True, hang=hang, children=(care, *concern.children))


def _control(robot: Equipment, motor_delay: float) -> Supervisor:
    """The guard: what keeps the robot on its feet, and sits it down when all else has failed."""
    body = robot.hardware
    commands = "body_drive" if body.capabilities.steps else "motor_targets"
    return _concern(
        "control",
        Child(Motors, args=(body, robot.charger, robot.model), stop=3.0),
        Child(Proprioception, args=(body,)),
        # Its estimator learns the gyro's bias by itself, all the time: it takes the samples that no calibration has touched.
        Child(
            Gait,
            args=(robot.model,),
            remap={"/imu/data": "/imu/data_raw"},
            parameters={"commands": commands, "motor_delay": motor_delay},
        ),
    )


def _safety(robot: Equipment) -> Supervisor:
    return _concern(
        "safety",
        Child(Battery, args=(robot.battery, robot.model)),
        Child(SafetyMonitor),
        Child(RobotController, args=(robot.model,), parameters={"enabled": True, "safety_timeout": 0.3}),
    )


def in_sight(scene: Scene, model: RobotModel = SPOT) -> Scene:
    """The scene without what the LiDAR of a standing robot looks over or under: scans are not to be held against that."""
    return replace(
        scene, obstacles=tuple(one for one in scene.obstacles if one.bottom < model.stand_height < one.height)
    )


def _perception(robot: Equipment, site: Site | None) -> Supervisor:
    return _concern(
        "perception",
        *(_lidar(robot.lidar, site, robot.model) if robot.lidar is not None else ()),
        Child(Frames, args=(robot.model,)),
        Child(RobotStatePublisher, args=(write_urdf(arm=robot.arm is not None, model=robot.model),)),
        *(_camera(robot.camera) if robot.camera is not None else ()),
        Child(Calibration),
        *(_depth(robot.depth) if robot.depth is not None else ()),
    )


def _lidar(lidar: LidarDevice, site: Site | None, model: RobotModel) -> list[Child]:
    """The driver of the LiDAR that it has, and the nodes that localize the robot by it."""
    driver = [Child(Lidar, args=(lidar,))]
    if lidar.fixed:  # what it sees in a moving body is corrected
        driver = [Child(TurningLidar, name="lidar", args=(lidar,)), Child(ScanCorrection, args=(model,))]
    if site is None:
        return driver
    scanned = site.grid if site.scanned is None else site.scanned
    return [
        *driver,
        Child(Heading),
        Child(MapServer, args=(site.grid, dict(site.places))),
        Child(Localizer, args=(scanned, site.start), parameters={"range_bias": lidar.bias}),
    ]


def _camera(camera: CameraDevice) -> list[Child]:
    return [Child(Camera, args=(camera,)), Child(ImageCompressor, args=(CAMERA_RGB,)), Child(Detector)]


def _depth(cameras: DepthDevice) -> list[Child]:
    return [Child(DepthCameras, args=(cameras,)), Child(Elevation)]


def _navigation(site: Site, robot: Equipment) -> list[Supervisor]:
    return [
        _concern(
            "navigation",
            Child(Navigation, args=(site.grid, site.dock, robot.depth is not None, robot.model)),
            Child(Docking, args=(site.dock, site.station)),
            Child(TutorialWalks),
        )
    ]


def _clock(rate: float | None) -> list[Child]:
    """The clock publisher at `rate` Hz; none without a rate."""
    if rate is None:
        return []
    from actors.nodes import ClockPublisher

    return [Child(ClockPublisher, args=(rate,))]


def _handling(robot: Equipment, site: Site | None) -> list[Supervisor]:
    """What a robot with an arm has more than one without; what fetches things needs to know where it is."""
    if robot.arm is None:
        return []
    from robot.nodes.confirm import ObjectConfirmation
    from robot.nodes.fetch import Fetch

    fetching = (Child(ObjectConfirmation, args=(site.looks,)), Child(Fetch, args=(site.looks,))) if site else ()
    return [_concern("handling", Child(ArmDriver, name="arm", args=(robot.arm,)), *fetching)]


def _mission(
    site: Site | None, waypoints: Sequence[tuple[str, Pose2]] | None, laps: int, delivery: Delivery | None
) -> Supervisor:
    """What gives the robot its goals, if anything does: the carrier or the patrol; and what reports its state."""
    reporting = (Child(RobotStatus), Child(Diagnostics), Child(Markers))
    return _concern("mission", *reporting, *_goals(site, waypoints, laps, delivery))


def _goals(
    site: Site | None, waypoints: Sequence[tuple[str, Pose2]] | None, laps: int, delivery: Delivery | None
) -> list[Child]:
    if delivery is not None:
        from robot.nodes.carrier import Carrier

        return [Child(Carrier, args=(delivery,))]
    if waypoints is None or site is None:
        return []
    return [Child(Patrol, args=(waypoints, site.dock, site.grid), parameters={"laps": laps})]
