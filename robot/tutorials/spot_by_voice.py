"""Three of the tutorials' nodes together: words become velocities, velocities become a gait, and an inertial sensor keeps the balance.

voice_command -> robot_controller -> cmd_vel -> spot_controller <- imu/data <- imu_publisher
"""

from __future__ import annotations

from actors import Child, Supervisor
from robot.nodes.twist_mux import TUTORIAL_LIMITS, RobotController
from robot.tutorials.imu_publisher import ImuPublisher
from robot.tutorials.program import main, system
from robot.tutorials.spot_controller import SpotController


def tree() -> Supervisor:
    """A quadruped's joints that obey the voice: call /robot/enable, /spot/stand and /spot/walk, and publish on /voice_command."""
    return system("spot_by_voice", ImuPublisher, SpotController, Child(RobotController, parameters=TUTORIAL_LIMITS))


if __name__ == "__main__":
    main(tree)
