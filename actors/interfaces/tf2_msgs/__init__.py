"""ROS 2 package tf2_msgs: msg, srv, action. Generated."""
