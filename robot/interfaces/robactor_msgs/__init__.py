"""ROS 2 package robactor_msgs: msg, srv, action. Generated."""
