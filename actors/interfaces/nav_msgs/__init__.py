"""ROS 2 package nav_msgs: msg, srv. Generated."""
