"""The runs behind `tests.figures rates`: the robot in this process, on the real clock, with listeners that only count."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from time import perf_counter, process_time
from typing import Any, Final

import numpy as np

from actors import Child, Node, Supervisor, System, Topic, every, execute, publishes, run
from actors.interfaces.geometry_msgs.msg import Twist, Vector3
from actors.interfaces.std_srvs.srv import Trigger
from actors.typing import Stream
from robot import contracts
from robot.interfaces.robactor_msgs.msg import BodyDrive, MotorTargets
from robot.link.time_slices import short_turns
from robot.run.tree_nodes import changed, only
from robot.scenes.worlds import get_world
from robot.sim.battery import Pack
from robot.sim.simulation import Simulation
from robot.tree import robot_tree
from tests.figures.load import busy

WARM_UP: Final = 5.0
"""Seconds until the robot has stood up and walks."""

STREAMS: Final = (
    ("RT-01", "camera/rgb", 30.0),
    ("RT-01", "camera/depth", 30.0),
    ("RT-02", "camera/points", 10.0),
    ("RT-02", "lidar/points", 10.0),
    ("RT-02", "lidar/scan", 10.0),
    ("RT-03", "imu/data", 200.0),
    ("RT-04", "joint_states", 200.0),
    ("RT-04", "foot_contacts", 200.0),
    ("RT-05", "control loop", 200.0),
    ("RT-07", "odom", 50.0),
    ("RT-07", "pose", 50.0),
)
"""Scenario row, stream, rate in Hz."""
TIMERS: Final = (
    ("RT-06", "timer of 2 s", 0.5),
    ("RT-06", "timer of 1 s", 1.0),
    ("RT-06", "timer of 0.5 s", 2.0),
    ("RT-06", "timer of 0.1 s", 10.0),
)
TOPICS: Final[dict[str, Topic[Any]]] = {
    "camera/rgb": contracts.CAMERA_RGB,
    "camera/depth": contracts.CAMERA_DEPTH,
    "camera/points": contracts.CAMERA_POINTS,
    "lidar/points": contracts.LIDAR_POINTS,
    "lidar/scan": contracts.SCAN,
    "imu/data": contracts.IMU,
    "joint_states": contracts.JOINT_STATES,
    "foot_contacts": contracts.CONTACTS,
    "odom": contracts.ODOMETRY,
    "pose": contracts.POSE,
}
CAMERA: Final = ("camera/rgb", "camera/depth", "camera/points")


@dataclass(frozen=True, slots=True)
class Punctuality:
    """When the steps of a control loop came."""

    rate: float
    """Hz, mean."""
    p50: float
    p99: float
    """Of how much the time between two steps differs from the period, ms."""
    missed: float
    """Per cent of the steps that came more than a period after they were due."""


@dataclass(frozen=True, slots=True)
class Run:
    """What one run showed."""

    rates: dict[str, float]
    """Hz, by stream."""
    control: Punctuality
    quiet_share: float
    """Processor time by wall time while somebody listens to all sensors but the camera, per cent."""
    share: float
    """The same with a listener on every sensor."""
    alone_share: float = 0.0
    """The same while nobody listens but the robot itself."""
    falls: int = 0
    """1 if the robot lay on the floor at the end."""
    shares: dict[str, float] = field(default_factory=dict[str, float])
    """By process, of `alone_share`; empty in one process."""
    restarts: int = 0
    """How many nodes had been restarted by then, with their processes or alone."""


def run_robot(backend: str, seed: int, duration: float, loops: int = 0, rate: float = 200.0) -> Run:
    """The whole robot in this process, on its patrol: for `duration` seconds alone, as long with listeners on all sensors but the camera, and on all.

    Its control loop runs `rate` times a second.

    Meanwhile so many endless loops run on the only processor that it may use; without any, nothing holds it to one.
    """
    scene = get_world("warehouse")
    body = _body(backend, seed, "warehouse")
    waypoints = [(f"patrol_{number}", pose) for number, pose in enumerate(scene.patrol, start=1)]
    found: list[Run] = []

    async def main() -> None:
        tree = at_rate(robot_tree(body, Pack(90.0), waypoints), rate)
        async with run(tree, seed=seed, sinks=()) as system:
            await system.clock.sleep(WARM_UP)
            alone_share, _ = await _measured({}, lambda: system.clock.sleep(duration))
            await system.join(Child(Clockwork))
            listener = await listener_in(system, backend)
            with ExitStack() as stack:
                quiet = listen(stack, listener, [name for name in TOPICS if name not in CAMERA])
                quiet_share, _ = await _measured(quiet, lambda: system.clock.sleep(duration))
                streams = quiet | listen(stack, listener, CAMERA)
                await system.clock.sleep(0.5)
                listener.times.clear()
                share, rates = await _measured(streams, lambda: system.clock.sleep(duration))
            control = punctuality(listener.times, rate)
            rates = rates | {"control loop": control.rate} | clockwork_rates(system)
            fallen = int(body.truth().fallen)
            found.append(Run(rates, control, quiet_share, share, alone_share, fallen, restarts=restarts_in(system)))

    with busy(loops):
        short_turns()  # as `python -m robot run` does
        execute(main)
    return found[0]


def run_loop(backend: str, seed: int, duration: float, hz: float) -> Punctuality:
    """Motors, sensors and gait alone, at `hz`, walking."""
    body = _body(backend, seed, "empty")
    whole = robot_tree(body, Pack(90.0), [("here", body.scene.start)])
    tree = at_rate(only(whole, ("motors", "proprioception", "gait")), hz)
    times: list[float] = []

    async def main() -> None:
        async with run(tree, seed=seed, sinks=()) as system:
            await system.join(Child(PacedNode))
            listener = await listener_in(system, backend)
            await system.clock.sleep(WARM_UP)
            listener.times.clear()
            await system.clock.sleep(duration)
            times.extend(listener.times)

    execute(main)
    return punctuality(times, hz)


class Clockwork(Node):
    """Timers of the periods that the scenarios ask for, beside everything else."""

    @every(period=2.0)
    def plan(self) -> None: ...
    @every(period=1.0)
    def chatter(self) -> None: ...
    @every(period=0.5)
    def telemetry(self) -> None: ...
    @every(period=0.1)
    def sensor(self) -> None: ...


class PacedNode(Node):
    """Gets the robot up and lets it walk."""

    cmd = publishes(contracts.CMD_VEL)

    async def on_start(self) -> None:
        await self.call(contracts.WALK, Trigger.Request(), timeout=5.0)

    @every(hz=10)
    def walk(self) -> None:
        self.cmd(Twist(linear=Vector3(x=0.5)))


class Listener(Node):
    """Listens to the sensors, and writes down the stamps of the control loop's steps, seconds."""

    def __init__(self, backend: str) -> None:
        self._backend = backend
        self.times: list[float] = []

    async def on_start(self) -> None:
        if self._backend == "physics":
            self.on(contracts.MOTOR_TARGETS, self._stepped, qos=1000)
        elif self._backend == "kinematic":
            self.on(contracts.BODY_DRIVE, self._stepped, qos=1000)

    def _stepped(self, message: MotorTargets | BodyDrive) -> None:
        self.times.append(message.stamp.sec + 1e-9 * message.stamp.nanosec)


