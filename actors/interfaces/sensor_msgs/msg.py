"""sensor_msgs/msg. Generated from its definitions in share; do not edit."""

from typing import Annotated, ClassVar

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import Point32, Quaternion, Transform, Twist, Vector3, Wrench
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.types import (
    Exactly,
    Many,
    default,
    float32,
    float32_array,
    float64,
    float64_array,
    int8,
    int32_array,
    string,
    string_array,
    uint8,
    uint8_array,
    uint16,
    uint32,
)

__all__ = [
    "BatteryState",
    "CameraInfo",
    "ChannelFloat32",
    "CompressedImage",
    "FluidPressure",
    "Illuminance",
    "Image",
    "Imu",
    "JointState",
    "Joy",
    "JoyFeedback",
    "JoyFeedbackArray",
    "LaserEcho",
    "LaserScan",
    "MagneticField",
    "MultiDOFJointState",
    "MultiEchoLaserScan",
    "NavSatFix",
    "NavSatStatus",
    "PointCloud",
    "PointCloud2",
    "PointField",
    "Range",
    "RegionOfInterest",
    "RelativeHumidity",
    "Temperature",
    "TimeReference",
]


class BatteryState(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/BatteryState"""

    POWER_SUPPLY_STATUS_UNKNOWN: ClassVar[uint8] = 0
    POWER_SUPPLY_STATUS_CHARGING: ClassVar[uint8] = 1
    POWER_SUPPLY_STATUS_DISCHARGING: ClassVar[uint8] = 2
    POWER_SUPPLY_STATUS_NOT_CHARGING: ClassVar[uint8] = 3
    POWER_SUPPLY_STATUS_FULL: ClassVar[uint8] = 4
    POWER_SUPPLY_HEALTH_UNKNOWN: ClassVar[uint8] = 0
    POWER_SUPPLY_HEALTH_GOOD: ClassVar[uint8] = 1
    POWER_SUPPLY_HEALTH_OVERHEAT: ClassVar[uint8] = 2
    POWER_SUPPLY_HEALTH_DEAD: ClassVar[uint8] = 3
    POWER_SUPPLY_HEALTH_OVERVOLTAGE: ClassVar[uint8] = 4
    POWER_SUPPLY_HEALTH_UNSPEC_FAILURE: ClassVar[uint8] = 5
    POWER_SUPPLY_HEALTH_COLD: ClassVar[uint8] = 6
    POWER_SUPPLY_HEALTH_WATCHDOG_TIMER_EXPIRE: ClassVar[uint8] = 7
    POWER_SUPPLY_HEALTH_SAFETY_TIMER_EXPIRE: ClassVar[uint8] = 8
    POWER_SUPPLY_TECHNOLOGY_UNKNOWN: ClassVar[uint8] = 0
    POWER_SUPPLY_TECHNOLOGY_NIMH: ClassVar[uint8] = 1
    POWER_SUPPLY_TECHNOLOGY_LION: ClassVar[uint8] = 2
    POWER_SUPPLY_TECHNOLOGY_LIPO: ClassVar[uint8] = 3
    POWER_SUPPLY_TECHNOLOGY_LIFE: ClassVar[uint8] = 4
    POWER_SUPPLY_TECHNOLOGY_NICD: ClassVar[uint8] = 5
    POWER_SUPPLY_TECHNOLOGY_LIMN: ClassVar[uint8] = 6
    POWER_SUPPLY_TECHNOLOGY_TERNARY: ClassVar[uint8] = 7
    POWER_SUPPLY_TECHNOLOGY_VRLA: ClassVar[uint8] = 8

    header: Header = default()
    voltage: float32 = 0.0
    temperature: float32 = 0.0
    current: float32 = 0.0
    charge: float32 = 0.0
    capacity: float32 = 0.0
    design_capacity: float32 = 0.0
    percentage: float32 = 0.0
    power_supply_status: uint8 = 0
    power_supply_health: uint8 = 0
    power_supply_technology: uint8 = 0
    present: bool = False
    cell_voltage: float32_array = default()
    cell_temperature: float32_array = default()
    location: string = ""
    serial_number: string = ""


class RegionOfInterest(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/RegionOfInterest"""

    x_offset: uint32 = 0
    y_offset: uint32 = 0
    height: uint32 = 0
    width: uint32 = 0
    do_rectify: bool = False


class CameraInfo(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/CameraInfo"""

    header: Header = default()
    height: uint32 = 0
    width: uint32 = 0
    distortion_model: string = ""
    d: float64_array = default()
    k: Annotated[float64_array, Exactly(9)] = default()
    r: Annotated[float64_array, Exactly(9)] = default()
    p: Annotated[float64_array, Exactly(12)] = default()
    binning_x: uint32 = 0
    binning_y: uint32 = 0
    roi: RegionOfInterest = default()


class ChannelFloat32(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/ChannelFloat32"""

    name: string = ""
    values: float32_array = default()


class CompressedImage(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/CompressedImage"""

    header: Header = default()
    format: string = ""
    data: uint8_array = default()


class FluidPressure(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/FluidPressure"""

    header: Header = default()
    fluid_pressure: float64 = 0.0
    variance: float64 = 0.0


class Illuminance(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/Illuminance"""

    header: Header = default()
    illuminance: float64 = 0.0
    variance: float64 = 0.0


class Image(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/Image"""

    header: Header = default()
    height: uint32 = 0
    width: uint32 = 0
    encoding: string = ""
    is_bigendian: uint8 = 0
    step: uint32 = 0
    data: uint8_array = default()


class Imu(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/Imu"""

    header: Header = default()
    orientation: Quaternion = default()
    orientation_covariance: Annotated[float64_array, Exactly(9)] = default()
    angular_velocity: Vector3 = default()
    angular_velocity_covariance: Annotated[float64_array, Exactly(9)] = default()
    linear_acceleration: Vector3 = default()
    linear_acceleration_covariance: Annotated[float64_array, Exactly(9)] = default()


class JointState(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/JointState"""

    header: Header = default()
    name: string_array = default()
    position: float64_array = default()
    velocity: float64_array = default()
    effort: float64_array = default()


class Joy(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/Joy"""

    header: Header = default()
    axes: float32_array = default()
    buttons: int32_array = default()


class JoyFeedback(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/JoyFeedback"""

    TYPE_LED: ClassVar[uint8] = 0
    TYPE_RUMBLE: ClassVar[uint8] = 1
    TYPE_BUZZER: ClassVar[uint8] = 2

    type: uint8 = 0
    id: uint8 = 0
    intensity: float32 = 0.0


class JoyFeedbackArray(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/JoyFeedbackArray"""

    array: Many[JoyFeedback] = default()


class LaserEcho(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/LaserEcho"""

    echoes: float32_array = default()


class LaserScan(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/LaserScan"""

    header: Header = default()
    angle_min: float32 = 0.0
    angle_max: float32 = 0.0
    angle_increment: float32 = 0.0
    time_increment: float32 = 0.0
    scan_time: float32 = 0.0
    range_min: float32 = 0.0
    range_max: float32 = 0.0
    ranges: float32_array = default()
    intensities: float32_array = default()


class MagneticField(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/MagneticField"""

    header: Header = default()
    magnetic_field: Vector3 = default()
    magnetic_field_covariance: Annotated[float64_array, Exactly(9)] = default()


class MultiDOFJointState(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/MultiDOFJointState"""

    header: Header = default()
    joint_names: string_array = default()
    transforms: Many[Transform] = default()
    twist: Many[Twist] = default()
    wrench: Many[Wrench] = default()


class MultiEchoLaserScan(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/MultiEchoLaserScan"""

    header: Header = default()
    angle_min: float32 = 0.0
    angle_max: float32 = 0.0
    angle_increment: float32 = 0.0
    time_increment: float32 = 0.0
    scan_time: float32 = 0.0
    range_min: float32 = 0.0
    range_max: float32 = 0.0
    ranges: Many[LaserEcho] = default()
    intensities: Many[LaserEcho] = default()


class NavSatStatus(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/NavSatStatus"""

    STATUS_UNKNOWN: ClassVar[int8] = -2
    STATUS_NO_FIX: ClassVar[int8] = -1
    STATUS_FIX: ClassVar[int8] = 0
    STATUS_SBAS_FIX: ClassVar[int8] = 1
    STATUS_GBAS_FIX: ClassVar[int8] = 2
    SERVICE_UNKNOWN: ClassVar[uint16] = 0
    SERVICE_GPS: ClassVar[uint16] = 1
    SERVICE_GLONASS: ClassVar[uint16] = 2
    SERVICE_COMPASS: ClassVar[uint16] = 4
    SERVICE_GALILEO: ClassVar[uint16] = 8

    status: int8 = -2
    service: uint16 = 0


class NavSatFix(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/NavSatFix"""

    COVARIANCE_TYPE_UNKNOWN: ClassVar[uint8] = 0
    COVARIANCE_TYPE_APPROXIMATED: ClassVar[uint8] = 1
    COVARIANCE_TYPE_DIAGONAL_KNOWN: ClassVar[uint8] = 2
    COVARIANCE_TYPE_KNOWN: ClassVar[uint8] = 3

    header: Header = default()
    status: NavSatStatus = default()
    latitude: float64 = 0.0
    longitude: float64 = 0.0
    altitude: float64 = 0.0
    position_covariance: Annotated[float64_array, Exactly(9)] = default()
    position_covariance_type: uint8 = 0


class PointCloud(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/PointCloud"""

    header: Header = default()
    points: Many[Point32] = default()
    channels: Many[ChannelFloat32] = default()


class PointField(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/PointField"""

    INT8: ClassVar[uint8] = 1
    UINT8: ClassVar[uint8] = 2
    INT16: ClassVar[uint8] = 3
    UINT16: ClassVar[uint8] = 4
    INT32: ClassVar[uint8] = 5
    UINT32: ClassVar[uint8] = 6
    FLOAT32: ClassVar[uint8] = 7
    FLOAT64: ClassVar[uint8] = 8
    INT64: ClassVar[uint8] = 9
    UINT64: ClassVar[uint8] = 10
    BOOL: ClassVar[uint8] = 11

    name: string = ""
    offset: uint32 = 0
    datatype: uint8 = 0
    count: uint32 = 0


class PointCloud2(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/PointCloud2"""

    header: Header = default()
    height: uint32 = 0
    width: uint32 = 0
    fields: Many[PointField] = default()
    is_bigendian: bool = False
    point_step: uint32 = 0
    row_step: uint32 = 0
    data: uint8_array = default()
    is_dense: bool = False


class Range(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/Range"""

    ULTRASOUND: ClassVar[uint8] = 0
    INFRARED: ClassVar[uint8] = 1

    header: Header = default()
    radiation_type: uint8 = 0
    field_of_view: float32 = 0.0
    min_range: float32 = 0.0
    max_range: float32 = 0.0
    range: float32 = 0.0
    variance: float32 = 0.0


class RelativeHumidity(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/RelativeHumidity"""

    header: Header = default()
    relative_humidity: float64 = 0.0
    variance: float64 = 0.0


class Temperature(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/Temperature"""

    header: Header = default()
    temperature: float64 = 0.0
    variance: float64 = 0.0


class TimeReference(Message, frozen=True, kw_only=True):
    """sensor_msgs/msg/TimeReference"""

    header: Header = default()
    time_ref: Time = default()
    source: string = ""
