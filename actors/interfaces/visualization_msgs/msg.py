"""visualization_msgs/msg. Generated from its definitions in share; do not edit."""

from typing import ClassVar

from actors.interfaces.builtin_interfaces.msg import Duration
from actors.interfaces.geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from actors.interfaces.message import Message
from actors.interfaces.sensor_msgs.msg import CompressedImage
from actors.interfaces.std_msgs.msg import ColorRGBA, Header
from actors.interfaces.types import (
    Many,
    default,
    float32,
    int32,
    string,
    string_array,
    uint8,
    uint8_array,
    uint32,
    uint64,
)

__all__ = [
    "ImageMarker",
    "InteractiveMarker",
    "InteractiveMarkerControl",
    "InteractiveMarkerFeedback",
    "InteractiveMarkerInit",
    "InteractiveMarkerPose",
    "InteractiveMarkerUpdate",
    "Marker",
    "MarkerArray",
    "MenuEntry",
    "MeshFile",
    "UVCoordinate",
]


class ImageMarker(Message, frozen=True, kw_only=True):
    """visualization_msgs/msg/ImageMarker"""

    CIRCLE: ClassVar[int32] = 0
    LINE_STRIP: ClassVar[int32] = 1
    LINE_LIST: ClassVar[int32] = 2
    POLYGON: ClassVar[int32] = 3
    POINTS: ClassVar[int32] = 4
    ADD: ClassVar[int32] = 0
    REMOVE: ClassVar[int32] = 1

    header: Header = default()
    ns: string = ""
    id: int32 = 0
    type: int32 = 0
    action: int32 = 0
    position: Point = default()
    scale: float32 = 0.0
    outline_color: ColorRGBA = default()
    filled: uint8 = 0
    fill_color: ColorRGBA = default()
    lifetime: Duration = default()
    points: Many[Point] = default()
    outline_colors: Many[ColorRGBA] = default()


class MenuEntry(Message, frozen=True, kw_only=True):
    """visualization_msgs/msg/MenuEntry"""

    FEEDBACK: ClassVar[uint8] = 0
    ROSRUN: ClassVar[uint8] = 1
    ROSLAUNCH: ClassVar[uint8] = 2

    id: uint32 = 0
    parent_id: uint32 = 0
    title: string = ""
    command: string = ""
    command_type: uint8 = 0


class UVCoordinate(Message, frozen=True, kw_only=True):
    """visualization_msgs/msg/UVCoordinate"""

    u: float32 = 0.0
    v: float32 = 0.0


class MeshFile(Message, frozen=True, kw_only=True):
    """visualization_msgs/msg/MeshFile"""

    filename: string = ""
    data: uint8_array = default()


class Marker(Message, frozen=True, kw_only=True):
    """visualization_msgs/msg/Marker"""

    ARROW: ClassVar[int32] = 0
    CUBE: ClassVar[int32] = 1
    SPHERE: ClassVar[int32] = 2
    CYLINDER: ClassVar[int32] = 3
    LINE_STRIP: ClassVar[int32] = 4
    LINE_LIST: ClassVar[int32] = 5
    CUBE_LIST: ClassVar[int32] = 6
    SPHERE_LIST: ClassVar[int32] = 7
    POINTS: ClassVar[int32] = 8
    TEXT_VIEW_FACING: ClassVar[int32] = 9
    MESH_RESOURCE: ClassVar[int32] = 10
    TRIANGLE_LIST: ClassVar[int32] = 11
    ARROW_STRIP: ClassVar[int32] = 12
    ADD: ClassVar[int32] = 0
    MODIFY: ClassVar[int32] = 0
    DELETE: ClassVar[int32] = 2
    DELETEALL: ClassVar[int32] = 3

    header: Header = default()
    ns: string = ""
    id: int32 = 0
    type: int32 = 0
    action: int32 = 0
    pose: Pose = default()
    scale: Vector3 = default()
    color: ColorRGBA = default()
    lifetime: Duration = default()
    frame_locked: bool = False
    points: Many[Point] = default()
    colors: Many[ColorRGBA] = default()
    texture_resource: string = ""
    texture: CompressedImage = default()
    uv_coordinates: Many[UVCoordinate] = default()
    text: string = ""
    mesh_resource: string = ""
    mesh_file: MeshFile = default()
    mesh_use_embedded_materials: bool = False


