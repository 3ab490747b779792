"""The message, service and action types of the ROS 2 tutorials: six packages under the names that the tutorials give them.

    from robot.interfaces.tutorials.my_robot_interfaces.srv import GetBatteryStatus

The robot serves some of them beside its own (`robot.contracts`); the programs of `robot.tutorials` use all. Importing this package makes
them known by their ROS names too: `get_service("my_robot_interfaces/GetBatteryStatus")`.
"""

from pathlib import Path

from actors.interfaces import add_folder

add_folder(Path(__file__).parent / "share", __name__)
