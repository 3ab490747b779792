"""Launch files of ROS 2, in Python, XML and YAML, as supervisor trees; packages and their executables.

::

    launch = Launch(Path("robot.launch.py"), {"world": "kitchen"})
    print(launch.show())
    async with run(launch.tree()) as system:
        await system.wait()

A launch file in Python imports `launch` and `launch_ros`, as for ROS 2. While it is evaluated here, these names lead to the actions of this
package, whether or not ROS 2 is installed.
"""

from __future__ import annotations

from actors.launch.errors import LaunchError, Line
from actors.launch.launching import Launch
from actors.launch.looking import NotDone
from actors.launch.packages import Executable, NodeTarget, Packages, Program, UnknownExecutable, UnknownPackage
from actors.launch.scripts import run_script, starts_itself

__all__ = [
    "Executable",
    "Launch",
    "LaunchError",
    "Line",
    "NodeTarget",
    "NotDone",
    "Packages",
    "Program",
    "UnknownExecutable",
    "UnknownPackage",
    "run_script",
    "starts_itself",
]
