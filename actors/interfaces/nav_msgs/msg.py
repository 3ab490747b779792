"""nav_msgs/msg. Generated from its definitions in share; do not edit."""

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import (
    Accel,
    Point,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    Twist,
    TwistWithCovariance,
    Wrench,
)
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.types import Many, default, float32, int8_array, string, uint32

__all__ = [
    "Goals",
    "GridCells",
    "MapMetaData",
    "OccupancyGrid",
    "Odometry",
    "Path",
    "Trajectory",
    "TrajectoryPoint",
]


class Goals(Message, frozen=True, kw_only=True):
    """nav_msgs/msg/Goals"""

    header: Header = default()
    goals: Many[PoseStamped] = default()


class GridCells(Message, frozen=True, kw_only=True):
    """nav_msgs/msg/GridCells"""

    header: Header = default()
    cell_width: float32 = 0.0
    cell_height: float32 = 0.0
    cells: Many[Point] = default()


class MapMetaData(Message, frozen=True, kw_only=True):
    """nav_msgs/msg/MapMetaData"""

    map_load_time: Time = default()
    resolution: float32 = 0.0
    width: uint32 = 0
    height: uint32 = 0
    origin: Pose = default()


class OccupancyGrid(Message, frozen=True, kw_only=True):
    """nav_msgs/msg/OccupancyGrid"""

    header: Header = default()
    info: MapMetaData = default()
    data: int8_array = default()


class Odometry(Message, frozen=True, kw_only=True):
    """nav_msgs/msg/Odometry"""

    header: Header = default()
    child_frame_id: string = ""
    pose: PoseWithCovariance = default()
    twist: TwistWithCovariance = default()


class Path(Message, frozen=True, kw_only=True):
    """nav_msgs/msg/Path"""

    header: Header = default()
    poses: Many[PoseStamped] = default()


class TrajectoryPoint(Message, frozen=True, kw_only=True):
    """nav_msgs/msg/TrajectoryPoint"""

    header: Header = default()
    pose: Pose = default()
    velocity: Twist = default()
    acceleration: Accel = default()
    effort: Wrench = default()


class Trajectory(Message, frozen=True, kw_only=True):
    """nav_msgs/msg/Trajectory"""

    header: Header = default()
    points: Many[TrajectoryPoint] = default()
