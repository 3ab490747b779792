"""Whether the fields of a message agree with each other: what types cannot say and ROS 2 does not check.

Such messages do travel (a robot may send them), so they are flagged, not refused.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, Final

from actors.interfaces.message import Message

if TYPE_CHECKING:
    from actors.interfaces.nav_msgs.msg import OccupancyGrid
    from actors.interfaces.sensor_msgs.msg import Image, JointState, LaserScan, PointCloud2


def flaws(message: Message) -> tuple[str, ...]:
    """Sentences about the fields of a sensor or map message that contradict each other; empty where all is well.

    Knows JointState, LaserScan, Image, PointCloud2 and OccupancyGrid; of other types nothing is known to be wrong.
    """
    check = CHECKS.get(message.__ros_type__)
    return tuple(f"{type(message).__name__}: {flaw}" for flaw in check(message)) if check is not None else ()


def _joint_state(message: JointState) -> Iterator[str]:
    for name in ("position", "velocity", "effort"):
        count = len(getattr(message, name))
        if count not in (0, len(message.name)):
            yield f"{name} has {count} values for {len(message.name)} names; it holds none, or one for each"


def _laser_scan(message: LaserScan) -> Iterator[str]:
    if message.angle_increment:
        beams = round((message.angle_max - message.angle_min) / message.angle_increment) + 1
        # Drivers disagree on whether the last beam of a full turn is counted.
        if abs(beams - len(message.ranges)) > 1:
            yield f"the angles make {beams} beams, but there are {len(message.ranges)} ranges"
    if len(message.intensities) not in (0, len(message.ranges)):
        yield f"{len(message.intensities)} intensities for {len(message.ranges)} ranges; they are none, or one for each"


def _image(message: Image) -> Iterator[str]:
    if message.step * message.height != len(message.data):
        yield f"step {message.step} times height {message.height} is not the {len(message.data)} bytes of data"
    if message.step < message.width:
        yield f"a row of {message.width} pixels does not fit into step {message.step} (bytes in a row)"


def _point_cloud(message: PointCloud2) -> Iterator[str]:
    if message.row_step != message.point_step * message.width:
        yield f"row_step {message.row_step} is not point_step {message.point_step} times width {message.width}"
    if message.row_step * message.height != len(message.data):
        yield f"row_step {message.row_step} times height {message.height} is not the {len(message.data)} bytes of data"


def _occupancy_grid(message: OccupancyGrid) -> Iterator[str]:
    cells = message.info.width * message.info.height
    if cells != len(message.data):
        yield f"{message.info.width} x {message.info.height} cells, but {len(message.data)} values"
    if len(message.data) and not (message.data.min() >= -1 and message.data.max() <= 100):
        yield "cells hold -1 (unknown) or 0 to 100 (percent)"


CHECKS: Final[dict[str, Callable[[Any], Iterator[str]]]] = {
    "sensor_msgs/msg/JointState": _joint_state,
    "sensor_msgs/msg/LaserScan": _laser_scan,
    "sensor_msgs/msg/Image": _image,
    "sensor_msgs/msg/PointCloud2": _point_cloud,
    "nav_msgs/msg/OccupancyGrid": _occupancy_grid,
}
"""The checks by the ROS name of their type."""