def punctuality(times: Sequence[float], hz: float) -> Punctuality:
    """Of steps at these times, s. Due is k periods after the start, for the start that makes no step early. A step that never came is missed, too."""
    if len(times) < 3:
        return Punctuality(0.0, float("inf"), float("inf"), 100.0)
    steps, period = np.asarray(times) - times[0], 1.0 / hz
    errors = np.abs(np.diff(steps) - period) * 1e3
    late = steps - period * np.arange(len(steps), dtype=np.float64)
    late -= late.min()
    # What is never caught up with is a step that never came.
    lost = np.floor(np.minimum.accumulate(late[::-1])[::-1] / period + 0.5)
    missed = 100.0 * (lost[-1] + int((late - period * lost > period).sum())) / len(late)
    rate = (len(steps) - 1) / float(steps[-1])
    return Punctuality(rate, float(np.quantile(errors, 0.5)), float(np.quantile(errors, 0.99)), missed)


def restarts_in(system: System) -> int:
    """How many restarts its nodes have had."""
    return sum(record.incarnation - 1 for record in system.nodes.values() if record.incarnation > 1)


async def listener_in(system: System, backend: str) -> Listener:
    """A node that listens to the steps of the control loop of this back end, and to nothing for ``none``."""
    await system.join(Child(Listener, args=(backend,)))
    listener = system.node("listener")
    assert isinstance(listener, Listener)
    return listener


def listen(stack: ExitStack, node: Node, names: Sequence[str]) -> dict[str, Stream[Any]]:
    """Subscriptions that nobody reads: they keep what their depth allows and count the rest."""
    streams = {name: node.subscribe(TOPICS[name]) for name in names}
    for stream in streams.values():
        stack.callback(stream.close)
    return streams


async def _measured(
    streams: dict[str, Stream[Any]], wait: Callable[[], Awaitable[object]]
) -> tuple[float, dict[str, float]]:
    """Processor time by wall time (per cent) and the rate of each stream (Hz) meanwhile."""
    before = {name: stream.received for name, stream in streams.items()}
    wall, spent = perf_counter(), process_time()
    await wait()
    wall, spent = perf_counter() - wall, process_time() - spent
    return 100.0 * spent / wall, {name: (stream.received - before[name]) / wall for name, stream in streams.items()}


def clockwork_rates(system: System) -> dict[str, float]:
    """The rates of the clockwork's timers so far."""
    timers = next(state.timers for state in system.nodes.values() if state.identity.name == "clockwork")
    now = system.loop.time()
    by_rate = {timer.hz: timer.rate(now) for timer in timers.values()}
    return {name: by_rate[hz] for _, name, hz in TIMERS}


def _body(backend: str, seed: int, world: str) -> Simulation:
    """One that the loop does not wait for: it is measured how punctual that is."""
    from robot.sim.kinematic import KinematicBody
    from robot.sim.physics import PhysicsBody

    scene = get_world(world)
    body = KinematicBody(scene, seed=seed) if backend == "kinematic" else PhysicsBody(scene, seed=seed)
    body.real_time = True
    return body


def at_rate(tree: Supervisor, hz: float) -> Supervisor:
    """The tree with samples, and so steps of its control loop, `hz` times a second."""

    def change(child: Child) -> Child:
        parameters = dict(child.parameters) | {"rate": hz}
        return child.replace(parameters=parameters) if child.name == "proprioception" else child

    return changed(tree, change)
