"""The message types of Unitree's robots: those of `unitree_go` and `unitree_api` that `robot.hardware.unitree` exchanges with a Go2.

Importing this package makes them known by their ROS names too: `get_message("unitree_go/LowState")`. Their licence is in NOTICE.
"""

from pathlib import Path

from actors.interfaces import add_folder

add_folder(Path(__file__).parent / "share", __name__)
