"""ROS 2 package trajectory_msgs: msg. Generated."""
