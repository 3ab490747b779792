"""ROS 2 package robactor_msgs: msg. Generated."""
