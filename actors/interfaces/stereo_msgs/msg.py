"""stereo_msgs/msg. Generated from its definitions in share; do not edit."""

from actors.interfaces.message import Message
from actors.interfaces.sensor_msgs.msg import Image, RegionOfInterest
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.types import default, float32

__all__ = [
    "DisparityImage",
]


class DisparityImage(Message, frozen=True, kw_only=True):
    """stereo_msgs/msg/DisparityImage"""

    header: Header = default()
    image: Image = default()
    f: float32 = 0.0
    t: float32 = 0.0
    valid_window: RegionOfInterest = default()
    min_disparity: float32 = 0.0
    max_disparity: float32 = 0.0
    delta_d: float32 = 0.0
