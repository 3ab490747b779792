"""geometry_msgs/msg. Generated from its definitions in share; do not edit."""

from typing import Annotated

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.types import Exactly, Many, default, float32, float64, float64_array, int64, string

__all__ = [
    "Accel",
    "AccelStamped",
    "AccelWithCovariance",
    "AccelWithCovarianceStamped",
    "Inertia",
    "InertiaStamped",
    "Point",
    "Point32",
    "PointStamped",
    "Polygon",
    "PolygonInstance",
    "PolygonInstanceStamped",
    "PolygonStamped",
    "Pose",
    "PoseArray",
    "PoseStamped",
    "PoseWithCovariance",
    "PoseWithCovarianceStamped",
    "Quaternion",
    "QuaternionStamped",
    "Transform",
    "TransformStamped",
    "Twist",
    "TwistStamped",
    "TwistWithCovariance",
    "TwistWithCovarianceStamped",
    "Vector3",
    "Vector3Stamped",
    "VelocityStamped",
    "Wrench",
    "WrenchStamped",
]


class Vector3(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/Vector3"""

    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0


class Accel(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/Accel"""

    linear: Vector3 = default()
    angular: Vector3 = default()


class AccelStamped(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/AccelStamped"""

    header: Header = default()
    accel: Accel = default()


class AccelWithCovariance(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/AccelWithCovariance"""

    accel: Accel = default()
    covariance: Annotated[float64_array, Exactly(36)] = default()


class AccelWithCovarianceStamped(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/AccelWithCovarianceStamped"""

    header: Header = default()
    accel: AccelWithCovariance = default()


class Inertia(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/Inertia"""

    m: float64 = 0.0
    com: Vector3 = default()
    ixx: float64 = 0.0
    ixy: float64 = 0.0
    ixz: float64 = 0.0
    iyy: float64 = 0.0
    iyz: float64 = 0.0
    izz: float64 = 0.0


class InertiaStamped(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/InertiaStamped"""

    header: Header = default()
    inertia: Inertia = default()


class Point(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/Point"""

    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0


class Point32(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/Point32"""

    x: float32 = 0.0
    y: float32 = 0.0
    z: float32 = 0.0


class PointStamped(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/PointStamped"""

    header: Header = default()
    point: Point = default()


class Polygon(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/Polygon"""

    points: Many[Point32] = default()


class PolygonInstance(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/PolygonInstance"""

    polygon: Polygon = default()
    id: int64 = 0


class PolygonInstanceStamped(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/PolygonInstanceStamped"""

    header: Header = default()
    polygon: PolygonInstance = default()


class PolygonStamped(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/PolygonStamped"""

    header: Header = default()
    polygon: Polygon = default()


class Quaternion(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/Quaternion"""

    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0
    w: float64 = 1.0


class Pose(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/Pose"""

    position: Point = default()
    orientation: Quaternion = default()


class PoseArray(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/PoseArray"""

    header: Header = default()
    poses: Many[Pose] = default()


class PoseStamped(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/PoseStamped"""

    header: Header = default()
    pose: Pose = default()


class PoseWithCovariance(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/PoseWithCovariance"""

    pose: Pose = default()
    covariance: Annotated[float64_array, Exactly(36)] = default()


class PoseWithCovarianceStamped(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/PoseWithCovarianceStamped"""

    header: Header = default()
    pose: PoseWithCovariance = default()


class QuaternionStamped(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/QuaternionStamped"""

    header: Header = default()
    quaternion: Quaternion = default()


class Transform(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/Transform"""

    translation: Vector3 = default()
    rotation: Quaternion = default()


class TransformStamped(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/TransformStamped"""

    header: Header = default()
    child_frame_id: string = ""
    transform: Transform = default()


class Twist(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/Twist"""

    linear: Vector3 = default()
    angular: Vector3 = default()


class TwistStamped(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/TwistStamped"""

    header: Header = default()
    twist: Twist = default()


class TwistWithCovariance(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/TwistWithCovariance"""

    twist: Twist = default()
    covariance: Annotated[float64_array, Exactly(36)] = default()


class TwistWithCovarianceStamped(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/TwistWithCovarianceStamped"""

    header: Header = default()
    twist: TwistWithCovariance = default()


class Vector3Stamped(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/Vector3Stamped"""

    header: Header = default()
    vector: Vector3 = default()


class VelocityStamped(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/VelocityStamped"""

    header: Header = default()
    body_frame_id: string = ""
    reference_frame_id: string = ""
    velocity: Twist = default()


class Wrench(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/Wrench"""

    force: Vector3 = default()
    torque: Vector3 = default()


class WrenchStamped(Message, frozen=True, kw_only=True):
    """geometry_msgs/msg/WrenchStamped"""

    header: Header = default()
    wrench: Wrench = default()
