"""ROS 2 package action_msgs: msg, srv. Generated."""
