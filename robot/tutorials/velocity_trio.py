"""Two publishers and a subscriber: several publishers and subscribers of one topic know nothing of each other.

Nothing here decides who is obeyed: that is the business of a controller (see robot_controller).
"""

from __future__ import annotations

from math import hypot

from actors import Node, Supervisor, Topic, every, publishes
from actors.interfaces.geometry_msgs.msg import Twist, Vector3
from robot.tutorials.program import main, system

CMD_VEL = Topic(Twist, "/cmd_vel", 10)

LIMIT = 1.0
"""What the monitor takes for too fast, m/s."""


class Teleop(Node):
    """A hand on a stick: /cmd_vel at 10 Hz, straight on."""

    cmd = publishes(CMD_VEL)

    @every(hz=10)
    def drive(self) -> None:
        self.cmd(Twist(linear=Vector3(x=0.3)))


class Autonomy(Node):
    """A program: /cmd_vel at 10 Hz, in a curve."""

    cmd = publishes(CMD_VEL)

    @every(hz=10)
    def drive(self) -> None:
        self.cmd(Twist(linear=Vector3(x=0.5), angular=Vector3(z=0.2)))


class SafetyMonitor(Node):
    """Counts what is commanded on /cmd_vel, and warns of speeds over 1 m/s."""

    async def on_start(self) -> None:
        self.seen = 0
        self.log.info("Safety Monitor initialized")

    @CMD_VEL.on()
    def watch(self, message: Twist) -> None:
        self.seen += 1
        speed = hypot(message.linear.x, message.linear.y)
        if not speed <= LIMIT:  # NaN is no speed either
            self.log.warning(f"Unsafe speed commanded: {speed:.2f} m/s")


def tree() -> Supervisor:
    """Teleop and autonomy that both publish velocities, and a monitor that hears them all."""
    return system("velocity_trio", SafetyMonitor, Teleop, Autonomy)


if __name__ == "__main__":
    main(tree)
