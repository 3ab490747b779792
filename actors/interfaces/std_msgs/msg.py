"""std_msgs/msg. Generated from its definitions in share; do not edit."""

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.message import Message
from actors.interfaces.types import (
    Many,
    byte,
    byte_array,
    char,
    default,
    float32,
    float32_array,
    float64,
    float64_array,
    int8,
    int8_array,
    int16,
    int16_array,
    int32,
    int32_array,
    int64,
    int64_array,
    string,
    uint8,
    uint8_array,
    uint16,
    uint16_array,
    uint32,
    uint32_array,
    uint64,
    uint64_array,
)

__all__ = [
    "Bool",
    "Byte",
    "ByteMultiArray",
    "Char",
    "ColorRGBA",
    "Empty",
    "Float32",
    "Float32MultiArray",
    "Float64",
    "Float64MultiArray",
    "Header",
    "Int8",
    "Int8MultiArray",
    "Int16",
    "Int16MultiArray",
    "Int32",
    "Int32MultiArray",
    "Int64",
    "Int64MultiArray",
    "MultiArrayDimension",
    "MultiArrayLayout",
    "String",
    "UInt8",
    "UInt8MultiArray",
    "UInt16",
    "UInt16MultiArray",
    "UInt32",
    "UInt32MultiArray",
    "UInt64",
    "UInt64MultiArray",
]


class Bool(Message, frozen=True, kw_only=True):
    """std_msgs/msg/Bool"""

    data: bool = False


class Byte(Message, frozen=True, kw_only=True):
    """std_msgs/msg/Byte"""

    data: byte = 0


class MultiArrayDimension(Message, frozen=True, kw_only=True):
    """std_msgs/msg/MultiArrayDimension"""

    label: string = ""
    size: uint32 = 0
    stride: uint32 = 0


class MultiArrayLayout(Message, frozen=True, kw_only=True):
    """std_msgs/msg/MultiArrayLayout"""

    dim: Many[MultiArrayDimension] = default()
    data_offset: uint32 = 0


class ByteMultiArray(Message, frozen=True, kw_only=True):
    """std_msgs/msg/ByteMultiArray"""

    layout: MultiArrayLayout = default()
    data: byte_array = default()


class Char(Message, frozen=True, kw_only=True):
    """std_msgs/msg/Char"""

    data: char = 0


class ColorRGBA(Message, frozen=True, kw_only=True):
    """std_msgs/msg/ColorRGBA"""

    r: float32 = 0.0
    g: float32 = 0.0
    b: float32 = 0.0
    a: float32 = 0.0


class Empty(Message, frozen=True, kw_only=True):
    """std_msgs/msg/Empty"""


class Float32(Message, frozen=True, kw_only=True):
    """std_msgs/msg/Float32"""

    data: float32 = 0.0


class Float32MultiArray(Message, frozen=True, kw_only=True):
    """std_msgs/msg/Float32MultiArray"""

    layout: MultiArrayLayout = default()
    data: float32_array = default()


class Float64(Message, frozen=True, kw_only=True):
    """std_msgs/msg/Float64"""

    data: float64 = 0.0


class Float64MultiArray(Message, frozen=True, kw_only=True):
    """std_msgs/msg/Float64MultiArray"""

    layout: MultiArrayLayout = default()
    data: float64_array = default()


class Header(Message, frozen=True, kw_only=True):
    """std_msgs/msg/Header"""

    stamp: Time = default()
    frame_id: string = ""


class Int16(Message, frozen=True, kw_only=True):
    """std_msgs/msg/Int16"""

    data: int16 = 0


class Int16MultiArray(Message, frozen=True, kw_only=True):
    """std_msgs/msg/Int16MultiArray"""

    layout: MultiArrayLayout = default()
    data: int16_array = default()


class Int32(Message, frozen=True, kw_only=True):
    """std_msgs/msg/Int32"""

    data: int32 = 0


class Int32MultiArray(Message, frozen=True, kw_only=True):
    """std_msgs/msg/Int32MultiArray"""

    layout: MultiArrayLayout = default()
    data: int32_array = default()


class Int64(Message, frozen=True, kw_only=True):
    """std_msgs/msg/Int64"""

    data: int64 = 0


class Int64MultiArray(Message, frozen=True, kw_only=True):
    """std_msgs/msg/Int64MultiArray"""

    layout: MultiArrayLayout = default()
    data: int64_array = default()


class Int8(Message, frozen=True, kw_only=True):
    """std_msgs/msg/Int8"""

    data: int8 = 0


class Int8MultiArray(Message, frozen=True, kw_only=True):
    """std_msgs/msg/Int8MultiArray"""

    layout: MultiArrayLayout = default()
    data: int8_array = default()


class String(Message, frozen=True, kw_only=True):
    """std_msgs/msg/String"""

    data: string = ""


class UInt16(Message, frozen=True, kw_only=True):
    """std_msgs/msg/UInt16"""

    data: uint16 = 0


class UInt16MultiArray(Message, frozen=True, kw_only=True):
    """std_msgs/msg/UInt16MultiArray"""

    layout: MultiArrayLayout = default()
    data: uint16_array = default()


class UInt32(Message, frozen=True, kw_only=True):
    """std_msgs/msg/UInt32"""

    data: uint32 = 0


class UInt32MultiArray(Message, frozen=True, kw_only=True):
    """std_msgs/msg/UInt32MultiArray"""

    layout: MultiArrayLayout = default()
    data: uint32_array = default()


class UInt64(Message, frozen=True, kw_only=True):
    """std_msgs/msg/UInt64"""

    data: uint64 = 0


class UInt64MultiArray(Message, frozen=True, kw_only=True):
    """std_msgs/msg/UInt64MultiArray"""

    layout: MultiArrayLayout = default()
    data: uint64_array = default()


class UInt8(Message, frozen=True, kw_only=True):
    """std_msgs/msg/UInt8"""

    data: uint8 = 0


class UInt8MultiArray(Message, frozen=True, kw_only=True):
    """std_msgs/msg/UInt8MultiArray"""

    layout: MultiArrayLayout = default()
    data: uint8_array = default()
