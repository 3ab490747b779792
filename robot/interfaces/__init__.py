"""The message, service and action types of the tutorials, beside the common ones of `actors.interfaces`.

    from robot.interfaces.my_robot_interfaces.srv import GetBatteryStatus

Importing this package makes them known by their ROS names too: `get_service("my_robot_interfaces/GetBatteryStatus")`.
"""

from pathlib import Path

from actors.interfaces import add_folder

add_folder(Path(__file__).parent / "share", __name__)
