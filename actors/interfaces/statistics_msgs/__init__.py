"""ROS 2 package statistics_msgs: msg. Generated."""
