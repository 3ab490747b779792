"""The whole robot in one line: a world, a body in it, a battery, a mission, and the supervisor tree that drives them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Literal, TypeAlias

from robot.geometry.planar import Pose2
from robot.model.actuators import MOTOR_DELAY, ActuatorDesign
from robot.model.battery import PackDesign
from robot.model.robot import SPOT, RobotModel
from robot.nodes.carrier import Delivery
from robot.scenes.scene import Scene
from robot.scenes.worlds import get_world
from robot.sim.battery import Pack
from robot.sim.simulation import Simulation
from robot.tree import robot_tree

if TYPE_CHECKING:
    from actors import Supervisor
    from robot.hardware.sensors import Sensors
    from robot.link.process import BodyProcess
    from robot.planning.grid import Grid
    from robot.sim.ground import Ground

BodyKind: TypeAlias = Literal["physics", "kinematic"]
Mission: TypeAlias = Literal["patrol"] | Sequence[Pose2] | Delivery | None


class Robot:
    """The whole robot, ready to be started: ``await rig.start(robot.tree)``, or ``async with run(robot.tree)``.

    `world` is a name that `get_world` knows, or a scene of your own. `body` is ``physics`` (MuJoCo) or ``kinematic`` (numpy only, exact,
    several times faster, cannot fall). `mission` says what the robot does by itself:

    * ``None``: nothing. It lies at the world's start and waits for goals and commands.
    * ``"patrol"``: it walks the world's patrol until it is stopped.
    * a sequence of `Pose2`: it walks to each of them once, in this order, and sits down.
    * a `Delivery`: it fetches a thing and sits down; the robot then has an arm.

    `seed` seeds the noise of the body's sensors, `battery` is the charge at the start in per cent, `arm` adds the arm, `motor_delay` is how
    late the drives act, in seconds. `actuators` are drives whose torque falls with speed and heat, on a bus that gives so much; without them
    each always has its torque limit. `map` is the map that the robot is given, instead of one made of its world. `ground` is what the
    physical body stands on and carries; its controllers are not told. `sensors` says how wrong the body's sensors are, `Sensors.ideal()`
    unless told otherwise; a LiDAR that turns has a node `scan_correction` after it. With `publish_clock`, a rate in Hz, a first node
    publishes /clock.

    With `processes`, on the real clock and in physics, the body and each concern of the tree run in processes of their own: what plans and
    looks cannot hold up what walks. `close` it at the end. `hosts` says which concerns run on which other machines, such as
    ``{"navigation": ["base", "spare"]}``, and `run(hosts=...)` then where those are. With `sight` it has depth cameras and an elevation map,
    and avoids what stands, hangs or is missing on its way outside of the LiDAR's plane.

    `model` is the robot whose figures the body has; an arm and `sight` are those of the reference body, `SPOT`.

    A robot holds one body, which grows older as it runs: make a new `Robot` for each test and each trial.

    Raises `UnknownWorld`, `BackendMissing` when MuJoCo is not installed, and `ValueError` for a kinematic body in a process or on
    a `ground`, for walkers who meet any but a physical body in this process, and for `hosts` of a concern that must stay on the robot.
    """

    def __init__(
        self,
        world: str | Scene = "empty",
        *,
        body: BodyKind = "physics",
        mission: Mission = None,
        seed: int = 0,
        battery: float = 90.0,
        arm: bool = False,
        motor_delay: float = MOTOR_DELAY,
        ground: Ground | None = None,
        actuators: ActuatorDesign | None = None,
        map: Grid | None = None,
        sensors: Sensors | None = None,
        publish_clock: float | None = None,
        processes: bool = False,
        hosts: Mapping[str, Sequence[str]] | None = None,
        sight: bool = False,
        model: RobotModel = SPOT,
    ) -> None:
        self.scene: Scene = get_world(world) if isinstance(world, str) else world
        """Where it is: obstacles, places, things."""
        delivery = mission if isinstance(mission, Delivery) else None
        arm = arm or delivery is not None
        _check(self.scene, body, model, processes=processes, others=arm or sight)
        self.process: BodyProcess | None = None
        """That of the body, with `processes`. It starts at once."""
        if processes:
            self.process = _body_process(
                self.scene, body, seed=seed, motor_delay=motor_delay, arm=arm, ground=ground, actuators=actuators, sensors=sensors, model=model
            )  # fmt: skip
        self.body: Simulation = self.process.body if self.process is not None else make_body(
            self.scene, body, seed=seed, motor_delay=motor_delay, arm=arm, ground=ground, actuators=actuators, sensors=sensors, model=model
        )  # fmt: skip
        """The simulated body. `body.truth()` is where it really is, which no controller knows."""
        try:
            tree = robot_tree(
                self.body,
                Pack(battery, design=PackDesign.of(model)),
                _waypoints(mission, self.scene),
                laps=0 if mission == "patrol" else 1, motor_delay=motor_delay,
                publish_clock=publish_clock,
                delivery=delivery,
                processes=processes,
                hosts=hosts,
                grid=map,
                sight=sight, seed=seed,
            )  # fmt: skip
        except BaseException:
            self.close()
            raise
        self.tree: Supervisor = tree
        """The supervisor with all of its nodes. A tree like any other: `replace` its children, or take some by `robot.tree.only`."""

    def close(self) -> None:
        """Free what the body holds: its process, if it has one."""
        if self.process is not None:
            self.process.close()
        else:
            self.body.close()

    def __repr__(self) -> str:
        return f"Robot(world={self.scene.name!r}, body={self.body.backend!r})"


def default_tree() -> Supervisor:
    """The tree of a robot with a physical body, lying at the start of the empty world and waiting for goals: the executable `robot robot`."""
    return Robot().tree


def _check(scene: Scene, body: BodyKind, model: RobotModel, *, processes: bool, others: bool) -> None:
    """Raise `ValueError` for a robot that cannot be; `others` says that it has an arm or depth cameras."""
    if scene.walkers and (processes or body != "physics"):
        raise ValueError(f"the world {scene.name!r} has walkers: only the physics body in this process meets them")
    if model is not SPOT and others:
        raise ValueError(f"the robot {model.name!r} has no arm and no depth cameras: leave those out")


def _body_process(
    scene: Scene,
    kind: BodyKind,
    *,
    seed: int,
    motor_delay: float,
    arm: bool,
    ground: Ground | None,
    actuators: ActuatorDesign | None,
    sensors: Sensors | None,
    model: RobotModel,
) -> BodyProcess:
    if kind != "physics":
        raise ValueError(
            f"Robot(body={kind!r}, processes=True): only the physics body has a process of its own; leave one of them out"
        )
    from robot.link.process import BodyProcess
    from robot.sim.physics import check_engine

    check_engine()
    return BodyProcess(
        scene, seed=seed, delay=motor_delay, arm=arm, ground=ground, actuators=actuators, sensors=sensors, model=model
    )


def make_body(
    scene: Scene,
    kind: BodyKind,
    *,
    seed: int = 0,
    motor_delay: float = MOTOR_DELAY,
    arm: bool = False,
    ground: Ground | None = None,
    actuators: ActuatorDesign | None = None,
    sensors: Sensors | None = None,
    model: RobotModel = SPOT,
) -> Simulation:
    """A body in a scene. Raises `BackendMissing` when MuJoCo is asked for and not installed, `ValueError` for a kinematic one on a `ground` or
    with `actuators`.
    """
    if kind == "kinematic":
        if ground is not None:
            raise ValueError("A kinematic body feels neither ground nor load; leave out `ground`, or make it physical.")
        if actuators is not None:
            raise ValueError("A kinematic body has no torques to limit; leave out `actuators`, or make it physical.")
        from robot.sim.kinematic import KinematicBody

        return KinematicBody(scene, seed=seed, arm=arm, sensors=sensors, model=model)
    from robot.sim.physics import PhysicsBody

    return PhysicsBody(
        scene, seed=seed, delay=motor_delay, arm=arm, ground=ground, actuators=actuators, sensors=sensors, model=model
    )


def _waypoints(mission: Mission, scene: Scene) -> list[tuple[str, Pose2]] | None:
    """The names are those of the reports on /mission/goals."""
    if mission is None or isinstance(mission, Delivery):
        return None
    if mission == "patrol":
        return [(f"patrol_{number}", pose) for number, pose in enumerate(scene.patrol, start=1)]
    if len(mission) == 1:
        return [("goal", mission[0])]
    return [(f"goal_{number}", pose) for number, pose in enumerate(mission, start=1)]
