"""ROS 2 package lifecycle_msgs: msg, srv. Generated."""
