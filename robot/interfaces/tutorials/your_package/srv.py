"""your_package/srv. Generated from its definitions in share; do not edit."""

from typing import TypeAlias

from actors.interfaces.message import Message, ServiceType
from actors.interfaces.types import string

__all__ = [
    "SensorCalibration",
    "SensorCalibration_Request",
    "SensorCalibration_Response",
]


class SensorCalibration_Request(Message, frozen=True, kw_only=True):
    """your_package/srv/SensorCalibration_Request

    Calibrate a sensor, or only reset it. From a tutorial, whose own placeholder name the package is.
    """

    sensor_name: string = ""
    reset_only: bool = False


class SensorCalibration_Response(Message, frozen=True, kw_only=True):
    """your_package/srv/SensorCalibration_Response"""

    success: bool = False
    message: string = ""


class SensorCalibration(ServiceType[SensorCalibration_Request, SensorCalibration_Response]):
    """your_package/srv/SensorCalibration"""

    Request: TypeAlias = SensorCalibration_Request
    Response: TypeAlias = SensorCalibration_Response