class InteractiveMarkerControl(Message, frozen=True, kw_only=True):
    """visualization_msgs/msg/InteractiveMarkerControl"""

    INHERIT: ClassVar[uint8] = 0
    FIXED: ClassVar[uint8] = 1
    VIEW_FACING: ClassVar[uint8] = 2
    NONE: ClassVar[uint8] = 0
    MENU: ClassVar[uint8] = 1
    BUTTON: ClassVar[uint8] = 2
    MOVE_AXIS: ClassVar[uint8] = 3
    MOVE_PLANE: ClassVar[uint8] = 4
    ROTATE_AXIS: ClassVar[uint8] = 5
    MOVE_ROTATE: ClassVar[uint8] = 6
    MOVE_3D: ClassVar[uint8] = 7
    ROTATE_3D: ClassVar[uint8] = 8
    MOVE_ROTATE_3D: ClassVar[uint8] = 9

    name: string = ""
    orientation: Quaternion = default()
    orientation_mode: uint8 = 0
    interaction_mode: uint8 = 0
    always_visible: bool = False
    markers: Many[Marker] = default()
    independent_marker_orientation: bool = False
    description: string = ""


class InteractiveMarker(Message, frozen=True, kw_only=True):
    """visualization_msgs/msg/InteractiveMarker"""

    header: Header = default()
    pose: Pose = default()
    name: string = ""
    description: string = ""
    scale: float32 = 0.0
    menu_entries: Many[MenuEntry] = default()
    controls: Many[InteractiveMarkerControl] = default()


class InteractiveMarkerFeedback(Message, frozen=True, kw_only=True):
    """visualization_msgs/msg/InteractiveMarkerFeedback"""

    KEEP_ALIVE: ClassVar[uint8] = 0
    POSE_UPDATE: ClassVar[uint8] = 1
    MENU_SELECT: ClassVar[uint8] = 2
    BUTTON_CLICK: ClassVar[uint8] = 3
    MOUSE_DOWN: ClassVar[uint8] = 4
    MOUSE_UP: ClassVar[uint8] = 5

    header: Header = default()
    client_id: string = ""
    marker_name: string = ""
    control_name: string = ""
    event_type: uint8 = 0
    pose: Pose = default()
    menu_entry_id: uint32 = 0
    mouse_point: Point = default()
    mouse_point_valid: bool = False


class InteractiveMarkerInit(Message, frozen=True, kw_only=True):
    """visualization_msgs/msg/InteractiveMarkerInit"""

    server_id: string = ""
    seq_num: uint64 = 0
    markers: Many[InteractiveMarker] = default()


class InteractiveMarkerPose(Message, frozen=True, kw_only=True):
    """visualization_msgs/msg/InteractiveMarkerPose"""

    header: Header = default()
    pose: Pose = default()
    name: string = ""


class InteractiveMarkerUpdate(Message, frozen=True, kw_only=True):
    """visualization_msgs/msg/InteractiveMarkerUpdate"""

    KEEP_ALIVE: ClassVar[uint8] = 0
    UPDATE: ClassVar[uint8] = 1

    server_id: string = ""
    seq_num: uint64 = 0
    type: uint8 = 0
    markers: Many[InteractiveMarker] = default()
    poses: Many[InteractiveMarkerPose] = default()
    erases: string_array = default()


class MarkerArray(Message, frozen=True, kw_only=True):
    """visualization_msgs/msg/MarkerArray"""

    markers: Many[Marker] = default()
