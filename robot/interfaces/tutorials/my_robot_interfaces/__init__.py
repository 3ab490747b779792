"""ROS 2 package my_robot_interfaces: msg, srv, action. Generated."""
