"""ROS 2 package unitree_go: msg. Generated."""
