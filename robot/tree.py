"""The robot's supervisor tree: who is in it, in which order, and what happens when one of them fails.

One supervisor, `rest_for_one`: a node that fails is restarted together with those that were started after it, because they build on it.
The first to start is the last to stop: the motors, which hold the safe stop.

    motors, proprioception, gait, battery, lidar, localizer, navigation, patrol

A node that fails more often than the intensity allows (3 restarts within 5 s) ends the whole tree: everything stops in reverse order,
and the motors sit the robot down.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from actors import Child, Intensity, Node, Supervisor, rest_for_one
from robot.battery.model import Pack
from robot.battery.node import Battery
from robot.gait.node import Gait
from robot.navigation.grid import Grid
from robot.navigation.localizer import Localizer
from robot.navigation.node import Navigation
from robot.sensors.nodes import Lidar, Proprioception
from robot.tasks.patrol import Patrol
from robot.world.body import Body
from robot.world.motors import Motors
from robot.world.scene import Pose2

if TYPE_CHECKING:
    from actors.params_file import ParameterOverrides

__all__ = ["robot_tree"]


def robot_tree(
    body: Body,
    pack: Pack,
    waypoints: Sequence[tuple[str, Pose2]],
    *,
    laps: int = 0,
    motor_delay: float = 0.004,
    overrides: ParameterOverrides | None = None,
    publish_clock: float | None = None,
) -> Supervisor:
    """The whole robot around `body`, walking `waypoints`. `overrides` come from parameter files and apply by full node name.

    With `publish_clock`, a rate in Hz, it has one node more, the first: a `ClockPublisher`, so that time runs for all who follow it.
    """

    def parameters(kind: type[Node], node: str, **own: Any) -> dict[str, Any]:
        """A pattern such as /** reaches nodes that lack what it sets; they go without."""
        found = overrides.for_node(f"/{node}") if overrides is not None else {}
        return own | {name: value for name, value in found.items() if name in kind.blueprint.table.values}

    grid = Grid.from_scene(body.scene)
    clock: list[Child] = []
    if publish_clock is not None:
        from actors.clock_publisher import ClockPublisher

        clock = [Child(ClockPublisher, args=(publish_clock,))]
    return Supervisor(
        "robot",
        strategy=rest_for_one,
        intensity=Intensity(3, within=5.0),
        children=[
            *clock,
            Child(Motors, args=(body,), parameters=parameters(Motors, "motors"), stop=3.0),
            Child(Proprioception, args=(body,), parameters=parameters(Proprioception, "proprioception")),
            Child(Gait, parameters=parameters(Gait, "gait", backend=body.backend, motor_delay=motor_delay)),
            Child(Battery, args=(pack,), parameters=parameters(Battery, "battery")),
            Child(Lidar, args=(body,), parameters=parameters(Lidar, "lidar")),
            Child(Localizer, args=(grid, body.scene.start), parameters=parameters(Localizer, "localizer")),
            Child(Navigation, args=(grid,), parameters=parameters(Navigation, "navigation")),
            Child(Patrol, args=(waypoints, body.scene.dock, grid), parameters=parameters(Patrol, "patrol", laps=laps)),
        ],
    )
