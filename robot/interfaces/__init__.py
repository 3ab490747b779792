"""The message, service and action types of the robot's own ROS package, robactor_msgs; those of the tutorials are in `tutorials`.

    from robot.interfaces.robactor_msgs.msg import GaitStatus

Importing this package makes them known by their ROS names too: `get_message("robactor_msgs/GaitStatus")`.
"""

from pathlib import Path

from actors.interfaces import add_folder

add_folder(Path(__file__).parent / "share", __name__)
