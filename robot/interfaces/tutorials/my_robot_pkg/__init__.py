"""ROS 2 package my_robot_pkg: srv, action. Generated."""
