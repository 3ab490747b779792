"""ROS 2 package visualization_msgs: msg, srv. Generated."""
