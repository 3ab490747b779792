"""DDS, the usual wire of ROS 2: as its Cyclone DDS and Fast DDS middlewares write it."""

from actors.transport.dds.config import DdsConfig
from actors.transport.dds.raw import RawTopics, RawWriter
from actors.transport.dds.transport import DdsTransport

__all__ = ["DdsConfig", "DdsTransport", "RawTopics", "RawWriter"]
