"""statistics_msgs/msg. Generated from its definitions in share; do not edit."""

from typing import ClassVar

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.message import Message
from actors.interfaces.types import Many, default, float64, string, uint8

__all__ = [
    "MetricsMessage",
    "StatisticDataPoint",
    "StatisticDataType",
]


class StatisticDataPoint(Message, frozen=True, kw_only=True):
    """statistics_msgs/msg/StatisticDataPoint"""

    data_type: uint8 = 0
    data: float64 = 0.0


class MetricsMessage(Message, frozen=True, kw_only=True):
    """statistics_msgs/msg/MetricsMessage"""

    measurement_source_name: string = ""
    metrics_source: string = ""
    unit: string = ""
    window_start: Time = default()
    window_stop: Time = default()
    statistics: Many[StatisticDataPoint] = default()


class StatisticDataType(Message, frozen=True, kw_only=True):
    """statistics_msgs/msg/StatisticDataType"""

    STATISTICS_DATA_TYPE_UNINITIALIZED: ClassVar[uint8] = 0
    STATISTICS_DATA_TYPE_AVERAGE: ClassVar[uint8] = 1
    STATISTICS_DATA_TYPE_MINIMUM: ClassVar[uint8] = 2
    STATISTICS_DATA_TYPE_MAXIMUM: ClassVar[uint8] = 3
    STATISTICS_DATA_TYPE_STDDEV: ClassVar[uint8] = 4
    STATISTICS_DATA_TYPE_SAMPLE_COUNT: ClassVar[uint8] = 5
