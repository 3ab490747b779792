"""ROS 2 package diagnostic_msgs: msg, srv. Generated."""
