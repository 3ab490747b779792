"""Voice and joystick: the robot's own controller node with the tutorial's limits of 1.0 m/s and 1.0 rad/s. It is disabled at the start.

    forward, back, left, right, stop          frente, tras, esquerda, direita, parar

The joystick goes before the voice, a word for stopping before any other, and a command is forgotten after half a second.
"""

from __future__ import annotations

from actors import Child, Supervisor
from robot.nodes import twist_mux as node
from robot.nodes.twist_mux import TUTORIAL_LIMITS
from robot.tutorials.program import main, system


class RobotController(node.RobotController):
    """The robot's own controller, which says that it is there."""

    async def on_start(self) -> None:
        await super().on_start()
        self.log.info("Robot Controller initialized")


def tree() -> Supervisor:
    """A controller that turns words and joystick into velocities, once somebody calls /robot/enable."""
    return system("robot_controller", Child(RobotController, parameters=TUTORIAL_LIMITS))


if __name__ == "__main__":
    main(tree)
