"""ROS 2 package unitree_api: msg. Generated."""
