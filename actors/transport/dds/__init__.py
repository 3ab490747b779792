"""DDS, the usual wire of ROS 2: as its Cyclone DDS and Fast DDS middlewares write it."""
