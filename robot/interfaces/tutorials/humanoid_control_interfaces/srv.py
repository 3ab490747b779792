"""humanoid_control_interfaces/srv. Generated from its definitions in share; do not edit."""

from typing import TypeAlias

from actors.interfaces.geometry_msgs.msg import Point, PoseStamped
from actors.interfaces.message import Message, ServiceType
from actors.interfaces.nav_msgs.msg import Path
from actors.interfaces.types import default, string

__all__ = [
    "PlanPath",
    "PlanPath_Request",
    "PlanPath_Response",
    "PlanTrajectory",
    "PlanTrajectory_Request",
    "PlanTrajectory_Response",
]


class PlanPath_Request(Message, frozen=True, kw_only=True):
    """humanoid_control_interfaces/srv/PlanPath_Request

    A path between two poses.
    """

    start: PoseStamped = default()
    goal: PoseStamped = default()


class PlanPath_Response(Message, frozen=True, kw_only=True):
    """humanoid_control_interfaces/srv/PlanPath_Response"""

    path: Path = default()
    success: bool = False
    message: string = ""


class PlanPath(ServiceType[PlanPath_Request, PlanPath_Response]):
    """humanoid_control_interfaces/srv/PlanPath"""

    Request: TypeAlias = PlanPath_Request
    Response: TypeAlias = PlanPath_Response


class PlanTrajectory_Request(Message, frozen=True, kw_only=True):
    """humanoid_control_interfaces/srv/PlanTrajectory_Request

    A path between two points.
    """

    start: Point = default()
    goal: Point = default()


class PlanTrajectory_Response(Message, frozen=True, kw_only=True):
    """humanoid_control_interfaces/srv/PlanTrajectory_Response"""

    trajectory: Path = default()
    success: bool = False


class PlanTrajectory(ServiceType[PlanTrajectory_Request, PlanTrajectory_Response]):
    """humanoid_control_interfaces/srv/PlanTrajectory"""

    Request: TypeAlias = PlanTrajectory_Request
    Response: TypeAlias = PlanTrajectory_Response
