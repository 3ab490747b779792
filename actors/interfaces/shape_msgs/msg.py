"""shape_msgs/msg. Generated from its definitions in share; do not edit."""

from typing import Annotated, ClassVar

from actors.interfaces.geometry_msgs.msg import Point, Polygon
from actors.interfaces.message import Message
from actors.interfaces.types import AtMost, Exactly, Many, default, float64_array, uint8, uint32_array

__all__ = [
    "Mesh",
    "MeshTriangle",
    "Plane",
    "SolidPrimitive",
]


class MeshTriangle(Message, frozen=True, kw_only=True):
    """shape_msgs/msg/MeshTriangle"""

    vertex_indices: Annotated[uint32_array, Exactly(3)] = default()


class Mesh(Message, frozen=True, kw_only=True):
    """shape_msgs/msg/Mesh"""

    triangles: Many[MeshTriangle] = default()
    vertices: Many[Point] = default()


class Plane(Message, frozen=True, kw_only=True):
    """shape_msgs/msg/Plane"""

    coef: Annotated[float64_array, Exactly(4)] = default()


class SolidPrimitive(Message, frozen=True, kw_only=True):
    """shape_msgs/msg/SolidPrimitive"""

    BOX: ClassVar[uint8] = 1
    SPHERE: ClassVar[uint8] = 2
    CYLINDER: ClassVar[uint8] = 3
    CONE: ClassVar[uint8] = 4
    PRISM: ClassVar[uint8] = 5
    BOX_X: ClassVar[uint8] = 0
    BOX_Y: ClassVar[uint8] = 1
    BOX_Z: ClassVar[uint8] = 2
    SPHERE_RADIUS: ClassVar[uint8] = 0
    CYLINDER_HEIGHT: ClassVar[uint8] = 0
    CYLINDER_RADIUS: ClassVar[uint8] = 1
    CONE_HEIGHT: ClassVar[uint8] = 0
    CONE_RADIUS: ClassVar[uint8] = 1
    PRISM_HEIGHT: ClassVar[uint8] = 0

    type: uint8 = 0
    dimensions: Annotated[float64_array, AtMost(3)] = default()
    polygon: Polygon = default()
