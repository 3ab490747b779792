"""ROS 2 package shape_msgs: msg. Generated."""
